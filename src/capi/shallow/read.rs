//! Reads shallow liquid: arrays of columns, samples at points, volumes in boxes.

use std::ffi::c_void;

use super::calls::informs;
use super::handle::frz_shallow;
use crate::capi::ffi::*;
use crate::shallow::{Shallow, View};

/// Properties of a shallow liquid.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_info {
    /// sizeof(frz_shallow_info), set by the caller.
    pub struct_size: u32,
    /// Maximum number of columns above each other in a cell.
    pub layers: u32,
    /// Number of column indices: 16 for each strip (16 cells along x on one layer) that has a column. Some indices may have no column.
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

sized32!(frz_shallow_info);

/// A layer index that means all layers, for frz_shallow_volume.
pub const FRZ_SHALLOW_ALL_LAYERS: u32 = 0xffff_ffff;

/// A column index that means no column, in frz_shallow_sample.
pub const FRZ_SHALLOW_NO_COLUMN: u32 = 0xffff_ffff;

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

const ARRAYS: Meanings<frz_shallow_array, 8> = numbered! {
    FRZ_SHALLOW_DEPTH, FRZ_SHALLOW_BASE, FRZ_SHALLOW_CEILING, FRZ_SHALLOW_CELL, FRZ_SHALLOW_LAYER,
    FRZ_SHALLOW_FLUX_EAST, FRZ_SHALLOW_FLUX_SOUTH, FRZ_SHALLOW_VELOCITY
};

const LENT: Meanings<fn(&Shallow) -> *const c_void, 5> = [
    (FRZ_SHALLOW_LENT_DEPTH as u32, |shallow| shallow.depths().as_ptr().cast()),
    (FRZ_SHALLOW_LENT_BASE as u32, |shallow| shallow.columns().bases().as_ptr().cast()),
    (FRZ_SHALLOW_LENT_CEILING as u32, |shallow| shallow.columns().ceilings().as_ptr().cast()),
    (FRZ_SHALLOW_LENT_EAST as u32, |shallow| shallow.fluxes()[0].as_ptr().cast()),
    (FRZ_SHALLOW_LENT_SOUTH as u32, |shallow| shallow.fluxes()[1].as_ptr().cast()),
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        informs(info, || {
            let shallow = &read(shallow)?.shallow;
            let columns = shallow.columns();
            Ok(frz_shallow_info {
                struct_size: 0,
                layers: shallow.view().layers() as u32,
                index_count: columns.len() as u64,
                column_count: columns.count() as u64,
                cell: columns.grid.cell,
                low: columns.heights.low,
                unit: columns.heights.unit,
                time: shallow.time(),
                last_step: shallow.last_step(),
            })
        })
    }
}

/// Copies an array of columns.
///
/// array: a frz_shallow_array, which states the type of the elements.
/// columns: uint32_t, the index of each requested column; data NULL with a count of 0: all indices, in order.
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
    // SAFETY: the liquid is NULL or alive; view and span are valid.
    guard(|| unsafe {
        let array = meaning("array", "frz_shallow_array", array, &ARRAYS)?;
        let shallow = &read(shallow)?.shallow;
        let (all, requested) =
            (shallow.columns(), Requested { columns, dst, count: shallow.columns().len() });
        let heights = all.heights;
        let length = |units: i32| heights.length(f64::from(units)) as f32;
        let height = |units: i32| heights.metres(units) as f32;
        let flow = all.grid.cell * all.grid.cell * heights.unit / shallow.last_step();
        let [east, south] =
            shallow.fluxes().map(|flux| move |index: usize| (f64::from(flux[index]) * flow) as f32);
        let cell = |index: usize| match all.is_column(index) {
            true => all.cell(index).map(|at| at as i32),
            false => [-1; 2],
        };
        match array {
            FRZ_SHALLOW_DEPTH => requested.copy(|index| length(shallow.depths()[index])),
            FRZ_SHALLOW_BASE => requested.copy(|index| height(all.bases()[index])),
            FRZ_SHALLOW_CEILING => requested.copy(|index| height(all.ceilings()[index])),
            FRZ_SHALLOW_CELL => requested.copy(cell),
            FRZ_SHALLOW_LAYER => requested.copy(|index| all.layer(index) as u32),
            FRZ_SHALLOW_FLUX_EAST => requested.copy(east),
            FRZ_SHALLOW_FLUX_SOUTH => requested.copy(south),
            FRZ_SHALLOW_VELOCITY => requested.copy(|index| shallow.velocity(index)),
        }
    })
}

/// The columns that a host requests, out of `count` indices, and its memory for their values.
pub(in crate::capi) struct Requested {
    pub columns: frz_view,
    pub dst: frz_span,
    pub count: usize,
}

impl Requested {
    /// Copies the value of each column, or of all indices if there is no list of columns.
    ///
    /// # Safety
    /// View and span must describe memory that can be read and written.
    pub(in crate::capi) unsafe fn copy<T: Plain>(&self, value: impl Fn(usize) -> T) -> Outcome {
        let Self { columns, dst, count } = self;
        // SAFETY: guaranteed by the caller.
        unsafe {
            if columns.data.is_null() && columns.count == 0 {
                return dst.put("dst", (0..*count).map(value));
            }
            let indices = columns.in_place::<u32>("columns")?;
            dst.check_room("dst", indices.len())?;
            if let Some((at, index)) =
                indices.clone().enumerate().find(|(_, index)| *index as usize >= *count)
            {
                let text = format!(
                    "columns: element {at}, {index}, is out of range: there are {count} column indices"
                );
                return Err(Failure::argument(text));
            }
            dst.put("dst", indices.map(|index| value(index as usize)))
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(out, "out", || {
            let data = meaning("array", "frz_shallow_lent", array, &LENT)?;
            let shallow = &read(shallow)?.shallow;
            Ok(frz_view { data: data(shallow), count: shallow.columns().len(), stride: 4 })
        })
    })
}

/// The liquid at a point.
#[repr(C)]
#[derive(Clone, Copy, Default)]
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

/// Reads the liquid at points (a real-time call: see frz_shallow): from the column that contains a point, or else the nearest one above or
/// below it.
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

/// Samples a liquid at a host's points.
///
/// # Safety
/// The view must describe memory that can be read, the span memory that can be written.
pub(in crate::capi) unsafe fn probe(view: &View<'_>, points: &frz_view, dst: &frz_span) -> Outcome {
    let sample = |point: [f64; 3]| match view.at(point) {
        None => frz_shallow_sample {
            height: f64::NAN,
            column: FRZ_SHALLOW_NO_COLUMN,
            ..frz_shallow_sample::default()
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(volume, "volume", || {
            let liquid = read(shallow)?;
            let view = liquid.shallow.view();
            Ok(match (low.is_null() && high.is_null(), layer) {
                (true, FRZ_SHALLOW_ALL_LAYERS) => view.volume([f64::NEG_INFINITY; 3], [f64::INFINITY; 3])?,
                (true, layer) => view.layer_volume(layer as usize),
                (false, FRZ_SHALLOW_ALL_LAYERS) => {
                    view.volume(numbers(low, "low")?, numbers(high, "high")?)?
                }
                (false, _) => {
                    return Err(Failure::argument("layer: give either a layer or a box, not both"));
                }
            })
        })
    })
}
