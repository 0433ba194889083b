//! Winding number of the chain at every voxel, by counting signed crossings along lines parallel to z; and crossings
//! along the lines through voxels parallel to any axis.
//!
//! Crossings are decided in exact integers, under one symbolic shift of all voxels: mostly -z, then +x, then +y, each
//! infinitesimal against the last. A line therefore meets each closed surface a consistent number of times, and
//! lines of different axes agree about the voxels that they share.

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::region::{Region, each_block, extent};

/// One crossing: where along the line (cells from the base voxel), and by how much the winding
/// number changes when it is passed upward.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    line: u32,
    change: i32,
    z: f64,
}

/// Lines (x, y) through the voxels of a region, each with its sorted crossings; none where no face is above or below.
pub struct Lines {
    /// Least and greatest block column.
    low: [i32; 2],
    high: [i32; 2],
    /// For each block column of the region the index of its 64 lines, or [`NONE`].
    columns: Vec<u32>,
    start: Vec<u32>,
    /// Where a crossing is, and the winding number above it.
    crossings: Vec<(f64, i32)>,
}

/// Faces a task scans: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;
/// Crossings nearer than this to a voxel (cells) are told to be above or below it in exact integers.
const NEAR: f64 = 1e-6;
/// Where they are then put: so far above or below (cells).
const BESIDE: f64 = 1e-7;
/// No lines.
const NONE: u32 = u32::MAX;

impl Lines {
    /// Scans faces along the lines through the voxels of a region.
    pub fn scan(faces: &[Face], region: &Region) -> Self {
        let [low, high] = [region.low, region.high].map(|p| [p[0], p[1]]);
        let mut lines = Self { low, high, columns: Vec::new(), start: vec![0], crossings: Vec::new() };
        if region.blocks() == 0 {
            return lines;
        }
        lines.columns = vec![NONE; ((high[0] - low[0] + 1) * (high[1] - low[1] + 1)) as usize];
        let mut count = 0;
        for face in faces {
            let (first, last) = region.touched(extent(&face.v), 0.01);
            for [x, y, _] in each_block([first[0], first[1], 0], [last[0], last[1], 0]) {
                let column = lines.column(x, y).expect("within the region");
                if lines.columns[column] == NONE {
                    lines.columns[column] = count;
                    count += 1;
                }
            }
        }
        let parts: Vec<Vec<Crossing>> = faces
            .par_chunks(GRAIN)
            .map(|chunk| {
                let mut out = Vec::new();
                chunk.iter().for_each(|face| lines.cross(face, &mut out));
                out
            })
            .collect();
        lines.gather(count as usize * 64, parts);
        lines
    }

    /// Winding number at a voxel; 0 outside the region.
    pub fn winding(&self, [x, y, z]: [i32; 3]) -> i32 {
        let line = self.line(x, y);
        let below = line.partition_point(|(height, _)| *height < f64::from(z));
        if below == 0 { 0 } else { line[below - 1].1 }
    }

    /// The crossings of line (x, y) upward: position in cells and winding number above; empty outside.
    pub fn line(&self, x: i32, y: i32) -> &[(f64, i32)] {
        match self.index(x, y) {
            Some(line) => &self.crossings[self.start[line] as usize..self.start[line + 1] as usize],
            None => &[],
        }
    }

    /// Calls `see` with the coordinates of each line that has crossings, and with those.
    pub fn each_line(&self, mut see: impl FnMut([i32; 2], &[(f64, i32)])) {
        let width = i64::from(self.high[1] - self.low[1] + 1);
        for (place, _) in (0i64..).zip(&self.columns).filter(|(_, column)| **column != NONE) {
            let [x, y] = [self.low[0] + (place / width) as i32, self.low[1] + (place % width) as i32];
            for [i, j, _] in each_block([x * 8, y * 8, 0], [x * 8 + 7, y * 8 + 7, 0]) {
                let line = self.line(i, j);
                if !line.is_empty() {
                    see([i, j], line);
                }
            }
        }
    }

    fn column(&self, x: i32, y: i32) -> Option<usize> {
        let within = (self.low[0]..=self.high[0]).contains(&x) && (self.low[1]..=self.high[1]).contains(&y);
        let [i, j, width] = [x - self.low[0], y - self.low[1], self.high[1] - self.low[1] + 1].map(i64::from);
        within.then(|| (i * width + j) as usize)
    }

    /// Index of a line, if it has any.
    fn index(&self, x: i32, y: i32) -> Option<usize> {
        let column = self.columns[self.column(x >> 3, y >> 3)?];
        (column != NONE).then(|| column as usize * 64 + ((x & 7) << 3 | (y & 7)) as usize)
    }

