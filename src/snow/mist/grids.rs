//! Mist as grids for files and hosts.

use rayon::prelude::*;

use super::Mist;
use crate::context::Context;
use crate::error::Result;
use crate::flow::{Coord, Tile};
use crate::geometry::DVec3;
use crate::numeric::blocks::{Block, BlockEdit, Mask};
use crate::vdb::{FloatGrid, GridClass, VectorEdit, VectorGrid};

/// Grids of mist, whose voxels are its cells: their centres are offset by half a cell from multiples of the cell size.
pub struct Grids {
    /// `density`: the density of the mist; active where there is mist.
    pub density: FloatGrid,
    /// `vel`: velocity (m/s) of the air at the cells' centres; active in the blocks that hold mist.
    pub velocity: VectorGrid,
}

/// A block of mist.
struct Piece {
    density: Block,
    velocity: VectorEdit,
}

impl Grids {
    /// The grids of some mist.
    ///
    /// # Errors
    /// When memory runs out; cancel.
    pub fn of(ctx: &Context, mist: &Mist) -> Result<Self> {
        let cell = mist.params.cell;
        let half = DVec3::repeat(0.5 * cell);
        let mut density = FloatGrid::new(cell, 0.0)?;
        density.set_class(GridClass::Fog)?;
        density.set_name("density")?;
        density.shift(half)?;
        let mut velocity = VectorGrid::new(cell, [0.0; 3])?;
        velocity.set_name("vel")?;
        velocity.shift(half)?;
        let pieces = ctx.phase("grids", || {
            let held = mist.flow.density().par_iter().enumerate();
            Ok(held.filter_map(|(slot, tile)| piece(mist, slot, tile)).collect::<Vec<_>>())
        })?;
        let (blocks, vectors): (Vec<BlockEdit>, Vec<VectorEdit>) =
            pieces.into_iter().map(|piece| (BlockEdit::Dense(piece.density), piece.velocity)).unzip();
        density.replace_blocks(ctx, &blocks)?;
        velocity.replace_blocks(ctx, &vectors)?;
        Ok(Self { density, velocity })
    }
}

/// The grids' values for a tile; none if it holds no mist.
fn piece(mist: &Mist, slot: usize, tile: &Tile) -> Option<Piece> {
    let mut mask: Mask = [0; 8];
    for (cell, value) in tile.iter().enumerate() {
        mask[cell >> 6] |= u64::from(*value > 0.0) << (cell & 63);
    }
    if mask == [0; 8] {
        return None;
    }
    let coord: Coord = mist.flow.tiles().coords()[slot];
    let origin = coord.map(|x| x * 8);
    let mut values = Box::new([[0.0f32; 3]; 512]);
    let velocity = mist.flow.velocity();
    for (cell, value) in values.iter_mut().enumerate() {
        *value = std::array::from_fn(|axis| {
            let (above, upper) = mist.flow.tiles().adjacent_cell(slot, cell, axis, true);
            0.5 * (velocity[axis][slot][cell] + velocity[axis][above as usize][upper])
        });
    }
    let density = Block { origin, values: Box::new(*tile), mask };
    Some(Piece { density, velocity: VectorEdit::Dense { origin, values, mask: [u64::MAX; 8] } })
}
