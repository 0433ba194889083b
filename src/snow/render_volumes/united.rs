//! One surface around the base layer and the grains that rest on it.
//!
//! A grid has voxels of one size: they must be fine where grains rest, and so they are fine everywhere. The base's distances are
//! interpolated on them, only in the narrow band of the fine grid. A cell is a whole number of voxels wide, so that each leaf of the base
//! becomes a cube of whole blocks.

use super::fill;
use super::spheres::{Spheres, SquaredDistances};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{Block, BlockEdit, DIM, Origin, VOXELS, Values, offset};
use crate::numeric::checks::ensure;
use crate::vdb::{FloatGrid, Probe};

/// Maximum voxel size (radii of a grain): spheres with a radius of less than one and a half voxels are lost between the voxels.
const VOXEL: f64 = 1.0 / 1.5;
/// Radius with which a grain becomes part of the surface (radii): grains touch only in points, which no grid can represent. Grown by a
/// quarter, two touching grains share a neck whose radius is three quarters of a grain's, and a grain a tenth of a diameter above the base
/// is joined to it.
const GROWN: f64 = 1.25;
/// Half width of the narrow band (voxels).
const HALF_WIDTH: f32 = 3.0;
/// Values of a leaf along an axis, plus the adjacent one of the next leaf.
const SIDE: usize = DIM + 1;

/// Number of voxels of the united surface along the edge of a cell of the base, which is `cell` m wide, for grains of a radius (m).
pub fn division(cell: f64, radius: f64) -> usize {
    // A quotient may be off in its last bit.
    ((cell / (VOXEL * radius)) * (1.0 - 1.0e-9)).ceil().max(1.0) as usize
}

