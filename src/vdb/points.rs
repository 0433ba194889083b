//! Point clouds in .vdb files, as OpenVDB's PointDataGrid: any program that supports VDB Points can read them.
//!
//! Every array keeps its numbers in full width (no 16-bit or fixed-point codec), and a value that all points share is stored once per leaf.
//! A file lists the points leaf by leaf and voxel by voxel, and those of a voxel in the order in which they were given. [`order`] returns
//! this order; points that already have it are read back in the same order.

use std::path::Path;

use cxx::UniquePtr;
use rayon::prelude::*;

use super::bridge::ffi;
use super::file::{WriteOptions, codec_number, named_by_content};
use super::grid::to_meta;
use super::reading::{decode, guard};
use super::{alone, call, fail};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::geometry::points::{Attribute, Column, Points, Values};

/// Maximum number of points of a grid: OpenVDB counts those of a leaf in 32 bits, and orders are 32-bit indices.
const MOST: usize = u32::MAX as usize;

/// The order of the points in a file, as indices into `cells`; none if they already have this order.
///
/// # Errors
/// More than 2^32 - 1 points; cancel.
pub fn order(ctx: &Context, cells: &[[i32; 3]]) -> Result<Option<Vec<u32>>> {
    if cells.len() > MOST {
        return Err(Error::argument(format!("{} points are too many for a grid", cells.len())));
    }
    ctx.check()?;
    ctx.pool().install(|| {
        let keys: Vec<u128> = cells.par_iter().map(|cell| key(*cell)).collect();
        if keys.is_sorted() {
            return Ok(None);
        }
        let mut order: Vec<u32> = (0..cells.len() as u32).collect();
        // Equal cells stay in the order of their indices, which are part of the key.
        order.par_sort_unstable_by_key(|&point| (keys[point as usize], point));
        Ok(Some(order))
    })
}

/// Sort key of a voxel in the order of OpenVDB's tree: cubes of 4096 voxels by x, then y, then z; within them cubes of 128; within those
/// leaves of 8; within those voxels.
fn key(cell: [i32; 3]) -> u128 {
    // Flipping the sign bit maps the minimum coordinate to 0.
    let cell = cell.map(|part| (part as u32) ^ (1 << 31));
    let level = |shift: u32, bits: u32| {
        cell.iter().fold(0u128, |key, part| key << bits | u128::from(part >> shift & ((1 << bits) - 1)))
    };
    level(12, 20) << 36 | level(7, 5) << 21 | level(3, 4) << 9 | level(0, 3)
}

/// The bytes of a .vdb file that holds points as a grid of this name; the same bytes for the same points and any number of threads. Numbers
/// keep 32 bits: `options.half` has no effect. A file without points has no attributes.
///
/// # Errors
/// As [`Points::validate`] and [`order`]; when memory runs out; cancel.
pub fn to_bytes(ctx: &Context, name: &str, points: &Points, options: &WriteOptions) -> Result<Vec<u8>> {
    points.validate()?;
    let order = order(ctx, &points.cells)?;
    let at = |n: usize| points.cells[order.as_ref().map_or(n, |order| order[n] as usize)];
    let leaf = |n: usize| at(n).map(|part| part >> 3);
    let count = points.count();
    let starts: Vec<usize> = (0..count).filter(|&n| n == 0 || leaf(n) != leaf(n - 1)).collect();
    let positions = ffi::PointArray {
        name: "P".into(),
        kind: 4,
        uniform: false,
        address: points.offsets.as_ptr() as usize,
    };
    let arrays: Vec<ffi::PointArray> =
        std::iter::once(positions).chain(points.attributes.iter().map(array)).collect();
    let (call, _running) = call(ctx);
    let (cells, order) = (points.cells.as_flattened(), order.as_deref().unwrap_or_default());
    let grid =
        ffi::make_points(&call, points.voxel_size, name, cells, &arrays, order, &starts).map_err(fail)?;
    let meta: Vec<ffi::Meta> = options.metadata.iter().map(|(key, value)| to_meta(key, value)).collect();
    let bytes = ffi::points_to_bytes(&grid, codec_number(options.compression), &meta).map_err(fail)?;
    Ok(named_by_content(&bytes))
}

