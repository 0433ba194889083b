//! Sparse grids of floats.

use std::collections::HashSet;
use std::ffi::{c_char, c_void};
use std::ptr::NonNull;

use super::context::{creates, frz_context};
use super::guard::{Failure, Outcome, frz_status, guard};
use super::handle::{Noun, change, clear, destroy, read, required};
use super::mesh::no_flags;
use super::views::{Plain, Sized32, fill, finite, frz_span, frz_view, meaning, sized, text, write_bytes};
use crate::base::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};
use crate::vdb::{FloatGrid, GridClass, Leaf, Probe};

/// A sparse grid of 32-bit floats; voxel (i, j, k) has its centre at (i, j, k) x voxel size, unless a file brought
/// another transform.
pub struct frz_grid {
    _opaque: [u8; 0],
}

/// What a grid's values mean.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_grid_class {
    /// Nothing said.
    FRZ_GRID_UNKNOWN = 0,
    /// Signed distances (m), negative inside, cut off at the background.
    FRZ_GRID_LEVEL_SET = 1,
    /// A density.
    FRZ_GRID_FOG = 2,
}

/// A block of 8 x 8 x 8 voxels. Voxel (x, y, z) of the block has its value at x * 64 + y * 8 + z, and its bit in
/// mask[x] at y * 8 + z.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_leaf {
    /// Voxel of the least corner, multiples of 8.
    pub origin: [i32; 3],
    /// The value of all voxels where values is NULL.
    pub tile: f32,
    /// 512 values, or NULL.
    pub values: *const f32,
    /// 8 words: which voxels are active; NULL where values is NULL.
    pub mask: *const u64,
}

// SAFETY: numbers and pointers, which are looked at only after the host promised them.
unsafe impl Plain for frz_leaf {}

/// What a grid is made of.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_desc {
    /// sizeof(frz_grid_desc).
    pub struct_size: u32,
    /// A frz_grid_class. A level set gets the sign of its band everywhere outside the leaves.
    pub grid_class: u32,
    /// Edge of a voxel (m), 1e-6 to 1000.
    pub voxel_size: f64,
    /// Value where nothing is stored, finite. For a level set the half width of its band (m), at least 3 voxels.
    pub background: f32,
    /// 0.
    pub flags: u32,
    /// Leaves, at different places; NULL for none. Values are finite. A mask of NULL makes all voxels active, of a
    /// level set those nearer than the background.
    pub leaves: *const frz_leaf,
    /// Number of leaves.
    pub leaf_count: usize,
    /// Name in files, UTF-8; NULL for none.
    pub name: *const c_char,
}

// SAFETY: numbers and pointers.
unsafe impl Sized32 for frz_grid_desc {
    const SIZES: &'static [usize] = &[std::mem::offset_of!(frz_grid_desc, name), size_of::<Self>()];
    const NAME: &'static str = "frz_grid_desc";
}

/// What a grid is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_info {
    /// sizeof(frz_grid_info), set by the caller.
    pub struct_size: u32,
    /// A frz_grid_class.
    pub grid_class: u32,
    /// Edge of a voxel (m).
    pub voxel_size: f64,
    /// Value where nothing is stored.
    pub background: f32,
    /// 1 when voxel (0, 0, 0) lies at the origin and the axes are the world's, else 0.
    pub world_fixed: u32,
    /// Active voxels, constant blocks counted in full.
    pub active_voxels: u64,
    /// Leaves.
    pub leaf_count: u64,
    /// Memory (bytes).
    pub memory_bytes: u64,
    /// Least active voxel on each axis; all zeroes when there is none.
    pub voxel_min: [i32; 3],
    /// Greatest active voxel on each axis, included; all zeroes when there is none.
    pub voxel_max: [i32; 3],
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_grid_info {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_grid_info";
}

/// What a grid's handle holds.
pub(super) enum Grid {
    /// The host's own.
    Own(FloatGrid),
    /// A part of another object, which keeps it alive and unchanged while it is read.
    Lent(NonNull<FloatGrid>),
}

impl Noun for frz_grid {
    type Value = Grid;
    const NAME: &'static str = "grid";
    const TAG: u32 = 0x6672_7a04;
}

impl Grid {
    /// The grid, to read.
    pub(super) fn get(&self) -> &FloatGrid {
        match self {
            Self::Own(grid) => grid,
            // SAFETY: the owner changes it only while it holds this handle to change.
            Self::Lent(grid) => unsafe { grid.as_ref() },
        }
    }

    /// The grid, to change; what is lent stays as it is.
    pub(super) fn own(&mut self) -> Outcome<&mut FloatGrid> {
        match self {
            Self::Own(grid) => Ok(grid),
            Self::Lent(_) => {
                Err(Failure::argument("the grid belongs to another object: change a copy of it"))
            }
        }
    }
}

