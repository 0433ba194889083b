//! The unbounded prism over a triangle: four linear functions that tell where a segment passes the triangle.

use super::cells::{Point, cross, difference, dot, sub};
use super::lattice::{Fixed, UNITS};

/// Height over the triangle's plane, then for each edge how far inward of it (cells), as linear functions of a
/// position: `x[i] * p.x + y[i] * p.y + z[i] * p.z + constant[i]`. One line of cache.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
pub struct Prism {
    x: [f32; 4],
    y: [f32; 4],
    z: [f32; 4],
    constant: [f32; 4],
}

impl Prism {
    /// The prism of a triangle with this normal (of any length), for positions in cells from a voxel.
    pub fn new(v: &[Fixed; 3], normal: &Point, voxel: [i32; 3]) -> Self {
        let mut prism = Self { x: [0.0; 4], y: [0.0; 4], z: [0.0; 4], constant: [0.0; 4] };
        let mut set = |index: usize, direction: Point, through: &Fixed| {
            let length = dot(&direction, &direction).sqrt().max(f64::MIN_POSITIVE);
            let unit = direction.map(|value| value / length);
            let corner = through.map(|value| f64::from(value) / f64::from(UNITS));
            [prism.x[index], prism.y[index], prism.z[index]] = unit.map(|value| value as f32);
            prism.constant[index] = dot(&unit, &sub(voxel.map(f64::from), corner)) as f32;
        };
        set(0, *normal, &v[0]);
        (0..3).for_each(|i| set(i + 1, cross(*normal, difference(&v[(i + 1) % 3], &v[i])), &v[i]));
        prism
    }

    /// How a segment between two positions (cells) passes the triangle.
    pub fn crossing(&self, begin: [f32; 3], end: [f32; 3]) -> Crossing {
        let (begin, end) = (self.heights(begin), self.heights(end));
        if (begin[0] > CLEAR) & (end[0] > 0.0) | (begin[0] < -CLEAR) & (end[0] < 0.0) {
            return Crossing::None;
        }
        let t = begin[0] / (begin[0] - end[0]);
        let inward = |i: usize| begin[i] + t * (end[i] - begin[i]);
        let least = inward(1).min(inward(2)).min(inward(3));
        match begin[0] {
            _ if least < -CLEAR && begin[0].abs() > CLEAR => Crossing::None,
            height if height > CLEAR && least > CLEAR => Crossing::Inward,
            height if height < -CLEAR && least > CLEAR => Crossing::Outward,
            _ => Crossing::Unclear,
        }
    }

    /// The four functions at a position.
    #[inline(always)]
    fn heights(&self, p: [f32; 3]) -> [f32; 4] {
        let mut out = self.constant;
        for (i, out) in out.iter_mut().enumerate() {
            *out += self.x[i] * p[0] + self.y[i] * p[1] + self.z[i] * p[2];
        }
        out
    }
}

/// How a segment passes a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossing {
    /// It does not pass through it.
    None,
    /// From its front to its back.
    Inward,
    /// From its back to its front.
    Outward,
    /// It begins too near to the plane, or passes too near to an edge, to tell in 32 bits.
    Unclear,
}

/// Nearer than this (cells), sides are told in 64 bits.
const CLEAR: f32 = 1e-3;
