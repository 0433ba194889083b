//! OpenVDB's level-set tools. Each reads the context's cancel flag and uses the context's threads.

use super::bridge::ffi;
use super::{FloatGrid, call, fail};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{DVec3, TriMesh, Vec3};
use crate::numeric::blocks::Origin;

/// Accuracy of the tools that renormalise as they advance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// First order in space and time, one pass: about seven times cheaper.
    FirstOrder,
    /// OpenVDB's defaults: fifth-order WENO.
    Weno5,
}

/// Size of a level set's solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// Surface area (m2).
    pub area: f64,
    /// Volume (m3).
    pub volume: f64,
}

/// Level set of a closed mesh by OpenVDB's meshToVolume, `half_width` cells on each side.
///
/// # Errors
/// An index out of range, cancel, or what OpenVDB reports.
pub fn from_mesh(ctx: &Context, mesh: &TriMesh, voxel: f64, half_width: f32) -> Result<FloatGrid> {
    let count = mesh.positions.len();
    if let Some(bad) = mesh.triangles.as_flattened().iter().find(|&&index| index as usize >= count) {
        return Err(Error::argument(format!("a triangle names vertex {bad} of {count}")));
    }
    let points: Vec<f32> = mesh.positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let (call, _running) = call(ctx);
    let inner =
        ffi::from_mesh(&call, &points, mesh.triangles.as_flattened(), voxel, half_width).map_err(fail)?;
    Ok(FloatGrid { inner })
}

/// Level set of the union of spheres (m), `half_width` cells on each side; spheres smaller than a cell and a half are omitted, because the
/// grid cannot resolve them.
///
/// # Errors
/// Different numbers of radii and positions, cancel, or what OpenVDB reports.
pub fn from_particles(
    ctx: &Context,
    positions: &[DVec3],
    radii: &[f32],
    voxel: f64,
    half_width: f32,
) -> Result<FloatGrid> {
    if positions.len() != radii.len() {
        return Err(Error::argument(format!("{} positions, but {} radii", positions.len(), radii.len())));
    }
    let flat: Vec<f64> = positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    let (call, _running) = call(ctx);
    let inner = ffi::from_particles(&call, &flat, radii, voxel, half_width).map_err(fail)?;
    Ok(FloatGrid { inner })
}

/// Triangles of the surface at `iso` (m), counter-clockwise seen from outside. `adaptivity` in 0..=1
/// merges flat regions.
///
/// # Errors
/// Cancel, or what OpenVDB reports.
pub fn to_mesh(ctx: &Context, grid: &FloatGrid, iso: f32, adaptivity: f32) -> Result<TriMesh> {
    let part = ffi::Part { whole: true, origins: Vec::new(), low: [0; 3], high: [0; 3] };
    mesh_of(ctx, grid, iso, adaptivity, &part)
}

/// As [`to_mesh`], for the voxels of a box (minimum and maximum, both inclusive). The meshes of adjacent boxes fit together, with each
/// triangle in exactly one of them.
///
/// # Errors
/// As [`to_mesh`].
pub fn box_to_mesh(
    ctx: &Context,
    grid: &FloatGrid,
    iso: f32,
    adaptivity: f32,
    [low, high]: [[i32; 3]; 2],
) -> Result<TriMesh> {
    mesh_of(ctx, grid, iso, adaptivity, &ffi::Part { whole: false, origins: Vec::new(), low, high })
}

/// As [`to_mesh`], for the blocks at these origins: the cost grows with their number, not with the grid.
///
/// # Errors
/// As [`to_mesh`].
pub fn blocks_to_mesh(
    ctx: &Context,
    grid: &FloatGrid,
    iso: f32,
    adaptivity: f32,
    origins: &[Origin],
) -> Result<TriMesh> {
    let origins = origins.as_flattened().to_vec();
    // Without origins: a box without voxels.
    let part = ffi::Part { whole: false, origins, low: [1; 3], high: [0; 3] };
    mesh_of(ctx, grid, iso, adaptivity, &part)
}

