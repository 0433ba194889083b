//! Small amounts of liquid on a terrain, in real time.

use super::calls::changes;
use super::handle::{ShallowHandle, frz_shallow};
use super::params::{frz_shallow_domain, frz_shallow_params};
use super::surroundings::{Ground, creates_on};
use crate::capi::ffi::*;
#[cfg(feature = "vdb")]
use crate::capi::grid::sparse::frz_grid;
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::frz_context;
use crate::context::Context;
use crate::shallow::Report;
use crate::shallow::time_step::MAX_STEPS;

/// What a frame did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_report {
    /// sizeof(frz_shallow_report), set by the caller.
    pub struct_size: u32,
    /// Number of steps into which the frame was divided.
    pub steps: u32,
    /// Simulated time (s): dt, or less if the budget ran out.
    pub seconds: f64,
    /// Time that was dropped because the budget ran out (s): dt minus seconds. No liquid is lost with it.
    pub dropped: f64,
    /// Maximum depth (m), or slightly more.
    pub deepest: f64,
    /// Rows of cells, summed over steps, in which columns would have given more liquid than they had, and were limited to what they had.
    pub emptied: u64,
    /// Rows of cells, summed over steps, in which columns would have taken more than they had room for, and were limited to what fitted.
    pub filled: u64,
    /// Rows of cells, summed over steps, in which films on slopes would have been too fast for steps of this length, and were slowed down;
    /// with shorter steps they would not be.
    pub slowed: u64,
}

sized32!(frz_shallow_report);

fields_of!(Report => frz_shallow_report { steps, seconds, deepest, emptied, filled, slowed });

impl frz_shallow_report {
    pub(in crate::capi) fn of(done: Report, dt: f64) -> Self {
        Self { dropped: (dt - done.seconds).max(0.0), ..done.into() }
    }
}

/// Creates a liquid on a mesh, initially dry.
///
/// The vertical line through the centre of a cell is solid where it is inside the mesh: overlapping closed parts form one solid. Where the
/// mesh is open, everything below a face that faces up is solid, and a face that faces down is ignored; a warning says that the mesh is
/// open. Liquid stands on each solid of a cell, up to the underside of the next one.
///
/// params: NULL for the defaults.
/// domain: where liquid can be.
/// mesh: it is copied. FRZ_ERROR_ARGUMENT if no face of it within the domain faces up.
/// out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
///
/// Any number of threads may read a mesh; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_create(
    context: *mut frz_context,
    params: *const frz_shallow_params,
    domain: *const frz_shallow_domain,
    mesh: *const frz_mesh,
    out: *mut *mut frz_shallow,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates_on(context, (params, domain, Ground::Mesh(mesh)), out, ShallowHandle::new) }
}

/// Creates a liquid on a height field, initially dry.
///
/// params: NULL for the defaults.
/// domain: where liquid can be.
/// heights: float for each cell (m), finite: the height of the ground at its centre, row by row along x from the minimum z. Heights outside
///     the range of the domain are clamped to it.
/// out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_create_heights(
    context: *mut frz_context,
    params: *const frz_shallow_params,
    domain: *const frz_shallow_domain,
    heights: frz_view,
    out: *mut *mut frz_shallow,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates_on(context, (params, domain, Ground::Heights(heights)), out, ShallowHandle::new) }
}

/// Creates a liquid on a level set, initially dry.
///
/// params: NULL for the defaults.
/// domain: where liquid can be.
/// level_set: a grid of distances (m), negative inside; it is sampled at each voxel over the height of the domain. What is solid at the
///     minimum height is solid all the way down. The ground cannot move afterwards.
/// out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[cfg(feature = "vdb")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_create_grid(
    context: *mut frz_context,
    params: *const frz_shallow_params,
    domain: *const frz_shallow_domain,
    level_set: *const frz_grid,
    out: *mut *mut frz_shallow,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates_on(context, (params, domain, Ground::LevelSet(level_set)), out, ShallowHandle::new) }
}

/// Destroys a liquid; NULL is ignored. Its snapshots remain.
///
/// shallow: may be NULL. It is not destroyed while a call uses it.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_destroy(shallow: *mut frz_shallow) {
    // SAFETY: the liquid is NULL or alive.
    guard(|| unsafe { destroy(shallow) });
}

/// Sets the parameters from the next frame on. border, friction and the falls_ fields cannot change.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_params(
    shallow: *mut frz_shallow,
    params: *const frz_shallow_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { Ok(change(shallow)?.shallow.set_params(given(params)?.params()?)?) })
}

/// Computes a frame (a real-time call: see frz_shallow), in steps as frz_shallow_params.pace states.
///
/// dt: length of the frame (s), 1e-12 to 1e6. FRZ_ERROR_ARGUMENT also if it would take over a million steps: the liquid is then as it was.
/// budget_seconds: CPU time of this thread (s), or elapsed time if several threads work, after which no step begins, 0 to 1e6; 0: no limit.
///     The rest of the frame is then dropped (frz_shallow_report.dropped), but never any liquid. At least one step is made.
///     frz_shallow_last_steps and frz_shallow_replay reproduce such a frame.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_step(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    dt: f64,
    budget_seconds: f64,
    report: *mut frz_shallow_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, shallow, report, |ctx, liquid| {
            within("budget_seconds", budget_seconds, 0.0..=1e6, " s")?;
            let done = match budget_seconds {
                0.0 => liquid.shallow.step(ctx, dt),
                budget => liquid.shallow.step_within(ctx, dt, budget),
            };
            Ok(frz_shallow_report::of(done?, dt))
        })
    }
}

impl ShallowHandle {
    /// Computes a frame with a host's steps.
    ///
    /// # Safety
    /// The view must describe memory that can be read.
    unsafe fn replay(&mut self, ctx: &Context, steps: &frz_view) -> Outcome<frz_shallow_report> {
        // SAFETY: guaranteed by the caller.
        let given = unsafe { steps.in_place::<f64>("steps") }?;
        within("the count of steps", given.len() as f64, 1.0..=f64::from(MAX_STEPS), "")?;
        self.steps.clear();
        self.steps.extend(given);
        let dt = self.steps.iter().sum();
        Ok(frz_shallow_report::of(self.shallow.replay(ctx, &self.steps)?, dt))
    }
}

/// Computes a frame with given steps (a real-time call: see frz_shallow): from the same state, with the same parameters, flow points and
/// bodies, the result has the same bytes as the frame that the steps were reported for.
///
/// steps: double for each step, its length (s), 1e-12 to 1e6, as frz_shallow_last_steps listed them: 1 to 1000000 steps, together up to 1e6
///     s.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_replay(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    steps: frz_view,
    report: *mut frz_shallow_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { changes(context, shallow, report, |ctx, liquid| liquid.replay(ctx, &steps)) }
}

/// Lists the steps of the last frame: frz_shallow_replay reproduces it from them.
///
/// dst: room for a double for each step, its length (s). With data NULL only the count is reported. FRZ_ERROR_CAPACITY if it is too small.
/// count: receives their number; 0 after other failures.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_last_steps(
    shallow: *const frz_shallow,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { lists(count, || list(read(shallow)?.shallow.last_steps().iter().copied(), &dst, count)) }
}
