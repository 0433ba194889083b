//! Grids to be drawn: level sets as surfaces, fog volumes as fog, both as fields to be cut.

use super::camera::corner;
use super::cut::Field;
use super::fog::{Fog, Part, Placement};
use super::model::{Model, smooth_normals};
use super::shade::SNOW;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{DIM, Origin};
use crate::vdb::{DENSITY_SCALE_KEY, FloatGrid, GridClass, MetaValue, Tile, level_set};

impl Model {
    /// A level set with the colour of snow.
    ///
    /// # Errors
    /// Errors of OpenVDB; cancel.
    pub fn level_set(ctx: &Context, grid: &FloatGrid) -> Result<Self> {
        let mesh = level_set::to_mesh(ctx, grid, 0.0, 0.0)?;
        let normals = smooth_normals(&mesh);
        Ok(Self::new(mesh, Some(normals), SNOW, 0.5 * grid.voxel_size()))
    }
}

impl Fog {
    /// A fog volume. A density of 1 has the extinction (1/m) of the metadata `frazil:density_scale`, or without it `extinction` (1/m,
    /// above 0). Inactive voxels and values below 0 are empty.
    ///
    /// # Errors
    /// A transform that is not linear; a scale that is not a number of 0 or more; densities too far apart to be drawn, or too many for the
    /// memory limit; a cancel.
    pub fn grid(ctx: &Context, grid: &FloatGrid, extinction: f64) -> Result<Self> {
        let grid_error = |what: String| Error::argument(format!("grid \"{}\" {what}", grid.name()));
        let placement =
            placement(grid).ok_or_else(|| grid_error("has a transform that is not linear".into()))?;
        let extinction = density_scale(grid)?.unwrap_or(extinction);
        let tiles: Vec<Tile> =
            grid.tiles()?.into_iter().filter(|tile| tile.active && tile.value > 0.0).collect();
        let edge = |tile: &Tile| u64::from(tile.edge.unsigned_abs()) / DIM as u64;
        let count: u64 = tiles.iter().map(|tile| edge(tile).pow(3)).sum();
        ctx.allow("a fog", count * BYTES_PER_TILE_BLOCK)?;
        let leaves = grid.leaves()?;
        let mut parts: Vec<(Origin, Part<'_>)> =
            leaves.iter().map(|leaf| (leaf.origin, Part::Dense(leaf.values, leaf.mask))).collect();
        for tile in &tiles {
            let edge = edge(tile) as i32;
            let positions = (0..edge * edge * edge).map(|n| [n / (edge * edge), n / edge % edge, n % edge]);
            let origin = |at: Origin| [0, 1, 2].map(|axis| tile.origin[axis] + DIM as i32 * at[axis]);
            parts.extend(positions.map(|at| (origin(at), Part::Uniform(tile.value))));
        }
        Self::of_parts(ctx, placement, parts, extinction).map_err(|error| match error {
            Error::Argument(what) => grid_error(what),
            other => other,
        })
    }
}

impl Field {
    /// The values of a grid, linear between its voxels. For a level set the colours span the narrow band, for any other grid the range of
    /// its values and 0.
    ///
    /// # Errors
    /// More leaves than the memory limit allows to list; out of memory; a cancel.
    pub fn grid(ctx: &Context, grid: FloatGrid) -> Result<Self> {
        let bounds = bounds_of(&grid);
        let range = match grid.class() {
            GridClass::LevelSet => [-grid.background().abs(), grid.background().abs()],
            _ => value_range(ctx, &grid)?,
        };
        let read = move |ctx: &Context, positions: &[DVec3], values: &mut Vec<f32>| {
            grid.sample_linear(ctx, positions, values)
        };
        Ok(Self::new(bounds, range, read))
    }
}

/// Memory (bytes) of a leaf in a list of leaves, and while that list is made; its values are not copied.
const BYTES_PER_LISTED_LEAF: u64 = 80;
/// Leaves between two checks for a cancel.
const LEAVES_PER_CHECK: usize = 4096;

/// Minimum and maximum of 0 and the finite values of a grid.
fn value_range(ctx: &Context, grid: &FloatGrid) -> Result<[f32; 2]> {
    ctx.allow("a list of a grid's leaves", grid.leaf_count() as u64 * BYTES_PER_LISTED_LEAF)?;
    let extended = |[low, high]: [f32; 2], value: f32| match value {
        _ if !value.is_finite() => [low, high],
        _ if value < low => [value, high],
        _ if value > high => [low, value],
        _ => [low, high],
    };
    let mut range = grid.tiles()?.iter().map(|tile| tile.value).fold([0.0; 2], extended);
    for leaves in grid.leaves()?.chunks(LEAVES_PER_CHECK) {
        ctx.check()?;
        range = leaves.iter().flat_map(|leaf| leaf.values.iter().copied()).fold(range, extended);
    }
    Ok(range)
}

/// Minimum and maximum corner of the active voxels of a grid (m); none if no voxel is active.
fn bounds_of(grid: &FloatGrid) -> Option<(DVec3, DVec3)> {
    let (low, high) = grid.active_bbox()?;
    let bounds =
        (DVec3::from(low.map(|at| f64::from(at) - 0.5)), DVec3::from(high.map(|at| f64::from(at) + 0.5)));
    let corners = (0..8).map(|n| grid.index_to_world(corner(bounds, n)));
    corners.map(|at| (at, at)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
}

/// Memory (bytes) of a block of a tile while it is prepared.
const BYTES_PER_TILE_BLOCK: u64 = 64;

/// The density scale in a fog's metadata.
fn density_scale(grid: &FloatGrid) -> Result<Option<f64>> {
    let metadata = grid.metadata()?;
    let Some((_, value)) = metadata.iter().find(|(key, _)| key == DENSITY_SCALE_KEY) else { return Ok(None) };
    let number = match value {
        MetaValue::Float(number) => Some(f64::from(*number)),
        MetaValue::Double(number) => Some(*number),
        MetaValue::Int(number) => Some(*number as f64),
        _ => None,
    };
    let number = number.filter(|number| *number >= 0.0 && number.is_finite());
    number.map(Some).ok_or_else(|| {
        let name = grid.name();
        Error::argument(format!("grid \"{name}\" has a {DENSITY_SCALE_KEY} that is no number of 0 or more"))
    })
}

/// Placement of a grid's voxels in the world; none if its transform is not linear.
fn placement(grid: &FloatGrid) -> Option<Placement> {
    let origin = grid.index_to_world(DVec3::zeros());
    let axes = [DVec3::x(), DVec3::y(), DVec3::z()].map(|axis| grid.index_to_world(axis) - origin);
    let placement = Placement::new(origin, axes)?;
    // A perspective transform differs from the linear one at the corners of the active voxels.
    let (low, high) = grid.active_bbox().unwrap_or_default();
    let bounds = (DVec3::from(low.map(f64::from)), DVec3::from(high.map(f64::from)));
    let is_linear = (0..8).all(|n| {
        let corner = corner(bounds, n);
        let error = grid.index_to_world(corner) - placement.to_world(corner);
        error.norm() <= 1.0e-6 * placement.cell() * (1.0 + corner.norm())
    });
    is_linear.then_some(placement)
}
