//! Grids from a host's blocks of voxels.

use std::collections::HashSet;
use std::ffi::c_char;

use super::leaves::{check_origin, frz_leaf, frz_vector_leaf};
use super::sparse::{CLASSES, Grid, check_voxel, frz_grid, frz_value_type};
use crate::capi::ffi::guard::{Failure, Outcome, frz_status};
use crate::capi::ffi::views::{Sized32, finite, frz_view, meaning, sized, text};
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::numeric::blocks::{Block, BlockEdit, DIM, Mask, Origin, VOXELS, Values};
use crate::vdb::{AnyGrid, FloatGrid, GridClass, VectorEdit, VectorGrid, Vectors};

/// Description of a new grid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_desc {
    /// sizeof(frz_grid_desc).
    pub struct_size: u32,
    /// A frz_grid_class. A level set takes the sign of its band everywhere outside the leaves. For vectors FRZ_GRID_UNKNOWN or
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
    /// Leaves of a grid of vectors, as leaves, which must then be NULL; else NULL.
    pub vector_leaves: *const frz_vector_leaf,
}

impl frz_grid_desc {
    /// Values of the fields that an older header does not have.
    const NONE: Self = Self {
        struct_size: 0,
        grid_class: 0,
        voxel_size: 0.0,
        background: 0.0,
        flags: 0,
        leaves: std::ptr::null(),
        leaf_count: 0,
        name: std::ptr::null(),
        value_type: 0,
        background_vector: [0.0; 3],
        vector_leaves: std::ptr::null(),
    };
}

// SAFETY: numbers and pointers.
unsafe impl Sized32 for frz_grid_desc {
    const SIZES: &'static [usize] = &[
        std::mem::offset_of!(frz_grid_desc, name),
        std::mem::offset_of!(frz_grid_desc, value_type),
        size_of::<Self>(),
    ];
    const NAME: &'static str = "frz_grid_desc";
}

/// The origins of leaves: multiples of 8, each used once.
#[derive(Default)]
struct Places(HashSet<Origin>);

impl Places {
    /// Checks the origin of the next leaf, the one with index `at`.
    fn add(&mut self, at: usize, origin: Origin) -> Outcome<Origin> {
        let named = |failure: Failure| Failure { text: format!("leaf {at}: {}", failure.text), ..failure };
        if !self.0.insert(check_origin(origin).map_err(named)?) {
            return Err(Failure::argument(format!("leaf {at}: another one is at {origin:?} already")));
        }
        Ok(origin)
    }
}

/// Refuses values of a leaf that are not finite.
fn check_values(at: usize, values: &[f32]) -> Outcome {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(Failure::argument(format!("leaf {at}: a value is not finite")))
}

/// The active voxels of a leaf; `None` if the host does not specify them.
///
/// # Safety
/// The pointer must be NULL or point to 8 words.
unsafe fn mask_of(mask: *const u64) -> Outcome<Option<Mask>> {
    if mask.is_null() {
        return Ok(None);
    }
    let mask = frz_view { data: mask.cast(), count: 1, stride: 0 };
    // SAFETY: guaranteed by the caller.
    Ok(Some(unsafe { mask.elements::<Mask>("mask") }?[0]))
}

/// The leaves of a description as blocks.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn blocks(desc: &frz_grid_desc, class: GridClass) -> Outcome<Vec<BlockEdit>> {
    let view = frz_view { data: desc.leaves.cast(), count: desc.leaf_count, stride: 0 };
    // SAFETY: guaranteed by the caller.
    let leaves = unsafe { view.elements::<frz_leaf>("leaves") }?;
    let mut positions = Places::default();
    let mut out = Vec::with_capacity(leaves.len());
    for (at, leaf) in leaves.iter().enumerate() {
        let origin = positions.add(at, leaf.origin)?;
        if leaf.values.is_null() {
            check_values(at, &[leaf.tile])?;
            out.push(BlockEdit::Constant(origin, leaf.tile));
            continue;
        }
        let values = frz_view { data: leaf.values.cast(), count: 1, stride: 0 };
        // SAFETY: guaranteed by the caller.
        let values: Box<Values> = Box::new(unsafe { values.elements::<Values>("values") }?[0]);
        check_values(at, &*values)?;
        let band = |index: usize| class != GridClass::LevelSet || values[index].abs() < desc.background;
        let near =
            || std::array::from_fn(|x| (0..64).fold(0, |word, at| word | u64::from(band(x << 6 | at)) << at));
        // SAFETY: guaranteed by the caller.
        let mask = unsafe { mask_of(leaf.mask) }?.unwrap_or_else(near);
        out.push(BlockEdit::Dense(Block { origin, values, mask }));
    }
    Ok(out)
}

