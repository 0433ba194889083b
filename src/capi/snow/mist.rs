//! Mist: powder that fast grains raise into the air.

use std::ffi::c_void;

use super::base_layer::frz_base;
use super::grains::frz_grains;
use super::mist_params::frz_mist_params;
use crate::capi::ffi::saved::{Restart, Saved, new_or_resumed, saves};
use crate::capi::ffi::*;
use crate::capi::grid::sparse::{Grid, frz_grid};
use crate::capi::level_set::body::{Role, Shapes, bodies, frz_body};
use crate::capi::runtime::context::{creates, frz_context, steps};
use crate::context::Context;
use crate::flow::Tiles;
use crate::geometry::DVec3;
use crate::snow::base_layer::BaseLayer;
use crate::snow::mist::{Grids, Mist, Source, Start, StepInputs, StepReport, Surroundings, Wind};
use crate::sweep::Body;
use crate::vdb::{AnyGrid, FloatGrid, VectorGrid};

/// Powder in the air.
pub struct frz_mist {
    _opaque: [u8; 0],
}

/// What a step did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_mist_report {
    /// sizeof(frz_mist_report), set by the caller.
    pub struct_size: u32,
    /// Sub-steps that the step was divided into.
    pub sub_steps: u32,
    /// Cells of air after the step.
    pub cells: u64,
    /// Grains that raised mist.
    pub sources: u64,
    /// Iterations of all projections in the mist's own grid together.
    pub iterations: u64,
    /// Sum of the density times the volume of a cell (m3).
    pub mass: f64,
    /// Maximum divergence left by a projection, times the cell, divided by the maximum speed before the projection.
    pub divergence: f64,
    /// Maximum speed of the air along any axis (m/s).
    pub fastest: f64,
}

sized32!(frz_mist_report);

fields_of!(StepReport => frz_mist_report { sub_steps, cells, sources, iterations, mass, divergence, fastest });

/// The value of a handle of mist.
pub(in crate::capi) struct MistHandle {
    mist: Mist,
    floor: Option<f64>,
    shapes: Shapes,
    saved: Saved,
}

handle!(frz_mist, MistHandle, "mist handle", 7);

/// Minimum length of a step (s).
const MIN_DT: f64 = 1.0e-6;
/// Maximum length of a step (s).
const MAX_DT: f64 = 3600.0;
/// Maximum time (s), in absolute value.
const MAX_TIME: f64 = 1.0e9;

/// Inputs of a step besides grains.
pub(in crate::capi) struct HostInputs<'a> {
    pub snow: Option<&'a FloatGrid>,
    pub wind: Option<&'a VectorGrid>,
    pub bodies: (*const frz_body, usize),
    pub time: f64,
    pub dt: f64,
}

impl MistHandle {
    /// New mist, or that of a saved state.
    ///
    /// # Safety
    /// The pointers must be NULL or valid.
    unsafe fn new(ctx: &Context, params: *const frz_mist_params, restart: Restart) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let params = given_or_defaults(params)?;
            let own = params.params()?;
            let new = || Ok(Mist::new(own.clone())?);
            let mist = new_or_resumed(ctx, "mist", restart, new, Mist::unpacked_size, |state| {
                Mist::resume(own.clone(), state)
            })?;
            Ok(Self { mist, floor: params.ground(), shapes: Shapes::new(), saved: Saved::default() })
        }
    }

    fn set_params(&mut self, params: &frz_mist_params) -> Outcome {
        self.mist.set_params(params.params()?)?;
        self.floor = params.ground();
        Ok(())
    }

    /// Moves the mist through a step.
    ///
    /// # Safety
    /// The bodies must describe memory that can be read.
    pub(in crate::capi) unsafe fn step(
        &mut self,
        ctx: &Context,
        sources: &[Source],
        host: &HostInputs<'_>,
    ) -> Outcome<frz_mist_report> {
        let HostInputs { snow, wind, bodies: (list, count), time, dt } = *host;
        within("dt", dt, MIN_DT..=MAX_DT, " s")?;
        within("time", time, -MAX_TIME..=MAX_TIME, " s")?;
        // SAFETY: guaranteed by the caller.
        let bodies = unsafe { bodies(ctx, list, count, dt, Role::Bound, &mut self.shapes) }?;
        let bodies: Vec<&Body> = bodies.iter().map(|(body, _)| body).collect();
        let removing = vec![true; bodies.len()];
        let surroundings =
            Surroundings { base: snow, bodies: &bodies, removing: &removing, floor: self.floor };
        let walls = surroundings.during([0.0, dt], self.mist.params().cell)?;
        let boundary = |tiles: &Tiles, cell: f32, share: f64| walls.faces(ctx, tiles, cell, share);
        let sample = |ctx: &Context, positions: &[DVec3]| match wind {
            Some(wind) => wind.sample(ctx, positions, true),
            None => Ok(vec![[0.0; 3]; positions.len()]),
        };
        let wind = wind.map(|_| Wind(&sample));
        let fastest = walls.fastest_near(&self.mist, sources);
        let inputs = StepInputs { sources, boundary: &boundary, fastest, wind: wind.as_ref() };
        let done = self.mist.step(ctx, &inputs, [time, time + dt])?;
        self.saved.take();
        Ok(done.into())
    }
}

/// Creates mist: none yet, or that of a state that frz_mist_save wrote.
///
/// params: NULL for the defaults.
/// restart: restart_bytes bytes that frz_mist_save wrote for mist with the same cell and wind: it is restored bit for bit, on any number of
///     threads. NULL: none. FRZ_ERROR_FILE if they are damaged, or of another version, cell or wind.
/// restart_bytes: size of restart; 0 without one.
/// out: receives the mist, to be destroyed with frz_mist_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_create(
    context: *mut frz_context,
    params: *const frz_mist_params,
    restart: *const c_void,
    restart_bytes: usize,
    out: *mut *mut frz_mist,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| MistHandle::new(ctx, params, (restart, restart_bytes))) }
}

