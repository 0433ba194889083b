//! Blocks of voxels that a grid lends.

use super::sparse::frz_grid;
use crate::capi::ffi::*;
use crate::numeric::blocks::Origin;
use crate::vdb::{Leaf, Probe};

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

/// Maximum coordinate of a block's origin (voxels), in absolute value.
const MAX_ORIGIN: i32 = 1 << 30;

/// Checks that the origin of a block is a multiple of 8, and in range.
pub(in crate::capi) fn check_origin(origin: Origin) -> Outcome<Origin> {
    refuse(
        origin.iter().any(|&index| index & 7 != 0 || !(-MAX_ORIGIN..=MAX_ORIGIN).contains(&index)),
        || format!("origin {origin:?} is not a block's: multiples of 8 within -2^30 to 2^30"),
    )?;
    Ok(origin)
}

impl frz_leaf {
    fn of(origin: Origin, (tile, values, mask): (f32, *const f32, *const u64)) -> Self {
        Self { origin, tile, values, mask }
    }
}

impl frz_vector_leaf {
    fn of(origin: Origin, (tile, values, mask): ([f32; 3], *const f32, *const u64)) -> Self {
        Self { origin, tile, values, mask }
    }
}

/// The contents of a block: the value of a tile and NULLs, or pointers to the values and the mask of a leaf.
fn contents<V, T: Copy + Default>(probe: &Probe<'_, V, T>) -> (T, *const f32, *const u64) {
    match probe {
        Probe::Leaf(leaf) => (T::default(), std::ptr::from_ref(leaf.values).cast(), leaf.mask.as_ptr()),
        Probe::Tile { value, .. } => (*value, std::ptr::null(), std::ptr::null()),
    }
}

/// A host's origins of blocks, checked.
///
/// # Safety
/// The view must describe memory that can be read.
pub(in crate::capi) unsafe fn origins_of(origins: &frz_view) -> Outcome<Vec<Origin>> {
    // SAFETY: guaranteed by the caller.
    let origins = unsafe { origins.elements::<Origin>("origins") }?;
    origins.iter().try_for_each(|&origin| check_origin(origin).map(drop))?;
    Ok(origins)
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        lists(count, || {
            let held = read(grid)?;
            let grid = held.floats()?;
            let leaf = |leaf: Leaf<'_, _>| frz_leaf::of(leaf.origin, contents(&Probe::Leaf(leaf)));
            dst.list(count, grid.leaf_count(), || Ok(grid.leaves()?.into_iter().map(leaf).collect()))
        })
    }
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let held = read(grid)?;
        let origins = origins_of(&origins)?;
        let probes = held.floats()?.probe(&origins)?;
        dst.put("dst", origins.iter().zip(&probes).map(|(&at, probe)| frz_leaf::of(at, contents(probe))))
    })
}

/// Lends the leaves of a grid of vectors without copying them, in an order that changes only when the grid changes.
///
/// Blocks without a leaf have a single value, which frz_grid_vector_probe reports.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        lists(count, || {
            let held = read(grid)?;
            let grid = held.vectors()?;
            let leaf = |leaf: Leaf<'_, _>| frz_vector_leaf::of(leaf.origin, contents(&Probe::Leaf(leaf)));
            dst.list(count, grid.leaf_count(), || Ok(grid.leaves()?.into_iter().map(leaf).collect()))
        })
    }
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let held = read(grid)?;
        let grid = held.vectors()?;
        let origins = origins_of(&origins)?;
        let probes = grid.probe(&origins)?;
        dst.put(
            "dst",
            origins.iter().zip(&probes).map(|(&at, probe)| frz_vector_leaf::of(at, contents(probe))),
        )
    })
}
