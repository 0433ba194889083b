//! Corners of cells, and level sets sampled at them.

use std::borrow::Cow;

use crate::context::Context;
use crate::error::Result;
use crate::flow::Coord;
use crate::geometry::DVec3;
use crate::snow::bounds::bounds;
use crate::snow::grains::colliders::field::Window;
use crate::vdb::FloatGrid;

/// The corners of cells, and of the parts into which cells are divided.
#[derive(Clone, Copy)]
pub struct Lattice {
    /// Edge of a cell (m).
    pub cell: f64,
    /// Parts along an edge.
    pub parts: usize,
}

impl Lattice {
    /// Distance between adjacent corners (m).
    pub fn spacing(&self) -> f64 {
        self.cell / self.parts as f64
    }

    /// Corners along the edge of a tile, both ends included.
    pub fn corners(&self) -> usize {
        8 * self.parts + 1
    }

    /// Minimum and maximum corner (m) of tiles.
    pub fn bounds(&self, tiles: &[Coord]) -> [DVec3; 2] {
        let low = |coord: &Coord| DVec3::from(coord.map(f64::from)) * (8.0 * self.cell);
        let [min, max] = bounds(tiles.iter().map(low));
        [min, max.add_scalar(8.0 * self.cell)]
    }

    /// All corners (m) of a tile.
    pub fn positions(self, tile: Coord) -> impl Iterator<Item = DVec3> {
        let count = self.corners();
        let at = move |index: usize| [index / (count * count), index / count % count, index % count];
        (0..count.pow(3)).map(move |index| self.position(tile, at(index)))
    }

    /// The corner (m) at an index in a tile.
    pub fn position(&self, tile: Coord, at: [usize; 3]) -> DVec3 {
        let index = |axis: usize| f64::from(tile[axis] * 8 * self.parts as i32 + at[axis] as i32);
        DVec3::new(index(0), index(1), index(2)) * self.spacing()
    }
}

/// A level set around tiles.
pub struct Grid<'a> {
    /// Corners' spacing in cells of the level set.
    scale: f64,
    /// For each tile; none: it is far from the surface.
    near: Vec<Option<Distances<'a>>>,
}

/// Signed distances (m) around a tile.
enum Distances<'a> {
    /// The leaves around it.
    Leaves(Window<'a>),
    /// The values at its corners.
    Corners(Vec<f32>),
}

/// Maximum spacing of corners (cells of a level set) at which the leaves around a tile are copied; with wider spacing most of their values
/// would not be used.
const MAX_SCALE: f64 = 3.0;
/// Maximum width (cells of a level set) of such a tile; wider tiles have too many leaves.
const MAX_WIDTH: f64 = 48.0;

impl<'a> Grid<'a> {
    pub fn new(
        ctx: &Context,
        grid: Option<&'a FloatGrid>,
        tiles: &[Coord],
        lattice: &Lattice,
    ) -> Result<Option<Self>> {
        let Some(grid) = grid else { return Ok(None) };
        let Some((low, high)) = grid.active_bbox() else { return Ok(None) };
        let scale = lattice.spacing() / grid.voxel_size();
        let edge = 8.0 * lattice.parts as f64 * scale;
        let bounds = tiles.iter().map(|tile| {
            let low = tile.map(|at| (f64::from(at) * edge).floor() as i32);
            let high = tile.map(|at| (f64::from(at + 1) * edge).ceil() as i32).map(|at| at.saturating_add(1));
            [low, high]
        });
        // Outside the box of the level set's active voxels nothing is solid.
        let is_near = |[tile_low, tile_high]: &[[i32; 3]; 2]| {
            (0..3).all(|axis| {
                tile_low[axis] <= high[axis].saturating_add(1)
                    && tile_high[axis] >= low[axis].saturating_sub(1)
            })
        };
        let bounds: Vec<Option<[[i32; 3]; 2]>> = bounds.map(|bounds| Some(bounds).filter(is_near)).collect();
        let mut all = if scale > MAX_SCALE || edge > MAX_WIDTH {
            let near = tiles.iter().zip(&bounds).filter(|(_, bounds)| bounds.is_some());
            let positions: Vec<DVec3> = near.flat_map(|(tile, _)| lattice.positions(*tile)).collect();
            let mut values = Vec::new();
            grid.sample_linear(ctx, &positions, &mut values)?;
            let each = values.chunks(lattice.corners().pow(3));
            each.map(|values| Distances::Corners(values.to_vec())).collect::<Vec<_>>()
        } else {
            let leaves = bounds.iter().flatten().map(|bounds| bounds.map(|voxel| voxel.map(|x| x >> 3)));
            let leaves: Vec<[[i32; 3]; 2]> = leaves.collect();
            Window::all(grid, &leaves)?.into_iter().map(Distances::Leaves).collect()
        }
        .into_iter();
        let near = bounds.iter().map(|bounds| bounds.and_then(|_| all.next())).collect();
        Ok(Some(Self { scale, near }))
    }

