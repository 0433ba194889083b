//! Distance from points to triangles, eight points at a time.
//!
//! Compiled once for each instruction set, with the same bits in all of them (no fused multiply-add).

use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::{LANES, Lanes};

use super::lattice::{Fixed, UNITS};
use super::vectors::{cross, difference, dot, sub};

/// Eight positions, in cells from the block's corner.
#[derive(Debug, Clone, Copy)]
pub struct Points {
    /// x of each.
    pub x: [f32; LANES],
    /// y of each.
    pub y: [f32; LANES],
    /// z of each.
    pub z: [f32; LANES],
}

/// A triangle prepared for distance queries, in cells from the block's corner.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    corner: [[f32; 3]; 3],
    /// Edges from each corner to the next, and 1 / length^2 (0 for a zero-length edge).
    edge: [[f32; 3]; 3],
    inverse: [f32; 3],
    /// Unit normal (0 when the triangle has no area).
    pub normal: [f32; 3],
    /// For each edge, the in-plane vector that is perpendicular to it and points inward.
    inward: [[f32; 3]; 3],
}

impl Triangle {
    /// Prepares a fixed-point triangle relative to a block's corner (cells from the origin voxel).
    pub fn new(v: &[Fixed; 3], corner: [i32; 3]) -> Self {
        let position =
            |p: &Fixed| [0, 1, 2].map(|axis| (p[axis] - corner[axis] * UNITS) as f32 / UNITS as f32);
        // Integer differences are exact: even a sliver keeps the direction of its normal.
        let n = cross(difference(v[1], v[0]), difference(v[2], v[0]));
        Self::with_normal([position(&v[0]), position(&v[1]), position(&v[2])], n)
    }

    /// Prepares a triangle with corners in cells from a block's corner.
    pub fn of_cells(c: [[f32; 3]; 3]) -> Self {
        let [a, b, c64] = c.map(|p| p.map(f64::from));
        Self::with_normal(c, cross(sub(b, a), sub(c64, a)))
    }

    /// `n` is a normal of any length.
    fn with_normal(c: [[f32; 3]; 3], n: [f64; 3]) -> Self {
        let edge = [sub(c[1], c[0]), sub(c[2], c[1]), sub(c[0], c[2])];
        let inverse = edge.map(|e| if dot(e, e) > 0.0 { 1.0 / dot(e, e) } else { 0.0 });
        let length = dot(n, n).sqrt();
        let normal = if length > 0.0 { n.map(|value| (value / length) as f32) } else { [0.0; 3] };
        Self { corner: c, edge, inverse, normal, inward: edge.map(|e| cross(normal, e)) }
    }

    /// The point of the triangle nearest to `p`.
    pub fn closest(&self, p: [f32; 3]) -> [f32; 3] {
        let inside = (0..3).all(|i| dot(sub(p, self.corner[i]), self.inward[i]) > 0.0);
        if inside {
            let height = dot(sub(p, self.corner[0]), self.normal);
            return [0, 1, 2].map(|axis| p[axis] - height * self.normal[axis]);
        }
        let mut best = ([0.0; 3], f32::INFINITY);
        for i in 0..3 {
            let t = (dot(sub(p, self.corner[i]), self.edge[i]) * self.inverse[i]).clamp(0.0, 1.0);
            let q = [0, 1, 2].map(|axis| self.corner[i][axis] + t * self.edge[i][axis]);
            let d = sub(p, q);
            if dot(d, d) < best.1 {
                best = (q, dot(d, d));
            }
        }
        best.0
    }

    /// Offsets of eight points from the triangle's points nearest to them: the kernel, inlined for each instruction set.
    #[inline(always)]
    fn offsets(&self, points: &Points) -> Offsets {
        let p = [Lanes(points.x), Lanes(points.y), Lanes(points.z)];
        let mut nearest = Lanes::all(f32::INFINITY);
        let mut offset = [Lanes::all(0.0); 3];
        let mut inward = Lanes::all(f32::INFINITY);
        for i in 0..3 {
            let (d, e) = (sub(p, all(self.corner[i])), all(self.edge[i]));
            let t = dot(d, e) * Lanes::all(self.inverse[i]);
            let t = t.max(Lanes::all(0.0)).min(Lanes::all(1.0));
            let q = [d[0] - t * e[0], d[1] - t * e[1], d[2] - t * e[2]];
            let squared = dot(q, q);
            let nearer = squared.is_less(nearest);
            nearest = nearer.choose(squared, nearest);
            for axis in 0..3 {
                offset[axis] = nearer.choose(q[axis], offset[axis]);
            }
            inward = dot(d, all(self.inward[i])).min(inward);
        }
        let normal = all(self.normal);
        let height = dot(sub(p, all(self.corner[0])), normal);
        let over = Lanes::all(0.0).is_less(inward);
        Offsets {
            x: over.choose(height * normal[0], offset[0]).0,
            y: over.choose(height * normal[1], offset[1]).0,
            z: over.choose(height * normal[2], offset[2]).0,
            squared: over.choose(height * height, nearest).0,
        }
    }
}

/// One vector in all eight lanes.
#[inline(always)]
fn all(v: [f32; 3]) -> [Lanes; 3] {
    [Lanes::all(v[0]), Lanes::all(v[1]), Lanes::all(v[2])]
}

