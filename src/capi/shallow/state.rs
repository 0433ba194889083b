//! Saves and restores states of shallow liquid, in place.

use std::ffi::c_void;

use super::handle::frz_shallow;
use crate::capi::ffi::saved::{restores, saves_in_place};
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;

/// Saves all that the next frame depends on besides the ground, the parameters, the flow points and the bodies (a real-time call: see
/// frz_shallow): for a replay, an undo, a host's own cache. The bytes are the same on any number of threads.
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
    // SAFETY: the pointers are NULL or valid, and so is the memory at dst.
    unsafe {
        saves_in_place(
            context,
            shallow,
            (dst, capacity, size),
            |liquid| liquid.shallow.save_size(),
            |liquid, room| liquid.shallow.save_to(room),
        )
    }
}

/// Replaces the liquid's state by a saved one (a real-time call: see frz_shallow): the liquid then continues as the saved one did, to the
/// same bytes, with the same parameters, flow points and bodies, which must be set before. The volumes moved by flow points are restored
/// too.
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
    // SAFETY: the pointers are NULL or valid, and so are the bytes.
    unsafe { restores(context, shallow, (state, bytes), |liquid, state| liquid.shallow.restore(state)) }
}
