//! Shallow liquid in cells of two sizes: its ground, its surface, its states.

use std::ffi::c_void;

use super::liquid::{DetailHandle, frz_shallow_detail};
use crate::capi::ffi::saved::{restores, saves_in_place};
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;
use crate::capi::shallow::calls::{changes, informs};
use crate::capi::shallow::ground::{all_cells, read_heights};
use crate::capi::shallow::surface::{
    FRZ_SHALLOW_LIFTED, FRZ_SHALLOW_SKIRTED, MeshRequest, frz_shallow_layout, frz_shallow_size,
    frz_shallow_target, writes,
};
use crate::capi::shallow::terrain::{frz_shallow_body, frz_shallow_moved, read_bodies};
use crate::shallow::Moved;
use crate::shallow::terrain::Solids;
use crate::shallow::two_level::surface::bound;

/// Moves the vertices of the mesh that the liquid was created with, as frz_shallow_update_terrain does, everywhere. After a failure all is
/// as it was.
///
/// positions: float[3] for each vertex (m), finite, in the mesh's order.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_update_terrain(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    positions: frz_view,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    unsafe { changes(context, detail, moved, |_, liquid| liquid.update_terrain(&positions)) }
}

/// Changes the heights of the height field that the liquid was created with, as frz_shallow_update_heights does, everywhere. After a
/// failure all is as it was.
///
/// heights: float for each cell of the domain (m), finite, as in frz_shallow_create_heights.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_update_heights(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    heights: frz_view,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    unsafe { changes(context, detail, moved, |_, liquid| liquid.update_heights(&heights)) }
}

impl DetailHandle {
    /// # Safety
    /// The view must describe memory that can be read.
    unsafe fn update_terrain(&mut self, positions: &frz_view) -> Outcome<Moved> {
        let Self { detail, surroundings, .. } = self;
        let columns = detail.fine().columns();
        let mesh = surroundings.terrain.mesh()?;
        // SAFETY: guaranteed by the caller.
        unsafe { mesh.read_positions(positions) }?;
        let solids = mesh.cast(columns.grid, columns.heights)?;
        let moved = detail.update_terrain(&solids)?;
        mesh.adopt_incoming();
        surroundings.carry_flows(|flow, at| detail.move_flow(flow, at))?;
        Ok(moved)
    }

    /// # Safety
    /// As [`DetailHandle::update_terrain`].
    unsafe fn update_heights(&mut self, heights: &frz_view) -> Outcome<Moved> {
        let Self { detail, surroundings, .. } = self;
        let (grid, range) = (detail.fine().columns().grid, detail.fine().columns().heights);
        let own = surroundings.terrain.heights()?;
        // SAFETY: guaranteed by the caller.
        unsafe { read_heights(heights, &grid, &range, all_cells(&grid), own) }?;
        let mut solids = Solids::empty(grid, range);
        own.iter().for_each(|solid| solids.push(solid));
        Ok(detail.update_terrain(&solids)?)
    }
}

/// Sets the solids that move over the ground, as frz_shallow_set_bodies does (a real-time call: see frz_shallow_detail). They may cross the
/// edge of the box. After a failure all is as it was.
///
/// bodies: count bodies; NULL with a count of 0: none.
/// count: number of bodies.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_bodies(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    bodies: *const frz_shallow_body,
    count: usize,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, detail, moved, |_, DetailHandle { detail, surroundings, .. }| {
            Ok(detail.set_bodies(read_bodies(bodies, count, &mut surroundings.shapes)?)?)
        })
    }
}

/// Reports the maximum size of the surface of any liquid, as frz_shallow_surface_bound does. It holds until the ground, a body or the box
/// of small cells moves.
///
/// size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_surface_bound(
    detail: *const frz_shallow_detail,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { informs(size, || Ok(bound(&read(detail)?.detail))) }
}

/// Writes the surface of all liquid as triangles (a real-time call: see frz_shallow_detail): one mesh, without a crack between small and
/// large cells. It ends at the centres of the outermost cells. The first call after the box of small cells has moved may allocate.
///
/// layout: NULL for the defaults. Without FRZ_SHALLOW_LIFTED and FRZ_SHALLOW_SKIRTED.
/// target: the buffers, as in frz_shallow_surface. In frz_shallow_target.columns the indices of large cells follow those of small ones.
///     FRZ_ERROR_CAPACITY if one is too small: nothing is written, and size receives what is needed.
/// size: receives the size of the surface, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_surface(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    layout: *const frz_shallow_layout,
    target: *const frz_shallow_target,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the spans.
    unsafe {
        writes(context, detail, (layout, target, size), |liquid, request| liquid.write_surface(request))
    }
}

impl DetailHandle {
    fn write_surface(&mut self, request: &MeshRequest<frz_shallow_target>) -> Outcome {
        let Self { detail, surface, flow_fields: [fine, coarse], is_reserved, .. } = self;
        for (flag, name) in
            [(FRZ_SHALLOW_LIFTED, "FRZ_SHALLOW_LIFTED"), (FRZ_SHALLOW_SKIRTED, "FRZ_SHALLOW_SKIRTED")]
        {
            refuse(request.has(flag), || format!("{name} is not for liquid in cells of two sizes"))?;
        }
        if !*is_reserved {
            surface.reserve(detail);
            *is_reserved = true;
        }
        let needed = request.needed_fields();
        let depths = [fine.depths(detail.fine(), &needed)?, coarse.depths(detail.coarse(), &needed)?];
        request.write_with(|target| match target {
            Some(target) => surface.build(detail, depths.each_ref(), &request.layout, target),
            None => surface.count(detail, depths.each_ref()),
        })
    }
}

/// Saves all that the next frame depends on, as frz_shallow_save does (a real-time call: see frz_shallow_detail). The box of small cells is
/// part of it.
///
/// dst: room for capacity bytes. NULL: only the current size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time for each context; any number may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_save(
    context: *mut frz_context,
    detail: *const frz_shallow_detail,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the memory at dst.
    unsafe {
        saves_in_place(
            context,
            detail,
            (dst, capacity, size),
            |liquid| liquid.detail.save_size(),
            |liquid, room| liquid.detail.save_to(room),
        )
    }
}

/// Replaces the liquid's state by a saved one, as frz_shallow_restore does, and moves the box of small cells to where it was.
///
/// state: bytes bytes of frz_shallow_detail_save. FRZ_ERROR_FILE, with the liquid unchanged, if they are damaged, or of another version,
///     another ground or border, or other kinds of flow points.
/// bytes: size of state.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_restore(
    context: *mut frz_context,
    detail: *mut frz_shallow_detail,
    state: *const c_void,
    bytes: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the bytes.
    unsafe {
        restores(context, detail, (state, bytes), |liquid, state| {
            let near = liquid.detail.near().clone();
            liquid.detail.restore(state)?;
            liquid.is_reserved &= near == *liquid.detail.near();
            Ok(())
        })
    }
}
