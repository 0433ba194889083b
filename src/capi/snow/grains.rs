//! Grains: snow that is pushed, piled and thrown.

use std::ffi::c_void;

use super::base_layer::frz_base;
use super::grains_params::{FRZ_GRAINS_FLOOR, frz_grains_params};
use crate::capi::ffi::saved::{Restart, Saved, new_or_resumed};
use crate::capi::ffi::*;
use crate::capi::grid::sparse::frz_grid;
use crate::capi::level_set::body::{Role, Shapes, bodies, frz_body};
use crate::capi::runtime::context::{creates, frz_context, steps};
use crate::context::Context;
use crate::numeric::digits;
use crate::snow::grains::{Base, Grains, StepReport, Surroundings, memory};
use crate::vdb::{FloatGrid, GridClass};

/// Grains of snow, all of one size.
pub struct frz_grains {
    _opaque: [u8; 0],
}

impl frz_grains_params {
    fn ground(&self) -> Ground {
        let floor = Some(self.floor).filter(|_| self.flags & FRZ_GRAINS_FLOOR != 0);
        Ground { floor, lowest: self.lowest }
    }
}

/// What a step did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grains_report {
    /// sizeof(frz_grains_report), set by the caller.
    pub struct_size: u32,
    /// Sub-steps that the step was divided into.
    pub sub_steps: u32,
    /// Grains after the step.
    pub count: u64,
    /// Grains at rest, which do not move until something wakes them.
    pub resting: u64,
    /// Grains born from removed snow.
    pub born: u64,
    /// Grains that fell below the lowest height, or left the box or the range of coordinates.
    pub dropped: u64,
    /// Grains that reached their lifetime.
    pub expired: u64,
    /// Grains whose attribute FRZ_GRAINS_TRAPPED is 1.
    pub trapped: u64,
    /// Snow that the base layer lost (m3).
    pub removed_volume: f64,
    /// Grains due from removed snow that are not born yet: fractions of a grain, and those for which there was no room.
    pub owed: f64,
    /// Largest speed (m/s).
    pub fastest: f64,
}

sized32!(frz_grains_report);

fields_of!(StepReport => frz_grains_report {
    sub_steps, count, resting, born, dropped, expired, trapped, removed_volume, owed, fastest
});

/// Limits below the grains.
#[derive(Clone, Copy)]
struct Ground {
    /// Height of a level ground (m).
    floor: Option<f64>,
    /// Height (m) below which grains are removed.
    lowest: f64,
}

/// The value of a handle of grains.
pub(in crate::capi) struct GrainsHandle {
    pub grains: Grains,
    ground: Ground,
    shapes: Shapes,
    pub saved: Saved,
}

handle!(frz_grains, GrainsHandle, "grains handle", 6);

impl GrainsHandle {
    /// New grains, or those of a saved state.
    ///
    /// # Safety
    /// The pointers must be NULL or valid.
    unsafe fn new(ctx: &Context, params: *const frz_grains_params, restart: Restart) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let params = given_or_defaults(params)?;
            let own = params.params()?;
            let new = || Ok(Grains::new(own)?);
            let grains = new_or_resumed(ctx, "grains", restart, new, Grains::unpacked_size, |state| {
                Grains::resume(own, state)
            })?;
            Ok(Self { grains, ground: params.ground(), shapes: Shapes::new(), saved: Saved::default() })
        }
    }

    fn set_params(&mut self, params: &frz_grains_params) -> Outcome {
        self.grains.set_params(params.params()?)?;
        self.ground = params.ground();
        Ok(())
    }

    /// Moves the grains through a step.
    ///
    /// # Safety
    /// The bodies must describe memory that can be read.
    unsafe fn step(
        &mut self,
        ctx: &Context,
        base: Base<'_>,
        (list, count): (*const frz_body, usize),
        dt: f64,
        frame: i32,
    ) -> Outcome<frz_grains_report> {
        within("dt", dt, 0.0..=MAX_DT, " s")?;
        refuse(dt > 0.0 && dt < MIN_DT, || format!("dt = {dt} s is neither 0 nor at least {MIN_DT} s"))?;
        if let Some(snow) = base.after() {
            check_size(self.grains.params().radius, snow.voxel_size())?;
        }
        ctx.allow("the grains", memory(self.grains.count()))?;
        // SAFETY: guaranteed by the caller.
        let bodies = unsafe { bodies(ctx, list, count, dt, Role::Push, &mut self.shapes) }?;
        if dt == 0.0 {
            let (count, resting) = (self.grains.count() as u64, self.grains.resting() as u64);
            let (trapped, owed) = (self.grains.trapped().len() as u64, self.grains.owed());
            return Ok(frz_grains_report { count, resting, trapped, owed, ..frz_grains_report::zeroed() });
        }
        let objects: Vec<_> = bodies.iter().map(|(body, surface)| surface.object(body)).collect();
        let Ground { floor, lowest } = self.ground;
        let around = Surroundings { base, objects: &objects, statics: &[], ground: &[], floor, lowest };
        let done = self.grains.step(ctx, &around, [0.0, dt], frame)?;
        self.saved.take();
        let report = frz_grains_report::from(done);
        // An empty sum is -0.
        let (removed_volume, owed) = (report.removed_volume + 0.0, report.owed + 0.0);
        Ok(frz_grains_report { removed_volume, owed, ..report })
    }
}

/// Minimum length of a step (s), besides 0.
const MIN_DT: f64 = 1.0e-6;
/// Maximum length of a step (s).
const MAX_DT: f64 = 3600.0;
/// Minimum and maximum radius of a grain in voxels of the base layer.
const RADII: [f64; 2] = [0.02, 0.5];

