//! The ground below shallow liquid: made once, then moved.

use std::ops::Range;

use super::liquid::{Spill, frz_shallow};
use super::lists::each_sized;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::change;
use crate::capi::ffi::views::{Sized32, fill, frz_view, meaning};
use crate::capi::runtime::context::{enter_light, frz_context};
use crate::context::Context;
use crate::geometry::{DVec3, TriMesh, Vec3};
use crate::shallow::Moved;
use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use crate::shallow::terrain::facing::facing;
#[cfg(feature = "vdb")]
use crate::shallow::terrain::sampler;
use crate::shallow::terrain::shapes::Shape;
use crate::shallow::terrain::solids::Solid;
use crate::shallow::terrain::triangles::Caster;
use crate::shallow::terrain::{Solids, height};
#[cfg(feature = "vdb")]
use crate::vdb::FloatGrid;

/// What the ground was made from, so that it can be made again.
pub(in crate::capi) enum Terrain {
    /// A mesh.
    Mesh(Box<Moving>),
    /// A height field; solids of the cells of its last change.
    Heights(Vec<[Solid; 1]>),
    /// A level set: it does not move.
    #[cfg(feature = "vdb")]
    LevelSet,
}

/// A mesh whose vertices move.
pub(in crate::capi) struct Moving {
    pub(in crate::capi) positions: Vec<Vec3>,
    /// Incoming positions.
    coming: Vec<Vec3>,
    /// Triangles with closed parts outward, without duplicates.
    pub(in crate::capi) triangles: Vec<[u32; 3]>,
    /// Triangles as the host gave them, if that differs.
    own: Option<Vec<[u32; 3]>>,
    caster: Caster,
}

impl Terrain {
    /// The ground of a mesh, and its solids.
    pub(in crate::capi) fn of_mesh(
        ctx: &Context,
        mesh: &TriMesh,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let orientation = facing(mesh);
        let triangles = orientation.applied(&mesh.triangles);
        if orientation.has_open() {
            ctx.warn("the mesh is open: all below its faces that face up is solid");
        }
        if let Some(what) = orientation.warning() {
            ctx.warn(&format!("the mesh: {what}"));
        }
        let mut caster = Caster::new(grid, heights)?;
        let solids = ctx.phase("cast", || {
            caster.cast(&mesh.positions, &triangles, all_cells(&grid))?;
            let mut solids = Solids::empty(grid, heights);
            (0..grid.cells()).for_each(|cell| solids.push(caster.at(cell)));
            Ok(solids)
        })?;
        let positions = mesh.positions.clone();
        let own = (!orientation.is_unchanged()).then(|| mesh.triangles.clone());
        let coming = Vec::with_capacity(positions.len());
        Ok((Self::Mesh(Box::new(Moving { positions, coming, triangles, own, caster })), solids))
    }

    /// The ground of a height for each cell (m), and its solids.
    pub(in crate::capi) fn of_heights(
        tops: impl ExactSizeIterator<Item = f32>,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let solids = height::solids(tops.map(f64::from), grid, heights)?;
        Ok((Self::Heights(Vec::with_capacity(grid.cells())), solids))
    }

    /// The ground of a level set, and its solids.
    #[cfg(feature = "vdb")]
    pub(in crate::capi) fn of_level_set(
        ctx: &Context,
        level_set: &FloatGrid,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let solids = ctx.phase("sample", || {
            let (voxel, between) = (level_set.voxel_size(), level_set.heights());
            sampler::solids(grid, heights, voxel, between, |positions, distances| {
                ctx.check()?;
                level_set.sample_linear(ctx, positions, distances)
            })
        })?;
        Ok((Self::LevelSet, solids))
    }

    /// The position (m) on a triangle with these barycentric coordinates.
    pub(in crate::capi) fn position(&self, (triangle, shares): &(u32, [f64; 3])) -> Outcome<[f64; 3]> {
        let Self::Mesh(mesh) = self else {
            return Err(Failure::argument("the liquid was not made with a mesh: there is no triangle"));
        };
        let own = mesh.own.as_ref().unwrap_or(&mesh.triangles);
        let Some(corners) = own.get(*triangle as usize) else {
            let count = own.len();
            return Err(Failure::argument(format!("triangle = {triangle} is none of the mesh's {count}")));
        };
        let corner = |corner: usize| mesh.positions[corners[corner] as usize].cast::<f64>() * shares[corner];
        Ok((corner(0) + corner(1) + corner(2)).into())
    }
}

/// All cells of a grid.
fn all_cells(grid: &Grid) -> [Range<usize>; 2] {
    grid.size.map(|count| 0..count)
}

/// How far (cells) a cell's centre may lie outside a box and still count as inside.
const ROUNDING: f64 = 1e-6;

