//! Nearest triangle of every voxel of a block, by halving: bounds at the centres of 4^3 and 2^3
//! sub-blocks leave few triangles for the exact distances.

use super::distance::{LANES, Points, Triangle, to_each};
use crate::base::blocks::offset;

/// Working memory of one thread.
#[derive(Default)]
pub struct Scratch {
    lists: [Vec<u32>; 3],
    squared: [Vec<[f32; LANES]>; 3],
}

/// A voxel with the triangles around it.
pub struct Around<'a> {
    /// The voxel's number in its block.
    pub voxel: usize,
    /// Triangles that may be near.
    pub list: &'a [u32],
    /// Squared distance (cells^2) and index of the nearest.
    pub nearest: (f32, u32),
    /// Every triangle nearer than this (cells) is listed.
    pub complete_to: f32,
    squared: &'a [[f32; LANES]],
    lane: usize,
}

impl Around<'_> {
    /// The nearest triangle after `last`, by squared distance, then index.
    pub fn next_after(&self, last: (f32, u32)) -> Option<(f32, u32)> {
        let mut next: Option<(f32, u32)> = None;
        for (&index, squared) in self.list.iter().zip(self.squared) {
            let this = (squared[self.lane], index);
            if before(last, this) && next.is_none_or(|next| before(this, next)) {
                next = Some(this);
            }
        }
        next
    }
}

fn before(a: (f32, u32), b: (f32, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

/// Half diagonals between the voxel centres of a 4^3 and of a 2^3 sub-block, with room for rounding.
const RADII: [f32; 2] = [2.599, 0.867];

/// Shows `see` every voxel of a block that may be nearer than `reach` cells to a triangle.
pub fn search(triangles: &[Triangle], reach: f32, scratch: &mut Scratch, mut see: impl FnMut(&Around<'_>)) {
    let Scratch { lists: [all, some, few], squared: [far, mid, near] } = scratch;
    all.clear();
    all.extend(0..triangles.len() as u32);
    to_each(triangles, all, &points([0.0; 3], 4.0, 1.5), far);
    for lane in 0..LANES {
        if keep(all, far, lane, RADII[0], reach, some).is_none() {
            continue;
        }
        let corner = corner_of([0.0; 3], 4.0, lane);
        to_each(triangles, some, &points(corner, 2.0, 0.5), mid);
        for lane in 0..LANES {
            let Some(least) = keep(some, mid, lane, RADII[1], reach, few) else { continue };
            let corner = corner_of(corner, 2.0, lane);
            to_each(triangles, few, &points(corner, 1.0, 0.0), near);
            show(corner, few, near, least + RADII[1], &mut see);
        }
    }
}

fn show(
    corner: [f32; 3],
    list: &[u32],
    squared: &[[f32; LANES]],
    complete_to: f32,
    see: &mut impl FnMut(&Around<'_>),
) {
    let mut best = [f32::INFINITY; LANES];
    let mut index = [u32::MAX; LANES];
    for (&triangle, distances) in list.iter().zip(squared) {
        for lane in 0..LANES {
            let nearer = distances[lane] < best[lane];
            best[lane] = if nearer { distances[lane] } else { best[lane] };
            index[lane] = if nearer { triangle } else { index[lane] };
        }
    }
    for lane in 0..LANES {
        let at = corner_of(corner, 1.0, lane).map(|value| value as usize);
        let voxel = offset(at[0], at[1], at[2]);
        see(&Around { voxel, list, nearest: (best[lane], index[lane]), complete_to, squared, lane });
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

/// Lists the triangles that can be nearest to some voxel of a sub-block, and gives the least distance from
/// its centre; none when all are out of reach.
fn keep(
    list: &[u32],
    squared: &[[f32; LANES]],
    lane: usize,
    radius: f32,
    reach: f32,
    out: &mut Vec<u32>,
) -> Option<f32> {
    let least =
        squared.iter().fold(f32::INFINITY, |least, d| if d[lane] < least { d[lane] } else { least }).sqrt();
    if least > reach + radius {
        return None;
    }
    let limit = (least + 2.0 * radius).min(reach + radius);
    let limit = limit * limit;
    out.clear();
    out.extend(list.iter().zip(squared).filter(|(_, d)| d[lane] <= limit).map(|(&index, _)| index));
    Some(least)
}
