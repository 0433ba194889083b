//! The unbounded prism over a triangle: four linear functions that tell where a segment passes the triangle. The
//! prisms of a cell are asked eight at a time.

use super::cells::{Point, cross, difference, dot, sub};
use super::lattice::{Fixed, UNITS};
use crate::base::cpu::dispatch;

/// Prisms asked at once.
const LANES: usize = 8;
/// Nearer than this (cells), sides are told in 64 bits.
const CLEAR: f32 = 1e-3;
/// How far apart two points may be whose winding numbers are told together (cells).
pub const BESIDE: f32 = 0.02;

/// Height over the triangle's plane, then for each edge how far inward of it (cells), as linear functions of a
/// position: `f[0] * p.x + f[1] * p.y + f[2] * p.z + f[3]`. One line of cache.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
pub struct Prism([[f32; 4]; 4]);

impl Prism {
    /// The prism of a triangle with this normal (of any length), for positions in cells from a voxel.
    pub fn new(v: &[Fixed; 3], normal: &Point, voxel: [i32; 3]) -> Self {
        let along = |direction: Point, through: &Fixed| {
            let length = dot(&direction, &direction).sqrt().max(f64::MIN_POSITIVE);
            let unit = direction.map(|value| value / length);
            let corner = through.map(|value| f64::from(value) / f64::from(UNITS));
            let constant = dot(&unit, &sub(voxel.map(f64::from), corner));
            [unit[0], unit[1], unit[2], constant].map(|value| value as f32)
        };
        let edge = |i: usize| along(cross(*normal, difference(&v[(i + 1) % 3], &v[i])), &v[i]);
        Self([along(*normal, &v[0]), edge(0), edge(1), edge(2)])
    }
}

/// Cells whose prisms are kept at hand.
const KEPT: usize = 12;

/// The prisms of the cells that one thread asked last.
#[derive(Default)]
pub struct Prisms {
    /// The chain that they are of.
    chain: u64,
    /// Numbers of the cells.
    cells: Vec<usize>,
    bundles: Vec<Bundle>,
    /// The one to give up next.
    oldest: usize,
}

impl Prisms {
    /// The prisms of a chain's cell, each made with its face's number and coefficient if it is not at hand.
    pub fn of<I>(&mut self, chain: u64, cell: usize, prisms: impl FnOnce() -> I) -> &mut Bundle
    where
        I: Iterator<Item = (Prism, u32, i32)>,
    {
        if self.chain != chain {
            self.chain = chain;
            self.cells.clear();
        }
        if let Some(place) = self.cells.iter().position(|&other| other == cell) {
            return &mut self.bundles[place];
        }
        let place = if self.cells.len() < KEPT {
            self.cells.push(cell);
            self.cells.len() - 1
        } else {
            self.oldest = (self.oldest + 1) % KEPT;
            self.cells[self.oldest] = cell;
            self.oldest
        };
        if place == self.bundles.len() {
            self.bundles.push(Bundle::default());
        }
        self.bundles[place].take(prisms());
        &mut self.bundles[place]
    }
}

/// The prisms of one cell side by side.
#[derive(Default)]
pub struct Bundle {
    groups: Vec<Group>,
    /// Each one's face, lane after lane.
    faces: Vec<u32>,
    unclear: Vec<u32>,
}

/// Eight prisms.
struct Group {
    /// The four numbers of the plane's function, then of each edge's.
    functions: [[f32; LANES]; 16],
    /// How many layers of the chain end at each face; 0 where there is none.
    coef: [i32; LANES],
}

/// How winding numbers change along a way.
pub struct Change {
    /// From its begin to its end, as far as 32 bits tell.
    pub along: i32,
    /// From its end to the point beside it.
    pub beside: i32,
}

impl Bundle {
    /// Takes the prisms of a cell, each with its face's number and coefficient.
    fn take(&mut self, prisms: impl Iterator<Item = (Prism, u32, i32)>) {
        self.groups.clear();
        self.faces.clear();
        for (Prism(functions), face, coef) in prisms {
            let lane = self.faces.len() % LANES;
            if lane == 0 {
                // What no face is in is far in front of a plane.
                let mut none = [[0.0; LANES]; 16];
                none[3] = [1e9; LANES];
                self.groups.push(Group { functions: none, coef: [0; LANES] });
            }
            let group = self.groups.last_mut().expect("one was pushed");
            group.functions.iter_mut().zip(functions.as_flattened()).for_each(|(to, from)| to[lane] = *from);
            group.coef[lane] = coef;
            self.faces.push(face);
        }
    }

    /// How winding numbers change from `begin` to `end` and from there to `beside`, at most [`BESIDE`] away.
    pub fn ask(&mut self, begin: [f32; 3], end: [f32; 3], beside: [f32; 3]) -> Change {
        self.unclear.clear();
        let [along, beside] = pass(&self.groups, begin, end, beside, &mut self.unclear);
        Change { along, beside }
    }

    /// The faces, and their coefficients, that the way of the last question begins too near to the plane of, or
    /// passes too near to an edge of, to tell in 32 bits.
    pub fn unclear(&self) -> impl Iterator<Item = (u32, i32)> {
        self.unclear.iter().map(|&at| {
            let at = at as usize;
            (self.faces[at], self.groups[at / LANES].coef[at % LANES])
        })
    }
}