/// The cells whose centres lie within a host's box; all cells for NULL.
///
/// # Safety
/// The pointer must be NULL or point to four numbers.
pub(in crate::capi) unsafe fn cells_in(grid: &Grid, bounds: *const f64) -> Outcome<[Range<usize>; 2]> {
    if bounds.is_null() {
        return Ok(all_cells(grid));
    }
    // SAFETY: guaranteed by the caller.
    let bounds = unsafe { bounds.cast::<[f64; 4]>().read_unaligned() };
    let [x0, z0, x1, z1] = bounds;
    // Negated, so that NaN is refused too.
    if !(x0 <= x1 && z0 <= z1) {
        return Err(Failure::argument(format!("bounds = {bounds:?} m have no inside")));
    }
    let range = |axis: usize, low: f64, high: f64| {
        let count = grid.size[axis] as f64;
        // In cells, from the centre of the first; rounding excludes none.
        let [low, high] = [low, high].map(|position| (position - grid.origin[axis]) / grid.cell - 0.5);
        let first = (low - ROUNDING).ceil().clamp(0.0, count);
        let end = ((high + ROUNDING).floor() + 1.0).clamp(first, count);
        first as usize..end as usize
    };
    Ok([range(0, x0, x1), range(1, z0, z1)])
}

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

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_moved {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_moved";
}

impl From<Moved> for frz_shallow_moved {
    fn from(moved: Moved) -> Self {
        Self {
            struct_size: 0,
            reserved: 0,
            cells: moved.cells as u64,
            displaced: moved.displaced,
            held: moved.held,
            fallen: moved.fallen,
        }
    }
}

/// A call that changes the ground and reports the effect.
///
/// # Safety
/// The pointers must be NULL or valid.
unsafe fn moves(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    moved: *mut frz_shallow_moved,
    make: impl FnOnce(&mut Spill) -> Outcome<Moved>,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        if !moved.is_null() {
            fill(moved, None, Moved::default().into())?;
        }
        let _call = enter_light(context)?;
        let mut spill = change(shallow)?;
        let done = make(&mut spill)?;
        if done.cells > 0 {
            spill.lifted.is_current = false;
            spill.ledged.is_current = false;
        }
        if moved.is_null() { Ok(()) } else { fill(moved, None, done.into()) }
    }
}

/// Moves the vertices of the mesh that the liquid was created with, in real time (frz_shallow): bones and organs move or deform. The liquid
/// is carried along, and none of it is lost; flow points on triangles move with them. After a failure all is as it was.
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
    guard(|| {
        // SAFETY: the pointers are NULL or valid, and so is the view.
        unsafe {
            moves(context, shallow, moved, |spill| {
                let Spill { shallow, terrain, flows, .. } = spill;
                let cells = cells_in(&shallow.columns().grid, bounds)?;
                let Terrain::Mesh(mesh) = terrain else {
                    return Err(Failure::argument("the liquid was not made with a mesh that could move"));
                };
                mesh.take(&positions)?;
                mesh.caster.cast(&mesh.coming, &mesh.triangles, cells.clone())?;
                let caster = &mesh.caster;
                let moved = shallow.update_cells(cells, |cell| caster.at(cell))?;
                mesh.come();
                for (index, flow) in flows.iter_mut().enumerate() {
                    if let Some(on) = &flow.on {
                        flow.point.at = terrain.position(on)?;
                        shallow.move_flow(index, flow.point.at);
                    }
                }
                Ok(moved)
            })
        }
    })
}

impl Moving {
    /// The solids of all cells with the incoming vertices.
    pub(in crate::capi) fn cast(&mut self, grid: Grid, heights: Heights) -> Outcome<Solids> {
        self.caster.cast(&self.coming, &self.triangles, all_cells(&grid))?;
        let mut solids = Solids::empty(grid, heights);
        (0..grid.cells()).for_each(|cell| solids.push(self.caster.at(cell)));
        Ok(solids)
    }

    /// Adopts the incoming vertices.
    pub(in crate::capi) fn come(&mut self) {
        std::mem::swap(&mut self.positions, &mut self.coming);
    }

    /// Reads the new positions of the vertices.
    ///
    /// # Safety
    /// The view must describe memory that can be read.
    pub(in crate::capi) unsafe fn take(&mut self, positions: &frz_view) -> Outcome {
        // SAFETY: guaranteed by the caller.
        let given = unsafe { positions.in_place::<[f32; 3]>("positions") }?;
        let count = self.positions.len();
        if given.len() != count {
            let text = format!("positions: {} elements, but the mesh has {count} vertices", given.len());
            return Err(Failure::argument(text));
        }
        self.coming.clear();
        self.coming.extend(given.map(Vec3::from));
        let is_wild = |position: &Vec3| !position.iter().all(|number| number.is_finite());
        match self.coming.iter().position(is_wild) {
            None => Ok(()),
            Some(at) => Err(Failure::argument(format!("positions: element {at} is not finite"))),
        }
    }
}