const CLASSES: [(u32, GridClass); 3] = [
    (frz_grid_class::FRZ_GRID_UNKNOWN as u32, GridClass::Unknown),
    (frz_grid_class::FRZ_GRID_LEVEL_SET as u32, GridClass::LevelSet),
    (frz_grid_class::FRZ_GRID_FOG as u32, GridClass::Fog),
];

fn number_of(class: GridClass) -> u32 {
    CLASSES.iter().find(|(_, known)| *known == class).map_or(0, |(number, _)| *number)
}

/// Checks the edge of a voxel (m).
pub(super) fn check_voxel(voxel: f64) -> Outcome {
    finite("voxel_size", voxel)?;
    if !(1e-6..=1e3).contains(&voxel) {
        return Err(Failure::argument(format!("voxel_size = {voxel} is not within 1e-6 to 1000 m")));
    }
    Ok(())
}

/// Farthest voxel of a leaf from the origin.
const FARTHEST: i32 = 1 << 30;

/// Checks the place of a block.
pub(super) fn check_origin(origin: Origin) -> Outcome<Origin> {
    if origin.iter().any(|&index| index & 7 != 0 || !(-FARTHEST..=FARTHEST).contains(&index)) {
        let text = format!("origin {origin:?} is no block's: multiples of 8 within -2^30 to 2^30");
        return Err(Failure::argument(text));
    }
    Ok(origin)
}

/// The leaves of a description as blocks.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn blocks(desc: &frz_grid_desc, class: GridClass) -> Outcome<Vec<BlockEdit>> {
    let view = frz_view { data: desc.leaves.cast(), count: desc.leaf_count, stride: 0 };
    // SAFETY: the caller's promise.
    let leaves = unsafe { view.elements::<frz_leaf>("leaves") }?;
    let mut places = HashSet::with_capacity(leaves.len());
    let mut out = Vec::with_capacity(leaves.len());
    for (at, leaf) in leaves.iter().enumerate() {
        let named = |failure: Failure| Failure { text: format!("leaf {at}: {}", failure.text), ..failure };
        let origin = check_origin(leaf.origin).map_err(named)?;
        if !places.insert(origin) {
            return Err(Failure::argument(format!("leaf {at}: another one is at {origin:?} already")));
        }
        let finite = |values: &[f32]| {
            let wrong = !values.iter().all(|value| value.is_finite());
            if wrong { Err(Failure::argument(format!("leaf {at}: a value is not finite"))) } else { Ok(()) }
        };
        if leaf.values.is_null() {
            finite(&[leaf.tile])?;
            out.push(BlockEdit::Constant(origin, leaf.tile));
            continue;
        }
        let values = frz_view { data: leaf.values.cast(), count: 1, stride: 0 };
        // SAFETY: the caller's promise.
        let values: Box<Values> = Box::new(unsafe { values.elements::<Values>("values") }?[0]);
        finite(&*values)?;
        let mask: Mask = if leaf.mask.is_null() {
            let band = |index: usize| class != GridClass::LevelSet || values[index].abs() < desc.background;
            std::array::from_fn(|x| (0..64).fold(0, |word, at| word | u64::from(band(x << 6 | at)) << at))
        } else {
            let mask = frz_view { data: leaf.mask.cast(), count: 1, stride: 0 };
            // SAFETY: the caller's promise.
            unsafe { mask.elements::<Mask>("mask") }?[0]
        };
        out.push(BlockEdit::Dense(Block { origin, values, mask }));
    }
    Ok(out)
}

/// Makes a grid from blocks of voxels, which are copied.
///
/// desc: what it is made of.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_create(
    context: *mut frz_context,
    desc: *const frz_grid_desc,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        creates(context, out, |ctx| {
            let defaults = frz_grid_desc {
                struct_size: 0,
                grid_class: 0,
                voxel_size: 0.0,
                background: 0.0,
                flags: 0,
                leaves: std::ptr::null(),
                leaf_count: 0,
                name: std::ptr::null(),
            };
            let desc = sized(desc, defaults)?;
            no_flags(desc.flags, 0)?;
            let class = meaning("grid_class", "frz_grid_class", desc.grid_class, &CLASSES)?;
            check_voxel(desc.voxel_size)?;
            finite("background", f64::from(desc.background))?;
            let half_width = f64::from(desc.background) / desc.voxel_size;
            if class == GridClass::LevelSet && !(2.999..=64.001).contains(&half_width) {
                let text = format!("background: the band is {half_width:.2} voxels wide, not 3 to 64");
                return Err(Failure::argument(text));
            }
            ctx.allow("a grid", (desc.leaf_count as u64).saturating_mul((VOXELS * 8 + 64) as u64))?;
            let name = text(desc.name, "name")?;
            let blocks = blocks(&desc, class)?;
            let mut grid = FloatGrid::new(desc.voxel_size, desc.background)?;
            grid.set_class(class)?;
            grid.set_name(name.unwrap_or(""))?;
            let grid = ctx.polled(|| {
                grid.replace_blocks(ctx, &blocks)?;
                if class == GridClass::LevelSet && grid.leaf_count() > 0 {
                    grid.flood_fill()?;
                }
                Ok(grid)
            })?;
            Ok(Grid::Own(grid))
        })
    }
}

