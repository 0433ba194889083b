//! Input and output of grains: loose grains, attributes, saved states.

use std::ffi::c_void;

use super::grains::frz_grains;
use crate::capi::ffi::saved::saves;
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter, frz_context};
use crate::geometry::DVec3;
use crate::snow::grains::{Grains, memory};

/// Attributes of each grain that frz_grains_read copies; the customary attribute name is in brackets.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_grains_attribute {
    /// float[3]: its position (P, m).
    FRZ_GRAINS_POSITION = 0,
    /// double[3]: its position (m) in full precision, also far from the origin.
    FRZ_GRAINS_POSITION_DOUBLE = 1,
    /// float[3]: its velocity (v, m/s).
    FRZ_GRAINS_VELOCITY = 2,
    /// int64_t: its id (id), counted from 0 in the order of birth; it never changes and is never reused.
    FRZ_GRAINS_ID = 3,
    /// float: its radius (pscale, m).
    FRZ_GRAINS_RADIUS = 4,
    /// int32_t: the frame given to the frz_grains_step or frz_grains_emit that created it (source_frame).
    FRZ_GRAINS_SOURCE_FRAME = 5,
    /// float[3]: its position at birth (rest, m).
    FRZ_GRAINS_REST = 6,
    /// int32_t: 1 if it is awake, 0 if it rests (active).
    FRZ_GRAINS_ACTIVE = 7,
    /// int32_t: 1 if it is trapped: inside a surface, with no position nearby that is outside of all surfaces (trapped).
    FRZ_GRAINS_TRAPPED = 8,
}

use frz_grains_attribute::*;

const ATTRIBUTES: Meanings<frz_grains_attribute, 9> = numbered! {
    FRZ_GRAINS_POSITION, FRZ_GRAINS_POSITION_DOUBLE, FRZ_GRAINS_VELOCITY, FRZ_GRAINS_ID, FRZ_GRAINS_RADIUS,
    FRZ_GRAINS_SOURCE_FRAME, FRZ_GRAINS_REST, FRZ_GRAINS_ACTIVE, FRZ_GRAINS_TRAPPED
};

/// Adds loose grains: debris, drift, snow that falls from a tree. They exist at once and move with the next step; those that overlap each
/// other or an object are pushed apart.
///
/// positions: float[3] for each grain (m), finite, within 8388608 diameters of the origin along x and z and 65536 along y.
/// velocities: float[3] for each grain (m/s), each component from -10000 to 10000; data NULL with a count of 0: at rest.
/// frame: their source frame.
/// first: receives the id of the first new grain; the others follow in the order of the positions. -1 if there are none, 0 after a failure;
///     may be NULL.
///
/// After a failure no grain was added; the error names the index of the first element at fault. One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_emit(
    context: *mut frz_context,
    grains: *mut frz_grains,
    positions: frz_view,
    velocities: frz_view,
    frame: i32,
    first: *mut i64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(first);
        let call = enter(context)?;
        let ctx = call.ctx();
        let mut handle = change(grains)?;
        let grains = &mut handle.grains;
        ctx.allow("the grains", memory(grains.count().saturating_add(positions.count)))?;
        let emitted = positions.finite("positions")?;
        let velocities = velocities.finite("velocities")?;
        let emitted: Vec<DVec3> =
            emitted.into_iter().map(|position| position.map(f64::from).into()).collect();
        let id = ctx.phase_in_place("emit", || grains.emit(&emitted, &velocities, frame))?;
        handle.saved.take();
        write_some(first, if emitted.is_empty() { -1 } else { i64::from(id) });
        Ok(())
    })
}

/// Reports the number of grains.
///
/// count: receives their number; 0 after a failure.
///
/// Any number of threads may read grains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_count(grains: *const frz_grains, count: *mut usize) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { answer(count, "count", || Ok(read(grains)?.grains.count())) })
}

/// Copies an attribute of all grains. All attributes have the same order, which changes from step to step: ids identify the grains.
///
/// attribute: a frz_grains_attribute, which states the type of the elements.
/// dst: room for as many elements as frz_grains_count reports; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read grains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_read(
    grains: *const frz_grains,
    attribute: u32,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the grains are NULL or alive; the span is valid.
    guard(|| unsafe {
        let attribute = meaning("attribute", "frz_grains_attribute", attribute, &ATTRIBUTES)?;
        let handle = read(grains)?;
        let grains = &handle.grains;
        let single = |position: DVec3| <[f32; 3]>::from(position.map(|x| x as f32));
        match attribute {
            FRZ_GRAINS_POSITION => dst.collect("dst", grains.positions().map(single)),
            FRZ_GRAINS_POSITION_DOUBLE => dst.collect("dst", grains.positions().map(<[f64; 3]>::from)),
            FRZ_GRAINS_VELOCITY => dst.collect("dst", grains.velocities()),
            FRZ_GRAINS_ID => dst.collect("dst", grains.ids().iter().map(|&id| i64::from(id))),
            FRZ_GRAINS_RADIUS => dst.fill("dst", &vec![grains.params().radius as f32; grains.count()]),
            FRZ_GRAINS_SOURCE_FRAME => dst.collect("dst", grains.source_frames()),
            FRZ_GRAINS_REST => dst.collect("dst", grains.rests()),
            FRZ_GRAINS_ACTIVE => dst.collect("dst", grains.awake().map(i32::from)),
            FRZ_GRAINS_TRAPPED => dst.collect("dst", grains.trapped_each().map(i32::from)),
        }
    })
}

/// Saves all that the next step depends on besides the parameters, the base layer and the bodies, for a host's own cache. The bytes are the
/// same on any number of threads.
///
/// dst: room for capacity bytes. NULL: only the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_save(
    context: *mut frz_context,
    grains: *const frz_grains,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        saves(context, grains, (dst, capacity, size), |handle| (&handle.saved, &handle.grains), Grains::save)
    }
}
