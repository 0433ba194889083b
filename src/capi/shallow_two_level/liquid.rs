//! Shallow liquid in cells of two sizes: small ones near what matters.

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::frz_context;
use crate::capi::shallow::calls::{answer_some, changes, informs};
use crate::capi::shallow::flow_points::frz_shallow_flow;
use crate::capi::shallow::liquid::frz_shallow_report;
use crate::capi::shallow::params::{frz_shallow_domain, frz_shallow_params};
use crate::capi::shallow::sources::frz_shallow_balance;
use crate::capi::shallow::surface::prepared::FlowFields;
use crate::capi::shallow::surroundings::{Ground, Setup, Surroundings, creates_on};
use crate::context::Context;
use crate::shallow::Detail;
use crate::shallow::two_level::cells_around;
use crate::shallow::two_level::surface::Surface;

/// Shallow liquid in cells of two sizes: those of its domain in a box that may move, around an instrument or a player, and cells of twice
/// the length everywhere else, where a frame takes a quarter of the time. No liquid is lost between them.
///
/// It has no falls and no thickening. frz_shallow_detail_step, _surface, _save and _set_bodies are real-time calls, as frz_shallow defines
/// them; _set_near, _update_terrain and _update_heights may allocate, and so may _restore if it moves the box.
pub struct frz_shallow_detail {
    _opaque: [u8; 0],
}

/// The value of a handle.
pub(in crate::capi) struct DetailHandle {
    pub detail: Detail,
    pub surroundings: Surroundings,
    /// Builds surfaces of this liquid.
    pub surface: Surface,
    /// Whether `surface` has room for the current columns.
    pub is_reserved: bool,
    /// Velocities and concentrations for surfaces, in small cells and in large ones.
    pub flow_fields: [FlowFields; 2],
}

handle!(frz_shallow_detail, DetailHandle, "shallow liquid in cells of two sizes", 12);

impl DetailHandle {
    /// Dry ground, with a box of small cells.
    ///
    /// # Safety
    /// The pointer must be NULL or point to four numbers.
    unsafe fn new(ctx: &Context, setup: Setup, near: *const f64) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        let near = cells_around(&setup.solids.grid, unsafe { numbers(near, "near") }?)?;
        let detail = ctx.phase("columns", || Detail::new(ctx, &setup.solids, setup.params, near))?;
        let mut surface = Surface::default();
        surface.reserve(&detail);
        let surroundings = Surroundings::new(setup.terrain);
        Ok(Self { detail, surroundings, surface, is_reserved: true, flow_fields: Default::default() })
    }

    fn step(&mut self, ctx: &Context, dt: f64) -> Outcome<frz_shallow_report> {
        Ok(frz_shallow_report::of(self.detail.step(ctx, dt)?, dt))
    }
}

/// Creates a liquid in cells of two sizes on a mesh, as frz_shallow_create does, initially dry.
///
/// params: NULL for the defaults. Without falls and thickening.
/// domain: where liquid can be. Its numbers of cells are even.
/// mesh: it is copied.
/// near: double[4], minimum x, minimum z, maximum x and maximum z (m): the box in which cells are small, enlarged to whole pairs of cells
///     along x and z, within the domain; all cells may be small. FRZ_ERROR_ARGUMENT if it lies outside the domain.
/// out: receives the liquid, to be destroyed with frz_shallow_detail_destroy; NULL after a failure.
///
/// Any number of threads may read a mesh; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_create(
    context: *mut frz_context,
    params: *const frz_shallow_params,
    domain: *const frz_shallow_domain,
    mesh: *const frz_mesh,
    near: *const f64,
    out: *mut *mut frz_shallow_detail,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates_on(context, (params, domain, Ground::Mesh(mesh)), out, |ctx, setup| {
            DetailHandle::new(ctx, setup, near)
        })
    }
}

/// Creates a liquid in cells of two sizes on a height field, as frz_shallow_create_heights does, initially dry.
///
/// params: as in frz_shallow_detail_create.
/// domain: as in frz_shallow_detail_create.
/// heights: float for each cell of the domain (m), as in frz_shallow_create_heights.
/// near: as in frz_shallow_detail_create.
/// out: receives the liquid, to be destroyed with frz_shallow_detail_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_create_heights(
    context: *mut frz_context,
    params: *const frz_shallow_params,
    domain: *const frz_shallow_domain,
    heights: frz_view,
    near: *const f64,
    out: *mut *mut frz_shallow_detail,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates_on(context, (params, domain, Ground::Heights(heights)), out, |ctx, setup| {
            DetailHandle::new(ctx, setup, near)
        })
    }
}

/// Destroys a liquid in cells of two sizes; NULL is ignored.
///
/// detail: may be NULL. It is not destroyed while a call uses it.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_destroy(detail: *mut frz_shallow_detail) {
    // SAFETY: the liquid is NULL or alive.
    guard(|| unsafe { destroy(detail) });
}

