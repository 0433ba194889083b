//! Level sets of OpenVDB: of signed distances, and of the union of spheres around particles, which is the fastest preview of a liquid.

use rayon::prelude::*;

use super::band::Distances;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::coords::{around, cell_of};
use crate::geometry::{Coord, DVec3};
use crate::numeric::blocks::{Block, BlockEdit, DIM, VOXELS};
use crate::vdb::FloatGrid;
use crate::vdb::level_set::from_particles;

/// Half width of the narrow band (cells).
pub const HALF_WIDTH: f32 = 3.0;
/// Minimum radius (cells): OpenVDB leaves smaller spheres out, as they may lie between nodes.
const MIN_RADIUS: f64 = 1.5;
/// Maximum radius (cells): the inside of each sphere is filled node by node.
const MAX_RADIUS: f64 = 100.0;
/// Tolerance for rounding: OpenVDB takes radii of 32 bits.
const ROUNDING: f64 = 1e-6;
/// Farthest node from the origin, on each axis.
const FARTHEST: f64 = (1 << 29) as f64;
/// Bytes of a block: its nodes, in the grid and in a thread's part of it.
const BYTES: u64 = 2 * (4 * VOXELS as u64 + 100);
/// What needs the memory, for messages.
const WHAT: &str = "the spheres around particles (larger cells need less)";

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

/// Whether spheres of a radius (m) can be made on cells of `cell` (m): 1.5 to 100 cells are allowed.
pub fn is_sphere_radius(radius: f64, cell: f64) -> bool {
    (MIN_RADIUS * (1.0 - ROUNDING)..=MAX_RADIUS).contains(&(radius / cell))
}

/// Level set (m) of the union of spheres of a radius (m) around positions (m), on cells of `cell` (m), with a band of three cells on each
/// side. Where spheres overlap, values inside are nearer to 0 than the true distance.
///
/// # Errors
/// A radius that is not within 1.5 to 100 cells; a position that is not finite or too far from the origin; more memory than the
/// context allows; cancel.
pub fn spheres(ctx: &Context, positions: &[DVec3], radius: f64, cell: f64) -> Result<FloatGrid> {
    let cells = radius / cell;
    if !is_sphere_radius(radius, cell) {
        return Err(Error::argument(format!(
            "the radius of the spheres, {radius} m, is {cells:.3} cells of {cell} m: it must be 1.5 to 100 cells"
        )));
    }
    let is_near = |position: &DVec3| position.iter().all(|x| x.abs() + radius < FARTHEST * cell);
    if let Some(far) = positions.iter().position(|position| !is_near(position)) {
        return Err(Error::argument(format!(
            "particle {} is not finite, or too far from the origin for cells of {cell} m",
            far + 1
        )));
    }
    ctx.allow(WHAT, max_blocks(positions, cells + f64::from(HALF_WIDTH), cell).saturating_mul(BYTES))?;
    let radius = radius.max(MIN_RADIUS * cell * (1.0 + ROUNDING)) as f32;
    let mut grid = from_particles(ctx, positions, &vec![radius; positions.len()], cell, HALF_WIDTH)?;
    grid.set_name("surface")?;
    Ok(grid)
}

/// Upper bound on the count of blocks within `reach` (cells) of positions (m): the blocks in the cubes, with edges of at least `reach`,
/// that contain positions, and in the cubes around these.
fn max_blocks(positions: &[DVec3], reach: f64, cell: f64) -> u64 {
    let blocks = (reach / DIM as f64).ceil();
    let edge = blocks * DIM as f64 * cell;
    let mut cubes: Vec<Coord> = positions.par_iter().map(|position| cell_of(&(position / edge))).collect();
    cubes.par_sort_unstable();
    cubes.dedup();
    let mut cubes: Vec<Coord> = cubes.into_iter().flat_map(around).collect();
    cubes.par_sort_unstable();
    cubes.dedup();
    cubes.len() as u64 * (blocks as u64).pow(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::context;
    use crate::vdb::level_set::{measure, to_mesh};

    #[test]
    fn a_sphere_has_its_volume_and_two_apart_have_twice_that() {
        let ctx = context(2);
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.2f64.powi(3);
        for (positions, count) in
            [(vec![DVec3::repeat(0.013)], 1.0), (vec![DVec3::zeros(), DVec3::new(0.5, 0.0, 0.0)], 2.0)]
        {
            let grid = spheres(&ctx, &positions, 0.2, 0.0125).unwrap();
            let volumes =
                [measure(&ctx, &grid).unwrap().volume, to_mesh(&ctx, &grid, 0.0, 0.0).unwrap().volume()];
            for volume in volumes {
                assert!((volume / (count * ball) - 1.0).abs() < 0.02, "{volume} is not {count} of {ball}");
            }
        }
    }

    #[test]
    fn the_least_sphere_is_there_and_what_is_out_of_range_is_refused() {
        let ctx = context(2);
        // Rounding takes a quotient of 1.5 below that.
        for cell in [0.05, 0.0333, 0.7] {
            let grid = spheres(&ctx, &[DVec3::zeros()], 1.5 * cell, cell).unwrap();
            assert!(grid.value([0; 3]) < 0.0, "{cell}");
        }
        let said = |positions: &[DVec3], radius: f64, ctx: &Context| {
            spheres(ctx, positions, radius, 0.1).err().unwrap().to_string()
        };
        assert!(said(&[DVec3::zeros()], 0.14, &ctx).contains("1.5 to 100"));
        assert!(said(&[DVec3::zeros()], 11.0, &ctx).contains("1.5 to 100"));
        assert!(said(&[DVec3::zeros(), DVec3::repeat(1e9)], 0.2, &ctx).contains("particle 2"));
        assert!(said(&[DVec3::repeat(f64::NAN)], 0.2, &ctx).contains("particle 1"));
        let small = context(2);
        small.set_memory_limit(1 << 16);
        assert!(said(&[DVec3::zeros()], 0.2, &small).contains("limit"));
    }
}
