//! The ground below shallow liquid: made once, then moved.

use super::calls::changes;
use super::ground::{cells_in, read_heights};
use super::handle::{ShallowHandle, frz_shallow};
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;
use crate::geometry::DVec3;
use crate::shallow::Moved;
use crate::shallow::terrain::shapes::Shape;

/// How a change of the ground affected the liquid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_moved {
    /// sizeof(frz_shallow_moved), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// Cells whose columns were rebuilt.
    pub cells: u64,
    /// Liquid (m3) that could not stay in its column, and moved to others of its cell or of adjacent cells.
    pub displaced: f64,
    /// All liquid (m3) that now waits for room: the ground has displaced it, and returns it where there is room again. It is part of
    /// frz_shallow_balance.held.
    pub held: f64,
    /// Liquid (m3) that fell where there is no longer any ground: it is part of frz_shallow_balance.lost.
    pub fallen: f64,
}

sized32!(frz_shallow_moved);

fields_of!(Moved => frz_shallow_moved { cells, displaced, held, fallen });

/// Moves the vertices of the mesh that the liquid was created with (a real-time call: see frz_shallow): bones and organs move or deform.
/// The liquid is carried along, and none of it is lost; flow points on triangles move with them. After a failure all is as it was.
///
/// positions: float[3] for each vertex (m), finite, in the mesh's order.
/// bounds: double[4], minimum x, minimum z, maximum x and maximum z (m) of all triangles that move, at their old and their new positions:
///     the ground is rebuilt only there. NULL: everywhere.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_update_terrain(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    positions: frz_view,
    bounds: *const f64,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    unsafe {
        changes(context, shallow, moved, |_, liquid| {
            let ShallowHandle { shallow, surroundings, .. } = &mut *liquid;
            let cells = cells_in(&shallow.columns().grid, bounds)?;
            let mesh = surroundings.terrain.mesh()?;
            mesh.read_positions(&positions)?;
            mesh.caster.cast(&mesh.incoming, &mesh.triangles, cells.clone())?;
            let moved = shallow.update_cells(cells, |cell| mesh.caster.at(cell))?;
            mesh.adopt_incoming();
            surroundings.carry_flows(|flow, at| shallow.move_flow(flow, at))?;
            Ok(liquid.ground_changed(moved))
        })
    }
}

/// Changes the heights of the height field that the liquid was created with (a real-time call: see frz_shallow). The liquid is carried
/// along, and none of it is lost. After a failure all is as it was.
///
/// heights: float for each cell of the domain (m), finite, as in frz_shallow_create_heights.
/// bounds: as in frz_shallow_update_terrain: heights outside it are assumed unchanged.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_update_heights(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    heights: frz_view,
    bounds: *const f64,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    unsafe {
        changes(context, shallow, moved, |_, liquid| {
            let ShallowHandle { shallow, surroundings, .. } = &mut *liquid;
            let (grid, range) = (shallow.columns().grid, shallow.columns().heights);
            let cells = cells_in(&grid, bounds)?;
            let solids = surroundings.terrain.heights()?;
            read_heights(&heights, &grid, &range, cells.clone(), solids)?;
            let moved = shallow.update_cells(cells, |cell| &solids[cell])?;
            Ok(liquid.ground_changed(moved))
        })
    }
}

/// Shapes of bodies.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_shape {
    /// A sphere.
    FRZ_SHALLOW_SPHERE = 0,
    /// All points within a distance of a line segment.
    FRZ_SHALLOW_CAPSULE = 1,
    /// A box in any orientation.
    FRZ_SHALLOW_BOX = 2,
}

use frz_shallow_shape::*;

const SHAPES: Meanings<fn(&frz_shallow_body) -> Shape, 3> = [
    (FRZ_SHALLOW_SPHERE as u32, |body| Shape::Sphere { centre: body.at.into(), radius: body.radius }),
    (FRZ_SHALLOW_CAPSULE as u32, |body| Shape::Capsule {
        ends: [body.at.into(), body.end.into()],
        radius: body.radius,
    }),
    (FRZ_SHALLOW_BOX as u32, |body| {
        let is_turned = body.axes.as_flattened().iter().any(|number| *number != 0.0);
        let world = [DVec3::x(), DVec3::y(), DVec3::z()];
        let axes = if is_turned { body.axes.map(DVec3::from) } else { world };
        Shape::Cuboid { centre: body.at.into(), axes, half: body.half }
    }),
];

/// A solid that moves over the ground: a tool, a finger. Zero it, then set struct_size.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_body {
    /// sizeof(frz_shallow_body), the same in all bodies of a call.
    pub struct_size: u32,
    /// A frz_shallow_shape.
    pub shape: u32,
    /// Its centre, or one end of a capsule's segment (m).
    pub at: [f64; 3],
    /// The other end of a capsule's segment (m); otherwise ignored.
    pub end: [f64; 3],
    /// Radius of a sphere or capsule (m), over 0; ignored for a box.
    pub radius: f64,
    /// Half of a box's length along each of its axes (m), over 0; otherwise ignored.
    pub half: [f64; 3],
    /// Unit vectors along a box's axes, perpendicular to each other; all zeroes: those of the world. Otherwise ignored.
    pub axes: [[f64; 3]; 3],
}

sized32!(frz_shallow_body);

/// Replaces shapes by those of a host's bodies.
///
/// # Safety
/// As [`read_list`].
pub(in crate::capi) unsafe fn read_bodies(
    bodies: *const frz_shallow_body,
    count: usize,
    shapes: &mut Vec<Shape>,
) -> Outcome<&[Shape]> {
    // SAFETY: guaranteed by the caller.
    unsafe { read_list(bodies, count, ["body", "bodies"], shapes, frz_shallow_body::shape) }?;
    Ok(shapes)
}

impl frz_shallow_body {
    fn shape(self) -> Outcome<Shape> {
        let shape = meaning("shape", "frz_shallow_shape", self.shape, &SHAPES)?(&self);
        shape.validate()?;
        Ok(shape)
    }
}

/// Sets the solids that move over the ground, replacing the previous ones (a real-time call: see frz_shallow): the ground is rebuilt where
/// one moves, and no triangle is visited. The liquid is displaced, and none of it is lost. After a failure all is as it was.
///
/// A body is identified by its index: keep it at the same one from call to call. Bodies that do not move cost nothing.
///
/// bodies: count bodies; NULL with a count of 0: none. FRZ_ERROR_ARGUMENT names the index of one that is out of range.
/// count: number of bodies.
/// moved: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_bodies(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    bodies: *const frz_shallow_body,
    count: usize,
    moved: *mut frz_shallow_moved,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, shallow, moved, |_, liquid| {
            let moved =
                liquid.shallow.set_bodies(read_bodies(bodies, count, &mut liquid.surroundings.shapes)?)?;
            Ok(liquid.ground_changed(moved))
        })
    }
}
