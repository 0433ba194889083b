//! Shallow liquid as numbers: its columns, at points, in boxes.

use super::spill::frz_shallow;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{clear, read, required};
use crate::capi::ffi::views::{Plain, Sized32, fill, frz_span, frz_view, meaning};
use crate::shallow::{Shallow, View};

/// Layer of a volume: all layers.
pub const FRZ_SHALLOW_ALL_LAYERS: u32 = 0xffff_ffff;

/// Column of a sample: there is no column.
pub const FRZ_SHALLOW_NO_COLUMN: u32 = 0xffff_ffff;

/// Properties of a shallow liquid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_info {
    /// sizeof(frz_shallow_info), set by the caller.
    pub struct_size: u32,
    /// Maximum number of columns above each other in a cell.
    pub layers: u32,
    /// Number of column indices: 16 for each strip of 16 cells along x that has a column of a layer. Some indices may have no column.
    pub index_count: u64,
    /// Number of columns.
    pub column_count: u64,
    /// Edge of a cell (m).
    pub cell: f64,
    /// Height of unit 0 (m).
    pub low: f64,
    /// One unit of heights and depths (m).
    pub unit: f64,
    /// Simulated time since the start (s).
    pub time: f64,
    /// Length of the last step (s), in which the fluxes of frz_shallow_lend are measured.
    pub last_step: f64,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_info {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_info";
}

/// Column arrays that frz_shallow_read copies. An index without a column has the cell (-1, -1), no depth, and a ceiling at its base.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_array {
    /// float: depth of the liquid (m).
    FRZ_SHALLOW_DEPTH = 0,
    /// float: height of the ground below it (m).
    FRZ_SHALLOW_BASE = 1,
    /// float: height of the underside of the next solid above (m), or the maximum height of the domain.
    FRZ_SHALLOW_CEILING = 2,
    /// int32_t[2]: its cell along x and along z.
    FRZ_SHALLOW_CELL = 3,
    /// uint32_t: its layer, 0 for the lowest column of a cell.
    FRZ_SHALLOW_LAYER = 4,
    /// float: flux to the next cell along x (m3/s), in the same layer.
    FRZ_SHALLOW_FLUX_EAST = 5,
    /// float: flux to the next cell along z (m3/s), in the same layer.
    FRZ_SHALLOW_FLUX_SOUTH = 6,
    /// float[2]: mean velocity over the depth along x and z (m/s): at the surface it is 1.5 times as fast.
    FRZ_SHALLOW_VELOCITY = 7,
}

/// Arrays over all column indices that frz_shallow_lend lends. A height is frz_shallow_info.low + units x unit.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_lent {
    /// int32_t: depth of the liquid (units).
    FRZ_SHALLOW_LENT_DEPTH = 0,
    /// int32_t: height of the ground below it (units).
    FRZ_SHALLOW_LENT_BASE = 1,
    /// int32_t: height of the underside of the next solid above (units).
    FRZ_SHALLOW_LENT_CEILING = 2,
    /// float: flux to the east, +x (units of depth in a step of frz_shallow_info.last_step).
    FRZ_SHALLOW_LENT_EAST = 3,
    /// float: flux to the south, +z (units of depth in a step of frz_shallow_info.last_step).
    FRZ_SHALLOW_LENT_SOUTH = 4,
}

use frz_shallow_array::*;
use frz_shallow_lent::*;

const ARRAYS: [(u32, frz_shallow_array); 8] = [
    (0, FRZ_SHALLOW_DEPTH),
    (1, FRZ_SHALLOW_BASE),
    (2, FRZ_SHALLOW_CEILING),
    (3, FRZ_SHALLOW_CELL),
    (4, FRZ_SHALLOW_LAYER),
    (5, FRZ_SHALLOW_FLUX_EAST),
    (6, FRZ_SHALLOW_FLUX_SOUTH),
    (7, FRZ_SHALLOW_VELOCITY),
];

const LENT: [(u32, frz_shallow_lent); 5] = [
    (0, FRZ_SHALLOW_LENT_DEPTH),
    (1, FRZ_SHALLOW_LENT_BASE),
    (2, FRZ_SHALLOW_LENT_CEILING),
    (3, FRZ_SHALLOW_LENT_EAST),
    (4, FRZ_SHALLOW_LENT_SOUTH),
];

