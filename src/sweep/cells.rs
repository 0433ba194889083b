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
/// A voxel nearer than this (cells) to a plane is told its side of it exactly.
const CLEAR: f32 = 1e-3;
/// Where a voxel is taken to be, off its centre (cells): the scan lines' side of faces and edges through it.
const NUDGE: [f32; 3] = [1e-3, 3e-4, -1e-4];
/// Room for rounding where a plane touches a cell's corner (cells).
const TOUCH: f64 = 1e-5;

/// Faces sorted into the unit cells around the voxels of some blocks.
pub struct Cells {
    slots: Vec<u32>,
    /// `ids[start[c]..start[c + 1]]` pass through cell c; 512 cells a slot.
    start: Vec<u32>,
    ids: Vec<u32>,
    /// For each of `ids` the face's unit normal, and the height of the cell's voxel over its plane (cells).
    planes: Vec<[f32; 4]>,
    rims: Vec<Rim>,
}

/// The rim of a face: for each edge the inward direction in the face's plane, and how far the edge lies that
/// way from the first corner (cells).
type Rim = [[f32; 4]; 3];

impl Cells {
    /// Sorts faces into the cells of the marked blocks.
    pub fn new(faces: &[Face], normals: &[Point], region: &Region, marked: &[bool]) -> Self {
        let mut slots = vec![NONE; marked.len()];
        let blocks: Vec<u32> = (0..marked.len() as u32).filter(|&block| marked[block as usize]).collect();
        blocks.iter().enumerate().for_each(|(slot, &block)| slots[block as usize] = slot as u32);
        let pairs: Vec<Vec<(u32, u32, [f32; 4])>> = faces
            .par_chunks(GRAIN)
            .enumerate()
            .map(|(chunk, faces)| {
                let mut out = Vec::with_capacity(faces.len() * 6);
                for (index, face) in faces.iter().enumerate() {
                    let id = chunk * GRAIN + index;
                    let plane = Plane::new(face, &normals[id]);
                    each_cell(&face.v, &normals[id], |voxel| {
                        if let Some(cell) = cell_of(voxel, region, &slots) {
                            out.push((cell, id as u32, plane.seen_from(voxel)));
                        }
                    });
                }
                out
            })
            .collect();
        let mut start = vec![0u32; blocks.len() * 512 + 1];
        pairs.iter().flatten().for_each(|(cell, ..)| start[*cell as usize + 1] += 1);
        (1..start.len()).for_each(|cell| start[cell] += start[cell - 1]);
        let mut ids = vec![0; start[start.len() - 1] as usize];
        let mut planes = vec![[0.0; 4]; ids.len()];
        let mut place = start.clone();
        for &(cell, id, plane) in pairs.iter().flatten() {
            let at = place[cell as usize] as usize;
            (ids[at], planes[at]) = (id, plane);
            place[cell as usize] += 1;
        }
        let rims = faces.par_iter().zip(normals).with_min_len(GRAIN).map(|(f, n)| rim(&f.v, n)).collect();
        Self { slots, start, ids, planes, rims }
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
        let Some(cell) = self.of_voxel(voxel, region) else { return lines.winding(voxel) };
        let from = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let way = [0, 1, 2].map(|axis| ((point[axis] - from[axis]) / f64::from(UNITS)) as f32);
        let mut winding = lines.winding(voxel);
        let range = self.start[cell] as usize..self.start[cell + 1] as usize;
        for (&id, [x, y, z, begin]) in self.ids[range.clone()].iter().zip(&self.planes[range]) {
            let end = begin + x * way[0] + y * way[1] + z * way[2];
            let one_side = (*begin > CLEAR) & (end > 0.0) | (*begin < -CLEAR) & (end < 0.0);
            if one_side || !self.passes(id, &faces[id as usize].v, voxel, way, begin / (begin - end)) {
                continue;
            }
            let begin_in_front = if begin.abs() > CLEAR {
                *begin > 0.0
            } else {
                let (normal, corner) = (&normals[id as usize], faces[id as usize].v[0].map(f64::from));
                in_front(dot(normal, &sub(from, corner)), normal)
            };
            if begin_in_front != (end > 0.0) {
                let coef = faces[id as usize].coef;
                winding += if begin_in_front { coef } else { -coef };
            }
        }
        winding
    }

    /// Whether a segment that meets the plane of a face after the part `t` of its way passes through the face.
    fn passes(&self, id: u32, v: &[Fixed; 3], voxel: [i32; 3], way: [f32; 3], t: f32) -> bool {
        let t = t.clamp(0.0, 1.0);
        let at = |axis: usize| {
            (voxel[axis] * UNITS - v[0][axis]) as f32 / UNITS as f32 + t * way[axis] + (1.0 - t) * NUDGE[axis]
        };
        let [x, y, z] = [at(0), at(1), at(2)];
        let over = |edge: &[f32; 4]| edge[0] * x + edge[1] * y + edge[2] * z > edge[3];
        let rim = &self.rims[id as usize];
        over(&rim[0]) & over(&rim[1]) & over(&rim[2])
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

/// The plane of a face: unit normal, and the first corner (cells).
struct Plane {
    normal: Point,
    corner: Point,
}

impl Plane {
    fn new(face: &Face, normal: &Point) -> Self {
        let length = dot(normal, normal).sqrt();
        let unit = if length > 0.0 { normal.map(|value| value / length) } else { [0.0; 3] };
        Self { normal: unit, corner: face.v[0].map(|value| f64::from(value) / f64::from(UNITS)) }
    }

    /// Normal, and the height of a voxel over the plane (cells).
    fn seen_from(&self, voxel: [i32; 3]) -> [f32; 4] {
        let height = dot(&self.normal, &sub(voxel.map(f64::from), self.corner));
        let [x, y, z] = self.normal;
        [x as f32, y as f32, z as f32, height as f32]
    }
}

/// Normal of a face, as long as twice its area (units^2).
pub fn normal(face: &Face) -> Point {
    cross(difference(&face.v[1], &face.v[0]), difference(&face.v[2], &face.v[0]))
}

fn rim(v: &[Fixed; 3], normal: &Point) -> Rim {
    [0, 1, 2].map(|i| {
        let inward = cross(*normal, difference(&v[(i + 1) % 3], &v[i]));
        let length = dot(&inward, &inward).sqrt().max(f64::MIN_POSITIVE);
        let offset = dot(&inward, &difference(&v[i], &v[0])) / (length * f64::from(UNITS));
        let [x, y, z] = inward.map(|value| (value / length) as f32);
        [x, y, z, offset as f32]
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