fn mesh_of(ctx: &Context, grid: &FloatGrid, iso: f32, adaptivity: f32, part: &ffi::Part) -> Result<TriMesh> {
    let (call, _running) = call(ctx);
    let mesh = ffi::to_mesh(&grid.inner, &call, f64::from(iso), f64::from(adaptivity), part).map_err(fail)?;
    Ok(TriMesh {
        positions: mesh.points.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect(),
        triangles: mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    })
}

#[derive(Clone, Copy)]
enum Operation {
    Union,
    Difference,
    Intersection,
}

fn check_same_lattice(a: &FloatGrid, b: &FloatGrid) -> Result<()> {
    let (cell_a, cell_b) = (a.voxel_size(), b.voxel_size());
    if (cell_a - cell_b).abs() > 1e-9 * cell_a.max(cell_b) {
        let what =
            format!("the level sets have cells of {cell_a} m and of {cell_b} m: they must be the same");
        return Err(Error::argument(what));
    }
    // A cell's corner and its neighbours along the axes determine an affine map.
    let positions = [DVec3::zeros(), DVec3::x(), DVec3::y(), DVec3::z()];
    let distance = |position: DVec3| (a.index_to_world(position) - b.index_to_world(position)).amax();
    if positions.into_iter().map(distance).fold(0.0, f64::max) > 1e-6 * cell_a {
        return Err(Error::argument("the level sets' cells are shifted or turned against each other"));
    }
    Ok(())
}

fn csg(ctx: &Context, a: &mut FloatGrid, mut b: FloatGrid, operation: Operation) -> Result<()> {
    check_same_lattice(a, &b)?;
    let (call, _running) = call(ctx);
    ffi::csg(a.inner.pin_mut(), b.inner.pin_mut(), &call, operation as i32).map_err(fail)
}

fn csg_copy(ctx: &Context, a: &FloatGrid, b: &FloatGrid, operation: Operation) -> Result<FloatGrid> {
    check_same_lattice(a, b)?;
    let (call, _running) = call(ctx);
    let inner = ffi::csg_copy(&a.inner, &b.inner, &call, operation as i32).map_err(fail)?;
    Ok(FloatGrid { inner })
}

/// Union: a becomes a or b.
///
/// # Errors
/// Cells of different sizes; cancel.
pub fn union(ctx: &Context, a: &mut FloatGrid, b: FloatGrid) -> Result<()> {
    csg(ctx, a, b, Operation::Union)
}

/// Difference: a becomes a without b.
///
/// # Errors
/// As [`union`].
pub fn difference(ctx: &Context, a: &mut FloatGrid, b: FloatGrid) -> Result<()> {
    csg(ctx, a, b, Operation::Difference)
}

/// Intersection: a becomes a and b.
///
/// # Errors
/// As [`union`].
pub fn intersection(ctx: &Context, a: &mut FloatGrid, b: FloatGrid) -> Result<()> {
    csg(ctx, a, b, Operation::Intersection)
}

/// Union of a and b, which are unchanged.
///
/// # Errors
/// As [`union`].
pub fn union_copy(ctx: &Context, a: &FloatGrid, b: &FloatGrid) -> Result<FloatGrid> {
    csg_copy(ctx, a, b, Operation::Union)
}

/// a without b; both are unchanged.
///
/// # Errors
/// As [`union`].
pub fn difference_copy(ctx: &Context, a: &FloatGrid, b: &FloatGrid) -> Result<FloatGrid> {
    csg_copy(ctx, a, b, Operation::Difference)
}

/// Intersection of a and b, which are unchanged.
///
/// # Errors
/// As [`union`].
pub fn intersection_copy(ctx: &Context, a: &FloatGrid, b: &FloatGrid) -> Result<FloatGrid> {
    csg_copy(ctx, a, b, Operation::Intersection)
}

