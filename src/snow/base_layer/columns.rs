//! Heights of the snow's columns: what compression is measured against.
//!
//! A column of cells (8 x 8 of them make a column block) remembers how much snow stood in it before
//! anything touched it, found when it is first touched: nothing is stored for untouched snow.

use std::collections::{BTreeSet, HashMap};

use rayon::prelude::*;

use crate::base::blocks::{Origin, VOXELS, Values};
use crate::error::Result;
use crate::vdb::{FloatGrid, Probe};

/// Cells of a column block, at `x << 3 | z`.
pub const CELLS: usize = 64;

/// Heights (cells) in one column block.
#[derive(Clone, PartialEq)]
pub struct Column {
    /// Snow before the first touch.
    pub original: [f32; CELLS],
    /// Snow removed since.
    pub removed: [f32; CELLS],
    /// y of the touched blocks' origins.
    pub blocks: BTreeSet<i32>,
}

impl Column {
    /// Part of the original height that is gone, 0..=1, of cell `x << 3 | z`.
    pub fn compression(&self, cell: usize) -> f32 {
        if self.original[cell] > 0.0 {
            (self.removed[cell] / self.original[cell]).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}

/// Column blocks that were touched, by x and z of their origin.
pub type Columns = HashMap<[i32; 2], Column>;

/// Part of a cell that a level set's solid fills, from the distance at its centre (both in metres).
pub fn filled(distance: f32, cell: f32) -> f32 {
    (0.5 - distance / cell).clamp(0.0, 1.0)
}

/// Cell of the column block that voxel `index` of a block stands in.
pub fn cell_of(index: usize) -> usize {
    index >> 3 & !7 | index & 7
}

/// Snow (cells) that stands in a column block now, between two heights (voxels).
pub fn heights(surface: &FloatGrid, [x, z]: [i32; 2], low: i32, high: i32) -> Result<[f32; CELLS]> {
    let origins: Vec<Origin> = (low.div_euclid(8)..=high.div_euclid(8)).map(|y| [x, y * 8, z]).collect();
    let cell = surface.voxel_size() as f32;
    let mut heights = [0.0; CELLS];
    for probe in surface.probe(&origins)? {
        match probe {
            Probe::Leaf(leaf) => add_filled(leaf.values, cell, &mut heights),
            Probe::Tile { value, .. } if value < 0.0 => heights.iter_mut().for_each(|height| *height += 8.0),
            Probe::Tile { .. } => {}
        }
    }
    Ok(heights)
}

/// Volume of a level set's solid (m3): filled parts of cells, summed leaf by leaf in the tree's order.
/// Blocks without a leaf are looked up between two voxels.
pub fn volume(surface: &FloatGrid, low: [i32; 3], high: [i32; 3]) -> Result<f64> {
    let cell = surface.voxel_size() as f32;
    let leaves = surface.leaves()?;
    let parts: Vec<f64> = leaves
        .par_iter()
        .map(|leaf| leaf.values.iter().map(|&value| f64::from(filled(value, cell))).sum())
        .collect();
    let mut cells: f64 = parts.iter().sum();
    let [bx, by, bz] = [0, 1, 2].map(|axis| low[axis].div_euclid(8)..=high[axis].div_euclid(8));
    for x in bx {
        let origins: Vec<Origin> =
            by.clone().flat_map(|y| bz.clone().map(move |z| [x * 8, y * 8, z * 8])).collect();
        for probe in surface.probe(&origins)? {
            if matches!(probe, Probe::Tile { value, .. } if value < 0.0) {
                cells += VOXELS as f64;
            }
        }
    }
    Ok(cells * surface.voxel_size().powi(3))
}

fn add_filled(values: &Values, cell: f32, heights: &mut [f32; CELLS]) {
    for index in 0..VOXELS {
        heights[cell_of(index)] += filled(values[index], cell);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_numbered_by_x_and_z() {
        use crate::base::blocks::offset;
        assert_eq!(cell_of(offset(3, 7, 5)), 3 << 3 | 5);
        assert_eq!(cell_of(offset(7, 0, 0)), 7 << 3);
    }
}
