//! Densities (thesis section 3.5): 1 in snow, 0 outside.
//!
//! Each part of the snow has its own grid with its own voxel size: the base's voxels are as large as its cells, those of grains at most
//! half their radius. A single grid would store the base's surface on the voxels of the grains.

use super::fill;
use super::spheres::{Spheres, SquaredDistances};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{Block, BlockEdit, DIM, VOXELS, Values};
use crate::numeric::checks::ensure;
use crate::vdb::{DENSITY_SCALE_KEY, FloatGrid, GridClass, Leaf, MetaValue, Tile};

/// Factor by which the thesis multiplies the density of base and grains for rendering (1/m, the unit that renderers use).
pub const DENSITY_SCALE: f32 = 100.0;
/// Width of the falloff around a sphere (radii).
pub const FALLOFF: f64 = 0.5;
/// Largest voxel of grains (radii).
pub const VOXEL: f64 = 0.5;
/// Blocks along a cube's edge.
const EDGE: usize = 4;

/// Density of the snow in a level set, on its own voxels: 1 inside, 0 outside, and linear across the voxel that the surface passes through,
/// so that the sum of the densities is the snow's volume. Regions full of snow are stored as tiles.
///
/// # Errors
/// A grid that is not world-fixed; cancel; when memory runs out.
pub fn base(ctx: &Context, surface: &FloatGrid) -> Result<FloatGrid> {
    ensure(surface.is_world_fixed(), "the level set's voxels are shifted or turned")?;
    let inside = |tile: Tile| (tile.value < 0.0).then_some(Tile { value: 1.0, active: true, ..tile });
    let tiles: Vec<Tile> = surface.tiles()?.into_iter().filter_map(inside).collect();
    let voxel = surface.voxel_size();
    let mut grid = FloatGrid::of_tiles(voxel, 0.0, &tiles)?;
    let cell = voxel as f32;
    let density = |leaf: &Leaf<'_>| {
        let values = Box::new(leaf.values.map(|distance| (0.5 - distance / cell).clamp(0.0, 1.0)));
        dense(leaf.origin, values).into_iter().collect()
    };
    fill(ctx, &mut grid, 1, &surface.leaves()?, density)?;
    finished(grid)
}

/// Density of grains of a radius (m) around `centres` (m): 1 in the union of their spheres, falling smoothly to 0 over half a radius
/// outside it. `voxel` (m) is at most half of the radius.
///
/// # Errors
/// A radius that is not above 0; a voxel that is not above 0, or is too large; centres that are not finite or too far from the
/// origin; cancel; when memory runs out.
pub fn grains(ctx: &Context, centres: &[DVec3], radius: f64, voxel: f64) -> Result<FloatGrid> {
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(Error::argument(format!("the radius of grains must be above 0, not {radius} m")));
    }
    // A product with a radius may be off in its last bit.
    if !(voxel > 0.0 && voxel <= VOXEL * radius * (1.0 + 1.0e-9)) {
        return Err(Error::argument(format!(
            "voxels must be above 0 m and at most half of the grains' radius of {radius} m, not {voxel} m"
        )));
    }
    let full = radius / voxel;
    let spheres = Spheres::new(ctx, centres, voxel, full * (1.0 + FALLOFF), EDGE)?;
    let mut grid = FloatGrid::new(voxel, 0.0)?;
    let cubes: Vec<[i32; 3]> = spheres.cubes().collect();
    let (full, falloff) = (full as f32, (full * FALLOFF) as f32);
    let density = |squares: SquaredDistances| {
        let values = Box::new(squares.values.map(|square| smooth_falloff((square.sqrt() - full) / falloff)));
        dense(squares.origin, values)
    };
    let blocks = |cube: &[i32; 3]| spheres.squared_distances(*cube).into_iter().filter_map(density).collect();
    fill(ctx, &mut grid, EDGE, &cubes, blocks)?;
    finished(grid)
}

/// The density at a distance outside the spheres (in widths of the falloff).
fn smooth_falloff(outside: f32) -> f32 {
    let left = (1.0 - outside).clamp(0.0, 1.0);
    left * left * (3.0 - 2.0 * left)
}

/// A block of densities, active where they are above 0; none if all are 0.
fn dense(origin: [i32; 3], values: Box<Values>) -> Option<BlockEdit> {
    let mut mask = [0u64; DIM];
    for index in 0..VOXELS {
        mask[index >> 6] |= u64::from(values[index] > 0.0) << (index & 63);
    }
    (mask != [0; DIM]).then_some(BlockEdit::Dense(Block { origin, values, mask }))
}

/// The grid with its class and density scale; blocks full of snow become tiles.
fn finished(mut grid: FloatGrid) -> Result<FloatGrid> {
    grid.prune(0.0)?;
    grid.set_class(GridClass::Fog)?;
    grid.set_metadata(DENSITY_SCALE_KEY, MetaValue::Float(DENSITY_SCALE))?;
    Ok(grid)
}
