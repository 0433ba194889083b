//! States of shallow liquid that a host saves and restores in place.

use std::ffi::c_void;

use super::spill::frz_shallow;
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter_light, frz_context};

/// Saves all that the next frame depends on besides the ground, the parameters, the flow points and the bodies, in real time (frz_shallow):
/// for a replay, an undo, a host's own cache. The bytes are the same on any number of threads.
///
/// dst: room for capacity bytes. NULL: only the current size is reported; it grows with the wet area of the ground.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time for each context; any number may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_save(
    context: *mut frz_context,
    shallow: *const frz_shallow,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid, and so is the memory at dst.
        unsafe {
            clear(size);
            let size = required(size, "size")?;
            let _call = enter_light(context)?;
            let spill = read(shallow)?;
            put_state(dst, capacity, size, spill.shallow.save_size(), |room| spill.shallow.save_to(room))
        }
    })
}

/// Replaces the liquid's state by a saved one, in real time (frz_shallow): from there it flows as the saved one did, to the same bytes,
/// with the same parameters, flow points and bodies, which must be set before. The volumes moved by flow points are restored too.
///
/// state: bytes bytes of frz_shallow_save. FRZ_ERROR_FILE, with the liquid unchanged, if they are damaged, or of another version, another
///     ground or border, or other kinds of flow points.
/// bytes: size of state.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_restore(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    state: *const c_void,
    bytes: usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid, and so are the bytes.
        unsafe {
            let _call = enter_light(context)?;
            let mut spill = change(shallow)?;
            let state = taken_state(state, bytes)?;
            Ok(spill.shallow.restore(state)?)
        }
    })
}

/// Writes a state of a given size to a host's memory, unless that is NULL.
///
/// # Safety
/// There must be room for `capacity` bytes at `dst`, unless it is NULL.
pub(in crate::capi) unsafe fn put_state(
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
    needed: usize,
    save_to: impl FnOnce(&mut [u8]) -> crate::Result<usize>,
) -> Outcome {
    let room = frz_span { data: dst, count: capacity, stride: 0 };
    // SAFETY: guaranteed by the caller.
    let room = unsafe {
        size.write_unaligned(needed);
        room.numbers::<u8>("dst", 1)?
    };
    let Some(room) = room else { return Ok(()) };
    if room.len() < needed {
        let text = format!("there is room for {capacity} bytes, {needed} are needed");
        return Err(Failure::new(frz_status::FRZ_ERROR_CAPACITY, text));
    }
    save_to(room)?;
    Ok(())
}

/// The bytes of a host's state.
///
/// # Safety
/// The pointer must be NULL or point to that many bytes, for `'a`.
pub(in crate::capi) unsafe fn taken_state<'a>(state: *const c_void, bytes: usize) -> Outcome<&'a [u8]> {
    required(state.cast_mut(), "state")?;
    // SAFETY: guaranteed by the caller.
    unsafe { frz_view { data: state, count: bytes, stride: 0 }.bytes("state") }
}
