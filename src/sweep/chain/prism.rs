//! The unbounded prism over a triangle: four linear functions that decide whether a segment passes through the triangle.
//! The prisms of a bin are tested eight at a time.

use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::vectors::{cross, difference, dot, sub};
use crate::numeric::cpu::dispatch;

/// Prisms tested at once.
const LANES: usize = 8;
/// Values closer to 0 than this (cells) are not decided in 32-bit arithmetic.
const CLEAR: f32 = 1e-3;
/// Maximum distance (cells) between a query point and the point beside it, whose winding numbers are found together.
pub const BESIDE: f32 = 0.02;

/// Height above the triangle's plane, then for each edge the distance from it (cells; positive on the triangle's side), as linear functions
/// of a position: `f[0] * p.x + f[1] * p.y + f[2] * p.z + f[3]`. One cache line.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
pub struct Prism([[f32; 4]; 4]);

impl Prism {
    /// The prism of a triangle with this normal (of any length), for positions in cells from a voxel.
    pub fn new(v: &[Fixed; 3], normal: &Point, voxel: [i32; 3]) -> Self {
        let along = |direction: Point, through: &Fixed| {
            let length = dot(direction, direction).sqrt().max(f64::MIN_POSITIVE);
            let unit = direction.map(|value| value / length);
            let corner = through.map(|value| f64::from(value) / f64::from(UNITS));
            let constant = dot(unit, sub(voxel.map(f64::from), corner));
            [unit[0], unit[1], unit[2], constant].map(|value| value as f32)
        };
        let edge = |i: usize| along(cross(*normal, difference(v[(i + 1) % 3], v[i])), &v[i]);
        Self([along(*normal, &v[0]), edge(0), edge(1), edge(2)])
    }
}

/// Number of bins whose prisms are cached.
const CACHED: usize = 12;

/// Cache of the prisms of the bins that one thread queried last.
#[derive(Default)]
pub struct Prisms {
    /// Identifies the chain that the prisms belong to.
    chain: u64,
    /// Indices of the bins.
    bins: Vec<usize>,
    groups: Vec<BinPrisms>,
    /// The entry that was replaced last.
    last_replaced: usize,
}

impl Prisms {
    /// The prisms of a chain's bin; if they are not cached, `prisms` makes them, each with its face's index and coefficient.
    pub fn of<I>(&mut self, chain: u64, bin: usize, prisms: impl FnOnce() -> I) -> &mut BinPrisms
    where
        I: Iterator<Item = (Prism, u32, i32)>,
    {
        if self.chain != chain {
            self.chain = chain;
            self.bins.clear();
        }
        if let Some(position) = self.bins.iter().position(|&other| other == bin) {
            return &mut self.groups[position];
        }
        let position = if self.bins.len() < CACHED {
            self.bins.push(bin);
            self.bins.len() - 1
        } else {
            self.last_replaced = (self.last_replaced + 1) % CACHED;
            self.bins[self.last_replaced] = bin;
            self.last_replaced
        };
        if position == self.groups.len() {
            self.groups.push(BinPrisms::default());
        }
        self.groups[position].replace(prisms());
        &mut self.groups[position]
    }
}

/// The prisms of one bin.
#[derive(Default)]
pub struct BinPrisms {
    groups: Vec<Group>,
    /// The face of each prism, lane after lane.
    faces: Vec<u32>,
    unclear: Vec<u32>,
}

/// Eight prisms.
struct Group {
    /// The four coefficients of the plane's function, then of each edge's.
    functions: [[f32; LANES]; 16],
    /// Coefficient of each face; 0 in lanes without one.
    coef: [i32; LANES],
}

/// How winding numbers change along a segment, and from its end to a point near it.
pub struct Change {
    /// From its beginning to its end, through the faces that 32-bit arithmetic decides.
    pub along: i32,
    /// From its end to the point beside it.
    pub beside: i32,
}

