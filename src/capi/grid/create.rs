//! Grids from a host's blocks of voxels.

use std::collections::HashSet;
use std::ffi::c_char;

use super::leaves::{check_origin, frz_leaf, frz_vector_leaf};
use super::sparse::frz_value_type::*;
use super::sparse::{CLASSES, check_voxel, frz_grid, set_name};
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::numeric::blocks::{Block, BlockEdit, DIM, Origin, VOXELS, Values};
use crate::vdb::{AnyGrid, FloatGrid, GridClass, VectorEdit, VectorGrid, Vectors};

/// Description of a new grid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_desc {
    /// sizeof(frz_grid_desc).
    pub struct_size: u32,
    /// A frz_grid_class. Outside its leaves a level set has the sign of the adjacent part of its band. For vectors FRZ_GRID_UNKNOWN or
    /// FRZ_GRID_STAGGERED.
    pub grid_class: u32,
    /// Edge of a voxel (m), 1e-6 to 1000.
    pub voxel_size: f64,
    /// Value where nothing is stored, finite. For a level set the half width of its band (m), at least 3 voxels. 0 for vectors.
    pub background: f32,
    /// Must be 0.
    pub flags: u32,
    /// Leaves, with different origins; NULL for none. Values are finite. If a mask is NULL all voxels are active, or, in a level set, those
    /// nearer to the surface than the background.
    pub leaves: *const frz_leaf,
    /// Number of leaves, or of vector_leaves.
    pub leaf_count: usize,
    /// Name in files, UTF-8; NULL for none.
    pub name: *const c_char,
    /// A frz_value_type.
    pub value_type: u32,
    /// For vectors the value where nothing is stored, finite; else zeroes.
    pub background_vector: [f32; 3],
    /// Leaves of a grid of vectors, under the same rules as leaves, which must then be NULL; for floats NULL.
    pub vector_leaves: *const frz_vector_leaf,
}

sized32!(frz_grid_desc, [name, value_type]);

/// Converts a host's leaves to edits; origins must be multiples of 8, and different. A failure names the leaf.
///
/// # Safety
/// `list` must be NULL or point to `count` leaves.
unsafe fn edits<L: Plain, E>(
    (list, count, name): (*const L, usize, &str),
    origin: impl Fn(&L) -> Origin,
    edit: impl Fn(&L) -> Outcome<E>,
) -> Outcome<Vec<E>> {
    // SAFETY: guaranteed by the caller.
    let leaves = unsafe { frz_view::packed(list, count).elements::<L>(name) }?;
    let mut origins = HashSet::new();
    let mut checked = |leaf: &L| {
        let origin = check_origin(origin(leaf))?;
        refuse(!origins.insert(origin), || format!("another one is at {origin:?} already"))?;
        edit(leaf)
    };
    let named = |(at, leaf)| {
        checked(leaf).map_err(|failure| Failure { text: format!("leaf {at}: {}", failure.text), ..failure })
    };
    leaves.iter().enumerate().map(named).collect()
}

/// Refuses values of a leaf that are not finite.
fn check_values(values: &[f32]) -> Outcome {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(Failure::argument("a value is not finite"))
}

/// Copies the array of a leaf that a pointer points to.
///
/// # Safety
/// The pointer must be valid.
unsafe fn array_at<T: Plain>(pointer: *const T, name: &str) -> Outcome<T> {
    // SAFETY: guaranteed by the caller.
    Ok(unsafe { frz_view::packed(pointer, 1).elements::<T>(name) }?[0])
}

/// The leaves of floats of a description as edits.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn float_edits(desc: &frz_grid_desc, class: GridClass) -> Outcome<Vec<BlockEdit>> {
    let edit = |&frz_leaf { origin, tile, values, mask }: &frz_leaf| {
        if values.is_null() {
            check_values(&[tile])?;
            return Ok(BlockEdit::Constant(origin, tile));
        }
        // SAFETY: guaranteed by the caller.
        let values: Box<Values> = Box::new(unsafe { array_at(values.cast(), "values") }?);
        check_values(&*values)?;
        let is_active = |index: usize| class != GridClass::LevelSet || values[index].abs() < desc.background;
        let word = |x: usize| (0..64).fold(0, |word, at| word | u64::from(is_active(x << 6 | at)) << at);
        let mask = match mask.is_null() {
            true => std::array::from_fn(word),
            // SAFETY: guaranteed by the caller.
            false => unsafe { array_at(mask.cast(), "mask") }?,
        };
        Ok(BlockEdit::Dense(Block { origin, values, mask }))
    };
    // SAFETY: guaranteed by the caller.
    unsafe { edits((desc.leaves, desc.leaf_count, "leaves"), |leaf| leaf.origin, edit) }
}

