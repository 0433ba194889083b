//! Samples of grids, and triangle meshes of their surfaces.

use std::ffi::c_char;

use super::leaves::origins_of;
use super::sparse::frz_grid;
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::{Mesh, frz_mesh};
use crate::capi::runtime::context::{creates, enter, frz_context};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{DVec3, TriMesh};
use crate::vdb::{FloatGrid, GridRef, VectorGrid, level_set};

/// Interpolation of values between voxels.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_sampling {
    /// The value of the voxel that contains the position.
    FRZ_SAMPLE_NEAREST = 0,
    /// Trilinear between voxel centres.
    FRZ_SAMPLE_LINEAR = 1,
}

/// Whether values are interpolated trilinearly.
fn sampling_of(sampling: u32) -> Outcome<bool> {
    let known =
        [(frz_sampling::FRZ_SAMPLE_NEAREST as u32, false), (frz_sampling::FRZ_SAMPLE_LINEAR as u32, true)];
    meaning("sampling", "frz_sampling", sampling, &known)
}

/// A host's positions (m), all finite.
///
/// # Safety
/// The view must describe memory that can be read.
unsafe fn positions_of(positions: &frz_view) -> Outcome<Vec<DVec3>> {
    // SAFETY: guaranteed by the caller.
    let positions = unsafe { positions.finite("positions") }?;
    Ok(positions.iter().map(|&p| DVec3::from(p.map(f64::from))).collect())
}

/// Number of positions sampled at once: between batches a cancel takes effect and progress is known.
const BATCH: usize = 1 << 16;

/// Values at positions (m), batch by batch.
fn in_batches<T: Clone + Send>(
    ctx: &Context,
    positions: &[DVec3],
    sample: impl Fn(&[DVec3]) -> Result<Vec<T>> + Send + Sync,
) -> Outcome<Vec<T>> {
    let bytes = size_of::<DVec3>() + size_of::<T>();
    ctx.allow("the samples", (positions.len() as u64).saturating_mul(bytes as u64))?;
    Ok(ctx.phase("sample", || {
        ctx.expect(positions.len().div_ceil(BATCH));
        let mut out = Vec::with_capacity(positions.len());
        for batch in positions.chunks(BATCH) {
            ctx.check()?;
            out.extend(sample(batch)?);
            ctx.advance();
        }
        Ok(out)
    })?)
}

fn sampled(ctx: &Context, grid: &FloatGrid, positions: &[DVec3], sampling: u32) -> Outcome<Vec<f32>> {
    let linear = sampling_of(sampling)?;
    in_batches(ctx, positions, |batch| {
        let mut values = Vec::new();
        match linear {
            false => grid.sample_nearest(ctx, batch, &mut values)?,
            true => grid.sample_linear(ctx, batch, &mut values)?,
        }
        Ok(values)
    })
}

fn sampled_vectors(
    ctx: &Context,
    grid: &VectorGrid,
    positions: &[DVec3],
    sampling: u32,
) -> Outcome<Vec<[f32; 3]>> {
    let linear = sampling_of(sampling)?;
    in_batches(ctx, positions, |batch| grid.sample(ctx, batch, linear))
}

/// Samples a grid of floats at world positions.
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let held = read(grid)?;
        let grid = held.floats()?;
        let positions = positions_of(&positions)?;
        dst.fill("dst", &sampled(call.ctx(), grid, &positions, sampling)?)
    })
}

/// Samples a grid of vectors at world positions. Components of a staggered grid are sampled at their own positions.
///
/// positions: float[3] for each (m), finite.
/// sampling: a frz_sampling.
/// dst: room for as many float[3].
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_sample_vectors(
    context: *mut frz_context,
    grid: *const frz_grid,
    positions: frz_view,
    sampling: u32,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let held = read(grid)?;
        let grid = held.vectors()?;
        let positions = positions_of(&positions)?;
        dst.fill("dst", &sampled_vectors(call.ctx(), grid, &positions, sampling)?)
    })
}

