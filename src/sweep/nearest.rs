//! Nearest triangle of every voxel of a block, by halving: bounds at the centres of 4^3 and 2^3
//! sub-blocks leave few triangles for the exact distances.

use super::distance::{LANES, Points, Triangle, to_each};
use crate::base::blocks::{VOXELS, offset};

/// No triangle in reach.
pub const NONE: u32 = u32::MAX;

/// Working memory of one thread.
#[derive(Default)]
pub struct Scratch {
    lists: [Vec<u32>; 3],
    squared: [Vec<[f32; LANES]>; 3],
}

/// Squared distance (cells^2) and index of the nearest triangle of each voxel.
pub struct Nearest {
    /// Squared distances; infinite where no triangle is in reach.
    pub squared: [f32; VOXELS],
    /// Indices, or [`NONE`].
    pub index: [u32; VOXELS],
}

/// Half diagonals between the voxel centres of a 4^3 and of a 2^3 sub-block, with room for rounding.
const RADII: [f32; 2] = [2.599, 0.867];

impl Nearest {
    /// Searches among `triangles` for voxels nearer than `reach` cells.
    pub fn search(triangles: &[Triangle], reach: f32, scratch: &mut Scratch) -> Self {
        let mut found = Self { squared: [f32::INFINITY; VOXELS], index: [NONE; VOXELS] };
        let Scratch { lists: [all, some, few], squared: [far, mid, near] } = scratch;
        all.clear();
        all.extend(0..triangles.len() as u32);
        to_each(triangles, all, &points([0.0; 3], 4.0, 1.5), far);
        for lane in 0..LANES {
            if !keep(all, far, lane, RADII[0], reach, some) {
                continue;
            }
            let corner = corner_of([0.0; 3], 4.0, lane);
            to_each(triangles, some, &points(corner, 2.0, 0.5), mid);
            for lane in 0..LANES {
                if !keep(some, mid, lane, RADII[1], reach, few) {
                    continue;
                }
                let corner = corner_of(corner, 2.0, lane);
                to_each(triangles, few, &points(corner, 1.0, 0.0), near);
                found.take_nearest(corner, few, near);
            }
        }
        found
    }

    fn take_nearest(&mut self, corner: [f32; 3], list: &[u32], squared: &[[f32; LANES]]) {
        let mut best = [f32::INFINITY; LANES];
        let mut index = [NONE; LANES];
        for (&triangle, distances) in list.iter().zip(squared) {
            for lane in 0..LANES {
                let nearer = distances[lane] < best[lane];
                best[lane] = if nearer { distances[lane] } else { best[lane] };
                index[lane] = if nearer { triangle } else { index[lane] };
            }
        }
        for lane in 0..LANES {
            let voxel = corner_of(corner, 1.0, lane).map(|value| value as usize);
            let at = offset(voxel[0], voxel[1], voxel[2]);
            (self.squared[at], self.index[at]) = (best[lane], index[lane]);
        }
    }
}

/// Corner of one of the eight sub-blocks of edge `size` inside the block at `corner`.
fn corner_of(corner: [f32; 3], size: f32, lane: usize) -> [f32; 3] {
    let bit = |shift: usize| (lane >> shift & 1) as f32 * size;
    [corner[0] + bit(2), corner[1] + bit(1), corner[2] + bit(0)]
}

/// Centres (corner + half) of the eight sub-blocks.
fn points(corner: [f32; 3], size: f32, half: f32) -> Points {
    let mut points = Points { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };
    for lane in 0..LANES {
        let at = corner_of(corner, size, lane);
        (points.x[lane], points.y[lane], points.z[lane]) = (at[0] + half, at[1] + half, at[2] + half);
    }
    points
}

/// Lists the triangles that can be nearest to some voxel of a sub-block; false when all are out of reach.
fn keep(
    list: &[u32],
    squared: &[[f32; LANES]],
    lane: usize,
    radius: f32,
    reach: f32,
    out: &mut Vec<u32>,
) -> bool {
    let least =
        squared.iter().fold(f32::INFINITY, |least, d| if d[lane] < least { d[lane] } else { least }).sqrt();
    if least > reach + radius {
        return false;
    }
    let limit = (least + 2.0 * radius).min(reach + radius);
    let limit = limit * limit;
    out.clear();
    out.extend(list.iter().zip(squared).filter(|(_, d)| d[lane] <= limit).map(|(&index, _)| index));
    true
}