/// Reports the properties of a liquid: the element counts for frz_shallow_read, and its dimensions.
///
/// info: receives them, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_get_info(
    shallow: *const frz_shallow,
    info: *mut frz_shallow_info,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            let mut value = frz_shallow_info {
                struct_size: 0,
                layers: 0,
                index_count: 0,
                column_count: 0,
                cell: 0.0,
                low: 0.0,
                unit: 0.0,
                time: 0.0,
                last_step: 0.0,
            };
            fill(info, None, value)?;
            let spill = read(shallow)?;
            let (shallow, columns) = (&spill.shallow, spill.shallow.columns());
            value.layers = shallow.view().layers() as u32;
            value.index_count = columns.len() as u64;
            value.column_count = columns.count() as u64;
            value.cell = columns.grid.cell;
            value.low = columns.heights.low;
            value.unit = columns.heights.unit;
            value.time = shallow.time();
            value.last_step = shallow.last_step();
            fill(info, None, value)
        }
    })
}

/// Copies an array of columns.
///
/// array: a frz_shallow_array, which states the type of the elements.
/// columns: uint32_t for each requested column, its index; data NULL with a count of 0: all indices, in order.
/// dst: room for as many elements; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_read(
    shallow: *const frz_shallow,
    array: u32,
    columns: frz_view,
    dst: frz_span,
) -> frz_status {
    guard(|| {
        let array = meaning("array", "frz_shallow_array", array, &ARRAYS)?;
        // SAFETY: the liquid is NULL or alive; view and span are valid.
        unsafe {
            let spill = read(shallow)?;
            let count = spill.shallow.columns().len();
            if columns.data.is_null() && columns.count == 0 {
                return copy(&spill.shallow, array, &dst, 0..count);
            }
            let indices = columns.in_place::<u32>("columns")?;
            dst.check_room("dst", indices.len())?;
            if let Some((at, index)) = indices.clone().enumerate().find(|(_, index)| *index as usize >= count)
            {
                let text = format!("columns: element {at}, {index}, is none of the {count} column indices");
                return Err(Failure::argument(text));
            }
            copy(&spill.shallow, array, &dst, indices.map(|index| index as usize))
        }
    })
}

/// # Safety
/// The span must describe memory that can be written.
unsafe fn copy(
    shallow: &Shallow,
    array: frz_shallow_array,
    dst: &frz_span,
    indices: impl ExactSizeIterator<Item = usize>,
) -> Outcome {
    let columns = shallow.columns();
    let heights = columns.heights;
    let length = |units: i32| heights.length(f64::from(units)) as f32;
    let height = |units: i32| heights.metres(units) as f32;
    let area = columns.grid.cell * columns.grid.cell;
    let flow = area * heights.unit / shallow.last_step();
    let [east, south] = shallow.fluxes();
    let cell = |index: usize| match columns.is_column(index) {
        true => columns.cell(index).map(|at| at as i32),
        false => [-1; 2],
    };
    // SAFETY: guaranteed by the caller.
    unsafe {
        match array {
            FRZ_SHALLOW_DEPTH => dst.put("dst", indices.map(|index| length(shallow.depths()[index]))),
            FRZ_SHALLOW_BASE => dst.put("dst", indices.map(|index| height(columns.bases()[index]))),
            FRZ_SHALLOW_CEILING => dst.put("dst", indices.map(|index| height(columns.ceilings()[index]))),
            FRZ_SHALLOW_CELL => dst.put("dst", indices.map(cell)),
            FRZ_SHALLOW_LAYER => dst.put("dst", indices.map(|index| columns.layer(index) as u32)),
            FRZ_SHALLOW_FLUX_EAST => {
                dst.put("dst", indices.map(|index| (f64::from(east[index]) * flow) as f32))
            }
            FRZ_SHALLOW_FLUX_SOUTH => {
                dst.put("dst", indices.map(|index| (f64::from(south[index]) * flow) as f32))
            }
            FRZ_SHALLOW_VELOCITY => dst.put("dst", indices.map(|index| shallow.velocity(index))),
        }
    }
}

