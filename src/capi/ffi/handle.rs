//! Handles: objects that a host holds by pointer. A pointer that is NULL, of another kind, in use or poisoned is an error.

use std::cell::UnsafeCell;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};

use super::guard::frz_status::*;
use super::guard::{Failure, Outcome, refuse};

/// A kind of handle.
///
/// Opaque to C: a pointer to it is a pointer to a [`Handle`] that holds its value.
pub(in crate::capi) trait HandleType {
    /// The value of the handle.
    type Value;
    /// Its name in messages.
    const NAME: &'static str;
    /// Identifies its memory.
    const TAG: u32;
}

/// Implements [`HandleType`] for an opaque struct: the type of its value, its name in messages, and its number, which no other kind has.
macro_rules! handle {
    ($handle:ident, $value:ty, $name:literal, $number:literal) => {
        impl $crate::capi::ffi::handle::HandleType for $handle {
            type Value = $value;
            const NAME: &'static str = $name;
            const TAG: u32 = 0x6672_7a00 + $number;
        }
    };
}
pub(in crate::capi) use handle;

/// Tag of a destroyed handle, until its memory is reused.
const GONE: u32 = 0xdead_0fff;
/// Value of `users` while a call changes the handle.
const CHANGING: i32 = -1;

/// A value behind a header that detects misuse; handles of all kinds begin with the tag.
#[repr(C)]
pub(in crate::capi) struct Handle<T> {
    tag: AtomicU32,
    /// Number of calls that read it, or [`CHANGING`].
    users: AtomicI32,
    poisoned: AtomicBool,
    value: UnsafeCell<T>,
}

/// A handle that this call reads; other calls may read it at the same time.
pub(in crate::capi) struct Reading<'a, T>(&'a Handle<T>);

/// A handle in exclusive use by this call; a panic poisons it.
pub(in crate::capi) struct Changing<'a, T>(&'a Handle<T>);

/// Moves a value into a new handle and gives it to the host.
///
/// # Safety
/// `out` must be NULL or point to memory for a pointer.
pub(in crate::capi) unsafe fn give<N: HandleType>(out: *mut *mut N, value: N::Value) -> Outcome {
    let out = required(out, "out")?;
    let head = Handle {
        tag: AtomicU32::new(N::TAG),
        users: AtomicI32::new(0),
        poisoned: AtomicBool::new(false),
        value: UnsafeCell::new(value),
    };
    // SAFETY: guaranteed by the caller, and it is not NULL.
    unsafe { out.write(Box::into_raw(Box::new(head)).cast()) };
    Ok(())
}

/// Zeroes an output unless it is NULL, at the beginning of a call: outputs are 0 after every failure.
///
/// # Safety
/// `out` must be NULL or point to memory, aligned or not, for a value for which zero bytes are valid.
pub(in crate::capi) unsafe fn clear<T>(out: *mut T) {
    if !out.is_null() {
        // SAFETY: guaranteed by the caller; bytes need no alignment.
        unsafe { out.cast::<u8>().write_bytes(0, size_of::<T>()) };
    }
}

/// Writes an output that may be NULL.
///
/// # Safety
/// `out` must be NULL or point to memory for it.
pub(in crate::capi) unsafe fn write_some<T>(out: *mut T, value: T) {
    if !out.is_null() {
        // SAFETY: guaranteed by the caller.
        unsafe { out.write_unaligned(value) };
    }
}

/// Runs the work of a call and writes its value to `out`, which is zeroed after a failure.
///
/// # Safety
/// `out` must be NULL or point to memory for it.
pub(in crate::capi) unsafe fn answer<T>(
    out: *mut T,
    name: &str,
    work: impl FnOnce() -> Outcome<T>,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        clear(out);
        required(out, name)?.write_unaligned(work()?);
    }
    Ok(())
}

/// Refuses NULL.
pub(in crate::capi) fn required<T>(pointer: *mut T, name: &str) -> Outcome<*mut T> {
    refuse(pointer.is_null(), || format!("{name} is NULL"))?;
    Ok(pointer)
}

/// The handle behind a pointer.
///
/// # Safety
/// The pointer must be NULL or point to a handle of any kind that was not destroyed, for `'a`.
unsafe fn handle_of<'a, N: HandleType>(pointer: *const N) -> Outcome<&'a Handle<N::Value>> {
    let handle = pointer.cast::<Handle<N::Value>>();
    refuse(handle.is_null(), || format!("the {} is NULL", N::NAME))?;
    if !handle.is_aligned() {
        return Err(Failure::new(FRZ_ERROR_HANDLE, format!("the pointer is not a {}", N::NAME)));
    }
    // SAFETY: guaranteed by the caller; handles of all kinds begin with their tag.
    match unsafe { &(*handle).tag }.load(Ordering::Acquire) {
        // SAFETY: the tag says that it is a handle of this kind.
        tag if tag == N::TAG => Ok(unsafe { &*handle }),
        GONE => Err(Failure::new(FRZ_ERROR_HANDLE, format!("the {} was destroyed", N::NAME))),
        _ => Err(Failure::new(FRZ_ERROR_HANDLE, format!("the pointer is not a {}", N::NAME))),
    }
}