/// Samples a grid at a mesh's vertices into an attribute: one float each, or three from a grid of vectors.
///
/// mesh: receives the attribute, which replaces one of the same name.
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let ctx = call.ctx();
        let held = read(grid)?;
        let mut mesh: Changing<'_, Mesh> = change(mesh)?;
        let name = match text(name, "name")? {
            Some(name) => name.to_string(),
            None => held.any().name(),
        };
        refuse(name.is_empty(), || "name: none is given, and the grid has none")?;
        let positions: Vec<DVec3> = mesh.triangles.positions.iter().map(|p| p.cast()).collect();
        let (components, values) = match held.any() {
            GridRef::Floats(grid) => (1, sampled(ctx, grid, &positions, sampling)?),
            GridRef::Vectors(grid) => (3, sampled_vectors(ctx, grid, &positions, sampling)?.into_flattened()),
        };
        mesh.set_attribute(&name, components, values);
        Ok(())
    })
}

/// Memory (bytes) for each leaf while a mesh is made.
const BYTES_PER_LEAF: u64 = 6000;

/// The body of an interface function that makes a mesh from a grid.
///
/// # Safety
/// The pointers must be NULL or valid.
unsafe fn meshes(
    context: *mut frz_context,
    grid: *const frz_grid,
    [iso, adaptivity]: [f32; 2],
    out: *mut *mut frz_mesh,
    make: impl FnOnce(&Context, &FloatGrid) -> Outcome<TriMesh>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    unsafe {
        creates(context, out, |ctx| {
            let held = read(grid)?;
            let grid = held.floats()?;
            refuse(!iso.is_finite(), || "iso is not finite")?;
            within("adaptivity", f64::from(adaptivity), 0.0..=1.0, "")?;
            Ok(Mesh::of_triangles(make(ctx, grid)?))
        })
    }
}

/// Creates a triangle mesh of the surface of a grid of floats, counter-clockwise seen from outside, even if the grid's transform mirrors.
///
/// A cancel takes effect before and after the work, not during it.
///
/// iso: the value at the surface, finite; for a level set a distance (m), 0 for its surface.
/// adaptivity: 0 to 1; above 0 flat regions get fewer and larger triangles.
/// out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure. It has no faces if there is no surface.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            ctx.allow("a mesh of the grid", grid.leaf_count() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.phase("mesh", || level_set::to_mesh(ctx, grid, iso, adaptivity))?)
        })
    }
}

/// As frz_grid_to_mesh, for the voxels in a box. The meshes of adjacent boxes meet; each triangle belongs to one of them.
///
/// voxel_min: int32_t[3]: the minimum voxel on each axis.
/// voxel_max: int32_t[3]: the maximum voxel on each axis, inclusive; not less than voxel_min.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            let corner = |pointer: *const i32, name: &str| -> Outcome<[i32; 3]> {
                let pointer = required(pointer.cast_mut(), name)?;
                Ok(pointer.cast::<[i32; 3]>().read_unaligned())
            };
            let corners = [corner(voxel_min, "voxel_min")?, corner(voxel_max, "voxel_max")?];
            refuse((0..3).any(|axis| corners[0][axis] > corners[1][axis]), || {
                format!("voxel_max = {:?} is less than voxel_min = {:?}", corners[1], corners[0])
            })?;
            ctx.allow("a mesh of the grid", grid.leaf_count() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.phase("mesh", || level_set::box_to_mesh(ctx, grid, iso, adaptivity, corners))?)
        })
    }
}

/// As frz_grid_to_mesh, for some blocks only, for instance those of frz_base_dirty: the cost grows with their number. The meshes of
/// different blocks meet; each triangle belongs to one of them.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        meshes(context, grid, [iso, adaptivity], out, |ctx, grid| {
            let origins = origins_of(&origins)?;
            ctx.allow("a mesh of the blocks", origins.len() as u64 * BYTES_PER_LEAF)?;
            Ok(ctx.phase("mesh", || level_set::blocks_to_mesh(ctx, grid, iso, adaptivity, &origins))?)
        })
    }
}
