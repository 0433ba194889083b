//! Arrays of structs from a host.

use crate::capi::ffi::guard::{Failure, Outcome};
use crate::capi::ffi::views::{Sized32, check_size, frz_view, sized};

/// Passes on the structs of a host's array, all of one version; `nouns` name one and all of them in an error. Fields that the host's header
/// does not have take their values from `usual`. Nothing is allocated, except on failure.
///
/// # Safety
/// `list` must be NULL or point to `count` structs.
pub(in crate::capi) unsafe fn each_sized<T: Sized32>(
    list: *const T,
    count: usize,
    nouns: [&str; 2],
    defaults: T,
    mut take: impl FnMut(T) -> Outcome,
) -> Outcome {
    let [noun, all] = nouns;
    if count == 0 {
        return Ok(());
    }
    if list.is_null() {
        return Err(Failure::argument(format!("{all}: the data is NULL, but the count is {count}")));
    }
    // SAFETY: guaranteed by the caller: at least the size of one is there.
    let stride = unsafe { list.cast::<u32>().read_unaligned() } as usize;
    let named =
        |at: usize, failure: Failure| Failure { text: format!("{noun} {at}: {}", failure.text), ..failure };
    // Checked before use: it is the stride.
    check_size::<T>(stride).map_err(|failure| named(0, failure))?;
    let sizes = frz_view { data: list.cast(), count, stride };
    // SAFETY: as above; the sizes must be equal for the structs to be contiguous.
    let mut sizes = unsafe { sizes.in_place::<u32>(all) }?;
    if sizes.any(|size| size as usize != stride) {
        return Err(Failure::argument(format!("{all}: their struct_size differs")));
    }
    for at in 0..count {
        // SAFETY: as above.
        let one = unsafe { sized(list.byte_add(at * stride), defaults) };
        one.and_then(&mut take).map_err(|failure| named(at, failure))?;
    }
    Ok(())
}