/// Sums what the prisms say of the two ways, and lists those that are not clear about the first.
fn pass(
    groups: &[Group],
    begin: [f32; 3],
    end: [f32; 3],
    beside: [f32; 3],
    unclear: &mut Vec<u32>,
) -> [i32; 2] {
    #[inline(always)]
    fn value(f: &[[f32; LANES]; 16], function: usize, lane: usize, p: [f32; 3]) -> f32 {
        let k = 4 * function;
        f[k][lane] * p[0] + f[k + 1][lane] * p[1] + f[k + 2][lane] * p[2] + f[k + 3][lane]
    }
    #[inline(always)]
    fn least_inward(f: &[[f32; LANES]; 16], lane: usize, p: [f32; 3]) -> f32 {
        let (a, b, c) = (value(f, 1, lane, p), value(f, 2, lane, p), value(f, 3, lane, p));
        let least = if a < b { a } else { b };
        if c < least { c } else { least }
    }
    #[inline(always)]
    fn body(
        groups: &[Group],
        begin: [f32; 3],
        end: [f32; 3],
        beside: [f32; 3],
        unclear: &mut Vec<u32>,
    ) -> [i32; 2] {
        let (mut along, mut aside) = ([0; LANES], [0; LANES]);
        for (at, Group { functions: f, coef }) in groups.iter().enumerate() {
            let mut doubts = [0; LANES];
            for lane in 0..LANES {
                let (first, last) = (value(f, 0, lane, begin), value(f, 0, lane, end));
                let after = value(f, 0, lane, beside);
                let t = first / (first - last);
                let meeting = [
                    begin[0] + t * (end[0] - begin[0]),
                    begin[1] + t * (end[1] - begin[1]),
                    begin[2] + t * (end[2] - begin[2]),
                ];
                let least = least_inward(f, lane, meeting);
                let sure = first.abs() > CLEAR;
                let same_side = (first > 0.0) & (last > 0.0) | (first < 0.0) & (last < 0.0);
                let misses = sure & (same_side | (least < -CLEAR));
                let passes = sure & !same_side & (least > CLEAR);
                let way = if first > 0.0 { coef[lane] } else { -coef[lane] };
                along[lane] += if passes { way } else { 0 };
                doubts[lane] = i32::from(!(misses | passes));
                let near = (last.abs() <= BESIDE) & (least_inward(f, lane, beside) > 0.0);
                let way = if last > 0.0 { coef[lane] } else { -coef[lane] };
                aside[lane] += if near & ((last > 0.0) != (after > 0.0)) { way } else { 0 };
            }
            if doubts != [0; LANES] {
                let lanes = doubts.iter().zip(0..).filter(|(doubt, _)| **doubt != 0);
                unclear.extend(lanes.map(|(_, lane): (_, u32)| (at * LANES) as u32 + lane));
            }
        }
        [along.iter().sum(), aside.iter().sum()]
    }
    dispatch!(body(groups: &[Group], begin: [f32; 3], end: [f32; 3], beside: [f32; 3], unclear: &mut Vec<u32>) -> [i32; 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eleven sheets, one cell apart, that face up; the one at height k counts k + 1 times.
    fn sheets() -> Bundle {
        let sheet = |k: i32| {
            let v = [[0, 0, k], [8, 0, k], [0, 8, k]].map(|p| p.map(|cells| cells * UNITS));
            (Prism::new(&v, &[0.0, 0.0, 1.0], [0; 3]), 100 + k as u32, k + 1)
        };
        let mut bundle = Bundle::default();
        bundle.take((0..11).map(sheet));
        bundle
    }

    #[test]
    fn a_way_counts_the_sheets_that_it_passes() {
        let mut bundle = sheets();
        let mut along = |begin, end| {
            let change = bundle.ask(begin, end, end);
            assert_eq!((change.beside, bundle.unclear().count()), (0, 0));
            change.along
        };
        assert_eq!(along([1.0, 1.0, 10.5], [1.0, 1.0, -0.5]), 66);
        assert_eq!(along([1.0, 1.0, -0.5], [1.0, 1.0, 10.5]), -66);
        assert_eq!(along([1.0, 1.0, 10.5], [1.0, 1.0, 4.5]), 51);
        assert_eq!(along([6.0, 6.0, 10.5], [6.0, 6.0, -0.5]), 0);
        assert_eq!(along([1.0, 1.0, 4.5], [3.0, 3.0, 4.6]), 0);
    }

    #[test]
    fn a_point_beside_counts_the_sheet_between() {
        let mut bundle = sheets();
        assert_eq!(bundle.ask([1.0, 1.0, 4.4], [1.0, 1.0, 4.005], [1.0, 1.0, 3.995]).beside, 5);
        assert_eq!(bundle.ask([1.0, 1.0, 3.6], [1.0, 1.0, 3.995], [1.0, 1.0, 4.005]).beside, -5);
        assert_eq!(bundle.ask([6.0, 6.0, 4.4], [6.0, 6.0, 4.005], [6.0, 6.0, 3.995]).beside, 0);
    }

    #[test]
    fn ways_along_edges_and_from_within_a_plane_are_told_to_be_unclear() {
        let mut bundle = sheets();
        assert_eq!(bundle.ask([4.0, 4.0, 9.5], [4.0, 4.0, 8.5], [4.0, 4.0, 8.5]).along, 0);
        assert_eq!(bundle.unclear().collect::<Vec<_>>(), [(109, 10)]);
        bundle.ask([1.0, 1.0, 2.0], [1.0, 1.0, 2.3], [1.0, 1.0, 2.3]);
        assert_eq!(bundle.unclear().collect::<Vec<_>>(), [(102, 3)]);
    }
}
