//! Positions that the liquid at the vertices of a tracker's mesh had at the first frame.

use super::handle::frz_tracker;
use super::mesh::{frz_particles, particles};
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter, frz_context};
use crate::surface::Rest;

/// Copies for each vertex where the liquid there was at the first frame, according to the nearby particles that already existed then. With
/// it a host carries its own textures and arrays through merges and splits: new vertices (frz_tracker_read_edits) take what the mesh of the
/// first frame has nearest to these positions. The corners of a triangle may come from far apart where liquids have merged: all of them
/// should then take their values from near one of them.
///
/// first: the particles at the first frame, with ids.
/// now: the particles at the end of the last step, with ids.
/// dst: room for as many double[3] as frz_tracker_count reports (m); FRZ_ERROR_CAPACITY if it is too small, and nothing is written. NaN
///     where unknown: no particle near the vertex existed at the first frame.
///
/// One thread at a time for each context; any number may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_read_rest(
    context: *mut frz_context,
    tracker: *const frz_tracker,
    first: *const frz_particles,
    now: *const frz_particles,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid; the span is valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let handle = read(tracker)?;
        let (first, now) = (particles(first)?, particles(now)?);
        let without_ids = |which: &str| Failure::argument(format!("{which}: the particles have no ids"));
        let rest = Rest::of(&first).ok_or_else(|| without_ids("first"))?;
        if now.ids.is_empty() {
            return Err(without_ids("now"));
        }
        let positions = handle.tracker.rest(call.ctx(), &rest, &now)?;
        dst.put("dst", positions.iter().map(|position| position.map_or([f64::NAN; 3], |p| p.into())))
    })
}