/// Changes the heights of the height field that the liquid was created with, in real time (frz_shallow). The liquid is carried along, and
/// none of it is lost. After a failure all is as it was.
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
    guard(|| {
        // SAFETY: the pointers are NULL or valid, and so is the view.
        unsafe {
            moves(context, shallow, moved, |spill| {
                let Spill { shallow, terrain, .. } = spill;
                let (grid, range) = (shallow.columns().grid, shallow.columns().heights);
                let cells = cells_in(&grid, bounds)?;
                let Terrain::Heights(solids) = terrain else {
                    return Err(Failure::argument(
                        "the liquid was not made on a height field that could change",
                    ));
                };
                read_heights(&heights, &grid, &range, cells.clone(), solids)?;
                Ok(shallow.update_cells(cells, |cell| &solids[cell])?)
            })
        }
    })
}

/// The solids of some cells, from a host's heights of all cells.
///
/// # Safety
/// The view must describe memory that can be read.
pub(in crate::capi) unsafe fn read_heights(
    heights: &frz_view,
    grid: &Grid,
    range: &Heights,
    [across, rows]: [Range<usize>; 2],
    solids: &mut Vec<[Solid; 1]>,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    let tops = unsafe { heights.in_place::<f32>("heights") }?;
    if tops.len() != grid.cells() {
        let text = format!("heights: {} elements, but there are {} cells", tops.len(), grid.cells());
        return Err(Failure::argument(text));
    }
    if let Some(at) = tops.clone().position(|top| !top.is_finite()) {
        return Err(Failure::argument(format!("heights: element {at} is not finite")));
    }
    let is_within = |cell: usize| {
        let [x, z] = grid.position(cell);
        across.contains(&x) && rows.contains(&z)
    };
    let own = tops.enumerate().filter(|(cell, _)| is_within(*cell));
    solids.clear();
    solids.extend(own.map(|(_, top)| [[BOTTOMLESS, range.round(top.into())]]));
    Ok(())
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

const SHAPES: [(u32, frz_shallow_shape); 3] = [
    (FRZ_SHALLOW_SPHERE as u32, FRZ_SHALLOW_SPHERE),
    (FRZ_SHALLOW_CAPSULE as u32, FRZ_SHALLOW_CAPSULE),
    (FRZ_SHALLOW_BOX as u32, FRZ_SHALLOW_BOX),
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

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_body {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_body";
}

impl frz_shallow_body {
    const NONE: Self = Self {
        struct_size: 0,
        shape: 0,
        at: [0.0; 3],
        end: [0.0; 3],
        radius: 0.0,
        half: [0.0; 3],
        axes: [[0.0; 3]; 3],
    };

    fn shape(&self) -> Outcome<Shape> {
        let at = DVec3::from(self.at);
        let shape = match meaning("shape", "frz_shallow_shape", self.shape, &SHAPES)? {
            FRZ_SHALLOW_SPHERE => Shape::Sphere { centre: at, radius: self.radius },
            FRZ_SHALLOW_CAPSULE => Shape::Capsule { ends: [at, self.end.into()], radius: self.radius },
            FRZ_SHALLOW_BOX => {
                let own = self.axes.map(DVec3::from);
                let is_turned = self.axes.as_flattened().iter().any(|number| *number != 0.0);
                let axes = if is_turned { own } else { [DVec3::x(), DVec3::y(), DVec3::z()] };
                Shape::Cuboid { centre: at, axes, half: self.half }
            }
        };
        shape.validate()?;
        Ok(shape)
    }
}

/// Reads the bodies of a host.
///
/// # Safety
/// As [`each_sized`].
pub(in crate::capi) unsafe fn read_bodies(
    bodies: *const frz_shallow_body,
    count: usize,
    shapes: &mut Vec<Shape>,
) -> Outcome {
    shapes.clear();
    // SAFETY: guaranteed by the caller.
    unsafe {
        each_sized(bodies, count, ["body", "bodies"], frz_shallow_body::NONE, |body| {
            shapes.push(body.shape()?);
            Ok(())
        })
    }
}

/// Sets the solids that move over the ground, replacing those before, in real time (frz_shallow): the ground is rebuilt where one moves,
/// and no triangle is visited. The liquid is displaced, and none of it is lost. After a failure all is as it was.
///
/// A body is identified by its index: keep it at the same one from call to call. Bodies that do not move cost nothing.
///
/// bodies: count bodies; NULL with a count of 0: none. FRZ_ERROR_ARGUMENT names one that is out of range, counted from 0.
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
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            moves(context, shallow, moved, |spill| {
                let Spill { shallow, shapes, .. } = spill;
                read_bodies(bodies, count, shapes)?;
                Ok(shallow.set_bodies(shapes)?)
            })
        }
    })
}
