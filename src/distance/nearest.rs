//! Nearest triangle to every voxel of a block, by subdivision: bounds at the centres of 4^3 and 2^3 sub-blocks leave few triangles for the
//! exact distances.

use super::triangle::{Offsets, Points, Triangle, near_lanes, nearest, prune, to_each};
use crate::numeric::blocks::{Mask, offset};
use crate::numeric::lanes::LANES;

/// Scratch memory of [`search`].
#[derive(Default)]
pub struct Search {
    lists: [Vec<u32>; 4],
    offsets: [Vec<Offsets>; 2],
    /// For each triangle, a mask of the sub-blocks in which it can be nearest to a voxel.
    lanes: [Vec<u8>; 2],
    centre: Vec<[f32; 4]>,
}

/// Half the distance between opposite corner voxels of a 4^3 and of a 2^3 sub-block (cells), rounded up.
const RADII: [f32; 2] = [2.599, 0.867];

/// Eight voxels, 2^3, and the triangles nearest to them.
pub struct Group<'a> {
    /// Index of the first voxel in its block.
    first: usize,
    /// Positions of the voxels from the block's corner (cells).
    pub points: Points,
    /// Squared distance of each voxel from its nearest triangle (cells^2).
    pub squared: [f32; LANES],
    /// Index of the triangle nearest to each voxel.
    pub nearest: [u32; LANES],
    /// All triangles within `complete` of one of the voxels, and some that are farther away.
    pub near: &'a [u32],
    /// Distance (cells) up to which `near` is complete.
    pub complete: f32,
    /// Offsets of the eight 4^3 sub-blocks' centres from all triangles, and the index of the sub-block of the voxels.
    far: (&'a [Offsets], usize),
}

impl Group<'_> {
    /// Index of a voxel in its block.
    pub fn voxel(&self, lane: usize) -> usize {
        self.first + offset(lane >> 2, lane >> 1 & 1, lane & 1)
    }

    /// All triangles within this distance (cells) of one of the voxels, and some that are farther away.
    pub fn within(&self, cells: f32) -> Vec<u32> {
        let (far, sub_block) = self.far;
        let max_squared = (cells + RADII[0]).powi(2);
        let near = far.iter().zip(0..).filter(|(offset, _)| offset.squared[sub_block] <= max_squared);
        near.map(|(_, id)| id).collect()
    }
}

/// Calls `see` with the groups of eight voxels of a block that contain a wanted one and may be within `reach` cells of
/// a triangle.
pub fn search(
    triangles: &[Triangle],
    reach: f32,
    wanted: &Mask,
    scratch: &mut Search,
    mut see: impl FnMut(&Group<'_>),
) {
    let Search { lists: [all, some, near, few], offsets: [far, mid], lanes, centre } = scratch;
    all.clear();
    all.extend(0..triangles.len() as u32);
    to_each(triangles, all, &points([0.0; 3], 4.0, 1.5), far);
    let far_near = near_lanes(far, RADII[0], reach, &mut lanes[0]);
    for (sub_block, in_reach) in far_near.into_iter().enumerate() {
        let corner = corner_of([0.0; 3], 4.0, sub_block);
        if !in_reach || !any_wanted(wanted, corner, 4) {
            continue;
        }
        some.clear();
        each_near(&lanes[0], sub_block, |at| some.push(at as u32));
        to_each(triangles, some, &points(corner, 2.0, 0.5), mid);
        let mid_near = near_lanes(mid, RADII[1], reach, &mut lanes[1]);
        for (lane, in_reach) in mid_near.into_iter().enumerate() {
            let corner = corner_of(corner, 2.0, lane);
            if !in_reach || !any_wanted(wanted, corner, 2) {
                continue;
            }
            near.clear();
            centre.clear();
            each_near(&lanes[1], lane, |at| {
                let offset = &mid[at];
                near.push(some[at]);
                centre.push([offset.x[lane], offset.y[lane], offset.z[lane], offset.squared[lane]]);
            });
            let nearest_centre = centre.iter().map(|offset| offset[3]).fold(f32::INFINITY, f32::min).sqrt();
            let complete = (nearest_centre + RADII[1]).min(reach);
            few.clone_from(near);
            prune(few, centre);
            let points = points(corner, 1.0, 0.0);
            let (squared, nearest) = nearest(triangles, few, &points);
            let [x, y, z] = corner.map(|value| value as usize);
            see(&Group {
                first: offset(x, y, z),
                points,
                squared,
                nearest,
                near,
                complete,
                far: (far, sub_block),
            });
        }
    }
}

/// Calls `see` with the index of each byte in which the bit of a sub-block is set. Most bytes have no such bit: eight are tested at once.
fn each_near(bits: &[u8], sub_block: usize, mut see: impl FnMut(usize)) {
    for (eight, begin) in bits.chunks(8).zip((0..).step_by(8)) {
        let mut bytes = [0; 8];
        bytes[..eight.len()].copy_from_slice(eight);
        let mut set = u64::from_le_bytes(bytes) >> sub_block & 0x0101_0101_0101_0101;
        while set != 0 {
            see(begin + set.trailing_zeros() as usize / 8);
            set &= set - 1;
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
