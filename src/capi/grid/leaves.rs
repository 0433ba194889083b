//! Blocks of voxels that a grid lends.

use super::sparse::frz_grid;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{read, required};
use crate::capi::ffi::views::{Plain, frz_span, frz_view};
use crate::numeric::blocks::Origin;
use crate::vdb::{Leaf, Probe, VectorLeaf, VectorProbe};

/// A block of 8 x 8 x 8 voxels. Voxel (x, y, z) of the block has its value at x * 64 + y * 8 + z, and its bit in
/// mask[x] at y * 8 + z.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_leaf {
    /// Minimum voxel of the block, multiples of 8.
    pub origin: [i32; 3],
    /// The value of all voxels if values is NULL.
    pub tile: f32,
    /// 512 values, or NULL.
    pub values: *const f32,
    /// 8 words: which voxels are active; NULL if values is NULL.
    pub mask: *const u64,
}

// SAFETY: numbers and pointers, which are followed only under the host's guarantee.
unsafe impl Plain for frz_leaf {}

/// A block of 8 x 8 x 8 voxels of vectors. Voxel (x, y, z) of the block has its float[3] at x * 64 + y * 8 + z, and its
/// bit in mask[x] at y * 8 + z.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_vector_leaf {
    /// Minimum voxel of the block, multiples of 8.
    pub origin: [i32; 3],
    /// The value of all voxels if values is NULL.
    pub tile: [f32; 3],
    /// 512 times float[3], or NULL.
    pub values: *const f32,
    /// 8 words: which voxels are active; NULL if values is NULL.
    pub mask: *const u64,
}

// SAFETY: numbers and pointers, which are followed only under the host's guarantee.
unsafe impl Plain for frz_vector_leaf {}

/// Maximum distance of a leaf's voxels from the origin.
const FARTHEST: i32 = 1 << 30;

/// Checks the origin of a block.
pub(in crate::capi) fn check_origin(origin: Origin) -> Outcome<Origin> {
    if origin.iter().any(|&index| index & 7 != 0 || !(-FARTHEST..=FARTHEST).contains(&index)) {
        let text = format!("origin {origin:?} is not a block's: multiples of 8 within -2^30 to 2^30");
        return Err(Failure::argument(text));
    }
    Ok(origin)
}

fn leaf_view(leaf: &Leaf<'_>) -> frz_leaf {
    frz_leaf { origin: leaf.origin, tile: 0.0, values: leaf.values.as_ptr(), mask: leaf.mask.as_ptr() }
}

/// Lends the leaves of a grid of floats without copying them, in an order that changes only when the grid changes.
///
/// Blocks without a leaf have a single value: the background, or for a level set plus or minus the background. Values of a level set are
/// distances (m).
///
/// dst: room for leaf_count elements of frz_leaf; with data NULL only the count is reported. FRZ_ERROR_CAPACITY if it is too small. The
///     pointers in it belong to the grid: they are valid until it is changed or destroyed, those of a base layer until its next step.
/// count: receives the number of leaves; 0 after other failures.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_leaves(
    grid: *const frz_grid,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    guard(|| {
        let count = required(count, "count")?;
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            count.write(0);
            let held = read(grid)?;
            let grid = held.floats()?;
            dst.list(count, grid.leaf_count(), || Ok(grid.leaves()?.iter().map(leaf_view).collect()))
        }
    })
}

/// Lends the leaves of a grid of floats at given origins, or the value that all 512 voxels there have.
///
/// origins: int32_t[3] for each block, multiples of 8, for instance those of frz_base_dirty.
/// dst: room for as many elements of frz_leaf; their pointers are valid as long as those of frz_grid_leaves.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_probe(
    grid: *const frz_grid,
    origins: frz_view,
    dst: frz_span,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            let held = read(grid)?;
            let origins = origins.elements::<[i32; 3]>("origins")?;
            origins.iter().try_for_each(|&origin| check_origin(origin).map(drop))?;
            let probes = held.floats()?.probe(&origins)?;
            let view = |(&origin, probe): (&Origin, &Probe<'_>)| match probe {
                Probe::Leaf(leaf) => leaf_view(leaf),
                Probe::Tile { value, .. } => {
                    frz_leaf { origin, tile: *value, values: std::ptr::null(), mask: std::ptr::null() }
                }
            };
            dst.fill("dst", &origins.iter().zip(&probes).map(view).collect::<Vec<_>>())
        }
    })
}

fn vector_leaf_view(leaf: &VectorLeaf<'_>) -> frz_vector_leaf {
    let (values, mask) = (leaf.values.as_flattened().as_ptr(), leaf.mask.as_ptr());
    frz_vector_leaf { origin: leaf.origin, tile: [0.0; 3], values, mask }
}

/// Lends the leaves of a grid of vectors without copying them, in an order that changes only when the grid changes.
///
/// Blocks without a leaf have a single value: the background, or that of frz_grid_vector_probe.
///
/// dst: room for leaf_count elements of frz_vector_leaf; with data NULL only the count is reported. FRZ_ERROR_CAPACITY if it is too small.
///     The pointers in it belong to the grid: they are valid until it is destroyed.
/// count: receives the number of leaves; 0 after other failures.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_vector_leaves(
    grid: *const frz_grid,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    guard(|| {
        let count = required(count, "count")?;
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            count.write(0);
            let held = read(grid)?;
            let grid = held.vectors()?;
            dst.list(count, grid.leaf_count(), || Ok(grid.leaves()?.iter().map(vector_leaf_view).collect()))
        }
    })
}

/// Lends the leaves of a grid of vectors at given origins, or the value that all 512 voxels there have.
///
/// origins: int32_t[3] for each block, multiples of 8.
/// dst: room for as many elements of frz_vector_leaf; their pointers are valid as long as those of frz_grid_vector_leaves.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_vector_probe(
    grid: *const frz_grid,
    origins: frz_view,
    dst: frz_span,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            let held = read(grid)?;
            let grid = held.vectors()?;
            let origins = origins.elements::<[i32; 3]>("origins")?;
            origins.iter().try_for_each(|&origin| check_origin(origin).map(drop))?;
            let probes = grid.probe(&origins)?;
            let view = |(&origin, probe): (&Origin, &VectorProbe<'_>)| match probe {
                Probe::Leaf(leaf) => vector_leaf_view(leaf),
                Probe::Tile { value, .. } => {
                    frz_vector_leaf { origin, tile: *value, values: std::ptr::null(), mask: std::ptr::null() }
                }
            };
            dst.fill("dst", &origins.iter().zip(&probes).map(view).collect::<Vec<_>>())
        }
    })
}
