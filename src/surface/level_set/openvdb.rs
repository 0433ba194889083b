//! Signed distances as a level set of OpenVDB.

use super::band::Distances;
use crate::context::Context;
use crate::error::Result;
use crate::numeric::blocks::{Block, BlockEdit, DIM};
use crate::vdb::FloatGrid;

/// Half width of the narrow band (cells).
pub const HALF_WIDTH: f32 = 3.0;

/// The level set (m) of a surface whose distances are known up to at least [`HALF_WIDTH`] cells.
///
/// # Errors
/// Cancel; out of memory.
pub fn level_set(ctx: &Context, distances: &Distances) -> Result<FloatGrid> {
    let cell = distances.cell();
    let width = HALF_WIDTH * cell as f32;
    let mut grid = FloatGrid::level_set(cell, HALF_WIDTH)?;
    let block = |slot: usize| {
        let origin = distances.coords()[slot].map(|at| at * DIM as i32);
        let block = Block::of_cells(origin, Box::new(*distances.values(slot)), cell as f32, width);
        (block.mask != [0; DIM]).then_some(BlockEdit::Dense(block))
    };
    let edits: Vec<BlockEdit> = (0..distances.coords().len()).filter_map(block).collect();
    ctx.check()?;
    grid.replace_blocks(ctx, &edits)?;
    grid.flood_fill()?;
    grid.set_name("surface")?;
    Ok(grid)
}