/// Level set (m) of the base united with grains of a radius (m) around `centres` (m), on voxels that divide a cell of the base:
/// see [`division`].
///
/// # Errors
/// A base that is not a level set on world-fixed cells with a band of at least two cells; a radius that is not above 0, or is less than a
/// hundredth of a cell; centres that are not finite or are too far from the origin; cancel; when memory runs out.
pub fn unite(ctx: &Context, base: &FloatGrid, centres: &[DVec3], radius: f64) -> Result<FloatGrid> {
    let cell = base.voxel_size();
    ensure(
        base.is_world_fixed() && f64::from(base.background()) >= 2.0 * cell,
        "the base must be a level set on world-fixed cells with a band of at least two cells on each side",
    )?;
    if !(radius.is_finite() && radius >= 0.01 * cell) {
        return Err(Error::argument(format!("grains of {radius} m are too small for cells of {cell} m")));
    }
    let division = division(cell, radius);
    let voxel = cell / division as f64;
    let grown = GROWN * radius / voxel;
    let spheres = Spheres::new(ctx, centres, voxel, grown + f64::from(HALF_WIDTH), division)?;
    let mut grid = FloatGrid::level_set(voxel, HALF_WIDTH)?;
    let leaf_of = |origin: Origin| origin.map(|at| at / DIM as i32);
    let mut cubes: Vec<[i32; 3]> = base.leaves()?.iter().map(|leaf| leaf_of(leaf.origin)).collect();
    cubes.extend(spheres.cubes());
    cubes.sort_unstable();
    cubes.dedup();
    let origins: Vec<Origin> = cubes.iter().flat_map(|cube| adjacent_leaves(*cube)).collect();
    let probes = base.probe(&origins)?;
    let cubes: Vec<([i32; 3], &[Probe<'_>])> = cubes.into_iter().zip(probes.chunks_exact(DIM)).collect();
    let fine = Fine { division, voxel: voxel as f32, grown: grown as f32 };
    let blocks = |(cube, probes): &([i32; 3], &[Probe<'_>])| {
        fine.blocks(*cube, probes, spheres.squared_distances(*cube))
    };
    fill(ctx, &mut grid, division, &cubes, blocks)?;
    grid.flood_fill()?;
    grid.set_name("surface")?;
    Ok(grid)
}

/// The origins of a leaf and of the seven adjacent leaves in the positive directions.
fn adjacent_leaves(leaf: [i32; 3]) -> impl Iterator<Item = Origin> {
    (0..DIM as i32)
        .map(move |corner| [0, 1, 2].map(|axis| (leaf[axis] + (corner >> (2 - axis) & 1)) * DIM as i32))
}

/// The fine grid.
struct Fine {
    /// Voxels along a cell's edge; equally, blocks along a cube's edge.
    division: usize,
    /// Edge of a voxel (m).
    voxel: f32,
    /// Radius of a grown grain (voxels).
    grown: f32,
}

impl Fine {
    /// The blocks of a cube that are near the surface: `probes` are the base's leaf there and its [`adjacent_leaves`].
    fn blocks(&self, cube: [i32; 3], probes: &[Probe<'_>], squares: Vec<SquaredDistances>) -> Vec<BlockEdit> {
        let cells = Cells::of(probes);
        let mut squares = squares.into_iter().peekable();
        let mut out = Vec::new();
        let all = 0..self.division;
        for (x, y) in all.clone().flat_map(|x| all.clone().map(move |y| (x, y))) {
            for block in all.clone().map(|z| [x, y, z]) {
                let position =
                    |axis: usize| (cube[axis] * self.division as i32 + block[axis] as i32) * DIM as i32;
                let origin = [0, 1, 2].map(position);
                let of_grains = squares.next_if(|squares| squares.origin == origin);
                out.extend(self.block(origin, block, &cells, of_grains));
            }
        }
        out
    }

    /// A block of the grid; none if the surface is not near it.
    fn block(
        &self,
        origin: Origin,
        block: [usize; 3],
        cells: &Cells,
        of_grains: Option<SquaredDistances>,
    ) -> Option<BlockEdit> {
        let width = HALF_WIDTH * self.voxel;
        let (low, high) = cells.range(self.division, block);
        if high <= -width || (low >= width && of_grains.is_none()) {
            return None;
        }
        let mut values = cells.interpolated(self.division, block);
        if let Some(squares) = of_grains {
            for (value, square) in values.iter_mut().zip(squares.values.iter()) {
                *value = value.min((square.sqrt() - self.grown) * self.voxel);
            }
        }
        values.iter_mut().for_each(|value| *value = value.clamp(-width, width));
        let block = Block::of_band(origin, values, width);
        (block.mask != [0; DIM]).then_some(BlockEdit::Dense(block))
    }
}

/// Values (m) of a leaf of the base, plus the adjacent ones in the positive directions.
struct Cells(Box<[f32; SIDE * SIDE * SIDE]>);

impl Cells {
    /// From a leaf and the seven after it.
    fn of(probes: &[Probe<'_>]) -> Self {
        let mut values = Box::new([0.0; SIDE * SIDE * SIDE]);
        for (index, value) in values.iter_mut().enumerate() {
            let at = [index / (SIDE * SIDE), index / SIDE % SIDE, index % SIDE];
            let probe = at.iter().fold(0, |probe, at| probe << 1 | usize::from(*at == DIM));
            let [x, y, z] = at.map(|at| at % DIM);
            *value = match &probes[probe] {
                Probe::Leaf(leaf) => leaf.values[offset(x, y, z)],
                Probe::Tile { value, .. } => *value,
            };
        }
        Self(values)
    }

    /// The values along z at a position.
    fn row(&self, x: usize, y: usize) -> &[f32] {
        &self.0[(x * SIDE + y) * SIDE..][..SIDE]
    }

    /// Minimum and maximum of the values that a fine block is interpolated from.
    fn range(&self, division: usize, block: [usize; 3]) -> (f32, f32) {
        let [xs, ys, zs] = block.map(|block| block * DIM / division..=(block * DIM + DIM - 1) / division + 1);
        let rows = xs.flat_map(|x| ys.clone().map(move |y| (x, y)));
        let values = rows.flat_map(|(x, y)| &self.row(x, y)[zs.clone()]);
        values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        })
    }

    /// The values of a fine block: trilinear.
    fn interpolated(&self, division: usize, block: [usize; 3]) -> Box<Values> {
        let mut values = Box::new([0.0; VOXELS]);
        let [xs, ys, zs] = block.map(|block| Steps::of(division, block));
        let (first, last) = (zs.0[0].0, zs.0[DIM - 1].0 + 1);
        let mut row = [0.0; SIDE];
        for (x, (cell_x, u)) in xs.0.into_iter().enumerate() {
            for (y, (cell_y, v)) in ys.0.into_iter().enumerate() {
                let [a, b] = [self.row(cell_x, cell_y), self.row(cell_x, cell_y + 1)];
                let [c, d] = [self.row(cell_x + 1, cell_y), self.row(cell_x + 1, cell_y + 1)];
                for z in first..=last {
                    row[z] = mix(mix(a[z], b[z], v), mix(c[z], d[z], v), u);
                }
                for (z, (cell, w)) in zs.0.into_iter().enumerate() {
                    values[offset(x, y, z)] = mix(row[cell], row[cell + 1], w);
                }
            }
        }
        values
    }
}

/// The cell below each voxel of a block along an axis, and the fraction of the distance to the next cell.
struct Steps([(usize, f32); DIM]);

impl Steps {
    fn of(division: usize, block: usize) -> Self {
        Self(std::array::from_fn(|voxel| {
            let at = block * DIM + voxel;
            (at / division, (at % division) as f32 / division as f32)
        }))
    }
}

fn mix(low: f32, high: f32, share: f32) -> f32 {
    low + (high - low) * share
}