/// Destroys a grid; NULL is fine. A grid that belongs to another object stays.
///
/// grid: may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_destroy(grid: *mut frz_grid) {
    // SAFETY: the grid is NULL or was not destroyed.
    guard(|| unsafe {
        if let Ok(held) = read(grid.cast_const())
            && matches!(*held, Grid::Lent(_))
        {
            return Err(Failure::argument("the grid belongs to another object"));
        }
        destroy(grid)
    });
}

/// Copies a grid; the copy shares no memory and belongs to the caller.
///
/// grid: of the caller or of another object.
/// out: receives the copy, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_copy(
    context: *mut frz_context,
    grid: *const frz_grid,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        creates(context, out, |ctx| {
            let held = read(grid)?;
            let source = held.get();
            ctx.allow("a copy of the grid", source.memory_bytes())?;
            Ok(Grid::Own(ctx.polled(|| source.deep_copy())?))
        })
    }
}

/// Tells what a grid is.
///
/// info: receives it; its struct_size says how much of it the caller knows.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_get_info(grid: *const frz_grid, info: *mut frz_grid_info) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let held = read(grid)?;
            let grid = held.get();
            let (voxel_min, voxel_max) = grid.active_bbox().unwrap_or_default();
            let value = frz_grid_info {
                struct_size: 0,
                grid_class: number_of(grid.class()),
                voxel_size: grid.voxel_size(),
                background: grid.background(),
                world_fixed: u32::from(grid.is_world_fixed()),
                active_voxels: grid.active_voxels(),
                leaf_count: grid.leaf_count() as u64,
                memory_bytes: grid.memory_bytes(),
                voxel_min,
                voxel_max,
            };
            fill(info, None, value)
        }
    })
}

/// Copies a grid's name, in UTF-8 with a zero at its end.
///
/// dst: room for capacity bytes; NULL only asks for the size. FRZ_ERROR_CAPACITY when it is too small.
/// capacity: bytes at dst.
/// size: receives the bytes that are needed, the zero counted; 0 after other failures.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_name(
    grid: *const frz_grid,
    dst: *mut c_char,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(size);
            let mut name = read(grid)?.get().name().into_bytes();
            name.push(0);
            let needed = name.len();
            write_bytes(dst.cast::<c_void>(), capacity, size, || needed, || Ok(name))
        }
    })
}

/// Names a grid, as files know it.
///
/// grid: of the caller.
/// name: UTF-8; NULL for none.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_set_name(grid: *mut frz_grid, name: *const c_char) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let name = text(name, "name")?.unwrap_or("");
            Ok(change(grid)?.own()?.set_name(name)?)
        }
    })
}

fn leaf_view(leaf: &Leaf<'_>) -> frz_leaf {
    frz_leaf { origin: leaf.origin, tile: 0.0, values: leaf.values.as_ptr(), mask: leaf.mask.as_ptr() }
}

/// Lends a grid's leaves without copying them, in an order that does not change while the grid does not.
///
/// Blocks without a leaf have one value: the background, or for a level set plus or minus the background. Values of a
/// level set are distances (m).
///
/// dst: room for leaf_count elements of frz_leaf; with data NULL only the number is told. FRZ_ERROR_CAPACITY when it
///     is too small. The pointers in it are the grid's: they stay until it is changed or destroyed, those of a base
///     layer until its next step.
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
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            count.write(0);
            let held = read(grid)?;
            if dst.data.is_null() {
                count.write(held.get().leaf_count());
                return Ok(());
            }
            let leaves: Vec<frz_leaf> = held.get().leaves()?.iter().map(leaf_view).collect();
            count.write(leaves.len());
            dst.fill("dst", &leaves)
        }
    })
}

/// Lends what a grid holds at some places: leaves, or the value of all 512 voxels.
///
/// origins: int32_t[3] for each place, multiples of 8, for instance those of frz_base_dirty.
/// dst: room for as many elements of frz_leaf, whose pointers stay as those of frz_grid_leaves do.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_probe(
    grid: *const frz_grid,
    origins: frz_view,
    dst: frz_span,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let held = read(grid)?;
            let origins = origins.elements::<[i32; 3]>("origins")?;
            origins.iter().try_for_each(|&origin| check_origin(origin).map(drop))?;
            let probes = held.get().probe(&origins)?;
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
