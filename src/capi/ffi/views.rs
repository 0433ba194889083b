//! Arrays and structs that cross the boundary: a host's pointers to them are checked and followed here.

use std::ffi::{CStr, c_char, c_void};
use std::ops::RangeInclusive;

use super::guard::frz_status::FRZ_ERROR_CAPACITY;
use super::guard::frz_status::FRZ_ERROR_VERSION;
use super::guard::{Failure, Outcome, refuse};
use crate::numeric::digits;

/// An array that the caller lends for the duration of the call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct frz_view {
    /// First element; NULL if there is none. It need not be aligned.
    pub data: *const c_void,
    /// Number of elements.
    pub count: usize,
    /// Bytes from one element to the next; 0: elements are packed.
    pub stride: usize,
}

/// Memory of the caller that a call writes to.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct frz_span {
    /// First element; NULL where the function allows it. It need not be aligned.
    pub data: *mut c_void,
    /// Number of elements that fit.
    pub count: usize,
    /// Bytes from one element to the next; 0: elements are packed. Bytes between elements are not touched.
    pub stride: usize,
}

/// Types for which any bytes are a valid value.
///
/// # Safety
/// Every bit pattern must be valid.
pub(in crate::capi) unsafe trait Plain: Copy {}

macro_rules! plain {
    ($($number:ty)*) => {
        // SAFETY: every bit pattern is a number.
        $(unsafe impl Plain for $number {})*
    };
}
plain!(u8 u16 u32 u64 i32 i64 f32 f64);

// SAFETY: elements for which any bytes are valid, without padding between them.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}
// SAFETY: pointers, which are followed only under the host's guarantee.
unsafe impl<T> Plain for *const T {}
// SAFETY: numbers and a pointer.
unsafe impl Plain for frz_view {}

/// Maximum memory that one array may span (bytes): the largest pointer offset.
const MAX_SPAN: usize = isize::MAX as usize;

/// Bytes from one element to the next; an error if the array is NULL, overlaps itself or exceeds the address space.
fn stride<T>(name: &str, data: *const c_void, count: usize, stride: usize) -> Outcome<usize> {
    let size = size_of::<T>();
    let stride = if stride == 0 { size } else { stride };
    refuse(stride < size, || {
        format!("{name}: the stride of {stride} bytes is less than an element's {size}")
    })?;
    let span = (count.max(1) - 1).checked_mul(stride).and_then(|bytes| bytes.checked_add(size));
    refuse(span.is_none_or(|span| span > MAX_SPAN || (data as usize).checked_add(span).is_none()), || {
        format!("{name}: {count} elements of {stride} bytes exceed the address space")
    })?;
    refuse(data.is_null() && count > 0, || format!("{name}: the data is NULL, but the count is {count}"))?;
    Ok(stride)
}

impl frz_view {
    /// Elements without gaps.
    pub(in crate::capi) fn packed<T>(first: *const T, count: usize) -> Self {
        Self { data: first.cast(), count, stride: 0 }
    }

    /// The elements, copied.
    ///
    /// # Safety
    /// The view must describe memory that can be read.
    pub(in crate::capi) unsafe fn elements<T: Plain>(&self, name: &str) -> Outcome<Vec<T>> {
        // SAFETY: guaranteed by the caller.
        let elements = unsafe { self.in_place::<T>(name) }?;
        let mut out = Vec::new();
        out.try_reserve_exact(self.count)
            .map_err(|_| Failure::argument(format!("{name}: {} elements do not fit", self.count)))?;
        out.extend(elements);
        Ok(out)
    }