/// Refuses grains that are too small or too large for a base layer's voxels (m).
fn check_size(radius: f64, voxel: f64) -> Outcome {
    let [low, high] = RADII.map(|part| part * voxel);
    if radius < low || radius > high {
        let [radius, voxel] = [radius, voxel].map(digits::given);
        let [low, high] = [low, high].map(digits::bound);
        let text = format!(
            "radius = {radius} is not within {low} to {high} m, as the base layer's voxels of {voxel} m require"
        );
        return Err(Failure::argument(text));
    }
    Ok(())
}

/// Refuses a grid that cannot be the snow of a base layer.
pub(in crate::capi) fn check_snow(name: &str, grid: &FloatGrid) -> Outcome {
    refuse(grid.class() != GridClass::LevelSet, || format!("{name}: the grid is not a level set"))?;
    refuse(!grid.is_world_fixed(), || {
        format!("{name}: the grid is rotated or shifted relative to the world's axes")
    })
}

/// Creates grains: none yet, or those of a state that frz_grains_save wrote.
///
/// params: NULL for the defaults.
/// restart: restart_bytes bytes that frz_grains_save wrote for grains of the same radius: they are restored bit for bit, on any number of
///     threads. NULL: none. FRZ_ERROR_FILE if they are damaged, or of another version or radius.
/// restart_bytes: size of restart; 0 without one.
/// out: receives the grains, to be destroyed with frz_grains_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_create(
    context: *mut frz_context,
    params: *const frz_grains_params,
    restart: *const c_void,
    restart_bytes: usize,
    out: *mut *mut frz_grains,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| GrainsHandle::new(ctx, params, (restart, restart_bytes))) }
}

/// Destroys grains; NULL is ignored.
///
/// grains: may be NULL. They are not destroyed while a call uses them.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_destroy(grains: *mut frz_grains) {
    // SAFETY: the grains are NULL or alive.
    guard(|| unsafe { destroy(grains) });
}

/// Sets how grains behave from the next step on. All parameters but the radius may change between steps.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_set_params(
    grains: *mut frz_grains,
    params: *const frz_grains_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { change(grains)?.set_params(&given(params)?) })
}

/// Moves grains through a step, and adds those born from the snow that the base layer's last step removed.
///
/// Call it once after each frz_base_step, with the same bodies, dt and frame. The layer has kept the previous state of the blocks that its
/// step changed; nothing else of it is compared or copied. After a failure or a cancel the grains are as they were before.
///
/// base: the layer after its step; it is only read. Its voxels must suit the radius, else FRZ_ERROR_ARGUMENT. A layer that has not stepped
///     since it was created or restored removed nothing. NULL: there is none.
/// bodies: count bodies that push the grains, each with its friction; NULL with a count of 0. Bodies that do not move have no
///     positions_end. Holes of less than a tenth of a mesh's area are closed; a mesh with wider ones collides on both sides. A warning says
///     so. A body with a vertex that moves faster than 100 m/s is treated as jumping: it stands at positions_end for the whole step and
///     carries no grains along, with a warning. A vertex farther than 1e6 m from the origin along an axis is FRZ_ERROR_ARGUMENT.
/// count: number of bodies.
/// dt: length of the step (s), 1e-6 to 3600. 0: nothing is born and nothing moves, as the first frame of a shot requires: the snow that
///     bodies cut out there was gone before the shot.
/// frame: the source frame of the grains that are born.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time; any number may read a base layer, but none may step it meanwhile (FRZ_ERROR_BUSY).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_step(
    context: *mut frz_context,
    grains: *mut frz_grains,
    base: *const frz_base,
    bodies: *const frz_body,
    count: usize,
    dt: f64,
    frame: i32,
    report: *mut frz_grains_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        steps(context, grains, report, |ctx, grains| {
            if base.is_null() {
                return grains.step(ctx, Base::Missing, (bodies, count), dt, frame);
            }
            let base = read(base)?;
            let base = Base::Changed(base.layer.surface(), base.layer.before());
            grains.step(ctx, base, (bodies, count), dt, frame)
        })
    }
}

/// Moves grains through a step, and adds those born from the snow that is in one grid but no longer in another: as frz_grains_step, for a
/// host that has a base layer of its own, or only its states. The grains are the same, bit for bit, but all blocks of both grids are
/// compared.
///
/// before: the snow before the base layer's step, a level set with voxels fixed in world space; NULL: nothing was removed.
/// after: the snow after it, with which grains collide; a level set with voxels of the same size.
/// bodies: as for frz_grains_step.
/// count: as for frz_grains_step.
/// dt: as for frz_grains_step.
/// frame: as for frz_grains_step.
/// report: as for frz_grains_step.
///
/// One thread at a time; any number may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_step_grids(
    context: *mut frz_context,
    grains: *mut frz_grains,
    before: *const frz_grid,
    after: *const frz_grid,
    bodies: *const frz_body,
    count: usize,
    dt: f64,
    frame: i32,
    report: *mut frz_grains_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        steps(context, grains, report, |ctx, grains| {
            let after = read(after)?;
            let after = after.floats()?;
            check_snow("after", after)?;
            if before.is_null() {
                return grains.step(ctx, Base::Changed(after, &[]), (bodies, count), dt, frame);
            }
            let before = read(before)?;
            let before = before.floats()?;
            check_snow("before", before)?;
            let voxels = [before, after].map(FloatGrid::voxel_size);
            refuse(voxels[0] != voxels[1], || {
                format!("before has voxels of {} m, but after of {} m", voxels[0], voxels[1])
            })?;
            grains.step(ctx, Base::Whole([before, after]), (bodies, count), dt, frame)
        })
    }
}
