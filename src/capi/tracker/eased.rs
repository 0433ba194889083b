//! The displayed positions of a tracker's mesh, eased towards coming merges and splits.

use super::handle::frz_tracker;
use super::mesh::{frz_particles, particles};
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter, frz_context};

/// Maximum number of steps ahead.
const MAX_AHEAD: usize = 100;

/// Copies the displayed positions of the mesh's vertices. In the steps before the liquid merges or splits, vertices that will be removed
/// already move towards the mesh that will replace them, so that the change does not pop. This needs frz_tracker_params.rebuild; without
/// it, and far from any change, the positions are those of frz_tracker_read.
///
/// The coming steps are computed for this and kept: frz_tracker_step with the same particles and dt then only adopts the result, so that a
/// step costs about as much as without easing. Each of these steps keeps its particles and a mesh, and two more meshes if it changes the
/// mesh. The tracker and its saved states do not change.
///
/// now: the particles at the end of the last step, or those that the tracker was created with.
/// coming: count pointers to the particles of the coming frames, in order, each dt after the previous one; NULL if count is 0.
/// count: 0 to ahead; less than ahead where the shot ends.
/// ahead: number of steps before a change in which vertices start to move, 1 to 100; 4 is a good value. Pass the same number in all frames.
/// dt: time between frames (s), above 0.
/// dst: room for as many double[3] as frz_tracker_count reports (m); FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_read_eased(
    context: *mut frz_context,
    tracker: *mut frz_tracker,
    now: *const frz_particles,
    coming: *const *const frz_particles,
    count: usize,
    ahead: u32,
    dt: f64,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let mut handle = change(tracker)?;
        call.ctx().check()?;
        finite("dt", dt)?;
        refuse(dt <= 0.0, || format!("dt = {dt} s must be positive and finite"))?;
        refuse(ahead == 0 || ahead as usize > MAX_AHEAD, || {
            format!("ahead = {ahead} is not within 1 to {MAX_AHEAD}")
        })?;
        refuse(count > ahead as usize, || format!("count = {count} is more than ahead, {ahead}"))?;
        refuse(coming.is_null() && count > 0, || "coming is NULL")?;
        let now = particles(now)?;
        let coming = frz_view::packed(coming, count).elements::<*const frz_particles>("coming")?;
        let coming = coming.into_iter().map(|frame| particles(frame)).collect::<Outcome<Vec<_>>>()?;
        let handle = &mut *handle;
        if !handle.tracker.params().rebuild {
            return dst.put("dst", handle.tracker.vertices().iter().map(|&p| <[f64; 3]>::from(p)));
        }
        handle.outlook.look(call.ctx(), &handle.tracker, now, coming, dt)?;
        let positions = handle.outlook.eased(call.ctx(), &handle.tracker, ahead as usize)?;
        dst.put("dst", positions.iter().map(|&p| <[f64; 3]>::from(p)))
    })
}
