//! Grids as numbers and meshes: samples, and the triangles along their surface.

use std::ffi::c_char;

use super::context::{creates, enter, frz_context};
use super::grid::{check_origin, frz_grid};
use super::guard::{Failure, Outcome, frz_status, guard};
use super::handle::{Changing, change, read, required};
use super::mesh::{Mesh, frz_mesh};
use super::views::{frz_span, frz_view, meaning, text, within};
use crate::base::{DVec3, TriMesh};
use crate::context::Context;
use crate::vdb::{FloatGrid, level_set};

/// How values between voxels are found.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_sampling {
    /// The value of the voxel that holds the position.
    FRZ_SAMPLE_NEAREST = 0,
    /// Trilinear between voxel centres.
    FRZ_SAMPLE_LINEAR = 1,
}

fn sampled(ctx: &Context, grid: &FloatGrid, positions: &[DVec3], sampling: u32) -> Outcome<Vec<f32>> {
    let known = [frz_sampling::FRZ_SAMPLE_NEAREST, frz_sampling::FRZ_SAMPLE_LINEAR].map(|s| (s as u32, s));
    let sampling = meaning("sampling", "frz_sampling", sampling, &known)?;
    ctx.allow("the samples", (positions.len() as u64).saturating_mul(28))?;
    let mut values = Vec::new();
    ctx.polled(|| match sampling {
        frz_sampling::FRZ_SAMPLE_NEAREST => grid.sample_nearest(ctx, positions, &mut values),
        frz_sampling::FRZ_SAMPLE_LINEAR => grid.sample_linear(ctx, positions, &mut values),
    })?;
    Ok(values)
}

/// Values of a grid at world positions.
///
/// positions: float[3] for each (m), finite.
/// sampling: a frz_sampling.
/// dst: room for as many floats.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_sample(
    context: *mut frz_context,
    grid: *const frz_grid,
    positions: frz_view,
    sampling: u32,
    dst: frz_span,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let call = enter(context)?;
            let ctx = call.ctx();
            let held = read(grid)?;
            let positions = positions.finite("positions")?;
            let positions: Vec<DVec3> = positions.iter().map(|&p| DVec3::from(p.map(f64::from))).collect();
            dst.fill("dst", &sampled(ctx, held.get(), &positions, sampling)?)
        }
    })
}

/// Gives a mesh's vertices an attribute of one float: a grid's values there.
///
/// mesh: gets the attribute, in the place of one of the same name.
/// sampling: a frz_sampling.
/// name: of the attribute, UTF-8; NULL for the grid's own.
///
/// Any number of threads may read a grid; one thread at a time for each mesh and context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_sample_mesh(
    context: *mut frz_context,
    grid: *const frz_grid,
    mesh: *mut frz_mesh,
    sampling: u32,
    name: *const c_char,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let call = enter(context)?;
            let ctx = call.ctx();
            let held = read(grid)?;
            let mut mesh: Changing<'_, Mesh> = change(mesh)?;
            let name = match text(name, "name")? {
                Some(name) => name.to_string(),
                None => held.get().name(),
            };
            if name.is_empty() {
                return Err(Failure::argument("name: neither it nor the grid has one"));
            }
            let positions: Vec<DVec3> = mesh.triangles.positions.iter().map(|p| p.cast()).collect();
            let values = sampled(ctx, held.get(), &positions, sampling)?;
            mesh.set_attribute(&name, 1, values);
            Ok(())
        }
    })
}

/// Bytes of a leaf's part of a mesh, while it is made.
const BYTES_PER_LEAF: u64 = 6000;

/// A function of the interface that makes a mesh of a grid.
///
/// # Safety
/// The pointers must be NULL or the caller's.
unsafe fn meshes(
    context: *mut frz_context,
    grid: *const frz_grid,
    [iso, adaptivity]: [f32; 2],
    out: *mut *mut frz_mesh,
    make: impl FnOnce(&Context, &FloatGrid) -> Outcome<TriMesh>,
) -> frz_status {
    // SAFETY: the caller's promise.
    unsafe {
        creates(context, out, |ctx| {
            let held = read(grid)?;
            if !iso.is_finite() {
                return Err(Failure::argument("iso is not finite"));
            }
            within("adaptivity", f64::from(adaptivity), 0.0..=1.0, "")?;
            Ok(Mesh::of_triangles(make(ctx, held.get())?))
        })
    }
}

/// Makes a mesh of triangles along a grid's surface, counter-clockwise seen from outside, also where the grid's transform
/// mirrors.
///
/// A cancel is heeded before and after the work, not within.
///
/// iso: the value at the surface; of a level set a distance (m), 0 for its surface. Finite.
/// adaptivity: 0 to 1; above 0 flat regions get fewer and larger triangles.
/// out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure. It has no faces where there
///     is no surface.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_to_mesh(
    context: *mut frz_context,
    grid: *const frz_grid,
    iso: f32,
    adaptivity: f32,
    out: *mut *mut frz_mesh,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            ctx.allow("a mesh of the grid", grid.leaf_count() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.stage("mesh", || level_set::to_mesh(ctx, grid, iso, adaptivity))?)
        })
    }
}

/// As frz_grid_to_mesh, of the voxels in a box. The meshes of boxes beside each other meet; each triangle is in one.
///
/// voxel_min: int32_t[3]: the least voxel on each axis.
/// voxel_max: int32_t[3]: the greatest voxel on each axis, included; not less than voxel_min.
/// out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_to_mesh_box(
    context: *mut frz_context,
    grid: *const frz_grid,
    iso: f32,
    adaptivity: f32,
    voxel_min: *const i32,
    voxel_max: *const i32,
    out: *mut *mut frz_mesh,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            let corner = |pointer: *const i32, name: &str| -> Outcome<[i32; 3]> {
                let pointer = required(pointer.cast_mut(), name)?;
                Ok(pointer.cast::<[i32; 3]>().read_unaligned())
            };
            let corners = [corner(voxel_min, "voxel_min")?, corner(voxel_max, "voxel_max")?];
            if (0..3).any(|axis| corners[0][axis] > corners[1][axis]) {
                let text = format!("voxel_max = {:?} is less than voxel_min = {:?}", corners[1], corners[0]);
                return Err(Failure::argument(text));
            }
            ctx.allow("a mesh of the grid", grid.leaf_count() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.stage("mesh", || level_set::box_to_mesh(ctx, grid, iso, adaptivity, corners))?)
        })
    }
}

/// As frz_grid_to_mesh, of some blocks only, for instance those of frz_base_dirty: what it costs grows with their number.
/// The meshes of different blocks meet; each triangle is in one.
///
/// origins: int32_t[3] for each block, multiples of 8.
/// out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_to_mesh_blocks(
    context: *mut frz_context,
    grid: *const frz_grid,
    iso: f32,
    adaptivity: f32,
    origins: frz_view,
    out: *mut *mut frz_mesh,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            let origins = origins.elements::<[i32; 3]>("origins")?;
            origins.iter().try_for_each(|&origin| check_origin(origin).map(drop))?;
            ctx.allow("a mesh of the blocks", origins.len() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.stage("mesh", || level_set::blocks_to_mesh(ctx, grid, iso, adaptivity, &origins))?)
        })
    }
}
