//! Sparse grids of floats or vectors: their handle, properties and names.

use std::ffi::{c_char, c_void};
use std::ptr::NonNull;

use crate::capi::ffi::saved::write_bytes;
use crate::capi::ffi::*;
use crate::capi::runtime::context::{creates, frz_context};
use crate::error::Result;
use crate::vdb::{AnyGrid, FloatGrid, GridClass, GridRef, VectorGrid};

/// A sparse grid of 32-bit floats, or of vectors of three of them. Voxel (i, j, k) has its centre at (i, j, k) x voxel size, unless a file
/// gave another transform.
pub struct frz_grid {
    _opaque: [u8; 0],
}

/// The meaning of a grid's values.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_grid_class {
    /// Not specified.
    FRZ_GRID_UNKNOWN = 0,
    /// Signed distances (m), negative inside, truncated at the background.
    FRZ_GRID_LEVEL_SET = 1,
    /// A density.
    FRZ_GRID_FOG = 2,
    /// For vectors: component x of voxel (i, j, k) is the value at (i - 1/2, j, k), on the voxel's face; y and z likewise.
    FRZ_GRID_STAGGERED = 3,
}

/// The type of a grid's values.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_value_type {
    /// A float.
    FRZ_VALUE_FLOAT = 0,
    /// float[3]: a velocity, a wind, a colour. Functions that do not mention vectors refuse such a grid.
    FRZ_VALUE_VECTOR = 1,
}

/// Properties of a grid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_info {
    /// sizeof(frz_grid_info), set by the caller.
    pub struct_size: u32,
    /// A frz_grid_class.
    pub grid_class: u32,
    /// Edge of a voxel (m).
    pub voxel_size: f64,
    /// Value where nothing is stored; 0 for vectors.
    pub background: f32,
    /// 1 if voxel (0, 0, 0) lies at the origin and the axes are the world's, else 0.
    pub world_fixed: u32,
    /// Number of active voxels; constant blocks count in full.
    pub active_voxels: u64,
    /// Number of leaves.
    pub leaf_count: u64,
    /// Memory of the grid (bytes).
    pub memory_bytes: u64,
    /// Minimum active voxel on each axis; all zeroes if there is none.
    pub voxel_min: [i32; 3],
    /// Maximum active voxel on each axis, inclusive; all zeroes if there is none.
    pub voxel_max: [i32; 3],
    /// A frz_value_type.
    pub value_type: u32,
    /// For vectors the value where nothing is stored; else zeroes.
    pub background_vector: [f32; 3],
}

sized32!(frz_grid_info, [value_type]);

/// The value of a grid's handle.
pub(in crate::capi) enum Grid {
    /// The host's own grid.
    Own(AnyGrid),
    /// A grid of another object, which keeps it alive, and unchanged while it is read.
    Lent(NonNull<FloatGrid>),
}

handle!(frz_grid, Grid, "grid", 4);

impl From<AnyGrid> for Grid {
    fn from(grid: AnyGrid) -> Self {
        Self::Own(grid)
    }
}

impl From<FloatGrid> for Grid {
    fn from(grid: FloatGrid) -> Self {
        Self::Own(AnyGrid::Floats(grid))
    }
}

/// The error for a grid whose values are not of the type that a function needs.
fn wrong_value_type(name: &str, holds: &str, needed: &str) -> Failure {
    let name = if name.is_empty() { String::new() } else { format!(" \"{name}\"") };
    Failure::argument(format!("the grid{name} holds {holds}, but one of {needed} is needed"))
}

impl Grid {
    /// The grid, to read, of any type.
    pub(in crate::capi) fn any(&self) -> GridRef<'_> {
        match self {
            Self::Own(grid) => grid.borrow(),
            // SAFETY: the owner changes it only while it has locked this handle (`BaseHandle::with_grids_locked`).
            Self::Lent(grid) => GridRef::Floats(unsafe { grid.as_ref() }),
        }
    }

    /// The grid, to read, if it holds floats.
    pub(in crate::capi) fn floats(&self) -> Outcome<&FloatGrid> {
        match self.any() {
            GridRef::Floats(grid) => Ok(grid),
            GridRef::Vectors(grid) => Err(wrong_value_type(&grid.name(), "vectors", "floats")),
        }
    }

    /// The grid, to read, if it holds vectors.
    pub(in crate::capi) fn vectors(&self) -> Outcome<&VectorGrid> {
        match self.any() {
            GridRef::Vectors(grid) => Ok(grid),
            GridRef::Floats(grid) => Err(wrong_value_type(&grid.name(), "floats", "vectors")),
        }
    }

    /// The grid, to change; an error if it is lent.
    fn own(&mut self) -> Outcome<&mut AnyGrid> {
        match self {
            Self::Own(grid) => Ok(grid),
            Self::Lent(_) => {
                Err(Failure::argument("the grid belongs to another object: change a copy of it"))
            }
        }
    }

    /// The grid, to change, if it holds floats.
    pub(in crate::capi) fn own_floats(&mut self) -> Outcome<&mut FloatGrid> {
        match self.own()? {
            AnyGrid::Floats(grid) => Ok(grid),
            AnyGrid::Vectors(grid) => Err(wrong_value_type(&grid.name(), "vectors", "floats")),
        }
    }
}

