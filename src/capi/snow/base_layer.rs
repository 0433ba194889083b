//! The base layer. The other objects that are moved in steps follow the same pattern.

use std::ffi::c_void;
use std::ptr::NonNull;

use crate::capi::ffi::saved::write_bytes;
use crate::capi::ffi::*;
use crate::capi::grid::sparse::{Grid, frz_grid};
use crate::capi::level_set::body::{Role, Shapes, bodies, frz_body};
use crate::capi::level_set::tools::frz_noise;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, enter, frz_context, steps};
use crate::numeric::blocks::Origin;
use crate::snow::base_layer::{BaseLayer, Params, StepReport};
use crate::sweep::{Body, TOLERANCE};
use crate::vdb::FloatGrid;

/// A layer of snow that bodies press into.
pub struct frz_base {
    _opaque: [u8; 0],
}

/// How bodies press into the snow. All parameters may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_base_params {
    /// sizeof(frz_base_params).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Maximum error of the swept volume (voxels), 0.001 to 1.
    pub tolerance: f64,
    /// Ragged edges of imprints.
    pub noise: frz_noise,
}

sized32!(
    frz_base_params,
    [noise],
    Self { tolerance: TOLERANCE, noise: frz_noise::DEFAULTS, ..Self::zeroed() }
);

impl frz_base_params {
    /// The library's own parameters for voxels of a size (m).
    fn params(&self, cell: f64) -> Outcome<Params> {
        no_flags(self.flags, 0)?;
        finite("tolerance", self.tolerance)?;
        Ok(Params { noise: self.noise.params(cell)?, tolerance: self.tolerance })
    }
}

/// What a step did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_base_report {
    /// sizeof(frz_base_report), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// Snow removed in this step (m3).
    pub removed_volume: f64,
    /// Snow left (m3).
    pub base_volume: f64,
    /// Blocks of 8 x 8 x 8 voxels in which the snow changed.
    pub touched_blocks: u64,
    /// Triangles of the boundary of the swept volume near the snow.
    pub sweep_faces: u64,
}

sized32!(frz_base_report, [touched_blocks]);

fields_of!(StepReport => frz_base_report { removed_volume, base_volume, touched_blocks, sweep_faces });

/// Number of grids that a base layer lends: snow, removed, compression, touched.
const LENT: usize = 4;

/// The value of a base layer's handle.
pub(in crate::capi) struct BaseHandle {
    pub layer: Box<BaseLayer>,
    shapes: Shapes,
    lent: [*mut frz_grid; LENT],
    dirty: Vec<Origin>,
}

handle!(frz_base, BaseHandle, "base layer", 5);

impl BaseHandle {
    fn new(layer: BaseLayer) -> Outcome<Self> {
        let mut state = Self {
            layer: Box::new(layer),
            shapes: Shapes::new(),
            lent: [std::ptr::null_mut(); LENT],
            dirty: Vec::new(),
        };
        for index in 0..LENT {
            let grid = NonNull::from(state.grids()[index]);
            // SAFETY: `out` points to a pointer of this object.
            unsafe { give(&raw mut state.lent[index], Grid::Lent(grid)) }?;
        }
        Ok(state)
    }

    fn grids(&self) -> [&FloatGrid; LENT] {
        [self.layer.surface(), self.layer.removed(), self.layer.compression(), self.layer.touched()]
    }

    /// Runs `work` while the lent grids are locked, and then lends the current ones.
    fn with_grids_locked<T>(&mut self, work: impl FnOnce(&mut Self) -> Outcome<T>) -> Outcome<T> {
        // SAFETY: the handles live as long as `self`.
        let mut held = self.lent.map(|grid| unsafe { change(grid) });
        if let Some(Err(_)) = held.iter().find(|held| held.is_err()) {
            let text = "a grid of the base layer is in use by another call";
            return Err(Failure::new(frz_status::FRZ_ERROR_BUSY, text));
        }
        let value = work(self);
        for (held, grid) in held.iter_mut().flatten().zip(self.grids()) {
            **held = Grid::Lent(NonNull::from(grid));
        }
        value
    }
}