/// Destroys mist; NULL is ignored.
///
/// mist: may be NULL. It is not destroyed while a call uses it.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_destroy(mist: *mut frz_mist) {
    // SAFETY: the mist is NULL or alive.
    guard(|| unsafe { destroy(mist) });
}

/// Sets how mist behaves from the next step on. All parameters but the cell and the wind may change between steps.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_set_params(
    mist: *mut frz_mist,
    params: *const frz_mist_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { change(mist)?.set_params(&given(params)?) })
}

/// Moves mist through a step, and adds what fast grains raise along their paths.
///
/// The paths of grains begin at their positions at the beginning of their last step, or where they were born in it: mist is the same at
/// every frame rate.
///
/// Call it once after each frz_grains_step, with the same base layer, bodies and dt, but not at the first frame of a shot, with a dt of 0:
/// nothing moved before it. After a failure or a cancel the mist is as it was before.
///
/// grains: the grains after their step; they are only read. NULL: none raise mist.
/// base: the layer after its step, around which the air flows; it is only read. NULL: there is none.
/// wind: a grid of velocities (m/s) that the air approaches where there is mist: half of the difference is gone after a tenth of a second.
///     Where there is air, a component that is beyond 1000 m/s or not finite is FRZ_ERROR_ARGUMENT. NULL: only frz_mist_params.wind.
/// bodies: count bodies that bound the air and carry it along; NULL with a count of 0. Bodies that do not move have no positions_end. If
///     the openings of a body exceed a tenth of its area, air flows around both of its sides. A body with a vertex that moves faster than
///     100 m/s is treated as jumping: it stands at positions_end for the whole step.
/// count: number of bodies.
/// time: time at the beginning of the step (s), -1e9 to 1e9: eddies change with it.
/// dt: length of the step (s), 1e-6 to 3600.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time; any number may read a base layer, grains and a grid, but none may change them meanwhile (FRZ_ERROR_BUSY).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_step(
    context: *mut frz_context,
    mist: *mut frz_mist,
    grains: *const frz_grains,
    base: *const frz_base,
    wind: *const frz_grid,
    bodies: *const frz_body,
    count: usize,
    time: f64,
    dt: f64,
    report: *mut frz_mist_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        steps(context, mist, report, |ctx, handle| {
            let grains = read_some(grains)?;
            let base = read_some(base)?;
            let wind = read_some(wind)?;
            let wind = wind.as_deref().map(Grid::vectors).transpose()?;
            let sources = match &grains {
                Some(handle) => {
                    let radius = handle.grains.params().radius;
                    let grains =
                        handle.grains.positions().zip(handle.grains.velocities()).zip(handle.grains.starts());
                    let start = |(position, velocity)| Start { position, velocity };
                    grains
                        .map(|((position, velocity), from)| Source {
                            position,
                            velocity,
                            radius,
                            start: from.map(start),
                        })
                        .collect()
                }
                None => Vec::new(),
            };
            let snow = base.as_deref().map(|base| snow_before(ctx, &base.layer)).transpose()?;
            handle.step(
                ctx,
                &sources,
                &HostInputs { snow: snow.as_ref(), wind, bodies: (bodies, count), time, dt },
            )
        })
    }
}

/// The snow of a layer before its last step.
fn snow_before(ctx: &Context, layer: &BaseLayer) -> Outcome<FloatGrid> {
    ctx.allow("the snow before the step", layer.surface().memory_bytes())?;
    let copy = || {
        let mut snow = layer.surface().deep_copy()?;
        snow.replace_blocks(ctx, layer.before())?;
        Ok(snow)
    };
    Ok(ctx.phase("snow", copy)?)
}

/// Fields that frz_mist_grid returns.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_mist_field {
    /// Floats: the density of the mist, a fog; active where there is some. The grid is named "density".
    FRZ_MIST_DENSITY = 0,
    /// Vectors: the velocity of the air (m/s) at the cells' centres, in blocks that hold mist. The grid is named "vel".
    FRZ_MIST_VELOCITY = 1,
}

use frz_mist_field::*;

const FIELDS: Meanings<frz_mist_field, 2> = numbered! { FRZ_MIST_DENSITY, FRZ_MIST_VELOCITY };

/// Creates a grid of the mist, whose voxels are its cells: the centre of voxel (0, 0, 0) lies at half a cell on each axis.
///
/// field: a frz_mist_field.
/// out: receives the grid, owned by the caller, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context; any number may read mist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_grid(
    context: *mut frz_context,
    mist: *const frz_mist,
    field: u32,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let field = meaning("field", "frz_mist_field", field, &FIELDS)?;
            let handle = read(mist)?;
            let Grids { density, velocity } = Grids::of(ctx, &handle.mist)?;
            Ok(Grid::Own(match field {
                FRZ_MIST_DENSITY => AnyGrid::Floats(density),
                FRZ_MIST_VELOCITY => AnyGrid::Vectors(velocity),
            }))
        })
    }
}

/// Saves all that the next step depends on besides the parameters and the surroundings, for a host's own cache. The bytes are the same on
/// any number of threads.
///
/// dst: room for capacity bytes. NULL: only the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_save(
    context: *mut frz_context,
    mist: *const frz_mist,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { saves(context, mist, (dst, capacity, size), |handle| (&handle.saved, &handle.mist), Mist::save) }
}
