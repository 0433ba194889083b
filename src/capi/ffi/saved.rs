//! Bytes for a host: files in memory, and states that it saves and restores.

use std::ffi::c_void;
use std::sync::{Mutex, PoisonError};

use super::guard::frz_status::*;
use super::guard::{Failure, Outcome, frz_status, guard};
use super::handle::{HandleType, change, clear, read, required};
use super::views::{frz_span, frz_view};
use crate::capi::runtime::context::{enter, enter_light, frz_context};
use crate::context::Context;
use crate::error::{Error, Result};

/// A host's buffer for a state: its memory, its capacity (bytes), and where the state's size is reported.
pub(in crate::capi) type StateBuffer = (*mut c_void, usize, *mut usize);

/// Writes bytes to the host and their number to `size`. With `dst` NULL it only writes `bound`, an upper bound of their number.
///
/// # Safety
/// `dst` must be NULL or have room for `capacity` bytes; `size` must be NULL or point to a number.
pub(in crate::capi) unsafe fn write_bytes<B: AsRef<[u8]>>(
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
    bound: impl FnOnce() -> usize,
    bytes: impl FnOnce() -> Outcome<B>,
) -> Outcome {
    let size = required(size, "size")?;
    // SAFETY: guaranteed by the caller, and it is not NULL.
    let report_size = |count: usize| unsafe { size.write(count) };
    report_size(0);
    if dst.is_null() {
        report_size(bound());
        return Ok(());
    }
    let bytes = bytes()?;
    let bytes = bytes.as_ref();
    report_size(bytes.len());
    if capacity < bytes.len() {
        let text = format!("there is room for {capacity} bytes, {} are needed", bytes.len());
        return Err(Failure::new(FRZ_ERROR_CAPACITY, text));
    }
    // SAFETY: guaranteed by the caller.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), dst.cast(), bytes.len()) };
    Ok(())
}

/// The bytes of a state whose size was queried, kept for the call that copies them.
#[derive(Default)]
pub(in crate::capi) struct Saved(Mutex<Option<Vec<u8>>>);

impl Saved {
    /// Removes and returns the bytes, which are outdated once the object changes.
    pub(in crate::capi) fn take(&self) -> Option<Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// The body of an interface function that writes an object's state to the host, or reports its size, as [`write_bytes`] does. `parts`
/// returns the state kept from a query of its size, and the object that `save` saves if there is none.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn saves<N: HandleType, T: Sync>(
    context: *mut frz_context,
    object: *const N,
    (dst, capacity, size): StateBuffer,
    parts: impl FnOnce(&N::Value) -> (&Saved, &T),
    save: fn(&T) -> Vec<u8>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        clear(size);
        required(size, "size")?;
        let call = enter(context)?;
        let object = read(object)?;
        let (kept, object) = parts(&object);
        // No lock is held while the host's poll function runs.
        let bytes = match kept.take() {
            Some(bytes) => bytes,
            None => call.ctx().phase("save", || Ok(save(object)))?,
        };
        let written = write_bytes(dst, capacity, size, || bytes.len(), || Ok(bytes.as_slice()));
        if dst.is_null() || written.is_err() {
            // A caller that queried the size, or whose buffer was too small, calls again.
            *kept.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(bytes);
        }
        written
    })
}

/// The body of an interface function that writes an object's state to the host in real time, or reports its size.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn saves_in_place<N: HandleType>(
    context: *mut frz_context,
    object: *const N,
    (dst, capacity, size): StateBuffer,
    needed: impl FnOnce(&N::Value) -> usize,
    save_to: impl FnOnce(&N::Value, &mut [u8]) -> Result<usize>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        clear(size);
        let size = required(size, "size")?;
        let _call = enter_light(context)?;
        let object = read(object)?;
        let needed = needed(&object);
        size.write_unaligned(needed);
        let room = frz_span { data: dst, count: capacity, stride: 0 };
        let Some(room) = room.numbers::<u8>("dst", 1)? else { return Ok(()) };
        if room.len() < needed {
            let text = format!("there is room for {capacity} bytes, {needed} are needed");
            return Err(Failure::new(FRZ_ERROR_CAPACITY, text));
        }
        save_to(&object, room)?;
        Ok(())
    })
}

/// The body of an interface function that replaces an object's state in real time by a saved one.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn restores<N: HandleType>(
    context: *mut frz_context,
    object: *mut N,
    (state, bytes): (*const c_void, usize),
    restore: impl FnOnce(&mut N::Value, &[u8]) -> Result<()>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        let _call = enter_light(context)?;
        let mut object = change(object)?;
        required(state.cast_mut(), "state")?;
        let state = frz_view::packed(state, bytes).bytes("state")?;
        Ok(restore(&mut object, state)?)
    })
}

/// A host's saved state, and its size (bytes); NULL: there is none.
pub(in crate::capi) type Restart = (*const c_void, usize);

/// Resumes a `noun` from a saved state, or makes a `new` one without a state. `unpacked` is the size (bytes) of a state once unpacked.
///
/// # Safety
/// The pointer must be NULL or point to that many bytes.
pub(in crate::capi) unsafe fn new_or_resumed<T: Send>(
    ctx: &Context,
    noun: &str,
    (restart, bytes): Restart,
    new: impl FnOnce() -> Outcome<T>,
    unpacked: fn(&[u8]) -> u64,
    resume: impl FnOnce(&[u8]) -> Result<T> + Send,
) -> Outcome<T> {
    // SAFETY: guaranteed by the caller.
    let state = unsafe { frz_view::packed(restart, bytes).elements::<u8>("restart") }?;
    if restart.is_null() {
        return new();
    }
    ctx.allow(&format!("the saved state of {noun}"), unpacked(&state).saturating_mul(3))?;
    ctx.phase("unpack", || resume(&state)).map_err(|error| match error {
        Error::Bytes(what) => {
            let what = what.strip_prefix("the state ").unwrap_or(&what);
            Failure::new(FRZ_ERROR_FILE, format!("the saved state {what}"))
        }
        other => other.into(),
    })
}