/// The handle behind a pointer, to read.
///
/// # Safety
/// The pointer must be NULL or point to a handle of any kind that was not destroyed, for `'a`.
pub(in crate::capi) unsafe fn read<'a, N: HandleType>(pointer: *const N) -> Outcome<Reading<'a, N::Value>> {
    // SAFETY: guaranteed by the caller.
    let handle = unsafe { handle_of(pointer) }?;
    let one_more = |users: i32| (users >= 0).then_some(users + 1);
    if handle.users.fetch_update(Ordering::Acquire, Ordering::Relaxed, one_more).is_err() {
        return Err(busy::<N>());
    }
    let reading = Reading(handle);
    check_not_poisoned::<N>(handle)?;
    Ok(reading)
}

/// The handle behind a pointer, to read; `None` for NULL.
///
/// # Safety
/// As [`read`].
pub(in crate::capi) unsafe fn read_some<'a, N: HandleType>(
    pointer: *const N,
) -> Outcome<Option<Reading<'a, N::Value>>> {
    // SAFETY: guaranteed by the caller.
    if pointer.is_null() { Ok(None) } else { unsafe { read(pointer) }.map(Some) }
}

/// The handle behind a pointer, to change.
///
/// # Safety
/// As [`read`].
pub(in crate::capi) unsafe fn change<'a, N: HandleType>(pointer: *mut N) -> Outcome<Changing<'a, N::Value>> {
    // SAFETY: guaranteed by the caller.
    let handle = unsafe { handle_of(pointer.cast_const()) }?;
    let changing = lock::<N>(handle)?;
    check_not_poisoned::<N>(handle)?;
    Ok(changing)
}

/// Destroys a handle; NULL is ignored, and a handle in use is kept.
///
/// # Safety
/// As [`read`]; the handle must not be used afterwards.
pub(in crate::capi) unsafe fn destroy<N: HandleType>(pointer: *mut N) -> Outcome {
    // SAFETY: guaranteed by the caller; there are no lent handles.
    unsafe { destroy_whole::<N, N>(pointer, |_| Vec::new()) }
}

/// Destroys a handle whose value owns other handles that it lends, which its `Drop` must [`free`]; NULL is ignored. If any of them is in
/// use, none is destroyed.
///
/// # Safety
/// As [`destroy`], also for the lent handles.
pub(in crate::capi) unsafe fn destroy_whole<N: HandleType, P: HandleType>(
    pointer: *mut N,
    lent: impl FnOnce(&N::Value) -> Vec<*mut P>,
) -> Outcome {
    if pointer.is_null() {
        return Ok(());
    }
    // SAFETY: guaranteed by the caller.
    let handle = unsafe { handle_of(pointer.cast_const()) }?;
    let whole = lock::<N>(handle)?;
    // SAFETY: they live as long as the value.
    let take = |part: &*mut P| lock::<P>(unsafe { handle_of(part.cast_const()) }?);
    let parts = lent(&whole).iter().map(take).collect::<Outcome<Vec<Changing<'_, P::Value>>>>()?;
    // None of them is in use now, and none can be used again.
    std::mem::forget((whole, parts));
    // SAFETY: made by `give`, and nobody uses it.
    unsafe { free(pointer) };
    Ok(())
}

/// Frees a handle that can no longer be used.
///
/// # Safety
/// It must come from [`give`], and must not be used now or afterwards.
pub(in crate::capi) unsafe fn free<N: HandleType>(pointer: *mut N) {
    if pointer.is_null() {
        return;
    }
    let handle = pointer.cast::<Handle<N::Value>>();
    // SAFETY: guaranteed by the caller.
    unsafe {
        (*handle).tag.store(GONE, Ordering::Release);
        drop(Box::from_raw(handle));
    }
}

/// Locks a handle against use by others, poisoned or not.
fn lock<N: HandleType>(handle: &Handle<N::Value>) -> Outcome<Changing<'_, N::Value>> {
    if handle.users.compare_exchange(0, CHANGING, Ordering::AcqRel, Ordering::Relaxed).is_err() {
        return Err(busy::<N>());
    }
    Ok(Changing(handle))
}

fn busy<N: HandleType>() -> Failure {
    Failure::new(FRZ_ERROR_BUSY, format!("the {} is in use by another call", N::NAME))
}

fn check_not_poisoned<N: HandleType>(handle: &Handle<N::Value>) -> Outcome {
    if handle.poisoned.load(Ordering::Acquire) {
        let text = format!("the {} saw an internal error before and can only be destroyed", N::NAME);
        return Err(Failure::new(FRZ_ERROR_POISONED, text));
    }
    Ok(())
}