/// Lends an array over all column indices, as the solver holds it: nothing is copied.
///
/// array: a frz_shallow_lent, which states the type of the elements.
/// out: receives a view of the packed elements; data NULL with a count of 0 after a failure. The liquid owns the memory, which may be read
///     until frz_shallow_update_terrain, _update_heights, _set_bodies or _destroy; its contents change with whatever changes the liquid.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_lend(
    shallow: *const frz_shallow,
    array: u32,
    out: *mut frz_view,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            clear(out);
            let out = required(out, "out")?;
            let array = meaning("array", "frz_shallow_lent", array, &LENT)?;
            let spill = read(shallow)?;
            let (columns, [east, south]) = (spill.shallow.columns(), spill.shallow.fluxes());
            let data = match array {
                FRZ_SHALLOW_LENT_DEPTH => spill.shallow.depths().as_ptr().cast(),
                FRZ_SHALLOW_LENT_BASE => columns.bases().as_ptr().cast(),
                FRZ_SHALLOW_LENT_CEILING => columns.ceilings().as_ptr().cast(),
                FRZ_SHALLOW_LENT_EAST => east.as_ptr().cast(),
                FRZ_SHALLOW_LENT_SOUTH => south.as_ptr().cast(),
            };
            out.write_unaligned(frz_view { data, count: columns.len(), stride: 4 });
            Ok(())
        }
    })
}

/// The liquid at a point.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_sample {
    /// Height of its surface (m); that of the ground if dry; NaN without a column.
    pub height: f64,
    /// Its depth (m).
    pub depth: f64,
    /// Mean velocity over the depth along x and z (m/s).
    pub velocity: [f32; 2],
    /// Velocity at the surface along x and z (m/s): 1.5 times the mean one.
    pub surface_velocity: [f32; 2],
    /// Index of the column. FRZ_SHALLOW_NO_COLUMN outside the domain and where there is no ground: the other fields are then 0, except
    /// height.
    pub column: u32,
    /// Its layer.
    pub layer: u32,
}

// SAFETY: numbers, without padding.
unsafe impl Plain for frz_shallow_sample {}

/// Reads the liquid at points, in real time (frz_shallow): from the column that contains a point, or else the nearest one above or below
/// it.
///
/// points: double[3] for each (m).
/// dst: room for a frz_shallow_sample for each; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_probe(
    shallow: *const frz_shallow,
    points: frz_view,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; view and span are valid.
    guard(|| unsafe { probe(&read(shallow)?.shallow.view(), &points, &dst) })
}

/// Reads a liquid at a host's points.
///
/// # Safety
/// The view must describe memory that can be read, the span memory that can be written.
pub(in crate::capi) unsafe fn probe(view: &View<'_>, points: &frz_view, dst: &frz_span) -> Outcome {
    let sample = |point: [f64; 3]| match view.at(point) {
        None => frz_shallow_sample {
            height: f64::NAN,
            depth: 0.0,
            velocity: [0.0; 2],
            surface_velocity: [0.0; 2],
            column: FRZ_SHALLOW_NO_COLUMN,
            layer: 0,
        },
        Some(there) => frz_shallow_sample {
            height: there.height,
            depth: there.depth,
            velocity: there.velocity,
            surface_velocity: there.surface_velocity,
            column: there.column as u32,
            layer: there.layer as u32,
        },
    };
    // SAFETY: guaranteed by the caller.
    unsafe { dst.put("dst", points.in_place::<[f64; 3]>("points")?.map(sample)) }
}

/// Reports the volume of liquid in a box: in the cells whose centres lie within it, between its two heights; or on a layer.
///
/// low: double[3], the minimum corner (m), which may be infinite; NULL with high NULL: everywhere.
/// high: double[3], the maximum corner (m).
/// layer: 0 for the lowest columns of all cells, and so on, with low and high NULL; or FRZ_SHALLOW_ALL_LAYERS.
/// volume: receives it (m3; 1 ml is 1e-6); 0 after a failure.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_volume(
    shallow: *const frz_shallow,
    low: *const f64,
    high: *const f64,
    layer: u32,
    volume: *mut f64,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            clear(volume);
            let volume = required(volume, "volume")?;
            let spill = read(shallow)?;
            let view = spill.shallow.view();
            let found = match (low.is_null() && high.is_null(), layer) {
                (true, FRZ_SHALLOW_ALL_LAYERS) => view.volume([f64::NEG_INFINITY; 3], [f64::INFINITY; 3])?,
                (true, layer) => view.layer_volume(layer as usize),
                (false, FRZ_SHALLOW_ALL_LAYERS) => {
                    let corner = |corner: *const f64, name: &str| {
                        let corner = required(corner.cast_mut(), name)?;
                        Outcome::Ok(corner.cast::<[f64; 3]>().read_unaligned())
                    };
                    view.volume(corner(low, "low")?, corner(high, "high")?)?
                }
                (false, _) => {
                    return Err(Failure::argument("layer: a box has no layer: give one of the two"));
                }
            };
            volume.write_unaligned(found);
            Ok(())
        }
    })
}
