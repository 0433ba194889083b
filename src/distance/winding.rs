//! Winding number of a surface at every voxel, by counting signed crossings along lines parallel to z; also crossings along the lines
//! through voxels parallel to any axis.
//!
//! Crossings are decided in exact integers, under one symbolic shift of all voxels: mostly -z, then +x, then +y, each infinitesimal
//! relative to the one before. A line therefore crosses each closed surface a consistent number of times, and lines of different axes agree
//! about the voxels that they share.

use rayon::prelude::*;

use super::Face;
use super::lattice::{Fixed, UNITS, floor};
use super::region::{Region, extent};
use super::scanlines::Columns;
use crate::geometry::coords::between;
use crate::geometry::lists::Lists;

/// The lines along z through the voxels of a region, each with its sorted crossings; only lines with faces above or below.
pub struct Lines {
    columns: Columns,
    /// The height of each crossing (cells), and the winding number above it.
    crossings: Lists<(f64, i32)>,
}

/// Faces per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;
/// Crossings closer than this to a voxel (cells) are classified as above or below it in exact integers.
const NEAR: f64 = 1e-6;
/// Distance from the voxel (cells) that these crossings are then given.
const BESIDE: f64 = 1e-7;

impl Lines {
    /// Scans faces along the lines through the voxels of a region.
    pub fn scan(faces: &[Face], region: &Region) -> Self {
        let [low, high] = [region.low, region.high].map(|p| [p[0], p[1]]);
        let mut columns = Columns::new(low, high);
        for face in faces {
            let (first, last) = region.touched(extent(&face.v), 0.01);
            between([first[0], first[1], 0], [last[0], last[1], 0]).for_each(|[x, y, _]| columns.add([x, y]));
        }
        let bounds = [0, 1].map(|axis| [i64::from(low[axis]) * 8, i64::from(high[axis]) * 8 + 7]);
        let cross = |chunk: &[Face]| {
            let mut out = Vec::with_capacity(chunk.len());
            for face in chunk {
                each_crossing(face, Axis::Z, bounds, |line, z, change| {
                    out.extend(columns.line(line).map(|line| (line as u32, (z, change))));
                });
            }
            out
        };
        let parts: Vec<Vec<(u32, (f64, i32))>> = faces.par_chunks(GRAIN).map(cross).collect();
        let mut crossings = Lists::new(columns.lines(), parts.iter().flatten().copied());
        crossings.each_mut(|line| {
            line.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut winding = 0;
            for (_, change) in line {
                winding += *change;
                *change = winding;
            }
        });
        Self { columns, crossings }
    }

    /// Winding number at a voxel; 0 outside the region.
    pub fn winding(&self, [x, y, z]: [i32; 3]) -> i32 {
        let line = self.line(x, y);
        let below = line.partition_point(|(height, _)| *height < f64::from(z));
        if below == 0 { 0 } else { line[below - 1].1 }
    }

    /// The crossings of line (x, y) upward: height in cells and winding number above; empty outside the region.
    pub fn line(&self, x: i32, y: i32) -> &[(f64, i32)] {
        self.columns.line([x, y]).map_or(&[], |line| self.crossings.get(line))
    }

    /// The minimum winding number on any line, or 0.
    pub fn min_winding(&self) -> i32 {
        self.crossings.items().iter().fold(0, |min, (_, winding)| min.min(*winding))
    }

    /// Calls `see` with the coordinates and crossings of each line that has any.
    pub fn each_line(&self, mut see: impl FnMut([i32; 2], &[(f64, i32)])) {
        for line in (0..self.crossings.count()).filter(|&line| !self.crossings.get(line).is_empty()) {
            see(self.columns.coordinates(line), self.crossings.get(line));
        }
    }
}

/// Direction of scan lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

