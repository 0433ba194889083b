//! Which faces pass through the unit cell around each voxel, and the winding number at any point.

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::region::{Region, extent};
use super::winding::Lines;

/// A position or direction in fixed-point units.
pub type Point = [f64; 3];

/// Faces a task sorts: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// No slot.
const NONE: u32 = u32::MAX;
/// Room for rounding where a plane touches a cell's corner (cells).
const TOUCH: f64 = 1e-5;

/// Faces sorted into the unit cells around the voxels of some blocks.
pub struct Cells {
    slots: Vec<u32>,
    /// `ids[start[c]..start[c + 1]]` pass through cell c; 512 cells a slot.
    start: Vec<u32>,
    ids: Vec<u32>,
}

impl Cells {
    /// Sorts faces into the cells of the marked blocks.
    pub fn new(faces: &[Face], normals: &[Point], region: &Region, marked: &[bool]) -> Self {
        let mut slots = vec![NONE; marked.len()];
        let blocks: Vec<u32> = (0..marked.len() as u32).filter(|&block| marked[block as usize]).collect();
        blocks.iter().enumerate().for_each(|(slot, &block)| slots[block as usize] = slot as u32);
        let pairs: Vec<Vec<(u32, u32)>> = faces
            .par_chunks(GRAIN)
            .enumerate()
            .map(|(chunk, faces)| {
                let mut out = Vec::with_capacity(faces.len() * 6);
                for (index, face) in faces.iter().enumerate() {
                    let id = chunk * GRAIN + index;
                    each_cell(&face.v, &normals[id], |voxel| {
                        if let Some(cell) = cell_of(voxel, region, &slots) {
                            out.push((cell, id as u32));
                        }
                    });
                }
                out
            })
            .collect();
        let mut start = vec![0u32; blocks.len() * 512 + 1];
        pairs.iter().flatten().for_each(|&(cell, _)| start[cell as usize + 1] += 1);
        (1..start.len()).for_each(|cell| start[cell] += start[cell - 1]);
        let mut ids = vec![0; start[start.len() - 1] as usize];
        let mut place = start.clone();
        for &(cell, id) in pairs.iter().flatten() {
            ids[place[cell as usize] as usize] = id;
            place[cell as usize] += 1;
        }
        Self { slots, start, ids }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// The cell around a voxel.
    pub fn of_voxel(&self, voxel: [i32; 3], region: &Region) -> Option<usize> {
        cell_of(voxel, region, &self.slots).map(|cell| cell as usize)
    }

    /// Faces that pass through a cell.
    pub fn faces(&self, cell: usize) -> &[u32] {
        &self.ids[self.start[cell] as usize..self.start[cell + 1] as usize]
    }

    /// Winding number of the chain at a point (fixed-point units): the nearest voxel's, and the faces between.
    pub fn winding(
        &self,
        point: Point,
        faces: &[Face],
        normals: &[Point],
        region: &Region,
        lines: &Lines,
    ) -> i32 {
        let voxel = point.map(|value| (value / f64::from(UNITS)).round() as i32);
        let from = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let ids = cell_of(voxel, region, &self.slots).map_or(&[][..], |cell| self.faces(cell as usize));
        let entered = ids.iter().map(|&id| entered(&faces[id as usize], &normals[id as usize], from, point));
        lines.winding(voxel) + entered.sum::<i32>()
    }
}

fn cell_of(voxel: [i32; 3], region: &Region, slots: &[u32]) -> Option<u32> {
    let block = voxel.map(|value| value >> 3);
    if !region.holds(block) {
        return None;
    }
    let slot = slots[region.index(block)];
    let inner = voxel.map(|value| (value & 7) as u32);
    (slot != NONE).then(|| slot * 512 + (inner[0] << 6 | inner[1] << 3 | inner[2]))
}

/// Calls `see` with the voxel of each unit cell that a triangle may pass through.
pub fn each_cell(v: &[Fixed; 3], normal: &Point, mut see: impl FnMut([i32; 3])) {
    let (low, high) = extent(v);
    let first = low.map(|value| (value - 0.5).ceil() as i32);
    let last = high.map(|value| (value + 0.5).floor() as i32);
    let reach = 0.5 * (normal[0].abs() + normal[1].abs() + normal[2].abs());
    let reach = reach + TOUCH * (normal[0].abs() + normal[1].abs() + normal[2].abs());
    let corner = v[0].map(|value| f64::from(value) / f64::from(UNITS));
    for x in first[0]..=last[0] {
        for y in first[1]..=last[1] {
            let height = (f64::from(x) - corner[0]) * normal[0] + (f64::from(y) - corner[1]) * normal[1];
            for z in first[2]..=last[2] {
                if (height + (f64::from(z) - corner[2]) * normal[2]).abs() <= reach {
                    see([x, y, z]);
                }
            }
        }
    }
}

/// Normal of a face, as long as twice its area (units^2).
pub fn normal(face: &Face) -> Point {
    cross(difference(&face.v[1], &face.v[0]), difference(&face.v[2], &face.v[0]))
}

/// Layers of the chain that are entered through a face on the way between two points.
fn entered(face: &Face, normal: &Point, from: Point, to: Point) -> i32 {
    let corner = face.v[0].map(f64::from);
    let (begin, end) = (dot(normal, &sub(from, corner)), dot(normal, &sub(to, corner)));
    let (begin_in_front, end_in_front) = (in_front(begin, normal), end > 0.0);
    if begin_in_front == end_in_front || begin == end {
        return 0;
    }
    let t = begin / (begin - end);
    let at = [0, 1, 2].map(|a| from[a] + t * (to[a] - from[a]));
    match (is_over(&face.v, normal, at), begin_in_front) {
        (false, _) => 0,
        (true, true) => face.coef,
        (true, false) => -face.coef,
    }
}

/// Whether a point lies over a triangle, along its normal.
pub fn is_over(v: &[Fixed; 3], normal: &Point, at: Point) -> bool {
    (0..3).all(|i| {
        let inward = cross(*normal, difference(&v[(i + 1) % 3], &v[i]));
        dot(&inward, &sub(at, v[i].map(f64::from))) > 0.0
    })
}

/// Which side of a face a voxel is on; the scan lines move a voxel in a face's plane down, then right.
fn in_front(height: f64, normal: &Point) -> bool {
    let towards = [height, -normal[2], normal[0], normal[1]];
    towards.into_iter().find(|value| *value != 0.0).is_some_and(|value| value > 0.0)
}

/// The difference of two fixed positions.
pub fn difference(a: &[i32; 3], b: &[i32; 3]) -> Point {
    [0, 1, 2].map(|axis| f64::from(a[axis] - b[axis]))
}

/// a - b.
pub fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Inner product.
pub fn dot(a: &Point, b: &Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
