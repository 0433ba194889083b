//! Subtracts a sweep from the snow, block by block: snow = max(snow, -sweep), removed = max(snow, sweep).
//!
//! The removed snow is the intersection with the sweep, not a difference of states: base(t) minus base(t + dt) would
//! leave a ghost surface of zero thickness wherever nothing moved.

use super::columns::{CELLS, add_by_cell};
use super::voxel_fill::{self, filled};
use crate::numeric::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};
use crate::sweep::Piece;
use crate::vdb::Probe;

/// The change of one block of the snow.
pub struct Edit {
    /// The snow afterwards.
    pub surface: BlockEdit,
    /// The removed snow; none if the block has none.
    pub removed: Option<BlockEdit>,
    /// Voxels whose value changed.
    pub changed: Mask,
    /// Removed height (cells) in each column of the block.
    pub heights: [f32; CELLS],
}

impl Edit {
    /// Snow removed from the block (cells^3), summed in a fixed order.
    pub fn volume(&self) -> f64 {
        self.heights.iter().map(|&height| f64::from(height)).sum()
    }
}

/// Cell size and band of the snow.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// Cell (m).
    pub cell: f32,
    /// Background of the level set (m): half width x cell.
    pub background: f32,
}

/// Whether a block has snow that a sweep could remove.
pub fn has_snow(probe: &Probe<'_>) -> bool {
    match probe {
        Probe::Leaf(_) => true,
        Probe::Tile { value, .. } => *value < 0.0,
    }
}

/// Subtracts a piece of the sweep from the snow there; none if nothing changes.
pub fn subtract(piece: &Piece, snow: &Probe<'_>, scale: Scale) -> Option<Edit> {
    let tile;
    let (before, mask) = match snow {
        Probe::Leaf(leaf) => (leaf.values, *leaf.mask),
        Probe::Tile { value, .. } => {
            tile = [*value; VOXELS];
            (&tile, [0; 8])
        }
    };
    match piece {
        Piece::Inside(origin) => Some(remove_all(*origin, before, mask, snow, scale)),
        Piece::Near(origin, cells) => remove_part(*origin, before, cells, scale),
    }
}

fn remove_all(origin: Origin, before: &Values, mask: Mask, snow: &Probe<'_>, scale: Scale) -> Edit {
    let removed = match snow {
        Probe::Leaf(_) => BlockEdit::Dense(Block { origin, values: Box::new(*before), mask }),
        Probe::Tile { .. } => BlockEdit::Constant(origin, -scale.background),
    };
    let mut heights = [0.0; CELLS];
    let fractions_before = voxel_fill::fractions(before, scale.cell);
    add_by_cell(&mut heights, |index| fractions_before[index]);
    Edit {
        surface: BlockEdit::Constant(origin, scale.background),
        removed: Some(removed),
        changed: [u64::MAX; 8],
        heights,
    }
}

fn remove_part(origin: Origin, before: &Values, cells: &Values, scale: Scale) -> Option<Edit> {
    let mut after = Box::new([0.0; VOXELS]);
    let mut removed = Box::new([0.0; VOXELS]);
    let mut changed: Mask = [0; 8];
    let mut heights = [0.0; CELLS];
    for index in 0..VOXELS {
        let (snow, sweep) = (before[index], cells[index] * scale.cell);
        let mut left = if -sweep > snow { (-sweep).min(scale.background) } else { snow };
        // Coincident faces, such as those of a sole and the ground under it, leave a shell of zero thickness whose values
        // still count as partly filled: raise the value until the voxel holds no more snow than the difference of the two
        // fractions.
        let is_thin = (0.0..0.5 * scale.cell).contains(&left) && sweep < 0.5 * scale.cell;
        if is_thin && faces_same_way(before, cells, index) {
            let rest = (filled(snow, scale.cell) - filled(sweep, scale.cell)).max(0.0);
            left = left.max((0.5 - rest) * scale.cell);
        }
        let taken = if sweep > snow { sweep } else { snow };
        after[index] = left;
        removed[index] = taken.clamp(-scale.background, scale.background);
        changed[index >> 6] |= u64::from(left != snow) << (index & 63);
    }
    if changed == [0; 8] {
        return None;
    }
    let (fractions_before, fractions_after) =
        (voxel_fill::fractions(before, scale.cell), voxel_fill::fractions(&after, scale.cell));
    add_by_cell(&mut heights, |index| fractions_before[index] - fractions_after[index]);
    let removed = pack(origin, removed, scale);
    let outside = matches!(removed, BlockEdit::Constant(_, value) if value > 0.0);
    Some(Edit {
        surface: pack(origin, after, scale),
        removed: (!outside).then_some(removed),
        changed,
        heights,
    })
}

/// Minimum cosine of the angle between surfaces that face the same way.
const MIN_COSINE: f32 = 0.9;

/// Whether the snow and a sweep face the same way at a voxel.
fn faces_same_way(snow: &Values, sweep: &Values, index: usize) -> bool {
    let (one, other) = (voxel_fill::direction(snow, index), voxel_fill::direction(sweep, index));
    one.zip(other).is_some_and(|([a, b, c], [d, e, f])| a * d + b * e + c * f > MIN_COSINE)
}

/// A block of a level set from distances in cells.
pub fn from_cells(origin: Origin, cells: Box<Values>, scale: Scale) -> BlockEdit {
    packed(Block::of_cells(origin, cells, scale.cell, scale.background), scale)
}

/// A leaf, or a constant if no value lies within the band.
pub fn pack(origin: Origin, values: Box<Values>, scale: Scale) -> BlockEdit {
    packed(Block::of_band(origin, values, scale.background), scale)
}

fn packed(block: Block, scale: Scale) -> BlockEdit {
    let is_outside = block.values[0] > 0.0;
    if block.mask == [0; 8] && block.values.iter().all(|value| (*value > 0.0) == is_outside) {
        let value = if is_outside { scale.background } else { -scale.background };
        return BlockEdit::Constant(block.origin, value);
    }
    BlockEdit::Dense(block)
}