/// Moves the surface outward by `metres` (inward if negative). Beyond the band the surface is moved in steps; the first-order scheme loses
/// about a tenth of the distance in each step, WENO hardly anything.
///
/// # Errors
/// The first-order scheme beyond the narrow band; cancel, or what OpenVDB reports.
pub fn offset(ctx: &Context, grid: &mut FloatGrid, metres: f32, scheme: Scheme) -> Result<()> {
    if scheme == Scheme::FirstOrder && beyond_band(grid, f64::from(metres)) {
        return Err(Error::argument(format!(
            "an offset of {metres} m leaves the band of distances, which is {} m wide: the first-order scheme would \
             fall short by a tenth, use the fifth-order one (weno5)",
            grid.background()
        )));
    }
    let (call, _running) = call(ctx);
    ffi::offset(grid.inner.pin_mut(), &call, metres, scheme == Scheme::Weno5).map_err(fail)
}

/// Whether an offset (m) exceeds a level set's narrow band.
pub fn beyond_band(grid: &FloatGrid, metres: f64) -> bool {
    metres.abs() > f64::from(grid.background()) * (1.0 + 1e-4)
}

/// Mean filter over cubes of (2 `width` + 1) cells, applied `times` times.
///
/// # Errors
/// As [`offset`].
pub fn mean_filter(
    ctx: &Context,
    grid: &mut FloatGrid,
    width: u32,
    times: u32,
    scheme: Scheme,
) -> Result<()> {
    smooth(ctx, grid, 0, width, times, scheme)
}

/// Gaussian smoothing (four mean filters in a row), applied `times` times.
///
/// # Errors
/// As [`offset`].
pub fn gaussian_filter(
    ctx: &Context,
    grid: &mut FloatGrid,
    width: u32,
    times: u32,
    scheme: Scheme,
) -> Result<()> {
    smooth(ctx, grid, 1, width, times, scheme)
}

fn smooth(
    ctx: &Context,
    grid: &mut FloatGrid,
    kind: i32,
    width: u32,
    times: u32,
    scheme: Scheme,
) -> Result<()> {
    let (call, _running) = call(ctx);
    let weno = scheme == Scheme::Weno5;
    ffi::smooth(grid.inner.pin_mut(), &call, kind, width as i32, times as i32, weno).map_err(fail)
}

/// Renormalises the values to distances, in `times` passes.
///
/// # Errors
/// As [`offset`].
pub fn renormalise(ctx: &Context, grid: &mut FloatGrid, scheme: Scheme, times: u32) -> Result<()> {
    let (call, _running) = call(ctx);
    ffi::renormalise(grid.inner.pin_mut(), &call, scheme == Scheme::Weno5, times as i32).map_err(fail)
}

/// Advects the surface along its normals by the local value of `speed`, a distance (m): the thesis' noise step (section 3.2) with OpenVDB's
/// default schemes; a baseline.
///
/// # Errors
/// As [`offset`].
#[doc(hidden)]
pub fn advect_outward(ctx: &Context, grid: &mut FloatGrid, speed: &FloatGrid) -> Result<()> {
    let (call, _running) = call(ctx);
    ffi::advect_outward(grid.inner.pin_mut(), &call, &speed.inner).map_err(fail)
}

/// Area and volume by OpenVDB's smeared delta function, about the centre of the level set. Sharp edges are smeared too: boxes lose about 3
/// % of their area, and less than 1 % of their volume.
///
/// # Errors
/// As [`offset`].
pub fn measure(ctx: &Context, grid: &FloatGrid) -> Result<Measure> {
    let (call, _running) = call(ctx);
    let mut measure = Measure { area: 0.0, volume: 0.0 };
    ffi::measure(&grid.inner, &call, &mut measure.area, &mut measure.volume).map_err(fail)?;
    Ok(measure)
}

/// Number of voxels in each connected component of the inside, largest first.
///
/// # Errors
/// As [`offset`].
pub fn components(ctx: &Context, grid: &FloatGrid) -> Result<Vec<u64>> {
    let (call, _running) = call(ctx);
    let mut sizes = ffi::components(&grid.inner, &call).map_err(fail)?;
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    Ok(sizes)
}
