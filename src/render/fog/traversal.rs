//! Traverses the blocks along a ray, skipping empty blocks and nodes (Amanatides and Woo 1987, on two levels).

use super::blocks::{Fog, Lookup, NODE};
use crate::geometry::DVec3;
use crate::numeric::blocks::DIM;

/// State of a ray that passes through a fog.
struct Traversal<'a> {
    fog: &'a Fog,
    /// Its origin, in voxels, and voxels per metre along it.
    origin: DVec3,
    direction: DVec3,
    /// Block position.
    position: [i32; 3],
    /// Distance (m) along the ray at which it leaves the block through each side.
    sides: [f64; 3],
    /// Current distance (m) along the ray, and its end.
    at: f64,
    end: f64,
}

/// The segment of a ray in one block (distances along the ray, m).
#[derive(Clone, Copy)]
struct Segment {
    from: f64,
    to: f64,
    block: usize,
}

impl<'a> Traversal<'a> {
    /// From a point (m) in a direction (a unit vector), at most to `end` (m); none where the ray misses the fog.
    fn new(fog: &'a Fog, from: DVec3, toward: DVec3, end: f64) -> Option<Self> {
        let [origin, direction] = fog.placement().ray(from, toward);
        let [low, high] = fog.block_box();
        let (mut enter, mut leave) = (0.0f64, end);
        for axis in 0..3 {
            let [low, high] = [low[axis], high[axis]].map(|at| f64::from(at) * DIM as f64 - origin[axis]);
            if direction[axis] == 0.0 {
                if !(low <= 0.0 && high > 0.0) {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / direction[axis], high / direction[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        // The box of a fog without blocks contains no block position.
        if enter >= leave || low == high {
            return None;
        }
        let mut traversal =
            Self { fog, origin, direction, position: [0; 3], sides: [0.0; 3], at: enter, end: leave };
        traversal.locate([low, high.map(|at| at - 1)]);
        Some(traversal)
    }

    /// Sets the block position from `at`, clamped to a box (minimum and maximum).
    fn locate(&mut self, [low, high]: [[i32; 3]; 2]) {
        for axis in 0..3 {
            let at = (self.origin[axis] + self.direction[axis] * self.at) / DIM as f64;
            // A number that does not fit an i32 becomes its maximum or minimum.
            self.position[axis] = (at.floor() as i32).clamp(low[axis], high[axis]);
            self.sides[axis] = self.side(axis, self.position[axis], 1);
        }
    }

    /// Distance (m) along the ray at which it leaves the `count` block positions from `position` on along an axis.
    fn side(&self, axis: usize, position: i32, count: i32) -> f64 {
        let direction = self.direction[axis];
        if direction == 0.0 {
            return f64::INFINITY;
        }
        let plane = if direction > 0.0 { position + count } else { position };
        (f64::from(plane) * DIM as f64 - self.origin[axis]) / direction
    }

    /// Steps to the next block position.
    fn step(&mut self) {
        let axis = nearest_side(self.sides);
        self.at = self.at.max(self.sides[axis]);
        self.position[axis] += if self.direction[axis] > 0.0 { 1 } else { -1 };
        self.sides[axis] = self.side(axis, self.position[axis], 1);
    }

    /// Steps beyond the node.
    fn leave_node(&mut self) {
        let low = self.position.map(|at| at.div_euclid(NODE) * NODE);
        let sides = [0, 1, 2].map(|axis| self.side(axis, low[axis], NODE));
        let axis = nearest_side(sides);
        self.at = self.at.max(sides[axis]);
        let (mut first, mut last) = (low, low.map(|at| at + NODE - 1));
        let next = if self.direction[axis] > 0.0 { low[axis] + NODE } else { low[axis] - 1 };
        (first[axis], last[axis]) = (next, next);
        self.locate([first, last]);
    }

    /// The next segment in a block that is not empty.
    fn next(&mut self) -> Option<Segment> {
        while self.at < self.end {
            match self.fog.lookup(self.position) {
                Lookup::Outside => return None,
                Lookup::Empty => self.step(),
                Lookup::EmptyNode => self.leave_node(),
                Lookup::Block(block) => {
                    let from = self.at;
                    self.step();
                    return Some(Segment { from, to: self.at.min(self.end), block });
                }
            }
        }
        None
    }
}

fn nearest_side(sides: [f64; 3]) -> usize {
    (0..3).fold(0, |best, axis| if sides[axis] < sides[best] { axis } else { best })
}

/// A position in a fog.
#[derive(Clone, Copy)]
pub(super) struct FogPosition {
    /// Which fog.
    pub fog: usize,
    /// Which of its blocks.
    pub block: usize,
    /// Voxels from the block's minimum corner, 0 to 8.
    pub local: [f32; 3],
}

/// A ray in one of the fogs, with its current segment.
struct RayInFog<'a> {
    index: usize,
    traversal: Traversal<'a>,
    segment: Segment,
}

impl RayInFog<'_> {
    fn position(&self, at: f64) -> FogPosition {
        let block = self.segment.block;
        let corner = self.traversal.fog.blocks()[block].origin;
        let local = [0, 1, 2].map(|axis| {
            let voxel =
                self.traversal.origin[axis] + self.traversal.direction[axis] * at - f64::from(corner[axis]);
            (voxel as f32).clamp(0.0, DIM as f32)
        });
        FogPosition { fog: self.index, block, local }
    }
}

/// The fogs that a ray from a point (m) in a direction (a unit vector) meets up to `end` (m).
fn rays_in_fogs(
    fogs: &[Fog],
    (from, toward): (DVec3, DVec3),
    end: f64,
) -> impl Iterator<Item = RayInFog<'_>> {
    fogs.iter().enumerate().filter_map(move |(index, fog)| {
        let mut traversal = Traversal::new(fog, from, toward, end)?;
        traversal.next().map(|segment| RayInFog { index, traversal, segment })
    })
}

/// Marches along a ray from a point (m) in a direction (a unit vector), at most to `end` (m), through all blocks that are not empty, in
/// steps of at most `stride` voxels. Calls `each` with the start and the end of a step (m) and the positions at its middle, one for each
/// fog there, until it returns false.
pub(super) fn march(
    fogs: &[Fog],
    (from, toward): (DVec3, DVec3),
    end: f64,
    stride: f64,
    mut each: impl FnMut(f64, f64, &[FogPosition]) -> bool,
) {
    let mut rays: Vec<RayInFog<'_>> = rays_in_fogs(fogs, (from, toward), end).collect();
    let mut positions = Vec::with_capacity(rays.len());
    let mut at = 0.0f64;
    while !rays.is_empty() {
        let first = rays.iter().map(|ray| ray.segment.from).fold(f64::INFINITY, f64::min);
        let from = first.max(at);
        let is_in = |ray: &&RayInFog<'_>| ray.segment.from <= from;
        // The steps up to `to` stay in the same blocks.
        let ends = rays.iter().map(|ray| if is_in(&ray) { ray.segment.to } else { ray.segment.from });
        let to = ends.fold(f64::INFINITY, f64::min);
        let voxels = rays.iter().filter(is_in).map(|ray| ray.traversal.direction.norm()).fold(0.0, f64::max);
        let count = ((to - from) * voxels / stride).ceil().max(1.0);
        let step = (to - from) / count;
        for n in 0..count as usize {
            let [begin, middle, end] = [0.0, 0.5, 1.0].map(|part| from + step * (n as f64 + part));
            positions.clear();
            positions.extend(rays.iter().filter(is_in).map(|ray| ray.position(middle)));
            if !each(begin, end, &positions) {
                return;
            }
        }
        at = to;
        rays.retain_mut(|ray| {
            while ray.segment.to <= at {
                match ray.traversal.next() {
                    Some(segment) => ray.segment = segment,
                    None => return false,
                }
            }
            true
        });
    }
}

/// Where a ray from a point (m) in a direction (a unit vector) first enters a block that is not empty.
pub(super) fn first_entry(fogs: &[Fog], ray: (DVec3, DVec3)) -> Option<FogPosition> {
    let rays = rays_in_fogs(fogs, ray, f64::INFINITY);
    let first = rays.reduce(|a, b| if b.segment.from < a.segment.from { b } else { a })?;
    Some(first.position(first.segment.from))
}

#[cfg(test)]
mod tests {
    use super::super::blocks::{Part, Placement};
    use super::*;
    use crate::{Context, Pool};