    /// The elements one by one, read in place.
    ///
    /// # Safety
    /// The view must describe memory that can be read, for `'a`.
    pub(in crate::capi) unsafe fn in_place<'a, T: Plain>(
        &self,
        name: &str,
    ) -> Outcome<impl ExactSizeIterator<Item = T> + Clone + use<'a, T>> {
        let stride = stride::<T>(name, self.data, self.count, self.stride)?;
        let first = self.data.cast::<u8>();
        // SAFETY: guaranteed by the caller, and the whole span was checked to be reachable by pointers.
        let element = move |index: usize| unsafe { first.add(index * stride).cast::<T>().read_unaligned() };
        Ok((0..self.count).map(element))
    }

    /// Packed bytes, in place.
    ///
    /// # Safety
    /// As [`frz_view::in_place`].
    pub(in crate::capi) unsafe fn bytes<'a>(&self, name: &str) -> Outcome<&'a [u8]> {
        stride::<u8>(name, self.data, self.count, 1)?;
        if self.count == 0 {
            return Ok(&[]);
        }
        // SAFETY: guaranteed by the caller, and all of them can be reached.
        Ok(unsafe { std::slice::from_raw_parts(self.data.cast(), self.count) })
    }

    /// Positions or other triples, all finite.
    ///
    /// # Safety
    /// As [`frz_view::elements`].
    pub(in crate::capi) unsafe fn finite(&self, name: &str) -> Outcome<Vec<[f32; 3]>> {
        // SAFETY: guaranteed by the caller.
        let elements = unsafe { self.elements::<[f32; 3]>(name) }?;
        match elements.iter().position(|triple| !triple.iter().all(|number| number.is_finite())) {
            Some(at) => Err(Failure::argument(format!("{name}: element {at} is not finite"))),
            None => Ok(elements),
        }
    }
}

impl frz_span {
    /// Writes elements if there is room for all of them.
    ///
    /// # Safety
    /// The span must describe memory that can be written.
    pub(in crate::capi) unsafe fn fill<T: Plain>(&self, name: &str, elements: &[T]) -> Outcome {
        // SAFETY: guaranteed by the caller.
        unsafe { self.put(name, elements.iter().copied()) }
    }

    /// Refuses a span with room for fewer elements than `needed`.
    pub(in crate::capi) fn check_room(&self, name: &str, needed: usize) -> Outcome {
        if self.count < needed {
            let text = format!("{name}: there is room for {} elements, {needed} are needed", self.count);
            return Err(Failure::new(FRZ_ERROR_CAPACITY, text));
        }
        Ok(())
    }

    /// As [`frz_span::fill`], from an iterator.
    ///
    /// # Safety
    /// As [`frz_span::fill`].
    pub(in crate::capi) unsafe fn put<T: Plain>(
        &self,
        name: &str,
        elements: impl ExactSizeIterator<Item = T>,
    ) -> Outcome {
        self.check_room(name, elements.len())?;
        let stride = stride::<T>(name, self.data, elements.len(), self.stride)?;
        let first = self.data.cast::<u8>();
        for (index, element) in elements.enumerate() {
            // SAFETY: guaranteed by the caller, and the whole span was checked to be reachable by pointers.
            unsafe { first.add(index * stride).cast::<T>().write_unaligned(element) };
        }
        Ok(())
    }

    /// As [`frz_span::fill`], from an iterator of unknown length.
    ///
    /// # Safety
    /// As [`frz_span::fill`].
    pub(in crate::capi) unsafe fn collect<T: Plain>(
        &self,
        name: &str,
        elements: impl Iterator<Item = T>,
    ) -> Outcome {
        // SAFETY: guaranteed by the caller.
        unsafe { self.fill(name, &elements.collect::<Vec<_>>()) }
    }