impl<T> Deref for Reading<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        // SAFETY: while this exists nobody changes the value.
        unsafe { &*self.0.value.get() }
    }
}

impl<T> Drop for Reading<'_, T> {
    fn drop(&mut self) {
        self.0.users.fetch_sub(1, Ordering::Release);
    }
}

impl<T> Deref for Changing<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        // SAFETY: while this exists nobody else uses the value.
        unsafe { &*self.0.value.get() }
    }
}

impl<T> DerefMut for Changing<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: while this exists nobody else uses the value.
        unsafe { &mut *self.0.value.get() }
    }
}

impl<T> Drop for Changing<'_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.poisoned.store(true, Ordering::Release);
        }
        self.0.users.store(0, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::super::guard::{guard, last_error};
    use super::*;
    use crate::error::{Error, Result};
    use std::ffi::CStr;

    struct Jar;
    struct Tin;

    impl HandleType for Jar {
        type Value = i32;
        const NAME: &'static str = "jar";
        const TAG: u32 = 1;
    }

    impl HandleType for Tin {
        type Value = [u8; 3];
        const NAME: &'static str = "tin";
        const TAG: u32 = 2;
    }

    fn jar(value: i32) -> *mut Jar {
        let mut out = std::ptr::null_mut();
        // SAFETY: `out` is a pointer.
        unsafe { give(&mut out, value) }.ok().unwrap();
        out
    }

    #[test]
    fn misuse_is_an_error() {
        let jar = jar(7);
        // SAFETY: the jar lives until it is destroyed.
        unsafe {
            assert_eq!(*read(jar.cast_const()).ok().unwrap(), 7);
            let reading = read(jar.cast_const()).ok().unwrap();
            assert_eq!(change(jar).err().unwrap().status, FRZ_ERROR_BUSY);
            assert_eq!(destroy(jar).err().unwrap().status, FRZ_ERROR_BUSY);
            drop(reading);
            *change(jar).ok().unwrap() += 1;
            assert_eq!(*read(jar.cast_const()).ok().unwrap(), 8);
            assert_eq!(read(jar.cast::<Tin>().cast_const()).err().unwrap().status, FRZ_ERROR_HANDLE);
            assert_eq!(read::<Jar>(std::ptr::null()).err().unwrap().text, "the jar is NULL");
            assert!(destroy(jar).is_ok());
            assert!(destroy::<Jar>(std::ptr::null_mut()).is_ok());
        }
    }

    /// Lends a jar.
    struct Shelf(*mut Jar);

    impl HandleType for Shelf {
        type Value = Shelf;
        const NAME: &'static str = "shelf";
        const TAG: u32 = 3;
    }

    impl Drop for Shelf {
        fn drop(&mut self) {
            // SAFETY: the test no longer uses it.
            unsafe { free(self.0) };
        }
    }

    #[test]
    fn an_owner_is_not_destroyed_while_a_handle_that_it_lends_is_in_use() {
        let lent = jar(7);
        let mut shelf: *mut Shelf = std::ptr::null_mut();
        // SAFETY: jar and shelf live until the shelf is destroyed.
        unsafe {
            assert!(give(&mut shelf, Shelf(lent)).is_ok());
            let destroyed = || destroy_whole(shelf, |shelf| vec![shelf.0]);
            let reading = read(lent.cast_const()).ok().unwrap();
            let refused = destroyed().err().unwrap();
            assert_eq!(
                (refused.status, refused.text.as_str()),
                (FRZ_ERROR_BUSY, "the jar is in use by another call")
            );
            assert_eq!(*reading, 7);
            drop(reading);
            assert!(read(shelf.cast_const()).is_ok(), "the shelf is as it was");
            *change(lent).ok().unwrap() += 1;
            assert!(destroyed().is_ok());
        }
    }

    #[test]
    fn a_handle_that_saw_a_bug_is_poisoned_and_can_be_destroyed() {
        let bugs: [fn() -> Result<()>; 2] =
            [|| panic!("on purpose"), || Err(Error::Internal("on purpose".into()))];
        for bug in bugs {
            let jar = jar(7);
            // SAFETY: the jar lives until it is destroyed.
            unsafe {
                let status = guard(|| {
                    let _changing = change(jar)?;
                    Ok(bug()?)
                });
                assert_eq!(status, FRZ_ERROR_INTERNAL);
                let message = CStr::from_ptr(last_error());
                assert_eq!(message.to_str().unwrap(), "internal error: on purpose");
                assert_eq!(change(jar).err().unwrap().status, FRZ_ERROR_POISONED);
                assert_eq!(read(jar.cast_const()).err().unwrap().status, FRZ_ERROR_POISONED);
                assert!(destroy(jar).is_ok());
            }
        }
    }
}