/// A grid of floats from its description.
///
/// # Safety
/// As [`float_edits`].
unsafe fn float_grid(ctx: &Context, desc: &frz_grid_desc, class: GridClass) -> Outcome<FloatGrid> {
    refuse(
        !desc.vector_leaves.is_null() || desc.background_vector != [0.0; 3],
        || "vector_leaves and background_vector are those of a grid of vectors: value_type says floats",
    )?;
    finite("background", f64::from(desc.background))?;
    let half_width = f64::from(desc.background) / desc.voxel_size;
    refuse(class == GridClass::LevelSet && !(2.999..=64.001).contains(&half_width), || {
        format!("background: the half width of the band is {half_width:.2} voxels, not 3 to 64")
    })?;
    refuse(class == GridClass::Staggered, || "grid_class: only vectors can be staggered")?;
    ctx.allow("a grid", (desc.leaf_count as u64).saturating_mul((VOXELS * 8 + 64) as u64))?;
    // SAFETY: guaranteed by the caller.
    let edits = unsafe { float_edits(desc, class) }?;
    let mut grid = FloatGrid::new(desc.voxel_size, desc.background)?;
    grid.set_class(class)?;
    Ok(ctx.polled(|| {
        grid.replace_blocks(ctx, &edits)?;
        if class == GridClass::LevelSet && grid.leaf_count() > 0 {
            grid.flood_fill()?;
        }
        Ok(grid)
    })?)
}

/// A grid of vectors from its description.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn vector_grid(ctx: &Context, desc: &frz_grid_desc, class: GridClass) -> Outcome<VectorGrid> {
    refuse(
        !desc.leaves.is_null() || desc.background != 0.0,
        || "leaves and background are those of a grid of floats: value_type says vectors",
    )?;
    if !desc.background_vector.iter().all(|component| component.is_finite()) {
        return Err(Failure::argument("background_vector is not finite"));
    }
    if !matches!(class, GridClass::Unknown | GridClass::Staggered) {
        return Err(Failure::argument("grid_class: vectors are neither a level set nor fog"));
    }
    let bytes = (VOXELS * 2 * size_of::<[f32; 3]>() + 64) as u64;
    ctx.allow("a grid", (desc.leaf_count as u64).saturating_mul(bytes))?;
    // SAFETY: guaranteed by the caller.
    let edits = unsafe { vector_edits(desc) }?;
    let mut grid = VectorGrid::new(desc.voxel_size, desc.background_vector)?;
    grid.set_class(class)?;
    Ok(ctx.polled(|| {
        grid.replace_blocks(ctx, &edits)?;
        Ok(grid)
    })?)
}

/// The leaves of vectors of a description as edits.
///
/// # Safety
/// As [`float_edits`].
unsafe fn vector_edits(desc: &frz_grid_desc) -> Outcome<Vec<VectorEdit>> {
    let edit = |&frz_vector_leaf { origin, tile, values, mask }: &frz_vector_leaf| {
        if values.is_null() {
            check_values(&tile)?;
            return Ok(VectorEdit::Constant(origin, tile));
        }
        // SAFETY: guaranteed by the caller.
        let values: Box<Vectors> = Box::new(unsafe { array_at(values.cast(), "values") }?);
        check_values(values.as_flattened())?;
        // SAFETY: guaranteed by the caller.
        let mask = if mask.is_null() { [u64::MAX; DIM] } else { unsafe { array_at(mask.cast(), "mask") }? };
        Ok(VectorEdit::Dense { origin, values, mask })
    };
    // SAFETY: guaranteed by the caller.
    unsafe { edits((desc.vector_leaves, desc.leaf_count, "vector_leaves"), |leaf| leaf.origin, edit) }
}

/// A grid from its description.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn grid_of(ctx: &Context, desc: &frz_grid_desc) -> Outcome<AnyGrid> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        no_flags(desc.flags, 0)?;
        let class = meaning("grid_class", "frz_grid_class", desc.grid_class, &CLASSES)?;
        check_voxel(desc.voxel_size)?;
        let name = text(desc.name, "name")?.unwrap_or("");
        let known = numbered! { FRZ_VALUE_FLOAT, FRZ_VALUE_VECTOR };
        let mut grid = match meaning("value_type", "frz_value_type", desc.value_type, &known)? {
            FRZ_VALUE_FLOAT => AnyGrid::Floats(float_grid(ctx, desc, class)?),
            FRZ_VALUE_VECTOR => AnyGrid::Vectors(vector_grid(ctx, desc, class)?),
        };
        set_name(&mut grid, name)?;
        Ok(grid)
    }
}

/// Creates a grid from blocks of voxels, which are copied.
///
/// desc: its description.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_create(
    context: *mut frz_context,
    desc: *const frz_grid_desc,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| grid_of(ctx, &given(desc)?)) }
}
