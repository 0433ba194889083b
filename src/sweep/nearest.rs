//! Nearest triangle of every voxel of a block, by halving: bounds at the centres of 4^3 and 2^3
//! sub-blocks leave few triangles for the exact distances.

use super::distance::{LANES, Offsets, Points, Triangle, near_lanes, nearest, prune, to_each};
use super::prism::Bundle;
use crate::base::blocks::{Mask, offset};

/// Working memory of one thread.
#[derive(Default)]
pub struct Scratch {
    lists: [Vec<u32>; 4],
    offsets: [Vec<Offsets>; 2],
    /// For each triangle the sub-blocks in which it can be nearest to a voxel, a bit each.
    lanes: [Vec<u8>; 2],
    centre: Vec<[f32; 4]>,
    /// What [`super::voxelise`] asks whether points bound the volume with.
    pub bundle: Bundle,
}

/// Half diagonals between the voxel centres of a 4^3 and of a 2^3 sub-block, with room for rounding.
const RADII: [f32; 2] = [2.599, 0.867];

/// Eight voxels, 2^3, and the triangles nearest to them.
pub struct Group<'a> {
    /// Positions from the block's corner (cells).
    pub points: Points,
    /// Squared distances (cells^2).
    pub squared: [f32; LANES],
    /// Number of each one's nearest triangle.
    pub nearest: [u32; LANES],
    /// All triangles within `complete` cells of a voxel, and some farther away.
    pub near: &'a [u32],
    /// See `near`.
    pub complete: f32,
}

impl Group<'_> {
    /// Number of a voxel in its block.
    pub fn voxel(&self, lane: usize) -> usize {
        let [x, y, z] = [self.points.x, self.points.y, self.points.z].map(|axis| axis[lane] as usize);
        offset(x, y, z)
    }
}

/// Gives `see` the voxels of a block that may be nearer than `reach` cells to a triangle, where one of eight is
/// wanted.
pub fn search(
    triangles: &[Triangle],
    reach: f32,
    wanted: &Mask,
    scratch: &mut Scratch,
    mut see: impl FnMut(&Group<'_>),
) {
    let Scratch { lists: [all, some, near, few], offsets: [far, mid], lanes, centre, .. } = scratch;
    all.clear();
    all.extend(0..triangles.len() as u32);
    to_each(triangles, all, &points([0.0; 3], 4.0, 1.5), far);
    let far_near = near_lanes(far, RADII[0], reach, &mut lanes[0]);
    for (lane, in_reach) in far_near.into_iter().enumerate() {
        let corner = corner_of([0.0; 3], 4.0, lane);
        if !in_reach || !any_wanted(wanted, corner, 4) {
            continue;
        }
        some.clear();
        some.extend(all.iter().zip(&lanes[0]).filter(|(_, bits)| **bits >> lane & 1 == 1).map(|(&id, _)| id));
        to_each(triangles, some, &points(corner, 2.0, 0.5), mid);
        let mid_near = near_lanes(mid, RADII[1], reach, &mut lanes[1]);
        for (lane, in_reach) in mid_near.into_iter().enumerate() {
            let corner = corner_of(corner, 2.0, lane);
            if !in_reach || !any_wanted(wanted, corner, 2) {
                continue;
            }
            near.clear();
            centre.clear();
            for (at, _) in lanes[1].iter().enumerate().filter(|(_, bits)| **bits >> lane & 1 == 1) {
                let offset = &mid[at];
                near.push(some[at]);
                centre.push([offset.x[lane], offset.y[lane], offset.z[lane], offset.squared[lane]]);
            }
            let least = centre.iter().map(|offset| offset[3]).fold(f32::INFINITY, f32::min).sqrt();
            let complete = (least + RADII[1]).min(reach);
            few.clone_from(near);
            prune(few, centre);
            let points = points(corner, 1.0, 0.0);
            let (squared, nearest) = nearest(triangles, few, &points);
            see(&Group { points, squared, nearest, near, complete });
        }
    }
}

/// Whether a voxel of a sub-block is wanted.
fn any_wanted(wanted: &Mask, corner: [f32; 3], size: usize) -> bool {
    let [x, y, z] = corner.map(|value| value as usize);
    let row = ((1u64 << size) - 1) << z;
    let plane = (y..y + size).fold(0, |plane, y| plane | row << (y * 8));
    wanted[x..x + size].iter().any(|bits| bits & plane != 0)
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