    /// Packed, aligned numbers to be written in place, `width` for each element; `None` if the data are NULL.
    ///
    /// # Safety
    /// As [`frz_span::fill`], for `'a`; nothing else may use the memory meanwhile.
    pub(in crate::capi) unsafe fn numbers<'a, T: Plain>(
        &self,
        name: &str,
        width: usize,
    ) -> Outcome<Option<&'a mut [T]>> {
        if self.data.is_null() {
            return Ok(None);
        }
        let packed = width * size_of::<T>();
        refuse(self.stride != 0 && self.stride != packed, || {
            format!("{name}: the stride of {} bytes is not {packed}, that of packed elements", self.stride)
        })?;
        let first = self.data.cast::<T>();
        refuse(!first.is_aligned(), || {
            format!("{name}: the data are not aligned to {} bytes", align_of::<T>())
        })?;
        let count = self.count.saturating_mul(width);
        stride::<T>(name, self.data, count, 0)?;
        // SAFETY: guaranteed by the caller, and all of it can be reached.
        Ok(Some(unsafe { std::slice::from_raw_parts_mut(first, count) }))
    }

    /// Reports the number of elements, and writes them unless the span's data are NULL; `total` is that number, known without the elements.
    ///
    /// # Safety
    /// As [`frz_span::fill`]; `count` must be writable.
    pub(in crate::capi) unsafe fn list<T: Plain>(
        &self,
        count: *mut usize,
        total: usize,
        elements: impl FnOnce() -> Outcome<Vec<T>>,
    ) -> Outcome {
        // SAFETY: guaranteed by the caller.
        unsafe {
            if self.data.is_null() {
                count.write(total);
                return Ok(());
            }
            let elements = elements()?;
            count.write(elements.len());
            self.fill("dst", &elements)
        }
    }
}

/// Refuses a value that is not finite, naming it.
pub(in crate::capi) fn finite(name: &str, value: f64) -> Outcome {
    refuse(!value.is_finite(), || format!("{name} is not finite"))
}

/// Refuses a number that is not finite, or outside its range.
pub(in crate::capi) fn within(name: &str, value: f64, range: RangeInclusive<f64>, unit: &str) -> Outcome {
    finite(name, value)?;
    refuse(!range.contains(&value), || {
        let (low, high) = range.into_inner();
        let (value, low, high) = (digits::given(value), digits::bound(low), digits::bound(high));
        format!("{name} = {value} is not within {low} to {high}{unit}")
    })
}

/// What each number of an enum of the interface stands for in the library.
pub(in crate::capi) type Meanings<T, const N: usize> = [(u32, T); N];

/// Values of an enum of the interface with their numbers.
macro_rules! numbered {
    ($($value:ident),+) => {
        [$(($value as u32, $value)),+]
    };
}
pub(in crate::capi) use numbered;

/// Looks up a number that a host gave for `name`, an argument or a field of the enum `kind`.
pub(in crate::capi) fn meaning<T: Copy>(
    name: &str,
    kind: &str,
    number: u32,
    known: &[(u32, T)],
) -> Outcome<T> {
    let found = known.iter().find(|(known, _)| *known == number).map(|(_, meaning)| *meaning);
    found.ok_or_else(|| Failure::argument(format!("{name} = {number} is not a value of {kind}")))
}

/// A host's text; `None` for NULL.
///
/// # Safety
/// The pointer must be NULL or point to a zero-terminated text.
pub(in crate::capi) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Outcome<Option<&'a str>> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: guaranteed by the caller.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map(Some).map_err(|_| Failure::argument(format!("{name} is not valid UTF-8")))
}

/// A text that the host must give.
///
/// # Safety
/// As [`text`].
pub(in crate::capi) unsafe fn required_text<'a>(pointer: *const c_char, name: &str) -> Outcome<&'a str> {
    // SAFETY: guaranteed by the caller.
    unsafe { text(pointer, name) }?.ok_or_else(|| Failure::argument(format!("{name} is NULL")))
}

/// A struct that begins with its own size: a host's header may be older or newer than this library.
///
/// # Safety
/// The struct must be `repr(C)`, begin with a `u32` that holds its size, and consist of numbers and pointers for which zero bytes are a
/// valid value.
pub(in crate::capi) unsafe trait Sized32: Copy {
    /// Sizes that a header may state: the end of the fields of each version.
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    /// Its name in messages.
    const NAME: &'static str;