/// Sets the parameters, as frz_shallow_set_params does.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_params(
    detail: *mut frz_shallow_detail,
    params: *const frz_shallow_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { Ok(change(detail)?.detail.set_params(given(params)?.params()?)?) })
}

/// Moves the box of small cells. The liquid keeps its volume and fluxes, and a level surface stays level. If the box covers the same cells
/// the call costs nothing, so a host may make it in each frame.
///
/// near: double[4], as in frz_shallow_detail_create. After a failure all is as it was.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_near(
    detail: *mut frz_shallow_detail,
    near: *const f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let DetailHandle { detail, is_reserved, .. } = &mut *change(detail)?;
        let cells = cells_around(&detail.fine().columns().grid, numbers(near, "near")?)?;
        *is_reserved &= cells == *detail.near();
        Ok(detail.set_near(cells)?)
    })
}

/// Reports the box of small cells.
///
/// near: receives double[4]: minimum x, minimum z, maximum x and maximum z (m); all zeroes after a failure.
///
/// Any number of threads may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_get_near(
    detail: *const frz_shallow_detail,
    near: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(near.cast::<[f64; 4]>(), "near", || {
            let liquid = read(detail)?;
            let ([x, z], grid) = (liquid.detail.near(), liquid.detail.fine().columns().grid);
            let at = |axis: usize, cell: usize| grid.origin[axis] + cell as f64 * grid.cell;
            Ok([at(0, x.start), at(1, z.start), at(0, x.end), at(1, z.end)])
        })
    })
}

/// Computes a frame (a real-time call: see frz_shallow_detail), as frz_shallow_step does without a budget.
///
/// dt: as in frz_shallow_step.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_step(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    dt: f64,
    report: *mut frz_shallow_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { changes(context, detail, report, |ctx, liquid| liquid.step(ctx, dt)) }
}

/// Sets sources, drains and absorbers, as frz_shallow_set_flows does. Each acts on cells of the size at its centre.
///
/// flows: count flow points; NULL with a count of 0: none. After a failure the old ones are kept.
/// count: number of flow points.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_flows(
    detail: *mut frz_shallow_detail,
    flows: *const frz_shallow_flow,
    count: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let DetailHandle { detail, surroundings, .. } = &mut *change(detail)?;
        surroundings.set_flows(flows, count, |points| detail.set_flows(points, |at| format!("flow {at}")))
    })
}

/// Changes the rate of a flow point: a valve. The volume that it has moved stays.
///
/// flow: its index, from 0.
/// rate: volume per second (m3/s), 0 or more.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_rate(
    detail: *mut frz_shallow_detail,
    flow: usize,
    rate: f64,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive.
    guard(|| Ok(unsafe { change(detail) }?.detail.set_rate(flow, rate)?))
}

/// Reports the volume that entered or left through a flow point since it was set.
///
/// flow: its index, from 0.
/// volume: receives it (m3); 0 after a failure.
///
/// Any number of threads may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_flow_moved(
    detail: *const frz_shallow_detail,
    flow: usize,
    volume: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(volume, "volume", || {
            let liquid = read(detail)?;
            Ok(liquid.detail.moved(check_index("flow", flow, liquid.surroundings.flows.len())?))
        })
    })
}

/// Pours a volume at a position, as frz_shallow_pour does, into cells of the size at that position.
///
/// at: double[3], the position (m).
/// radius: as in frz_shallow_flow (m).
/// volume: volume to pour in (m3); negative: to take out.
/// poured: receives the volume poured in (m3), negative if taken out; 0 after a failure. May be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_pour(
    detail: *mut frz_shallow_detail,
    at: *const f64,
    radius: f64,
    volume: f64,
    poured: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer_some(poured, || {
            let mut liquid = change(detail)?;
            let at = numbers(at, "at")?;
            finite("volume", volume)?;
            Ok(liquid.detail.pour_at(at, radius, volume)?)
        })
    })
}

/// Fills all columns up to a height, as frz_shallow_fill does.
///
/// height: height of the surface (m).
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_fill(detail: *mut frz_shallow_detail, height: f64) -> frz_status {
    // SAFETY: the liquid is NULL or alive.
    guard(|| unsafe {
        let mut liquid = change(detail)?;
        finite("height", height)?;
        liquid.detail.fill(height);
        Ok(())
    })
}

/// Reports where all liquid is, and where it came from. Each large cell has a remainder of less than its unit, which is four units of a
/// small cell; these remainders are part of held.
///
/// balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_get_balance(
    detail: *const frz_shallow_detail,
    balance: *mut frz_shallow_balance,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { informs(balance, || Ok(read(detail)?.detail.balance())) }
}