    /// Whether a tile may have corners inside.
    pub fn is_near(&self, slot: usize) -> bool {
        self.near[slot].as_ref().is_some_and(|near| match near {
            Distances::Leaves(window) => window.has_inside(),
            Distances::Corners(values) => values.iter().any(|value| *value < 0.0),
        })
    }

    /// Signed distances (m) at the corners of a tile, in the order of [`Lattice::positions`]; none if the level set is far away.
    pub fn corners(&self, slot: usize, tile: Coord, lattice: &Lattice) -> Option<Cow<'_, [f32]>> {
        Some(match self.near[slot].as_ref()? {
            // Level sets are sampled in their own cells: using the corners' indices keeps exact values exact.
            Distances::Leaves(window) => Cow::Owned(interpolated(
                window,
                &tile.map(|at| {
                    let first = at * 8 * lattice.parts as i32;
                    (first..).take(lattice.corners()).map(|index| f64::from(index) * self.scale).collect()
                }),
            )),
            Distances::Corners(values) => Cow::Borrowed(values),
        })
    }
}

/// Trilinear interpolation at the points of a lattice, given by their coordinates (voxels, ascending) on each axis; one axis after the
/// other, so that points share most of the work.
fn interpolated(window: &Window<'_>, points: &[Vec<f64>; 3]) -> Vec<f32> {
    let low = points.each_ref().map(|points| points[0].floor() as i32);
    let end = points.each_ref().map(|points| points[points.len() - 1].floor() as i32 + 2);
    let mut size = [0, 1, 2].map(|axis| (end[axis] - low[axis]) as usize);
    let mut values = Vec::with_capacity(size.iter().product());
    window.copy(low, end, &mut values);
    for axis in [2, 1, 0] {
        let (rows, width) =
            (size[..axis].iter().product::<usize>(), size[axis + 1..].iter().product::<usize>());
        let mut out = Vec::with_capacity(rows * points[axis].len() * width);
        for row in values.chunks_exact(size[axis] * width) {
            for at in &points[axis] {
                let voxel = at.floor();
                let weight = (at - voxel) as f32;
                let two = &row[(voxel as i32 - low[axis]) as usize * width..][..2 * width];
                let (lower, upper) = two.split_at(width);
                out.extend(lower.iter().zip(upper).map(|(a, b)| a + (b - a) * weight));
            }
        }
        size[axis] = points[axis].len();
        values = out;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;
    use crate::vdb::level_set::from_particles;

    #[test]
    fn corners_are_sampled_as_single_positions_are() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let ball = from_particles(&ctx, &[DVec3::new(0.01, -0.02, 0.03)], &[0.3], 0.05, 3.0).unwrap();
        for (cell, parts) in [(0.05, 1), (0.1, 1), (0.07, 1), (0.11, 2), (0.02, 1)] {
            let lattice = Lattice { cell, parts };
            for tile in [[0, 0, 0], [-1, 0, 0], [-1, -1, -1], [0, -1, 0]] {
                let grid = Grid::new(&ctx, Some(&ball), &[tile], &lattice).unwrap().unwrap();
                let Some(Distances::Leaves(window)) = &grid.near[0] else { panic!("a tile without leaves") };
                let values = grid.corners(0, tile, &lattice).unwrap();
                assert_eq!(values.len(), lattice.corners().pow(3));
                for (corner, value) in lattice.positions(tile).zip(values.iter()) {
                    let alone = window.sample((corner / lattice.spacing() * grid.scale).into()).0;
                    assert!((alone - value).abs() < 1.0e-6, "{cell} {tile:?} {corner:?}: {alone} {value}");
                }
            }
        }
    }
}