    /// Appends the lines that a face crosses.
    fn cross(&self, face: &Face, out: &mut Vec<Crossing>) {
        let bounds = [0, 1].map(|axis| [i64::from(self.low[axis]) * 8, i64::from(self.high[axis]) * 8 + 7]);
        each_crossing(face, Axis::Z, bounds, |[x, y], z, change| {
            if let Some(line) = self.index(x as i32, y as i32) {
                out.push(Crossing { line: line as u32, change, z });
            }
        });
    }

    /// Sorts crossings by line and height and sums the winding numbers.
    fn gather(&mut self, lines: usize, parts: Vec<Vec<Crossing>>) {
        let mut start = vec![0u32; lines + 1];
        parts.iter().flatten().for_each(|crossing| start[crossing.line as usize + 1] += 1);
        (0..lines).for_each(|line| start[line + 1] += start[line]);
        let mut place = start.clone();
        let mut crossings = vec![(0.0, 0); start[lines] as usize];
        for crossing in parts.iter().flatten() {
            let slot = &mut place[crossing.line as usize];
            crossings[*slot as usize] = (crossing.z, crossing.change);
            *slot += 1;
        }
        for line in 0..lines {
            let line = &mut crossings[start[line] as usize..start[line + 1] as usize];
            line.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut winding = 0;
            for crossing in line {
                winding += crossing.1;
                crossing.1 = winding;
            }
        }
        self.start = start;
        self.crossings = crossings;
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
    /// All of them.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// A position in right-handed coordinates whose third axis runs along the lines (downward for y), and whose first
    /// two are shifted by positive infinitesimals, the first the greater.
    fn turned(self, [x, y, z]: Fixed) -> [i64; 3] {
        let [x, y, z] = [x, y, z].map(i64::from);
        match self {
            Self::X => [-z, y, x],
            Self::Y => [-z, x, -y],
            Self::Z => [x, y, z],
        }
    }

    /// Whether a plane with this normal (turned) passes below a voxel in it, as the voxel is shifted.
    fn is_below(self, [p, q, along]: [i64; 3]) -> bool {
        let shifts = match self {
            Self::X => [p, along, q],
            Self::Y => [p, q, -along],
            Self::Z => [-along, p, q],
        };
        let towards = shifts.into_iter().find(|shift| *shift != 0).unwrap_or(0);
        (towards > 0) == (along > 0)
    }

    /// The voxel at coordinates (p, q) of a line, and at this place on its own axis.
    pub fn voxel(self, [p, q]: [i64; 2], along: i32) -> [i32; 3] {
        match self {
            Self::X => [along, q as i32, -p as i32],
            Self::Y => [q as i32, along, -p as i32],
            Self::Z => [p as i32, q as i32, along],
        }
    }

    /// The way to a line whose coordinates differ by this much.
    pub fn beside(self, [p, q]: [f64; 2]) -> [f64; 3] {
        match self {
            Self::X => [0.0, q, -p],
            Self::Y => [q, 0.0, -p],
            Self::Z => [p, q, 0.0],
        }
    }

    /// Bounds of the lines' coordinates p and q for voxels within a box.
    pub fn bounds(self, low: [i32; 3], high: [i32; 3]) -> [[i64; 2]; 2] {
        let [low, high] = [low, high].map(|p| p.map(i64::from));
        match self {
            Self::X => [[-high[2], -low[2]], [low[1], high[1]]],
            Self::Y => [[-high[2], -low[2]], [low[0], high[0]]],
            Self::Z => [[low[0], high[0]], [low[1], high[1]]],
        }
    }
}

/// Calls `see` with each line through voxels that a face crosses: the line's coordinates, the place on its axis
/// (cells; never on a voxel, but beside it), and how the winding number changes there in the direction of the axis.
pub fn each_crossing(
    face: &Face,
    axis: Axis,
    bounds: [[i64; 2]; 2],
    mut see: impl FnMut([i64; 2], f64, i32),
) {
    let v = face.v.map(|p| axis.turned(p));
    let flat = v.map(|p| [p[0], p[1]]);
    let area = edge_function(flat[0], flat[1], flat[2]);
    if area == 0 {
        return;
    }
    let unit = i64::from(UNITS);
    let (low, high) = least_and_most(flat.map(|p| p[1]));
    let [[p0, p1], [q0, q1]] = bounds;
    // Facing along the line (area > 0) the chain is left when the face is passed.
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
                let height = if (height - height.round()).abs() < NEAR {
                    let voxel = [p, q, height.round() as i64];
                    height.round() + if passes_below(&v, axis, voxel) { -BESIDE } else { BESIDE }
                } else {
                    height
                };
                see([p, q], mirror * height, change);
            }
        }
    }
}

/// Whether the plane of a face (turned) passes below a voxel (turned, in cells), exactly.
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

fn least_and_most(values: [i64; 3]) -> (i64, i64) {
    (values[0].min(values[1]).min(values[2]), values[0].max(values[1]).max(values[2]))
}

/// Where a triangle meets the row at height y: bounds of x, with rounding error below one unit.
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

/// Whether s, moved by (e, e^2), lies left of p -> q.
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
