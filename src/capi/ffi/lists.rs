//! Arrays of handles, structs and numbers, from a host and to it.

use super::guard::{Failure, Outcome, frz_status, guard, refuse};
use super::handle::{HandleType, Reading, read, required};
use super::views::{Plain, Sized32, check_size, frz_span, frz_view, sized};

/// The handles behind a host's array of pointers, to read.
///
/// # Safety
/// `list` must be NULL or point to `count` pointers, each as for [`read`].
pub(in crate::capi) unsafe fn read_each<'a, N: HandleType>(
    list: *const *const N,
    count: usize,
    name: &str,
) -> Outcome<Vec<Reading<'a, N::Value>>> {
    // SAFETY: guaranteed by the caller.
    let pointers = unsafe { frz_view::packed(list, count).elements::<*const N>(name) }?;
    // SAFETY: as above.
    pointers.iter().map(|&pointer| unsafe { read(pointer) }).collect()
}

/// Replaces the contents of `into` by the converted structs of a host's array, all of one version; `nouns` are the singular and the plural
/// for error messages. Fields that the host's header does not have are 0. Only `into` may grow: nothing else is allocated, except on
/// failure.
///
/// # Safety
/// `list` must be NULL or point to `count` structs.
pub(in crate::capi) unsafe fn read_list<T: Sized32, U>(
    list: *const T,
    count: usize,
    nouns: [&str; 2],
    into: &mut Vec<U>,
    convert: impl Fn(T) -> Outcome<U>,
) -> Outcome {
    let [noun, all] = nouns;
    into.clear();
    let named =
        |at: usize, failure: Failure| Failure { text: format!("{noun} {at}: {}", failure.text), ..failure };
    // SAFETY: guaranteed by the caller.
    let stride = unsafe { stride_of(list, count, all, |failure| named(0, failure)) }?;
    for at in 0..count {
        // SAFETY: as above.
        let one = unsafe { sized(list.byte_add(at * stride), T::zeroed()) };
        into.push(one.and_then(&convert).map_err(|failure| named(at, failure))?);
    }
    Ok(())
}

/// The size (bytes) of each struct in a host's array; 0 if there are none. `first` adds to a failure that the first struct caused it.
///
/// # Safety
/// `list` must be NULL or point to `count` structs.
pub(in crate::capi) unsafe fn stride_of<T: Sized32>(
    list: *const T,
    count: usize,
    all: &str,
    first: impl FnOnce(Failure) -> Failure,
) -> Outcome<usize> {
    if count == 0 {
        return Ok(0);
    }
    refuse(list.is_null(), || format!("{all}: the data is NULL, but the count is {count}"))?;
    // SAFETY: guaranteed by the caller: at least the size of one is there.
    let stride = unsafe { list.cast::<u32>().read_unaligned() } as usize;
    // Before it is used as a stride.
    check_size::<T>(stride).map_err(first)?;
    let sizes = frz_view { data: list.cast(), count, stride };
    // SAFETY: as above; the structs are contiguous only if their sizes are equal, and a different one ends the search.
    let is_other = unsafe { sizes.in_place::<u32>(all) }?.any(|size| size as usize != stride);
    refuse(is_other, || format!("{all}: their struct_size differs"))?;
    Ok(stride)
}

/// The elements of a view, one for each of `count` things. If their number differs, the error says "... but `there_are` `count` `things`".
///
/// # Safety
/// The view must describe memory that can be read, for `'a`.
pub(in crate::capi) unsafe fn one_for_each<'a, T: Plain>(
    view: &frz_view,
    name: &str,
    count: usize,
    [there_are, things]: [&str; 2],
) -> Outcome<impl ExactSizeIterator<Item = T> + Clone + use<'a, T>> {
    // SAFETY: guaranteed by the caller.
    let given = unsafe { view.in_place::<T>(name) }?;
    let len = given.len();
    refuse(len != count, || format!("{name}: {len} elements, but {there_are} {count} {things}"))?;
    Ok(given)
}

/// The body of an interface function that reports the number of elements, 0 after a failure, and may list them.
///
/// # Safety
/// `count` must be NULL or valid.
pub(in crate::capi) unsafe fn lists(count: *mut usize, work: impl FnOnce() -> Outcome) -> frz_status {
    guard(|| {
        // SAFETY: guaranteed by the caller.
        unsafe { required(count, "count")?.write_unaligned(0) };
        work()
    })
}

/// Writes a list, or only the number of its elements if there is no memory for them.
///
/// # Safety
/// The span must describe memory that can be written, and `count` must be NULL or valid.
pub(in crate::capi) unsafe fn list<T: Plain>(
    elements: impl ExactSizeIterator<Item = T>,
    dst: &frz_span,
    count: *mut usize,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        required(count, "count")?.write_unaligned(elements.len());
        if dst.data.is_null() { Ok(()) } else { dst.put("dst", elements) }
    }
}

/// Reads an array of `N` numbers.
///
/// # Safety
/// The pointer must be NULL or point to `N` numbers.
pub(in crate::capi) unsafe fn numbers<const N: usize>(first: *const f64, name: &str) -> Outcome<[f64; N]> {
    let first = required(first.cast_mut(), name)?;
    // SAFETY: guaranteed by the caller.
    Ok(unsafe { first.cast::<[f64; N]>().read_unaligned() })
}

/// Checks an index of one of the `count` things that a host has set; `name` is that of the argument.
pub(in crate::capi) fn check_index(name: &str, index: usize, count: usize) -> Outcome<usize> {
    refuse(index >= count, || format!("{name} = {index} is out of range: the count is {count}"))?;
    Ok(index)
}