/// Writes points to a file, atomically: see [`to_bytes`].
///
/// # Errors
/// As there, or what the operating system reports.
pub fn write(ctx: &Context, path: &Path, name: &str, points: &Points, options: &WriteOptions) -> Result<()> {
    crate::io::files::atomic::write_bytes(path, &to_bytes(ctx, name, points, options)?)
}

/// The points of the grid of that name; without a name, those of the file's first point grid. Codecs of 16 and 8 bits are decoded;
/// attributes of types that [`Values`] does not support are omitted and named in a warning, groups are omitted without one. A transform
/// other than a voxel size is applied to the positions.
///
/// In a program that called [`guard::install`], files that are not its own are decoded by another process.
///
/// # Errors
/// A file that is missing, empty, cut short or damaged; no such grid (the file's grids are named); numbers that are not finite.
pub fn read(path: &Path, name: Option<&str>) -> Result<Points> {
    match guard::of(path) {
        Some(guard) => guard.read_points(path, name),
        None => read_own(path, name),
    }
}

/// As [`read`], always in this process: for files whose content is known by its hash.
///
/// # Errors
/// As [`read`].
pub fn read_own(path: &Path, name: Option<&str>) -> Result<Points> {
    let (points, skipped) = decode::read_points(path, name)?;
    warn_of(path, &skipped);
    Ok(points)
}

/// Warns about the attributes of a file that were omitted.
pub(super) fn warn_of(path: &Path, skipped: &[String]) {
    if !skipped.is_empty() {
        let list = skipped.join(", ");
        log::warn!("{}: attributes of types that are not read are left out: {list}", path.display());
    }
}

/// An attribute in the form that the C++ side takes.
fn array(attribute: &Attribute) -> ffi::PointArray {
    fn address<T: Copy>(column: &Column<T>) -> usize {
        column.stored().as_ptr() as usize
    }
    let address = match &attribute.values {
        Values::Float(column) => address(column),
        Values::Int(column) => address(column),
        Values::Long(column) => address(column),
        Values::Bool(column) => address(column),
        Values::Vector(column) => address(column),
    };
    let kind = kind(&attribute.values);
    ffi::PointArray { name: attribute.name.clone(), kind, uniform: attribute.values.is_uniform(), address }
}

/// The number of a type, in the order of `PointKind` in points.cc.
pub(super) fn kind(values: &Values) -> i32 {
    match values {
        Values::Float(_) => 0,
        Values::Int(_) => 1,
        Values::Long(_) => 2,
        Values::Bool(_) => 3,
        Values::Vector(_) => 4,
    }
}