/// For eight points: the vector from the nearest point of a triangle (cells), and its squared length.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offsets {
    /// x of each.
    pub x: [f32; LANES],
    /// y of each.
    pub y: [f32; LANES],
    /// z of each.
    pub z: [f32; LANES],
    /// Squared distance of each.
    pub squared: [f32; LANES],
}

/// Offsets (cells) of the eight voxels around a centre.
const CORNERS: [[f32; LANES]; 3] = [
    [-0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, 0.5],
    [-0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5],
    [-0.5, 0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5],
];
/// Squared distance of those voxels from their centre.
const CORNER_SQUARED: f32 = 0.75;
/// Tolerance for rounding in squared distances (cells^2).
const SLACK: f32 = 1e-3;

#[inline(always)]
fn prune_body(list: &mut Vec<u32>, offsets: &mut Vec<[f32; 4]>) {
    let mut most = [f32::INFINITY; LANES];
    for [x, y, z, squared] in offsets.iter() {
        for lane in 0..LANES {
            let along = x * CORNERS[0][lane] + y * CORNERS[1][lane] + z * CORNERS[2][lane];
            let value = squared + 2.0 * along;
            most[lane] = if value < most[lane] { value } else { most[lane] };
        }
    }
    most.iter_mut().for_each(|most| *most += CORNER_SQUARED + SLACK);
    let mut kept = 0;
    for index in 0..list.len() {
        let [x, y, z, squared] = offsets[index];
        let inverse = 1.0 / (squared + 1e-12);
        let mut near = false;
        for lane in 0..LANES {
            let along = x * CORNERS[0][lane] + y * CORNERS[1][lane] + z * CORNERS[2][lane];
            let least = squared + 2.0 * along + along * along * inverse;
            near |= (least <= most[lane]) | (squared + along <= 0.0);
        }
        list[kept] = list[index];
        kept += usize::from(near || squared < 1e-4);
    }
    list.truncate(kept);
    offsets.clear();
}

/// Offsets of eight points from each listed triangle, into `out` (one entry per listed triangle).
pub fn to_each(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<Offsets>) {
    #[inline(always)]
    fn body(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<Offsets>) {
        // A plain loop: the closure of an iterator would be compiled without the wider instructions.
        out.clear();
        out.resize(list.len(), Offsets::default());
        for at in 0..list.len() {
            out[at] = triangles[list[at] as usize].offsets(points);
        }
    }
    dispatch!(body(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<Offsets>));
}

/// For each triangle, a mask of the eight sub-blocks in which it can be nearest to a voxel, from the offsets of the sub-blocks' centres and
/// their radius (cells); returns which sub-blocks are within `reach` cells of a triangle.
pub fn near_lanes(offsets: &[Offsets], radius: f32, reach: f32, out: &mut Vec<u8>) -> [bool; LANES] {
    #[inline(always)]
    fn body(offsets: &[Offsets], radius: f32, reach: f32, out: &mut Vec<u8>) -> [bool; LANES] {
        let mut least = [f32::INFINITY; LANES];
        for offset in offsets {
            for (least, &squared) in least.iter_mut().zip(&offset.squared) {
                *least = if squared < *least { squared } else { *least };
            }
        }
        let least = least.map(f32::sqrt);
        let limit = least.map(|least| (least + 2.0 * radius).min(reach + radius).powi(2));
        out.clear();
        out.resize(offsets.len(), 0);
        for at in 0..offsets.len() {
            let mut bits = 0;
            for (lane, (squared, limit)) in offsets[at].squared.iter().zip(&limit).enumerate() {
                bits |= u8::from(squared <= limit) << lane;
            }
            out[at] = bits;
        }
        least.map(|least| least <= reach + radius)
    }
    dispatch!(body(offsets: &[Offsets], radius: f32, reach: f32, out: &mut Vec<u8>) -> [bool; LANES])
}

/// Squared distance (cells^2) of each of eight points from the nearest of the listed triangles, and its index.
pub fn nearest(triangles: &[Triangle], list: &[u32], points: &Points) -> ([f32; LANES], [u32; LANES]) {
    #[inline(always)]
    fn body(triangles: &[Triangle], list: &[u32], points: &Points) -> ([f32; LANES], [u32; LANES]) {
        let (mut best, mut ids) = (Lanes::all(f32::INFINITY), [0; LANES]);
        for &triangle in list {
            let squared = Lanes(triangles[triangle as usize].offsets(points).squared);
            let nearer = squared.is_less(best);
            best = nearer.choose(squared, best);
            ids = nearer.choose_number(triangle, ids);
        }
        (best.0, ids)
    }
    dispatch!(body(triangles: &[Triangle], list: &[u32], points: &Points) -> ([f32; LANES], [u32; LANES]))
}

/// Keeps in `list` the triangles that can be nearest to one of the eight voxels around a centre; `offsets` holds the centre's offset from
/// each listed triangle (x, y, z, squared length) and is cleared.
///
/// The distance to a convex set is a convex function: at a voxel it is at least its first-order estimate from the centre, and at most the
/// distance to the point nearest to the centre.
pub fn prune(list: &mut Vec<u32>, offsets: &mut Vec<[f32; 4]>) {
    dispatch!(prune_body(list: &mut Vec<u32>, offsets: &mut Vec<[f32; 4]>));
}