impl Drop for BaseHandle {
    fn drop(&mut self) {
        for grid in self.lent {
            // SAFETY: made in `new`; `frz_base_destroy` has locked them.
            unsafe { free(grid) };
        }
    }
}

/// Fills parameters with the defaults, those of the thesis' look.
///
/// params: receives the defaults.
/// size: sizeof(frz_base_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_params_init(params: *mut frz_base_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have `size` bytes.
    guard(|| unsafe { fill(params, Some(size), frz_base_params::defaults()) })
}

/// Creates a base layer: untouched, or in a state that frz_base_save wrote.
///
/// params: NULL for the defaults.
/// snow: a level set with voxels fixed in world space, for instance from frz_snow_layer or frz_grid_load; it is copied.
/// restart: restart_bytes bytes that frz_base_save wrote for a layer made from the same snow: its grids are restored bit for bit, on any
///     number of threads. NULL: untouched. FRZ_ERROR_FILE if they are damaged, or of another version or other snow.
/// restart_bytes: size of restart; 0 without one.
/// out: receives the layer, to be destroyed with frz_base_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_create(
    context: *mut frz_context,
    params: *const frz_base_params,
    snow: *const frz_grid,
    restart: *const c_void,
    restart_bytes: usize,
    out: *mut *mut frz_base,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let held = read(snow)?;
            let snow = held.floats()?;
            let params = given_or_defaults(params)?.params(snow.voxel_size())?;
            let state = frz_view::packed(restart, restart_bytes).elements::<u8>("restart")?;
            ctx.allow("the base layer", snow.memory_bytes().saturating_add(state.len() as u64))?;
            let untouched = restart.is_null();
            let layer = ctx.polled(|| match untouched {
                true => BaseLayer::new(ctx, snow.deep_copy()?, params),
                false => BaseLayer::restore(ctx, snow.deep_copy()?, params, &state),
            })?;
            BaseHandle::new(layer)
        })
    }
}

/// Destroys a base layer, and the grids that it lent; NULL is ignored.
///
/// base: may be NULL. While a call uses it or one of its grids nothing is destroyed.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_destroy(base: *mut frz_base) {
    // SAFETY: the layer is NULL or alive.
    guard(|| unsafe { destroy_whole(base, |layer: &BaseHandle| layer.lent.to_vec()) });
}

/// Sets how bodies press from the next step on. All parameters may change between steps; the voxels and the snow itself are not parameters
/// and cannot.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_set_params(
    base: *mut frz_base,
    params: *const frz_base_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let mut base = change(base)?;
        let params = given(params)?.params(base.layer.surface().voxel_size())?;
        Ok(base.layer.set_params(params)?)
    })
}

/// Removes from the snow the space that bodies pass through in a step.
///
/// Results replace the layer's grids only at the end: after a failure or a cancel the layer is as it was before.
///
/// bodies: count bodies; NULL with a count of 0. What passes farther than 131072 voxels from the middle of the snow is left out. If a body
///     touches the snow while one of its vertices is that far away, FRZ_ERROR_ARGUMENT names the body's index, and nothing is changed.
/// count: number of bodies.
/// dt: length of the step (s). 0: the bodies are cut out at their positions at its beginning, as the first frame of a shot requires.
/// frame: the value that frz_base_touched takes where the snow changes, -16777216 to 16777216.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time; the layer's grids must not be in use meanwhile (FRZ_ERROR_BUSY).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_step(
    context: *mut frz_context,
    base: *mut frz_base,
    bodies: *const frz_body,
    count: usize,
    dt: f64,
    frame: i32,
    report: *mut frz_base_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        steps(context, base, report, |ctx, base| {
            refuse(frame.unsigned_abs() > 1 << 24, || {
                format!("frame = {frame} is not within -16777216 to 16777216")
            })?;
            base.with_grids_locked(|state| {
                let bodies = self::bodies(ctx, bodies, count, dt, Role::Sweep, &mut state.shapes)?;
                let bodies: Vec<Body> = bodies.into_iter().map(|(body, _)| body).collect();
                let done = state.layer.step(ctx, &bodies, 0.0, dt, frame)?;
                state.dirty = state.layer.dirty().collect();
                Ok(frz_base_report::from(done))
            })
        })
    }
}