    /// All fields 0 or NULL.
    fn zeroed() -> Self {
        // SAFETY: zero bytes are a valid value.
        unsafe { std::mem::zeroed() }
    }

    /// The values of fields that a host does not set.
    fn defaults() -> Self {
        Self::zeroed()
    }
}

/// A host's struct; fields that its header does not have take their defaults.
///
/// # Safety
/// As [`sized`].
pub(in crate::capi) unsafe fn given<T: Sized32>(pointer: *const T) -> Outcome<T> {
    // SAFETY: guaranteed by the caller.
    unsafe { sized(pointer, T::defaults()) }
}

/// As [`given`]; the defaults for NULL.
///
/// # Safety
/// As [`sized`].
pub(in crate::capi) unsafe fn given_or_defaults<T: Sized32>(pointer: *const T) -> Outcome<T> {
    // SAFETY: guaranteed by the caller.
    if pointer.is_null() { Ok(T::defaults()) } else { unsafe { given(pointer) } }
}

/// A host's struct; fields that its header does not have are those of `defaults`.
///
/// # Safety
/// The pointer must be NULL or point to a struct of the size that its struct_size states.
pub(in crate::capi) unsafe fn sized<T: Sized32>(pointer: *const T, mut defaults: T) -> Outcome<T> {
    let pointer = super::handle::required(pointer.cast_mut(), T::NAME)?;
    // SAFETY: guaranteed by the caller: there is at least a size.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() } as usize;
    check_size::<T>(size)?;
    // SAFETY: `size` bytes are readable, and no more than the struct has are copied.
    unsafe {
        std::ptr::copy_nonoverlapping(
            pointer.cast::<u8>(),
            (&raw mut defaults).cast::<u8>(),
            size.min(size_of::<T>()),
        );
    }
    let beyond = size.saturating_sub(size_of::<T>());
    // SAFETY: as above: the bytes up to the size that the struct states.
    let newer = unsafe { std::slice::from_raw_parts(pointer.cast::<u8>().add(size - beyond), beyond) };
    if newer.iter().any(|&byte| byte != 0) {
        let text = format!(
            "{}: fields are set that this library does not have; it is older than the header",
            T::NAME
        );
        return Err(Failure::new(FRZ_ERROR_VERSION, text));
    }
    Ok(defaults)
}

/// Fills a host's struct with the fields that its header has. Its size is `size`, or that which the struct states.
///
/// # Safety
/// The pointer must be NULL or have room for that many bytes.
pub(in crate::capi) unsafe fn fill<T: Sized32>(pointer: *mut T, size: Option<usize>, value: T) -> Outcome {
    let pointer = super::handle::required(pointer, T::NAME)?;
    // SAFETY: guaranteed by the caller.
    let size = size.unwrap_or_else(|| unsafe { pointer.cast::<u32>().read_unaligned() } as usize);
    check_size::<T>(size)?;
    // SAFETY: that many bytes are writable.
    unsafe {
        pointer.cast::<u8>().write_bytes(0, size);
        std::ptr::copy_nonoverlapping(
            (&raw const value).cast::<u8>(),
            pointer.cast::<u8>(),
            size.min(size_of::<T>()),
        );
        pointer.cast::<u32>().write_unaligned(size as u32);
    }
    Ok(())
}

/// Runs the work of a call and writes its report to the host unless the pointer is NULL; all zeroes after a failure.
///
/// # Safety
/// As [`fill`], without a size.
pub(in crate::capi) unsafe fn reports<T: Sized32, R: Into<T>>(
    report: *mut T,
    work: impl FnOnce() -> Outcome<R>,
) -> Outcome {
    if report.is_null() {
        return work().map(drop);
    }
    // SAFETY: guaranteed by the caller.
    unsafe {
        fill(report, None, T::zeroed())?;
        fill(report, None, work()?.into())
    }
}