/// A grid of floats from its description.
///
/// # Safety
/// As [`blocks`].
unsafe fn of_floats(ctx: &Context, desc: &frz_grid_desc, class: GridClass) -> Outcome<FloatGrid> {
    if !desc.vector_leaves.is_null() || desc.background_vector != [0.0; 3] {
        let text =
            "vector_leaves and background_vector are those of a grid of vectors: value_type says floats";
        return Err(Failure::argument(text));
    }
    finite("background", f64::from(desc.background))?;
    let half_width = f64::from(desc.background) / desc.voxel_size;
    if class == GridClass::LevelSet && !(2.999..=64.001).contains(&half_width) {
        let text = format!("background: the band is {half_width:.2} voxels wide, not 3 to 64");
        return Err(Failure::argument(text));
    }
    if class == GridClass::Staggered {
        return Err(Failure::argument("grid_class: floats are not staggered, vectors are"));
    }
    ctx.allow("a grid", (desc.leaf_count as u64).saturating_mul((VOXELS * 8 + 64) as u64))?;
    // SAFETY: guaranteed by the caller.
    let blocks = unsafe { blocks(desc, class) }?;
    let mut grid = FloatGrid::new(desc.voxel_size, desc.background)?;
    grid.set_class(class)?;
    Ok(ctx.polled(|| {
        grid.replace_blocks(ctx, &blocks)?;
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
unsafe fn of_vectors(ctx: &Context, desc: &frz_grid_desc, class: GridClass) -> Outcome<VectorGrid> {
    if !desc.leaves.is_null() || desc.background != 0.0 {
        let text = "leaves and background are those of a grid of floats: value_type says vectors";
        return Err(Failure::argument(text));
    }
    if !desc.background_vector.iter().all(|component| component.is_finite()) {
        return Err(Failure::argument("background_vector is not finite"));
    }
    if !matches!(class, GridClass::Unknown | GridClass::Staggered) {
        return Err(Failure::argument("grid_class: vectors are neither a level set nor fog"));
    }
    let bytes = (VOXELS * 2 * size_of::<[f32; 3]>() + 64) as u64;
    ctx.allow("a grid", (desc.leaf_count as u64).saturating_mul(bytes))?;
    // SAFETY: guaranteed by the caller.
    let edits = unsafe { edits(desc) }?;
    let mut grid = VectorGrid::new(desc.voxel_size, desc.background_vector)?;
    grid.set_class(class)?;
    Ok(ctx.polled(|| {
        grid.replace_blocks(ctx, &edits)?;
        Ok(grid)
    })?)
}

/// # Safety
/// As [`of_vectors`].
unsafe fn edits(desc: &frz_grid_desc) -> Outcome<Vec<VectorEdit>> {
    let view = frz_view { data: desc.vector_leaves.cast(), count: desc.leaf_count, stride: 0 };
    // SAFETY: guaranteed by the caller.
    let leaves = unsafe { view.elements::<frz_vector_leaf>("vector_leaves") }?;
    let mut positions = Places::default();
    let mut out = Vec::with_capacity(leaves.len());
    for (at, leaf) in leaves.iter().enumerate() {
        let origin = positions.add(at, leaf.origin)?;
        if leaf.values.is_null() {
            check_values(at, &leaf.tile)?;
            out.push(VectorEdit::Constant(origin, leaf.tile));
            continue;
        }
        let values = frz_view { data: leaf.values.cast(), count: 1, stride: 0 };
        // SAFETY: guaranteed by the caller.
        let values: Box<Vectors> = Box::new(unsafe { values.elements::<Vectors>("values") }?[0]);
        check_values(at, values.as_flattened())?;
        // SAFETY: guaranteed by the caller.
        let mask = unsafe { mask_of(leaf.mask) }?.unwrap_or([u64::MAX; DIM]);
        out.push(VectorEdit::Dense { origin, values, mask });
    }
    Ok(out)
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
    unsafe {
        creates(context, out, |ctx| {
            let desc = sized(desc, frz_grid_desc::NONE)?;
            no_flags(desc.flags, 0)?;
            let class = meaning("grid_class", "frz_grid_class", desc.grid_class, &CLASSES)?;
            check_voxel(desc.voxel_size)?;
            let name = text(desc.name, "name")?.unwrap_or("");
            let known =
                [frz_value_type::FRZ_VALUE_FLOAT, frz_value_type::FRZ_VALUE_VECTOR].map(|t| (t as u32, t));
            Ok(Grid::Own(match meaning("value_type", "frz_value_type", desc.value_type, &known)? {
                frz_value_type::FRZ_VALUE_FLOAT => {
                    let mut grid = of_floats(ctx, &desc, class)?;
                    grid.set_name(name)?;
                    AnyGrid::Floats(grid)
                }
                frz_value_type::FRZ_VALUE_VECTOR => {
                    let mut grid = of_vectors(ctx, &desc, class)?;
                    grid.set_name(name)?;
                    AnyGrid::Vectors(grid)
                }
            }))
        })
    }
}