/// The points of a grid of a file, and the names and types of the omitted attributes.
///
/// # Errors
/// As [`read`], as a message to be appended to the name of the file.
pub(super) fn of_grid(
    grid: &UniquePtr<ffi::PointGrid>,
) -> std::result::Result<(Points, Vec<String>), String> {
    let fault = |error: cxx::Exception| decode::cannot_read(&error);
    let head = ffi::points_head(grid, &alone()).map_err(fault)?;
    let out_of_memory = || "the .vdb file is damaged, or needs more memory than it may take".to_string();
    let mut cells = room::<[i32; 3]>(head.count).ok_or_else(out_of_memory)?;
    ffi::point_cells(grid, &alone(), cells.as_flattened_mut()).map_err(fault)?;
    let mut points = Points { voxel_size: head.voxel, cells, offsets: Vec::new(), attributes: Vec::new() };
    let mut skipped = Vec::new();
    for attribute in &head.attributes {
        let ffi::PointAttribute { name, type_name, kind, uniform } = attribute;
        let count = if *uniform { 1 } else { head.count };
        // The positions are an array even if all points lie at the centre of their voxel.
        let is_position = name == "P";
        let count = if is_position { head.count } else { count };
        macro_rules! column {
            ($type:ty, $values:expr) => {{
                let mut values = room::<$type>(count).ok_or_else(out_of_memory)?;
                let address = values.as_mut_ptr() as usize;
                // SAFETY: `values` has room for `count` values of the type with this number.
                unsafe { ffi::point_values(grid, &alone(), name, *kind, address, count) }.map_err(fault)?;
                $values(values)
            }};
        }
        let values = match kind {
            0 => column!(f32, |values| Values::Float(shared(values, *uniform))),
            1 => column!(i32, |values| Values::Int(shared(values, *uniform))),
            2 => column!(i64, |values| Values::Long(shared(values, *uniform))),
            3 => column!(u8, |values: Vec<u8>| {
                let values = values.into_iter().map(|byte| byte != 0).collect();
                Values::Bool(shared(values, *uniform))
            }),
            4 if is_position => {
                points.offsets = column!([f32; 3], |values| values);
                continue;
            }
            4 => column!([f32; 3], |values| Values::Vector(shared(values, *uniform))),
            _ => {
                skipped.push(format!("\"{name}\" ({type_name})"));
                continue;
            }
        };
        points.attributes.push(Attribute { name: name.clone(), values });
    }
    if points.offsets.len() != points.cells.len() {
        return Err("the .vdb file is damaged, or its points have no positions".into());
    }
    position(&mut points, &head)?;
    points.validate().map_err(|error| error.to_string())?;
    Ok((points, skipped))
}

/// Zeros, or none when memory runs out.
fn room<T: Copy + Default>(count: usize) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, T::default());
    Some(values)
}

fn shared<T: Copy>(values: Vec<T>, uniform: bool) -> Column<T> {
    match values.first() {
        Some(&value) if uniform => Column::Uniform(value),
        _ => Column::Each(values),
    }
}

/// Assigns positions to voxels anew, if the file has a transform other than a voxel size or stores points outside their voxels.
fn position(points: &mut Points, head: &ffi::PointsHead) -> std::result::Result<(), String> {
    if !head.is_linear {
        return Err(format!("grid \"{}\" has points in a space that is not linear", head.name));
    }
    // Row vectors are multiplied from the left: element (row, column) is at 4 x row + column.
    let m = &head.to_world;
    let identity = |n: usize| match n {
        0 | 5 | 10 => head.voxel,
        15 => 1.0,
        _ => 0.0,
    };
    let is_own = (0..16).all(|n| m[n] == identity(n));
    let inside = |offset: &[f32; 3]| offset.iter().all(|part| (-0.5..=0.5).contains(part));
    if is_own && points.offsets.iter().all(inside) {
        return Ok(());
    }
    let world = |(cell, offset): (&[i32; 3], &[f32; 3])| {
        let index = [0, 1, 2].map(|axis| f64::from(cell[axis]) + f64::from(offset[axis]));
        DVec3::from(
            [0, 1, 2].map(|to| m[12 + to] + (0..3).map(|from| index[from] * m[4 * from + to]).sum::<f64>()),
        )
    };
    let positions: Vec<DVec3> = points.cells.iter().zip(&points.offsets).map(world).collect();
    let placed = Points::at(head.voxel, &positions).map_err(|error| error.to_string())?;
    (points.cells, points.offsets) = (placed.cells, placed.offsets);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_follow_the_levels_of_the_tree() {
        let ascending = [
            [-4097, 5000, 9],
            [-1, -1, -1],
            [0, 0, 0],
            [0, 0, 1],
            [1, 0, 0],
            [7, 7, 7],
            [0, 0, 8],
            [8, 0, 0],
            [0, 0, 128],
            [0, 128, 0],
            [4095, 4095, 4095],
            [0, 0, 4096],
            [4096, -5000, 0],
        ];
        assert!(ascending.map(key).is_sorted_by(|a, b| a < b));
    }
}