/// Maximum size (bytes) accepted for a struct of a newer header.
const MAX_STRUCT_SIZE: usize = 4096;

/// Refuses a size that no version of a struct has.
pub(in crate::capi) fn check_size<T: Sized32>(size: usize) -> Outcome {
    let known = T::SIZES.contains(&size) || (size > size_of::<T>() && size <= MAX_STRUCT_SIZE);
    if !known {
        let text = format!("{}: struct_size = {size} is that of no version", T::NAME);
        return Err(Failure::new(FRZ_ERROR_VERSION, text));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Params {
        struct_size: u32,
        first: f32,
        second: u64,
    }

    // SAFETY: numbers only.
    unsafe impl Sized32 for Params {
        const SIZES: &'static [usize] = &[8, 16];
        const NAME: &'static str = "params";
    }

    const NONE: frz_view = frz_view { data: std::ptr::null(), count: 0, stride: 0 };
    const DEFAULTS: Params = Params { struct_size: 16, first: 1.0, second: 2 };

    #[test]
    fn older_headers_get_defaults_and_newer_ones_are_read_as_far_as_known() {
        // SAFETY: all structs have as many bytes as they state.
        unsafe {
            let older = Params { struct_size: 8, first: 5.0, second: u64::MAX };
            assert_eq!(
                sized(&older, DEFAULTS).ok().unwrap(),
                Params { struct_size: 8, first: 5.0, second: 2 }
            );
            let mut newer = [0u64; 4];
            newer[0] = 32;
            newer[1] = 9;
            let pointer = newer.as_ptr().cast::<Params>();
            assert_eq!(sized(pointer, DEFAULTS).ok().unwrap().second, 9);
            newer[3] = 1;
            let pointer = newer.as_ptr().cast::<Params>();
            assert_eq!(sized(pointer, DEFAULTS).err().unwrap().status, FRZ_ERROR_VERSION);
            for size in [0, 4, 12, 5000, u32::MAX] {
                let odd = Params { struct_size: size, ..DEFAULTS };
                assert_eq!(sized(&odd, DEFAULTS).err().unwrap().status, FRZ_ERROR_VERSION);
            }
        }
    }

    #[test]
    fn views_are_read_with_their_stride_and_wild_ones_are_refused() {
        let bytes: Vec<u8> = (0..64).collect();
        let view =
            |offset: usize, count, stride| frz_view { data: bytes[offset..].as_ptr().cast(), count, stride };
        // SAFETY: the good views lie within the bytes; the others are refused before they are followed.
        unsafe {
            assert_eq!(
                view(1, 3, 16).elements::<u32>("n").ok().unwrap(),
                [0x0403_0201, 0x1413_1211, 0x2423_2221]
            );
            assert_eq!(view(0, 2, 0).elements::<u32>("n").ok().unwrap().len(), 2);
            assert!(view(0, 2, 3).elements::<u32>("n").is_err());
            assert!(view(0, usize::MAX, 8).elements::<u32>("n").is_err());
            assert!(view(0, usize::MAX / 4, 4).elements::<u32>("n").is_err());
            assert!(frz_view { count: 1, ..NONE }.elements::<u32>("n").is_err());
            assert!(NONE.elements::<u32>("n").ok().unwrap().is_empty());
        }
        let mut room = [7u8; 12];
        let span = frz_span { data: room.as_mut_ptr().cast(), count: 2, stride: 6 };
        // SAFETY: the span lies within the room.
        unsafe {
            assert!(span.fill("n", &[1u32, 2]).is_ok());
            assert_eq!(span.fill("n", &[1u32, 2, 3]).err().unwrap().status, FRZ_ERROR_CAPACITY);
        }
        assert_eq!(room, [1, 0, 0, 0, 7, 7, 2, 0, 0, 0, 7, 7]);
    }
}
