//! Point clouds in .vdb files, as OpenVDB's PointDataGrid: any program that supports VDB Points can read them.
//!
//! Every array keeps its numbers in full width (no 16-bit or fixed-point codec), and a value that all points share is stored once per leaf.
//! A file lists the points leaf by leaf and voxel by voxel, and those of a voxel in the order in which they were given. [`order`] returns
//! this order; points that already have it are read back in the same order.

use std::path::Path;

use rayon::prelude::*;

use super::bridge::ffi;
use super::grid::to_meta;
use super::point_arrays::{to_array, warn_of_skipped};
use super::reading::{decode, guard};
use super::write_options::{WriteOptions, codec_number, named_by_content};
use super::{call, fail};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::points::Points;

/// Maximum number of points of a grid: OpenVDB counts those of a leaf in 32 bits, and orders are 32-bit indices.
const MAX_POINTS: usize = u32::MAX as usize;

/// The order of the points in a file, as indices into `cells`; none if they already have this order.
///
/// # Errors
/// More than 2^32 - 1 points; cancel.
pub fn order(ctx: &Context, cells: &[[i32; 3]]) -> Result<Option<Vec<u32>>> {
    if cells.len() > MAX_POINTS {
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
        std::iter::once(positions).chain(points.attributes.iter().map(to_array)).collect();
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
/// As [`to_bytes`], or what the operating system reports.
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
///
/// [`Values`]: crate::geometry::points::Values
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
    warn_of_skipped(path, &skipped);
    Ok(points)
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