/// Sets a grid's name.
pub(in crate::capi) fn set_name(grid: &mut AnyGrid, name: &str) -> Result<()> {
    match grid {
        AnyGrid::Floats(grid) => grid.set_name(name),
        AnyGrid::Vectors(grid) => grid.set_name(name),
    }
}

pub(in crate::capi) const CLASSES: [(u32, GridClass); 4] = [
    (frz_grid_class::FRZ_GRID_UNKNOWN as u32, GridClass::Unknown),
    (frz_grid_class::FRZ_GRID_LEVEL_SET as u32, GridClass::LevelSet),
    (frz_grid_class::FRZ_GRID_FOG as u32, GridClass::Fog),
    (frz_grid_class::FRZ_GRID_STAGGERED as u32, GridClass::Staggered),
];

fn number_of(class: GridClass) -> u32 {
    CLASSES.iter().find(|(_, known)| *known == class).map_or(0, |(number, _)| *number)
}

/// Checks the edge of a voxel (m).
pub(in crate::capi) fn check_voxel(voxel: f64) -> Outcome {
    finite("voxel_size", voxel)?;
    refuse(!(1e-6..=1e3).contains(&voxel), || format!("voxel_size = {voxel} is not within 1e-6 to 1000 m"))
}

/// Destroys a grid; NULL is ignored. A grid that belongs to another object is not destroyed.
///
/// grid: may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_destroy(grid: *mut frz_grid) {
    // SAFETY: the grid is NULL or alive.
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
/// grid: owned by the caller or by another object.
/// out: receives the copy, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_copy(
    context: *mut frz_context,
    grid: *const frz_grid,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let held = read(grid)?;
            let source = held.any();
            ctx.allow("a copy of the grid", source.memory_bytes())?;
            Ok(ctx.polled(|| source.deep_copy())?)
        })
    }
}

/// Reports the properties of a grid.
///
/// info: receives them. The caller sets its struct_size.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_get_info(grid: *const frz_grid, info: *mut frz_grid_info) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let held = read(grid)?;
        let grid = held.any();
        let (voxel_min, voxel_max) = grid.active_bbox().unwrap_or_default();
        let (value_type, background, background_vector) = match grid {
            GridRef::Floats(grid) => (frz_value_type::FRZ_VALUE_FLOAT, grid.background(), [0.0; 3]),
            GridRef::Vectors(grid) => (frz_value_type::FRZ_VALUE_VECTOR, 0.0, grid.background()),
        };
        let value = frz_grid_info {
            struct_size: 0,
            grid_class: number_of(grid.class()),
            voxel_size: grid.voxel_size(),
            background,
            world_fixed: u32::from(grid.is_world_fixed()),
            active_voxels: grid.active_voxels(),
            leaf_count: grid.leaf_count() as u64,
            memory_bytes: grid.memory_bytes(),
            voxel_min,
            voxel_max,
            value_type: value_type as u32,
            background_vector,
        };
        fill(info, None, value)
    })
}

/// Copies a grid's name as zero-terminated UTF-8.
///
/// dst: room for capacity bytes; NULL: only the size is reported. FRZ_ERROR_CAPACITY if it is too small.
/// capacity: size of dst (bytes).
/// size: receives the number of bytes needed, including the zero; 0 after other failures.
///
/// Any number of threads may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_name(
    grid: *const frz_grid,
    dst: *mut c_char,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(size);
        let mut name = read(grid)?.any().name().into_bytes();
        name.push(0);
        write_bytes(dst.cast::<c_void>(), capacity, size, || name.len(), || Ok(&name))
    })
}

/// Sets a grid's name, under which files store it.
///
/// grid: owned by the caller.
/// name: UTF-8; NULL for none.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_set_name(grid: *mut frz_grid, name: *const c_char) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let name = text(name, "name")?.unwrap_or("");
        Ok(set_name(change(grid)?.own()?, name)?)
    })
}