/// Saves what the next step depends on besides the snow that the layer was made from, for a host's own cache.
///
/// Only blocks that ever changed are stored, packed; the bytes are the same on any number of threads. What the last step removed, and which
/// blocks it changed, is not part of the state.
///
/// dst: room for capacity bytes. NULL: only an upper bound of the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_save(
    context: *mut frz_context,
    base: *const frz_base,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(size);
        let call = enter(context)?;
        let base = read(base)?;
        let bound = || base.layer.save_bound();
        write_bytes(dst, capacity, size, bound, || Ok(base.layer.save(call.ctx())?))
    })
}

fn lent(base: *const frz_base, index: usize) -> *const frz_grid {
    guard_value(std::ptr::null(), || {
        // SAFETY: the layer is NULL or alive.
        Ok(unsafe { read(base) }?.lent[index].cast_const())
    })
}

/// Lends the snow: a level set (m), negative inside.
///
/// The layer owns the grid: the pointer is valid until the layer is destroyed, its contents until the next step. NULL after a failure.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_grid(base: *const frz_base) -> *const frz_grid {
    lent(base, 0)
}

/// Lends the snow that the last step removed: a level set (m), empty before the first step and after a restart.
///
/// The layer owns the grid, as that of frz_base_grid.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_removed(base: *const frz_base) -> *const frz_grid {
    lent(base, 1)
}

/// Lends the compression of the snow: at each touched voxel of the surface, the fraction of its column's height that was removed, 0 to 1.
///
/// The layer owns the grid, as that of frz_base_grid.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_compression(base: *const frz_base) -> *const frz_grid {
    lent(base, 2)
}

/// Lends the time of the last change of the snow: the frame that frz_base_step was given, at touched voxels of the surface.
///
/// The layer owns the grid, as that of frz_base_grid.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_touched(base: *const frz_base) -> *const frz_grid {
    lent(base, 3)
}

/// Reports the bounding box of the snow, which no step enlarges.
///
/// min: receives double[3], its minimum corner (m); zeroes after a failure.
/// max: receives double[3], its maximum corner (m); zeroes after a failure.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_bounds(base: *const frz_base, min: *mut f64, max: *mut f64) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let [min, max] = [min.cast::<[f64; 3]>(), max.cast::<[f64; 3]>()];
        clear(min);
        clear(max);
        let [min, max] = [required(min, "min")?, required(max, "max")?];
        let (low, high) = read(base)?.layer.bounds();
        min.write_unaligned(low.into());
        max.write_unaligned(high.into());
        Ok(())
    })
}

/// Lends the origins of the blocks that the last step changed in any of the layer's grids, in ascending order: with them and frz_grid_probe
/// a host updates its own copy.
///
/// origins: receives a pointer to count times int32_t[3], the minimum voxels of the blocks. The layer owns it, until the next step. NULL if
///     there is none, or after a failure.
/// count: receives their number; 0 after a failure, before the first step and after a restart.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_base_dirty(
    base: *const frz_base,
    origins: *mut *const i32,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(origins);
        clear(count);
        let count = required(count, "count")?;
        let origins = required(origins, "origins")?;
        let base = read(base)?;
        if !base.dirty.is_empty() {
            origins.write(base.dirty.as_flattened().as_ptr());
            count.write(base.dirty.len());
        }
        Ok(())
    })
}