impl Axis {
    /// All axes.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Rotates a position into right-handed coordinates whose third axis runs along the lines (downward for y), and in which the symbolic
    /// shift of the first two is positive, with the first one larger.
    pub fn rotated(self, [x, y, z]: Fixed) -> [i64; 3] {
        let [x, y, z] = [x, y, z].map(i64::from);
        match self {
            Self::X => [-z, y, x],
            Self::Y => [-z, x, -y],
            Self::Z => [x, y, z],
        }
    }

    /// Whether a plane with this normal (rotated) passes below a voxel that lies in the plane, after the symbolic shift.
    fn is_below(self, [p, q, along]: [i64; 3]) -> bool {
        let shifts = match self {
            Self::X => [p, along, q],
            Self::Y => [p, q, -along],
            Self::Z => [-along, p, q],
        };
        let towards = shifts.into_iter().find(|shift| *shift != 0).unwrap_or(0);
        (towards > 0) == (along > 0)
    }

    /// The voxel at position `along` on the line with coordinates (p, q).
    pub fn voxel(self, [p, q]: [i32; 2], along: i32) -> [i32; 3] {
        match self {
            Self::X => [along, q, p],
            Self::Y => [q, along, p],
            Self::Z => [p, q, along],
        }
    }

    /// The coordinates of the line through a voxel.
    pub fn line(self, [x, y, z]: [i32; 3]) -> [i32; 2] {
        match self {
            Self::X => [z, y],
            Self::Y => [z, x],
            Self::Z => [x, y],
        }
    }

    /// The offset to a line whose coordinates differ by this amount.
    pub fn offset(self, [p, q]: [f64; 2]) -> [f64; 3] {
        match self {
            Self::X => [0.0, q, p],
            Self::Y => [q, 0.0, p],
            Self::Z => [p, q, 0.0],
        }
    }

    /// Bounds of rotated coordinates p and q of the lines through voxels within a box.
    pub fn bounds(self, low: [i32; 3], high: [i32; 3]) -> [[i64; 2]; 2] {
        let [low, high] = [low, high].map(|p| p.map(i64::from));
        match self {
            Self::X => [[-high[2], -low[2]], [low[1], high[1]]],
            Self::Y => [[-high[2], -low[2]], [low[0], high[0]]],
            Self::Z => [[low[0], high[0]], [low[1], high[1]]],
        }
    }
}

/// Whether the line through voxels with these coordinates passes left of the path from `a` to `b`, seen with the first rotated coordinate
/// ([`Axis::rotated`]) to the right and the second upward; exact, under the symbolic shift. Swapping `a` and `b` negates it; it is
/// undefined if they are the same point.
pub fn passes_left(axis: Axis, a: Fixed, b: Fixed, [p, q]: [i32; 2]) -> bool {
    let [a, b] = [a, b].map(|end| axis.rotated(end)).map(|[p, q, _]| [p, q]);
    let p = if axis == Axis::Z { p } else { -p };
    let line = [p, q].map(|value| i64::from(value) * i64::from(UNITS));
    left_of(a, b, edge_function(a, b, line))
}

/// Calls `see` with each line through voxels that a face crosses: the line's coordinates, the position on its axis
/// (cells; never exactly on a voxel), and the change of the winding number there in the direction of the axis.
pub fn each_crossing(
    face: &Face,
    axis: Axis,
    bounds: [[i64; 2]; 2],
    mut see: impl FnMut([i32; 2], f64, i32),
) {
    let v = face.v.map(|p| axis.rotated(p));
    let flat = v.map(|p| [p[0], p[1]]);
    let area = edge_function(flat[0], flat[1], flat[2]);
    if area == 0 {
        return;
    }
    let unit = i64::from(UNITS);
    let (low, high) = range(flat.map(|p| p[1]));
    let [[p0, p1], [q0, q1]] = bounds;
    // A line leaves the volume through a face whose normal points along it (area > 0).
    let mut change = if area > 0 { -face.coef } else { face.coef };
    let mirror = if axis == Axis::Y { -1.0 } else { 1.0 };
    if axis == Axis::Y {
        change = -change;
    }
    let heights = v.map(|p| p[2] as f64);
    for q in low.div_euclid(unit).max(q0)..=(high.div_euclid(unit) + 1).min(q1) {
        let Some((left, right)) = row_extent(flat, q * unit) else { continue };
        let left = (left / UNITS as f64).floor() as i64 - 1;
        let right = (right / UNITS as f64).ceil() as i64 + 1;
        for p in left.max(p0)..=right.min(p1) {
            if let Some(height) = crossing_height(heights, flat, area, [p * unit, q * unit]) {
                let nearest = floor(height + 0.5);
                let height = if (height - f64::from(nearest)).abs() < NEAR {
                    let below = passes_below(&v, axis, [p, q, i64::from(nearest)]);
                    f64::from(nearest) + if below { -BESIDE } else { BESIDE }
                } else {
                    height
                };
                // The first rotated coordinate of lines along x and y is -z.
                let line = [if axis == Axis::Z { p } else { -p }, q].map(|value| value as i32);
                see(line, mirror * height, change);
            }
        }
    }
}

