//! Data on the snow besides its shape: when its surface last changed, and how far its columns are compressed.

use std::collections::{BTreeSet, HashMap};

use rayon::prelude::*;

use super::BaseLayer;
use super::columns::{self, ChangedBlock, Column, Columns, Heights};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};
use crate::vdb::Probe;

impl BaseLayer {
    /// Heights of the column blocks that these changed blocks touch for the first time.
    pub(super) fn new_columns(&self, origins: impl Iterator<Item = Origin>) -> Result<Columns> {
        let columns: BTreeSet<[i32; 2]> = origins.map(column_of).collect();
        let new: Vec<[i32; 2]> =
            columns.into_iter().filter(|column| !self.columns.contains_key(column)).collect();
        let column = |column: [i32; 2]| {
            let original = columns::heights(&self.grids.surface, column, self.low[1], self.high[1])?;
            Ok((column, Column { original }))
        };
        new.into_par_iter().map(column).collect()
    }

    /// Frame numbers at the surface voxels of the changed blocks.
    pub(super) fn touched_edits(&self, changes: &[ChangedBlock<'_>], frame: i32) -> Result<Vec<BlockEdit>> {
        let origins: Vec<Origin> = changes.iter().map(|change| change.surface.origin()).collect();
        let before = self.grids.touched.probe(&origins)?;
        let edit_one = |(change, before): (&ChangedBlock<'_>, &Probe<'_>)| {
            let BlockEdit::Dense(surface) = change.surface else {
                return BlockEdit::Constant(change.surface.origin(), 0.0);
            };
            let (mut values, known) = match before {
                Probe::Leaf(leaf) => (Box::new(*leaf.values), *leaf.mask),
                Probe::Tile { .. } => (Box::new([0.0; VOXELS]), [0; 8]),
            };
            for index in (0..VOXELS).filter(|&index| change.changed[index >> 6] >> (index & 63) & 1 == 1) {
                values[index] = frame as f32;
            }
            let mask: Mask = std::array::from_fn(|x| surface.mask[x] & (known[x] | change.changed[x]));
            masked(surface.origin, values, mask)
        };
        Ok(changes.par_iter().zip(&before).map(edit_one).collect())
    }

    /// Compression at every touched surface voxel of the columns in which blocks change: `surfaces` and `touched` are those blocks after
    /// the change, in the same order; `fresh` are the columns that are touched for the first time.
    pub(super) fn compression_edits(
        &self,
        ctx: &Context,
        fresh: &Columns,
        surfaces: &[&BlockEdit],
        touched: &[BlockEdit],
    ) -> Result<Vec<BlockEdit>> {
        let now: HashMap<Origin, (&BlockEdit, &BlockEdit)> = surfaces
            .iter()
            .zip(touched)
            .map(|(surface, touched)| (surface.origin(), (*surface, touched)))
            .collect();
        let columns: BTreeSet<[i32; 2]> = now.keys().map(|origin| column_of(*origin)).collect();
        let cell = self.grids.surface.voxel_size() as f32;
        let levels = columns::levels(self.low[1], self.high[1]);
        let column_edits = |&[x, z]: &[i32; 2]| -> Result<Vec<BlockEdit>> {
            ctx.check()?;
            let column = fresh.get(&[x, z]).or_else(|| self.columns.get(&[x, z]));
            let column = column.ok_or_else(|| Error::Internal("a changed column is not known".into()))?;
            let origins: Vec<Origin> = levels.clone().map(|y| [x, y, z]).collect();
            let mut heights = Heights::default();
            for (origin, before) in origins.iter().zip(self.grids.surface.probe(&origins)?) {
                match now.get(origin).map(|(surface, _)| surface) {
                    Some(BlockEdit::Dense(block)) => heights.add(&block.values, cell),
                    Some(BlockEdit::Constant(_, value)) => heights.add_constant(*value),
                    None => heights.add_probe(&before, cell),
                }
            }
            let compression = column.compression(&heights);
            let mut out = Vec::new();
            for (origin, before) in origins.iter().zip(self.grids.touched.probe(&origins)?) {
                let mask = match (now.get(origin).map(|(_, touched)| touched), before) {
                    (Some(BlockEdit::Dense(block)), _) => block.mask,
                    (Some(BlockEdit::Constant(..)), _) => [0; 8],
                    (None, Probe::Leaf(leaf)) => *leaf.mask,
                    (None, Probe::Tile { .. }) => continue,
                };
                let values = std::array::from_fn(|index| compression[columns::cell_of(index)]);
                out.push(masked(*origin, Box::new(values), mask));
            }
            Ok(out)
        };
        let columns: Vec<[i32; 2]> = columns.into_iter().collect();
        let parts: Vec<Vec<BlockEdit>> = columns.par_iter().map(column_edits).collect::<Result<_>>()?;
        Ok(parts.into_iter().flatten().collect())
    }
}

/// x and z of the column block that contains a block.
fn column_of([x, _, z]: Origin) -> [i32; 2] {
    [x, z]
}

/// A block whose inactive values are 0; constant if no voxel is active.
fn masked(origin: Origin, mut values: Box<Values>, mask: Mask) -> BlockEdit {
    if mask == [0; 8] {
        return BlockEdit::Constant(origin, 0.0);
    }
    for (word, values) in mask.iter().zip(values.chunks_exact_mut(64)) {
        let mut inactive = !word;
        while inactive != 0 {
            values[inactive.trailing_zeros() as usize] = 0.0;
            inactive &= inactive - 1;
        }
    }
    BlockEdit::Dense(Block { origin, values, mask })
}
