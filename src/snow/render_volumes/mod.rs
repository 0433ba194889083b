//! Snow for renderers (thesis section 3.5): densities of the base layer and of grains ([`fog`]), and one surface around the base and the
//! grains that rest on it ([`united`]).
//!
//! All grids are sparse and world-fixed. They are built block by block in parallel, with the same result for any number of threads.
//!
//! | word | meaning |
//! |---|---|
//! | fog | a density: 1 where there is snow, 0 where there is none |
//! | falloff | the shell around a sphere in which its density falls from 1 to 0 |
//! | cube | the blocks that are built together: the unit of work |

pub mod fog;
mod spheres;
pub mod united;

use crate::context::Context;
use crate::error::Result;
use crate::numeric::blocks::BlockEdit;
use crate::vdb::FloatGrid;
use rayon::prelude::*;

/// Blocks in memory at once, in addition to the grid that they are put into: 64 MB.
const MAX_BLOCKS: usize = 1 << 15;

/// Builds the blocks of some cubes, `edge` blocks wide, in parallel and puts them into a grid.
fn fill<T: Sync>(
    ctx: &Context,
    grid: &mut FloatGrid,
    edge: usize,
    cubes: &[T],
    blocks: impl Fn(&T) -> Vec<BlockEdit> + Sync,
) -> Result<()> {
    let batch = (MAX_BLOCKS / edge.pow(3)).max(1);
    ctx.expect(cubes.len().div_ceil(batch));
    for batch in cubes.chunks(batch) {
        ctx.check()?;
        let made: Vec<Vec<BlockEdit>> = ctx.pool().install(|| batch.par_iter().map(&blocks).collect());
        let made: Vec<BlockEdit> = made.into_iter().flatten().collect();
        grid.replace_blocks(ctx, &made)?;
        ctx.advance();
    }
    Ok(())
}
