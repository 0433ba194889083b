//! The unbounded prism over a triangle: four linear functions that tell where a segment passes the triangle.

use super::cells::{Point, cross, difference, dot, sub};
use super::lattice::{Fixed, UNITS};

/// Height over the triangle's plane, then for each edge how far inward of it (cells), as linear functions of a
/// position: `f[0] * p.x + f[1] * p.y + f[2] * p.z + f[3]`. One line of cache.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
pub struct Prism {
    plane: [f32; 4],
    edges: [[f32; 4]; 3],
}

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
        Self { plane: along(*normal, &v[0]), edges: [edge(0), edge(1), edge(2)] }
    }

    /// How a segment between two positions (cells) passes the triangle, and the height of its end over the plane.
    #[inline]
    pub fn crossing(&self, begin: [f32; 3], end: [f32; 3]) -> (Crossing, f32) {
        let (first, last) = (value(&self.plane, begin), value(&self.plane, end));
        if (first > CLEAR) & (last > 0.0) | (first < -CLEAR) & (last < 0.0) {
            return (Crossing::None, last);
        }
        let t = first / (first - last);
        let at = [0, 1, 2].map(|axis| begin[axis] + t * (end[axis] - begin[axis]));
        let [a, b, c] = [0, 1, 2].map(|i| value(&self.edges[i], at));
        let least = a.min(b).min(c);
        let crossing = match first {
            _ if least < -CLEAR && first.abs() > CLEAR => Crossing::None,
            height if height > CLEAR && least > CLEAR => Crossing::Inward,
            height if height < -CLEAR && least > CLEAR => Crossing::Outward,
            _ => Crossing::Unclear,
        };
        (crossing, last)
    }

    /// 1 when a segment too short for doubt enters through the triangle's front, -1 when it leaves, else 0.
    #[inline]
    pub fn short_crossing(&self, begin: [f32; 3], end: [f32; 3]) -> i32 {
        let (first, last) = (value(&self.plane, begin), value(&self.plane, end));
        if (first > 0.0) == (last > 0.0) || !self.edges.iter().all(|edge| value(edge, end) > 0.0) {
            return 0;
        }
        if first > 0.0 { 1 } else { -1 }
    }
}

/// A linear function at a position.
#[inline(always)]
fn value(f: &[f32; 4], p: [f32; 3]) -> f32 {
    f[0] * p[0] + f[1] * p[1] + f[2] * p[2] + f[3]
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