    /// Whole numbers, 0 to below `count`, the same in every run.
    fn numbers(count: i32) -> impl FnMut() -> i32 {
        let mut state = 42u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % count as u64) as i32
        }
    }

    /// Length of a ray inside a block (voxels).
    fn length(origin: DVec3, direction: DVec3, corner: [i32; 3]) -> f64 {
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            let [a, b] = [corner[axis], corner[axis] + DIM as i32].map(|at| f64::from(at) - origin[axis]);
            if direction[axis] == 0.0 {
                // A ray in the plane between two blocks is in the one behind it.
                leave = if a <= 0.0 && b > 0.0 { leave } else { enter };
            } else {
                let [a, b] = [a / direction[axis], b / direction[axis]];
                (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            }
        }
        (leave - enter).max(0.0)
    }

    #[test]
    fn rays_pass_every_block_on_their_way_once() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let mut number = numbers(100);
        let mut positions: Vec<[i32; 3]> =
            (0..80).map(|_| [0; 3].map(|_: i32| 8 * (number() - 50))).collect();
        positions.sort_unstable();
        positions.dedup();
        let parts = positions.iter().map(|at| (*at, Part::Uniform(1.0))).collect();
        let axes = [DVec3::x(), DVec3::y(), DVec3::z()];
        let placement = Placement::new(DVec3::zeros(), axes).unwrap();
        let fogs = [Fog::of_parts(&ctx, placement, parts, 1.0).unwrap()];
        for n in 0..400 {
            let target =
                positions[n % positions.len()].map(|at| f64::from(at) + 1.5 + f64::from(number()) * 0.05);
            let mut origin = DVec3::from([0; 3].map(|_: i32| f64::from(12 * (number() - 50)) + 0.25));
            // Some rays run along one axis or in a plane.
            (0..n % 3).for_each(|axis| origin[(axis + n) % 3] = target[(axis + n) % 3]);
            let toward = (DVec3::from(target) - origin).normalize();
            let mut passed = vec![0.0; fogs[0].blocks().len()];
            let mut at = 0.0;
            march(&fogs, (origin, toward), f64::INFINITY, 2.0, |from, to, positions| {
                assert!(from >= at - 1e-9 && to - from <= 2.0 + 1e-9, "{n}: {at} {from} {to}");
                at = to;
                positions.iter().for_each(|position| passed[position.block] += to - from);
                true
            });
            for (block, passed) in fogs[0].blocks().iter().zip(passed) {
                let expected = length(origin, toward, block.origin);
                assert!(
                    (passed - expected).abs() < 1e-6,
                    "{n}: {passed}, not {expected}, of {:?}",
                    block.origin
                );
            }
        }
    }
}
