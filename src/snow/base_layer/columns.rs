//! Heights of the snow's columns: what compression is measured against.
//!
//! A column of cells (8 x 8 columns make a column block) stores how much snow it held before anything touched it; nothing is stored for
//! untouched snow. The current height is computed from the snow itself, so that a layer resumed from its grids has the same numbers as one
//! that never stopped.

use std::collections::{BTreeSet, HashMap, HashSet};

use rayon::prelude::*;

use super::voxel_fill::{self, filled};
use crate::error::Result;
use crate::numeric::blocks::{BlockEdit, Mask, Origin, Values};
use crate::vdb::{FloatGrid, Probe};

/// Columns of a column block; their indices are `x << 3 | z`.
pub const CELLS: usize = 64;

/// Height of snow (cells) in each column of a block.
#[derive(Clone, Copy, PartialEq)]
pub struct Heights([f32; CELLS]);

/// A column block that was touched.
#[derive(Clone, PartialEq)]
pub struct Column {
    /// Snow before the first touch.
    pub original: Heights,
}

impl Default for Heights {
    fn default() -> Self {
        Self([0.0; CELLS])
    }
}

impl Heights {
    /// Adds a block's snow.
    pub fn add(&mut self, values: &Values, cell: f32) {
        add_by_cell(&mut self.0, |index| filled(values[index], cell));
    }

    /// Adds a block that is all snow or has none.
    pub fn add_constant(&mut self, value: f32) {
        if value < 0.0 {
            self.0.iter_mut().for_each(|height| *height += 8.0);
        }
    }

    /// Adds the snow of a block of a grid.
    pub fn add_probe(&mut self, probe: &Probe<'_>, cell: f32) {
        match probe {
            Probe::Leaf(leaf) => self.add(leaf.values, cell),
            Probe::Tile { value, .. } => self.add_constant(*value),
        }
    }
}

impl Column {
    /// Fraction 0..=1 of the original height that is gone in each column, when `now` is left.
    pub fn compression(&self, now: &Heights) -> [f32; CELLS] {
        std::array::from_fn(|cell| {
            let (original, now) = (self.original.0[cell], now.0[cell]);
            if original > 0.0 { ((original - now) / original).clamp(0.0, 1.0) } else { 0.0 }
        })
    }
}

/// Column blocks that were touched, by x and z of their origin.
pub type Columns = HashMap<[i32; 2], Column>;

/// Adds a value of each voxel of a block to the sum of its column, from the bottom up.
pub fn add_by_cell(sums: &mut [f32; CELLS], value: impl Fn(usize) -> f32) {
    // Eight columns at a time, in the order of memory.
    for (x, sums) in sums.chunks_exact_mut(8).enumerate() {
        for y in 0..8 {
            sums.iter_mut().enumerate().for_each(|(z, sum)| *sum += value(x << 6 | y << 3 | z));
        }
    }
}

/// Index, in its column block, of the column that contains voxel `index` of a block.
pub fn cell_of(index: usize) -> usize {
    index >> 3 & !7 | index & 7
}

/// y of the blocks between two heights (voxels).
pub fn levels(low: i32, high: i32) -> impl Iterator<Item = i32> + Clone {
    (low.div_euclid(8)..=high.div_euclid(8)).map(|block| block * 8)
}

/// Current height of the snow in a column block, between two heights (voxels).
pub fn heights(surface: &FloatGrid, [x, z]: [i32; 2], low: i32, high: i32) -> Result<Heights> {
    let origins: Vec<Origin> = levels(low, high).map(|y| [x, y, z]).collect();
    let mut heights = Heights::default();
    let cell = surface.voxel_size() as f32;
    surface.probe(&origins)?.iter().for_each(|probe| heights.add_probe(probe, cell));
    Ok(heights)
}

/// The blocks in which the snow differs from that before the first step.
pub fn changed(initial: &FloatGrid, now: &FloatGrid) -> Result<HashSet<Origin>> {
    let mut changed = HashSet::new();
    for [one, other] in [[initial, now], [now, initial]] {
        let leaves = one.leaves()?;
        let origins: Vec<Origin> = leaves.iter().map(|leaf| leaf.origin).collect();
        let probes = other.probe(&origins)?;
        let differs = leaves.par_iter().zip(&probes).map(|(leaf, probe)| match probe {
            Probe::Leaf(there) => leaf.values != there.values,
            Probe::Tile { .. } => true,
        });
        let differs: Vec<bool> = differs.collect();
        changed
            .extend(origins.iter().zip(differs).filter(|(_, differs)| *differs).map(|(origin, _)| *origin));
    }
    Ok(changed)
}

/// The column blocks that contain changed blocks.
pub fn touched(initial: &FloatGrid, changed: &HashSet<Origin>, low: i32, high: i32) -> Result<Columns> {
    let columns: BTreeSet<[i32; 2]> = changed.iter().map(|[x, _, z]| [*x, *z]).collect();
    columns
        .into_iter()
        .map(|column| Ok((column, Column { original: heights(initial, column, low, high)? })))
        .collect()
}

/// Volume of a level set's solid (m3): filled fractions of cells, summed leaf by leaf in the tree's order, plus full blocks without a leaf,
/// from the block of voxel `low` to that of voxel `high`.
pub fn volume(surface: &FloatGrid, low: [i32; 3], high: [i32; 3]) -> Result<f64> {
    let cell = surface.voxel_size() as f32;
    let leaves = surface.leaves()?;
    let parts: Vec<f64> = leaves.par_iter().map(|leaf| voxel_fill::volume(leaf.values, cell)).collect();
    let mut cells: f64 = parts.iter().sum();
    // The bounding box of a stray leaf can contain too many blocks to visit one by one; the tree's tiles are few.
    for tile in surface.tiles()?.iter().filter(|tile| tile.value < 0.0) {
        let along = |axis: usize| {
            let (begin, end) = (i64::from(low[axis]) & !7, (i64::from(high[axis]) & !7) + 8);
            let own = i64::from(tile.origin[axis]);
            (end.min(own + i64::from(tile.edge)) - begin.max(own)).max(0) as f64
        };
        cells += along(0) * along(1) * along(2);
    }
    Ok(cells * surface.voxel_size().powi(3))
}

/// A block of the new snow that differs from the old one.
pub struct ChangedBlock<'a> {
    /// The new snow.
    pub surface: &'a BlockEdit,
    /// Voxels whose value changed.
    pub changed: &'a Mask,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_numbered_by_x_and_z() {
        use crate::numeric::blocks::offset;
        assert_eq!(cell_of(offset(3, 7, 5)), 3 << 3 | 5);
        assert_eq!(cell_of(offset(7, 0, 0)), 7 << 3);
    }
}