impl BinPrisms {
    /// Replaces the prisms by those of another bin, each with its face's index and coefficient.
    fn replace(&mut self, prisms: impl Iterator<Item = (Prism, u32, i32)>) {
        self.groups.clear();
        self.faces.clear();
        for (Prism(functions), face, coef) in prisms {
            let lane = self.faces.len() % LANES;
            if lane == 0 {
                // Lanes without a face: every point is far in front of the plane.
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

    /// How winding numbers change from `begin` to `end`, and from there to `beside`, which is at most [`BESIDE`] away.
    pub fn query(&mut self, begin: [f32; 3], end: [f32; 3], beside: [f32; 3]) -> Change {
        self.unclear.clear();
        let [along, beside] = pass(&self.groups, [begin, end, beside], &mut self.unclear);
        Change { along, beside }
    }

    /// Faces, with their coefficients, that 32-bit arithmetic could not decide for the last query: its segment starts too close to their
    /// plane or passes too close to an edge.
    pub fn unclear(&self) -> impl Iterator<Item = (u32, i32)> {
        self.unclear.iter().map(|&at| {
            let at = at as usize;
            (self.faces[at], self.groups[at / LANES].coef[at % LANES])
        })
    }
}

/// Sums the changes along the segment and to the point near its end, and lists the undecided prisms.
fn pass(groups: &[Group], points: [[f32; 3]; 3], unclear: &mut Vec<u32>) -> [i32; 2] {
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
    fn body(groups: &[Group], [begin, end, beside]: [[f32; 3]; 3], unclear: &mut Vec<u32>) -> [i32; 2] {
        let [mut along, mut aside] = [[0; LANES]; 2];
        for (at, Group { functions: f, coef }) in groups.iter().enumerate() {
            let mut doubts = [0; LANES];
            for lane in 0..LANES {
                let (first, last) = (value(f, 0, lane, begin), value(f, 0, lane, end));
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
                let signed = if first > 0.0 { coef[lane] } else { -coef[lane] };
                along[lane] += if passes { signed } else { 0 };
                doubts[lane] = i32::from(!(misses | passes));
                let near = (last.abs() <= BESIDE) & (least_inward(f, lane, beside) > 0.0);
                let leaves = (last > 0.0) != (value(f, 0, lane, beside) > 0.0);
                let signed = if last > 0.0 { coef[lane] } else { -coef[lane] };
                aside[lane] += if near & leaves { signed } else { 0 };
            }
            if doubts != [0; LANES] {
                let lanes = doubts.iter().zip(0..).filter(|(doubt, _)| **doubt != 0);
                unclear.extend(lanes.map(|(_, lane): (_, u32)| (at * LANES) as u32 + lane));
            }
        }
        [along, aside].map(|changes| changes.iter().sum())
    }
    dispatch!(body(groups: &[Group], points: [[f32; 3]; 3], unclear: &mut Vec<u32>) -> [i32; 2])
}

/// A position or direction in fixed-point units.
pub type Point = [f64; 3];

#[cfg(test)]
mod tests {
    use super::*;

    /// Eleven upward-facing sheets, one cell apart; the one at height k counts k + 1 times.
    fn sheets() -> BinPrisms {
        let sheet = |k: i32| {
            let v = [[0, 0, k], [8, 0, k], [0, 8, k]].map(|p| p.map(|cells| cells * UNITS));
            (Prism::new(&v, &[0.0, 0.0, 1.0], [0; 3]), 100 + k as u32, k + 1)
        };
        let mut prisms = BinPrisms::default();
        prisms.replace((0..11).map(sheet));
        prisms
    }

    #[test]
    fn a_segment_counts_the_sheets_that_it_passes_through() {
        let mut prisms = sheets();
        let mut along = |begin, end| {
            let change = prisms.query(begin, end, end);
            assert_eq!((change.beside, prisms.unclear().count()), (0, 0));
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
        let mut prisms = sheets();
        assert_eq!(prisms.query([1.0, 1.0, 4.4], [1.0, 1.0, 4.005], [1.0, 1.0, 3.995]).beside, 5);
        assert_eq!(prisms.query([1.0, 1.0, 3.6], [1.0, 1.0, 3.995], [1.0, 1.0, 4.005]).beside, -5);
        assert_eq!(prisms.query([6.0, 6.0, 4.4], [6.0, 6.0, 4.005], [6.0, 6.0, 3.995]).beside, 0);
    }

    #[test]
    fn segments_along_edges_and_from_within_a_plane_are_unclear() {
        let mut prisms = sheets();
        assert_eq!(prisms.query([4.0, 4.0, 9.5], [4.0, 4.0, 8.5], [4.0, 4.0, 8.5]).along, 0);
        assert_eq!(prisms.unclear().collect::<Vec<_>>(), [(109, 10)]);
        prisms.query([1.0, 1.0, 2.0], [1.0, 1.0, 2.3], [1.0, 1.0, 2.3]);
        assert_eq!(prisms.unclear().collect::<Vec<_>>(), [(102, 3)]);
    }
}
