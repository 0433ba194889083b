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

    /// The four functions at a position.
    #[inline(always)]
    pub fn heights(&self, p: [f32; 3]) -> [f32; 4] {
        self.heights_mixed(p, p)
    }

    /// Height over the plane at `p`, and over the edges at `q`.
    #[inline(always)]
    pub fn heights_mixed(&self, p: [f32; 3], q: [f32; 3]) -> [f32; 4] {
        let [x, y, z] = [0, 1, 2].map(|axis| [p[axis], q[axis], q[axis], q[axis]]);
        let mut out = self.constant;
        for i in 0..4 {
            out[i] += self.x[i] * x[i] + self.y[i] * y[i] + self.z[i] * z[i];
        }
        out
    }

    /// Whether a segment meets the plane inside the triangle, from the functions at its ends.
    #[inline(always)]
    pub fn is_inside(begin: [f32; 4], end: [f32; 4]) -> bool {
        let t = (begin[0] / (begin[0] - end[0])).clamp(0.0, 1.0);
        let over = |i: usize| begin[i] + t * (end[i] - begin[i]) > 0.0;
        over(1) & over(2) & over(3)
    }
}
