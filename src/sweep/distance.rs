//! Exact distance from points to triangles, eight points at a time.
//!
//! The loop over eight lanes is plain Rust that the compiler turns into vector code; it is compiled
//! once for each instruction set and gives the same bits in all of them (no fused multiply-add).

use crate::base::cpu::{CpuLevel, cpu_level};

use super::lattice::{Fixed, UNITS};

/// Points handled at once.
pub const LANES: usize = 8;

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
    /// Edges from each corner to the next, and 1 / length^2 (0 for a point).
    edge: [[f32; 3]; 3],
    inverse: [f32; 3],
    /// Unit normal (0 when the triangle has no area).
    pub normal: [f32; 3],
    /// Inside the plane, at right angles to each edge, inward.
    inward: [[f32; 3]; 3],
}

impl Triangle {
    /// Prepares a fixed-point triangle relative to a block's corner (cells from the base voxel).
    pub fn new(v: &[Fixed; 3], corner: [i32; 3]) -> Self {
        let place = |p: &Fixed| [0, 1, 2].map(|axis| (p[axis] - corner[axis] * UNITS) as f32 / UNITS as f32);
        let c = [place(&v[0]), place(&v[1]), place(&v[2])];
        let edge = [sub(c[1], c[0]), sub(c[2], c[1]), sub(c[0], c[2])];
        let inverse = edge.map(|e| if dot(e, e) > 0.0 { 1.0 / dot(e, e) } else { 0.0 });
        // Integer differences are exact: the normal of a sliver keeps its direction.
        let exact = |p: &Fixed| [0, 1, 2].map(|axis| f64::from(p[axis] - v[0][axis]));
        let (e, f) = (exact(&v[1]), exact(&v[2]));
        let n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let normal = if length > 0.0 { n.map(|value| (value / length) as f32) } else { [0.0; 3] };
        Self { corner: c, edge, inverse, normal, inward: edge.map(|e| cross(normal, e)) }
    }

    /// Signed distance of a point from the triangle's plane, positive outside.
    pub fn plane_distance(&self, p: [f32; 3]) -> f32 {
        dot(sub(p, self.corner[0]), self.normal)
    }

    /// The point of the triangle nearest to `p`.
    pub fn closest(&self, p: [f32; 3]) -> [f32; 3] {
        let inside = (0..3).all(|i| dot(sub(p, self.corner[i]), self.inward[i]) > 0.0);
        if inside {
            let height = self.plane_distance(p);
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

    /// Whether the segment from `p` to `q` passes through the triangle: +1 from back to front, -1 from
    /// front to back, else 0.
    pub fn passed(&self, p: [f32; 3], q: [f32; 3]) -> i32 {
        let (from, to) = (self.plane_distance(p), self.plane_distance(q));
        if (from > 0.0) == (to > 0.0) || from == to {
            return 0;
        }
        let t = from / (from - to);
        let at = [0, 1, 2].map(|axis| p[axis] + t * (q[axis] - p[axis]));
        let inside = (0..3).all(|i| dot(sub(at, self.corner[i]), self.inward[i]) > 0.0);
        if !inside {
            0
        } else if to > 0.0 {
            1
        } else {
            -1
        }
    }

    /// Squared distances of eight points: the kernel, inlined into each instruction set's copy.
    #[inline(always)]
    fn squared(&self, points: &Points) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            let p = [points.x[lane], points.y[lane], points.z[lane]];
            let mut nearest = f32::INFINITY;
            let mut least_inward = f32::INFINITY;
            for i in 0..3 {
                let d = sub(p, self.corner[i]);
                let t = dot(d, self.edge[i]) * self.inverse[i];
                let t = if t > 0.0 { t } else { 0.0 };
                let t = if t < 1.0 { t } else { 1.0 };
                let e = self.edge[i];
                let q = [d[0] - t * e[0], d[1] - t * e[1], d[2] - t * e[2]];
                let squared = dot(q, q);
                nearest = if squared < nearest { squared } else { nearest };
                let inward = dot(d, self.inward[i]);
                least_inward = if inward < least_inward { inward } else { least_inward };
            }
            let height = dot(sub(p, self.corner[0]), self.normal);
            let plane = height * height;
            *out = if least_inward > 0.0 { plane } else { nearest };
        }
        out
    }
}

#[inline(always)]
fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Squared distances from eight points to each listed triangle, into `out` (one entry a listed triangle).
pub fn to_each(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<[f32; LANES]>) {
    #[inline(always)]
    fn body(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<[f32; LANES]>) {
        out.clear();
        out.extend(list.iter().map(|&index| triangles[index as usize].squared(points)));
    }
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn avx2(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<[f32; LANES]>) {
        body(triangles, list, points, out);
    }
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
    fn avx512(triangles: &[Triangle], list: &[u32], points: &Points, out: &mut Vec<[f32; LANES]>) {
        body(triangles, list, points, out);
    }
    match cpu_level() {
        // SAFETY: the level was detected on this processor.
        #[cfg(target_arch = "x86_64")]
        CpuLevel::Avx512 => unsafe { avx512(triangles, list, points, out) },
        // SAFETY: the level was detected on this processor.
        #[cfg(target_arch = "x86_64")]
        CpuLevel::Avx2 => unsafe { avx2(triangles, list, points, out) },
        _ => body(triangles, list, points, out),
    }
}