/// Whether the plane of a face (rotated) passes below a voxel (rotated, in cells), exactly.
fn passes_below(v: &[[i64; 3]; 3], axis: Axis, voxel: [i64; 3]) -> bool {
    let [e, f] = [1, 2].map(|corner| [0, 1, 2].map(|a| v[corner][a] - v[0][a]));
    let normal = [0, 1, 2].map(|a| {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        e[b] * f[c] - e[c] * f[b]
    });
    let off = |a: usize| i128::from(voxel[a] * i64::from(UNITS) - v[0][a]);
    let height: i128 = (0..3).map(|a| i128::from(normal[a]) * off(a)).sum();
    match height {
        0 => axis.is_below(normal),
        _ => (height > 0) == (normal[2] > 0),
    }
}

fn range(values: [i64; 3]) -> (i64, i64) {
    (values[0].min(values[1]).min(values[2]), values[0].max(values[1]).max(values[2]))
}

/// The range of x in which a triangle meets the row at height y, with rounding error below one unit.
fn row_extent(v: [[i64; 2]; 3], y: i64) -> Option<(f64, f64)> {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    for (p, q) in [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])] {
        if (p[1] - y).signum() * (q[1] - y).signum() > 0 {
            continue;
        }
        let ends = if p[1] == q[1] {
            [p[0] as f64, q[0] as f64]
        } else {
            let t = (y - p[1]) as f64 / (q[1] - p[1]) as f64;
            [p[0] as f64 + t * (q[0] - p[0]) as f64; 2]
        };
        left = left.min(ends[0]).min(ends[1]);
        right = right.max(ends[0]).max(ends[1]);
    }
    (left <= right).then_some((left, right))
}

/// Twice the signed area of (p, q, s).
fn edge_function(p: [i64; 2], q: [i64; 2], s: [i64; 2]) -> i64 {
    (q[0] - p[0]) * (s[1] - p[1]) - (q[1] - p[1]) * (s[0] - p[0])
}

/// Whether s, shifted by (e, e^2), lies left of p -> q; `value` is the edge function.
fn left_of(p: [i64; 2], q: [i64; 2], value: i64) -> bool {
    match value {
        0 if p[1] != q[1] => q[1] < p[1],
        0 => q[0] > p[0],
        _ => value > 0,
    }
}

/// Height (cells) at which the line through s crosses the triangle, if it does.
fn crossing_height(heights: [f64; 3], v: [[i64; 2]; 3], area: i64, s: [i64; 2]) -> Option<f64> {
    let w = [edge_function(v[1], v[2], s), edge_function(v[2], v[0], s), edge_function(v[0], v[1], s)];
    let left = [left_of(v[1], v[2], w[0]), left_of(v[2], v[0], w[1]), left_of(v[0], v[1], w[2])];
    if left != [area > 0; 3] {
        return None;
    }
    let z = w[0] as f64 * heights[0] + w[1] as f64 * heights[1] + w[2] as f64 * heights[2];
    Some(z / area as f64 / f64::from(UNITS))
}
