//! Winding number of the chain at every voxel, by counting signed crossings along lines parallel to z.
//!
//! Crossings are decided in exact integers. A line through a vertex or an edge is moved by an
//! infinitesimal (e, e^2), so that it meets each closed surface a consistent number of times.

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::UNITS;
use super::region::Region;

/// One crossing: where along the line (cells from the base voxel), and by how much the winding
/// number changes when it is passed upward.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    line: u32,
    change: i32,
    z: f64,
}

/// Lines (x, y) over a rectangle of voxels, each with its sorted crossings.
pub struct Lines {
    x0: i32,
    y0: i32,
    nx: i32,
    ny: i32,
    start: Vec<u32>,
    /// Where a crossing is, and the winding number above it.
    crossings: Vec<(f64, i32)>,
}

/// Faces a task scans: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;

impl Lines {
    /// Scans faces along the lines through the voxels of a region.
    pub fn scan(faces: &[Face], region: &Region) -> Self {
        let [x0, y0] = [region.low[0] * 8, region.low[1] * 8];
        let (nx, ny) = (((region.high[0] + 1) * 8 - x0).max(0), ((region.high[1] + 1) * 8 - y0).max(0));
        let mut lines = Self { x0, y0, nx, ny, start: Vec::new(), crossings: Vec::new() };
        let parts: Vec<Vec<Crossing>> = faces
            .par_chunks(GRAIN)
            .map(|chunk| {
                let mut out = Vec::new();
                chunk.iter().for_each(|face| lines.cross(face, &mut out));
                out
            })
            .collect();
        lines.gather(parts);
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
        let (i, j) = (x - self.x0, y - self.y0);
        if i < 0 || j < 0 || i >= self.nx || j >= self.ny {
            return &[];
        }
        let line = (i * self.ny + j) as usize;
        &self.crossings[self.start[line] as usize..self.start[line + 1] as usize]
    }

    /// Appends the lines that a face crosses.
    fn cross(&self, face: &Face, out: &mut Vec<Crossing>) {
        let v = face.v.map(|p| [i64::from(p[0]), i64::from(p[1])]);
        let area = edge_function(v[0], v[1], v[2]);
        if area == 0 {
            return;
        }
        let unit = i64::from(UNITS);
        let (low, high) = extent(v.map(|p| p[1]));
        let first = low.div_euclid(unit).max(i64::from(self.y0));
        let last = (high.div_euclid(unit) + 1).min(i64::from(self.y0 + self.ny - 1));
        // Facing up (area > 0) the chain is left when the face is passed upward.
        let change = if area > 0 { -face.coef } else { face.coef };
        for y in first..=last {
            let Some((left, right)) = row_extent(v, y * unit) else { continue };
            let left = (left / UNITS as f64).floor() as i64 - 1;
            let right = (right / UNITS as f64).ceil() as i64 + 1;
            for x in left.max(i64::from(self.x0))..=right.min(i64::from(self.x0 + self.nx - 1)) {
                if let Some(z) = crossing_height(face, v, area, [x * unit, y * unit]) {
                    let line = (x as i32 - self.x0) * self.ny + (y as i32 - self.y0);
                    out.push(Crossing { line: line as u32, change, z });
                }
            }
        }
    }

    /// Sorts crossings by line and height and sums the winding numbers.
    fn gather(&mut self, parts: Vec<Vec<Crossing>>) {
        let lines = (self.nx * self.ny) as usize;
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

fn extent(values: [i64; 3]) -> (i64, i64) {
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

/// Height (cells) at which the line through s crosses the face, if it does.
fn crossing_height(face: &Face, v: [[i64; 2]; 3], area: i64, s: [i64; 2]) -> Option<f64> {
    let w = [edge_function(v[1], v[2], s), edge_function(v[2], v[0], s), edge_function(v[0], v[1], s)];
    let left = [left_of(v[1], v[2], w[0]), left_of(v[2], v[0], w[1]), left_of(v[0], v[1], w[2])];
    if left != [area > 0; 3] {
        return None;
    }
    let z = w[0] as f64 * f64::from(face.v[0][2])
        + w[1] as f64 * f64::from(face.v[1][2])
        + w[2] as f64 * f64::from(face.v[2][2]);
    Some(z / area as f64 / f64::from(UNITS))
}
