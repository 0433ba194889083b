//! The arrays of points on the C++ side.

use std::path::Path;

use cxx::UniquePtr;

use super::bridge::ffi;
use super::refusal::cannot_read;
use super::uncancellable_call;
use crate::geometry::DVec3;
use crate::geometry::points::{Attribute, Column, Points, Values};

/// Warns about the attributes of a file that were omitted.
pub(in crate::vdb) fn warn_of_skipped(path: &Path, skipped: &[String]) {
    if !skipped.is_empty() {
        let list = skipped.join(", ");
        log::warn!("{}: attributes of types that are not read are left out: {list}", path.display());
    }
}

/// An attribute in the form that the C++ side takes.
pub(in crate::vdb) fn to_array(attribute: &Attribute) -> ffi::PointArray {
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
pub(in crate::vdb) fn kind(values: &Values) -> i32 {
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
pub(in crate::vdb) fn of_grid(
    grid: &UniquePtr<ffi::PointGrid>,
) -> std::result::Result<(Points, Vec<String>), String> {
    let fault = |error: cxx::Exception| cannot_read(&error);
    let head = ffi::points_head(grid, &uncancellable_call()).map_err(fault)?;
    let out_of_memory = || "the .vdb file is damaged, or needs more memory than it may take".to_string();
    let mut cells = zeros::<[i32; 3]>(head.count).ok_or_else(out_of_memory)?;
    ffi::point_cells(grid, &uncancellable_call(), cells.as_flattened_mut()).map_err(fault)?;
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
                let mut values = zeros::<$type>(count).ok_or_else(out_of_memory)?;
                let address = values.as_mut_ptr() as usize;
                // SAFETY: `values` has room for `count` values of the type with this number.
                unsafe { ffi::point_values(grid, &uncancellable_call(), name, *kind, address, count) }
                    .map_err(fault)?;
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
    reassign_voxels(&mut points, &head)?;
    points.validate().map_err(|error| error.to_string())?;
    Ok((points, skipped))
}

/// Zeros, or none when memory runs out.
fn zeros<T: Copy + Default>(count: usize) -> Option<Vec<T>> {
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
fn reassign_voxels(points: &mut Points, head: &ffi::PointsHead) -> std::result::Result<(), String> {
    if !head.is_linear {
        return Err(format!("grid \"{}\" has points in a space that is not linear", head.name));
    }
    // Row vectors stand on the left of the matrix: element (row, column) is at 4 x row + column.
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
    let reassigned = Points::at(head.voxel, &positions).map_err(|error| error.to_string())?;
    (points.cells, points.offsets) = (reassigned.cells, reassigned.offsets);
    Ok(())
}
