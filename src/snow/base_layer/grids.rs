//! The grids of a layer: complete, or only the blocks that a step changed.

use super::empty_removed;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::blocks::{Block, BlockEdit, VOXELS};
use crate::vdb::{FloatGrid, Leaf, MetaValue, PreparedBlocks};

/// Metadata of `surface`: the snow's volume (m3), exactly as the layer computes it.
const VOLUME: &str = "volume_m3";

/// The grids of a layer: everything that its next step depends on, besides the layer before the first step.
pub struct Grids {
    /// The snow (level set, m).
    pub surface: FloatGrid,
    /// Fraction of the column's height that was removed, at touched surface voxels, 0..=1.
    pub compression: FloatGrid,
    /// Frame of the last change, at touched surface voxels.
    pub touched: FloatGrid,
}

/// The changes of a step, block by block: applied to the grids before the step, they give those after it.
pub struct Changes {
    pub(super) surface: Vec<BlockEdit>,
    pub(super) compression: Vec<BlockEdit>,
    pub(super) touched: Vec<BlockEdit>,
    /// The blocks of `surface` as they were before the step.
    pub(super) before: Vec<BlockEdit>,
    /// The snow that the step removed (level set).
    pub removed: FloatGrid,
    /// Snow left (m3).
    pub volume: f64,
}

impl Grids {
    /// Untouched snow.
    ///
    /// # Errors
    /// When memory runs out.
    pub(super) fn new(mut surface: FloatGrid, volume: f64) -> Result<Self> {
        surface.set_name("surface")?;
        surface.set_metadata(VOLUME, MetaValue::Double(volume))?;
        let cell = surface.voxel_size();
        Ok(Self {
            surface,
            compression: empty_named(cell, "compression")?,
            touched: empty_named(cell, "touched")?,
        })
    }

    /// A copy that shares no memory.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn deep_copy(&self) -> Result<Self> {
        Ok(Self {
            surface: self.surface.deep_copy()?,
            compression: self.compression.deep_copy()?,
            touched: self.touched.deep_copy()?,
        })
    }

    /// Extracts the grids from those of a file, by name.
    ///
    /// # Errors
    /// Names the grid that is missing or has no volume.
    pub fn from_named(mut grids: Vec<FloatGrid>) -> Result<Self> {
        let mut take = |name: &str| {
            let found = grids.iter().position(|grid| grid.name() == name);
            let none = || Error::argument(format!("there is no grid \"{name}\""));
            found.map(|at| grids.remove(at)).ok_or_else(none)
        };
        let all =
            Self { surface: take("surface")?, compression: take("compression")?, touched: take("touched")? };
        all.volume()?;
        Ok(all)
    }

    /// The grids, in the order of a file.
    pub fn list(&self) -> [&FloatGrid; 3] {
        [&self.surface, &self.compression, &self.touched]
    }

    fn list_mut(&mut self) -> [&mut FloatGrid; 3] {
        [&mut self.surface, &mut self.compression, &mut self.touched]
    }

    /// The snow's volume (m3).
    ///
    /// # Errors
    /// When it is missing from the metadata of `surface`.
    pub fn volume(&self) -> Result<f64> {
        let metadata = self.surface.metadata()?;
        match metadata.iter().find(|(key, _)| key == VOLUME) {
            Some((_, MetaValue::Double(volume))) => Ok(*volume),
            _ => Err(Error::argument(format!("grid \"surface\" has no metadata {VOLUME}"))),
        }
    }

    /// Applies a step's changes.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn apply(&mut self, ctx: &Context, changes: &Changes) -> Result<()> {
        // All memory is allocated before any change is applied.
        let edits = changes.edits().into_iter();
        let ready = edits.map(|edits| PreparedBlocks::new(ctx, edits)).collect::<Result<Vec<_>>>()?;
        self.list_mut().into_iter().zip(ready).try_for_each(|(grid, ready)| grid.put(ready))?;
        self.surface.set_metadata(VOLUME, MetaValue::Double(changes.volume))
    }

    /// A step's changes as grids that have a leaf for every block that changed, and nothing else.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn delta(ctx: &Context, cell: f64, half_width: f32, changes: &Changes) -> Result<Self> {
        let mut delta = Self::new(FloatGrid::level_set(cell, half_width)?, changes.volume)?;
        for (grid, edits) in delta.list_mut().into_iter().zip(changes.edits()) {
            // A constant block becomes a leaf without active voxels: a tile could not be distinguished from an absent
            // block.
            let (constant, dense): (Vec<&BlockEdit>, Vec<&BlockEdit>) =
                edits.iter().partition(|edit| matches!(edit, BlockEdit::Constant(..)));
            let as_leaf = |edit: &&BlockEdit| match edit {
                BlockEdit::Constant(origin, value) => BlockEdit::Dense(Block {
                    origin: *origin,
                    values: Box::new([*value; VOXELS]),
                    mask: [0; 8],
                }),
                BlockEdit::Dense(block) => BlockEdit::Dense(block.clone()),
            };
            let leaves: Vec<BlockEdit> = constant.iter().chain(&dense).map(as_leaf).collect();
            grid.replace_blocks(ctx, &leaves)?;
        }
        Ok(delta)
    }

    /// Applies a delta's blocks.
    ///
    /// # Errors
    /// Another cell size; no volume; when memory runs out.
    pub fn apply_delta(&mut self, ctx: &Context, delta: &Self) -> Result<()> {
        if delta.surface.voxel_size() != self.surface.voxel_size() {
            return Err(Error::argument("the changes have cells of another size"));
        }
        for (grid, changed) in self.list_mut().into_iter().zip(delta.list()) {
            let edits: Vec<BlockEdit> = changed.leaves()?.iter().map(block_of).collect();
            grid.replace_blocks(ctx, &edits)?;
        }
        self.surface.set_metadata(VOLUME, MetaValue::Double(delta.volume()?))
    }
}

impl Changes {
    /// The blocks of each grid, in the order of [`Grids::list`].
    fn edits(&self) -> [&[BlockEdit]; 3] {
        [&self.surface, &self.compression, &self.touched]
    }

    /// No changes.
    pub(super) fn none(grids: &Grids, half_width: f32) -> Result<Self> {
        let removed = empty_removed(grids.surface.voxel_size(), half_width)?;
        let (surface, compression, touched, before) = Default::default();
        Ok(Self { surface, compression, touched, before, removed, volume: grids.volume()? })
    }
}

/// A leaf as a block; one without active voxels is constant.
fn block_of(leaf: &Leaf<'_>) -> BlockEdit {
    let uniform = leaf.values.iter().all(|value| *value == leaf.values[0]);
    if *leaf.mask == [0; 8] && uniform {
        return BlockEdit::Constant(leaf.origin, leaf.values[0]);
    }
    BlockEdit::Dense(leaf.to_block())
}

fn empty_named(cell: f64, name: &str) -> Result<FloatGrid> {
    let mut grid = FloatGrid::new(cell, 0.0)?;
    grid.set_name(name)?;
    Ok(grid)
}
