//! Spheres of equal size, and the distances of voxels from the nearest centre.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{DIM, Origin, VOXELS, Values, offset};

/// Maximum coordinate of a voxel.
const MAX_VOXEL: f64 = (1 << 30) as f64;

/// Centres of spheres, sorted into cubes of blocks.
pub struct Spheres {
    /// Blocks along a cube's edge.
    edge: usize,
    /// Maximum distance (voxels) that is needed.
    reach: f32,
    /// The cubes within reach of a centre, ascending: their indices, and the index after their last member.
    cubes: Vec<([i32; 3], usize)>,
    /// Positions (voxels) relative to the minimum voxel of the cube, one cube after another.
    members: Vec<[f32; 3]>,
}

/// Squared distances (voxels^2) of a block's voxels from the nearest centre; beyond the reach they may be too large.
pub struct SquaredDistances {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    /// The squared distances.
    pub values: Box<Values>,
}

impl Spheres {
    /// Sorts centres (m) into cubes, `edge` blocks wide, of a grid with voxels of `voxel` m; distances beyond `reach` voxels are not
    /// needed.
    ///
    /// # Errors
    /// A centre that is not finite, or is too far from the origin for voxels of this size; cancel.
    pub fn new(ctx: &Context, centres: &[DVec3], voxel: f64, reach: f64, edge: usize) -> Result<Self> {
        ctx.check()?;
        let is_near = |centre: &DVec3| centre.iter().all(|x| (x / voxel).abs() < MAX_VOXEL);
        if let Some(far) = centres.iter().position(|centre| !is_near(centre)) {
            return Err(Error::argument(format!(
                "sphere {} of {} is not finite, or too far from the origin for voxels of {voxel} m",
                far + 1,
                centres.len()
            )));
        }
        let width = (edge * DIM) as i32;
        let spans = |centre: &DVec3| {
            let at: [f64; 3] = (centre / voxel).into();
            let ends = at.map(|at| {
                [(at - reach).ceil(), (at + reach).floor()].map(|voxel| (voxel as i32).div_euclid(width))
            });
            let [x, y, z] = ends.map(|[low, high]| low..=high);
            x.flat_map(move |x| {
                let z = z.clone();
                y.clone().flat_map(move |y| z.clone().map(move |z| [x, y, z]))
            })
        };
        ctx.pool().install(|| {
            let of = |(index, centre): (usize, &DVec3)| spans(centre).map(move |cube| (cube, index as u32));
            let mut pairs: Vec<([i32; 3], u32)> = centres.par_iter().enumerate().flat_map_iter(of).collect();
            // No two pairs are equal, so the order is unique.
            pairs.par_sort_unstable();
            let position = |(cube, index): &([i32; 3], u32)| {
                let at: [f64; 3] = (centres[*index as usize] / voxel).into();
                [0, 1, 2].map(|axis| (at[axis] - f64::from(cube[axis]) * f64::from(width)) as f32)
            };
            let members = pairs.par_iter().map(position).collect();
            let mut cubes: Vec<([i32; 3], usize)> = Vec::new();
            for (index, (cube, _)) in pairs.iter().enumerate() {
                match cubes.last_mut() {
                    Some((last, end)) if last == cube => *end = index + 1,
                    _ => cubes.push((*cube, index + 1)),
                }
            }
            Ok(Self { edge, reach: reach as f32, cubes, members })
        })
    }

    /// The cubes within reach of a centre, ascending.
    pub fn cubes(&self) -> impl Iterator<Item = [i32; 3]> + '_ {
        self.cubes.iter().map(|(cube, _)| *cube)
    }

    /// The squared distances in those blocks of a cube that may be within reach of a centre, in ascending order of origins.
    pub fn squared_distances(&self, cube: [i32; 3]) -> Vec<SquaredDistances> {
        let Ok(index) = self.cubes.binary_search_by_key(&cube, |(cube, _)| *cube) else { return Vec::new() };
        let begin = if index == 0 { 0 } else { self.cubes[index - 1].1 };
        let mut blocks: Vec<Option<Box<Values>>> = vec![None; self.edge.pow(3)];
        for member in &self.members[begin..self.cubes[index].1] {
            self.add(&mut blocks, *member);
        }
        let origin = |index: usize| {
            let block = [index / self.edge.pow(2), index / self.edge % self.edge, index % self.edge];
            [0, 1, 2].map(|axis| (cube[axis] * self.edge as i32 + block[axis] as i32) * DIM as i32)
        };
        let indexed = blocks.into_iter().enumerate();
        indexed
            .filter_map(|(index, values)| Some(SquaredDistances { origin: origin(index), values: values? }))
            .collect()
    }

    /// Lowers the squared distances in the blocks of a cube to those from a centre where these are smaller.
    fn add(&self, blocks: &mut [Option<Box<Values>>], centre: [f32; 3]) {
        let last = (self.edge * DIM) as f32 - 1.0;
        let low = centre.map(|at| (at - self.reach).ceil().clamp(0.0, last) as usize);
        let high = centre.map(|at| (at + self.reach).floor().clamp(0.0, last) as usize);
        let [xs, ys, zs] = [0, 1, 2].map(|axis| low[axis] / DIM..=high[axis] / DIM);
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    let values = &mut blocks[(x * self.edge + y) * self.edge + z];
                    let values = values.get_or_insert_with(|| Box::new([f32::INFINITY; VOXELS]));
                    lower_distances(
                        values,
                        [x, y, z].map(|block| block * DIM),
                        [low, high],
                        centre,
                        self.reach,
                    );
                }
            }
        }
    }
}

/// Lowers the squared distances of a block's voxels, from `low` to `high`, to those from a centre; all in voxels of the cube.
fn lower_distances(
    values: &mut Values,
    origin: [usize; 3],
    [low, high]: [[usize; 3]; 2],
    centre: [f32; 3],
    reach: f32,
) {
    let range = |axis: usize| {
        low[axis].max(origin[axis]) - origin[axis]..=high[axis].min(origin[axis] + DIM - 1) - origin[axis]
    };
    let square = |axis: usize, voxel: usize| {
        let apart = (origin[axis] + voxel) as f32 - centre[axis];
        apart * apart
    };
    for x in range(0) {
        let of_x = square(0, x);
        for y in range(1) {
            let of_xy = of_x + square(1, y);
            if of_xy > reach * reach {
                continue;
            }
            for z in range(2) {
                let value = &mut values[offset(x, y, z)];
                *value = value.min(of_xy + square(2, z));
            }
        }
    }
}
