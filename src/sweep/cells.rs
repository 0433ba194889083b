//! Which faces pass through the unit cell around each voxel, and the winding number at any point.

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::region::{Region, each_block, extent};
use super::winding::Lines;

/// A position or direction in fixed-point units.
pub type Point = [f64; 3];

/// Faces a task sorts: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// A block with at most this many faces is one cell.
const FEW: usize = 8;
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
    /// Place of each block of the region in `blocks`.
    slots: Vec<u32>,
    blocks: Vec<Block>,
    count: usize,
    rims: Vec<Rim>,
}

/// The faces of one block.
struct Block {
    /// Number of its first cell, among all.
    first: usize,
    /// `ids[start[c]..start[c + 1]]` pass through cell c: 512 cells, or one.
    start: Vec<u32>,
    ids: Vec<u32>,
    /// For each of `ids` the face's unit normal, and the height of the block's first voxel over its plane (cells).
    planes: Vec<[f32; 4]>,
}

/// The rim of a face: for each edge the inward direction in the face's plane, and how far the edge lies that
/// way from the first corner (cells).
type Rim = [[f32; 4]; 3];

impl Cells {
    /// Sorts faces into the cells of the marked blocks.
    pub fn new(faces: &[Face], normals: &[Point], region: &Region, marked: &[bool]) -> Self {
        let mut slots = vec![NONE; marked.len()];
        let places: Vec<[i32; 3]> =
            (0..marked.len()).filter(|&block| marked[block]).map(|block| region.place(block)).collect();
        places.iter().enumerate().for_each(|(slot, &block)| slots[region.index(block)] = slot as u32);
        let lists = by_block(faces, normals, region, &slots, places.len());
        let sort = |(&place, ids): (&[i32; 3], Vec<u32>)| Block::new(place, ids, faces, normals);
        let mut blocks: Vec<Block> = places.par_iter().zip(lists).map(sort).collect();
        let mut count = 0;
        for block in &mut blocks {
            block.first = count;
            count += block.start.len() - 1;
        }
        let rims = faces.par_iter().zip(normals).with_min_len(GRAIN).map(|(f, n)| rim(&f.v, n)).collect();
        Self { slots, blocks, count, rims }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Calls `see` with each cell's number and faces, in parallel.
    pub fn for_each(&self, see: impl Fn(usize, &[u32]) + Sync) {
        self.blocks.par_iter().for_each(|block| {
            (0..block.start.len() - 1)
                .for_each(|cell| see(block.first + cell, &block.ids[block.range(cell)]));
        });
    }

    /// The cell around a voxel.
    pub fn of_voxel(&self, voxel: [i32; 3], region: &Region) -> Option<usize> {
        self.block_of(voxel, region).map(|block| block.first + block.cell(voxel))
    }

    fn block_of(&self, voxel: [i32; 3], region: &Region) -> Option<&Block> {
        let place = voxel.map(|value| value >> 3);
        let slot = if region.holds(place) { self.slots[region.index(place)] } else { NONE };
        (slot != NONE).then(|| &self.blocks[slot as usize])
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
        let Some(block) = self.block_of(voxel, region) else { return lines.winding(voxel) };
        let local = voxel.map(|value| (value & 7) as f32);
        let from = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let way = [0, 1, 2].map(|axis| ((point[axis] - from[axis]) / f64::from(UNITS)) as f32);
        let mut winding = lines.winding(voxel);
        let range = block.range(block.cell(voxel));
        for (&id, [x, y, z, height]) in block.ids[range.clone()].iter().zip(&block.planes[range]) {
            let begin = height + x * local[0] + y * local[1] + z * local[2];
            let end = begin + x * way[0] + y * way[1] + z * way[2];
            let one_side = (begin > CLEAR) & (end > 0.0) | (begin < -CLEAR) & (end < 0.0);
            if one_side || !self.passes(id, &faces[id as usize].v, voxel, way, begin / (begin - end)) {
                continue;
            }
            let begin_in_front = if begin.abs() > CLEAR {
                begin > 0.0
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

impl Block {
    fn new(place: [i32; 3], ids: Vec<u32>, faces: &[Face], normals: &[Point]) -> Self {
        let corner = place.map(|block| block * 8);
        let plane = |&id: &u32| Plane::new(&faces[id as usize], &normals[id as usize]).seen_from(corner);
        if ids.len() <= FEW {
            let planes = ids.iter().map(plane).collect();
            return Self { first: 0, start: vec![0, ids.len() as u32], ids, planes };
        }
        let mut pairs: Vec<(u16, u32)> = Vec::with_capacity(ids.len() * 4);
        for &id in &ids {
            let (v, normal) = (&faces[id as usize].v, &normals[id as usize]);
            each_cell(v, normal, corner, |voxel| pairs.push((inner(voxel) as u16, id)));
        }
        let mut start = vec![0u32; 513];
        pairs.iter().for_each(|&(cell, _)| start[cell as usize + 1] += 1);
        (1..513).for_each(|cell| start[cell] += start[cell - 1]);
        let mut sorted = vec![0; pairs.len()];
        let mut next = start.clone();
        for &(cell, id) in &pairs {
            sorted[next[cell as usize] as usize] = id;
            next[cell as usize] += 1;
        }
        let planes = sorted.iter().map(plane).collect();
        Self { first: 0, start, ids: sorted, planes }
    }

    fn cell(&self, voxel: [i32; 3]) -> usize {
        if self.start.len() == 2 { 0 } else { inner(voxel) }
    }

    fn range(&self, cell: usize) -> std::ops::Range<usize> {
        self.start[cell] as usize..self.start[cell + 1] as usize
    }
}

/// A voxel's number in its block.
fn inner(voxel: [i32; 3]) -> usize {
    let [x, y, z] = voxel.map(|value| (value & 7) as usize);
    x << 6 | y << 3 | z
}

/// For each block in `slots` the faces that may pass through the unit cells of its voxels, ascending.
fn by_block(
    faces: &[Face],
    normals: &[Point],
    region: &Region,
    slots: &[u32],
    count: usize,
) -> Vec<Vec<u32>> {
    let pairs: Vec<Vec<(u32, u32)>> = faces
        .par_chunks(GRAIN)
        .enumerate()
        .map(|(chunk, faces)| {
            let mut out = Vec::with_capacity(faces.len() * 2);
            for (index, face) in faces.iter().enumerate() {
                let id = chunk * GRAIN + index;
                each_place(&face.v, &normals[id], region, |block| {
                    let slot = slots[region.index(block)];
                    if slot != NONE {
                        out.push((slot, id as u32));
                    }
                });
            }
            out
        })
        .collect();
    let mut lists = vec![Vec::new(); count];
    pairs.iter().flatten().for_each(|&(slot, id)| lists[slot as usize].push(id));
    lists
}

/// Calls `see` with the blocks of a region whose unit cells a triangle may pass through.
fn each_place(v: &[Fixed; 3], normal: &Point, region: &Region, mut see: impl FnMut([i32; 3])) {
    let (first, last) = region.touched(extent(v), 0.5);
    let slab = Slab::new(v, normal, 4.0);
    each_block(first, last)
        .filter(|block| slab.touches(block.map(|b| f64::from(b) * 8.0 + 3.5)))
        .for_each(&mut see);
}

/// Calls `see` with the voxels of a block whose unit cells a triangle may pass through.
fn each_cell(v: &[Fixed; 3], normal: &Point, corner: [i32; 3], mut see: impl FnMut([i32; 3])) {
    let (low, high) = extent(v);
    let first = [0, 1, 2].map(|a| ((low[a] - 0.5).ceil() as i32).max(corner[a]));
    let last = [0, 1, 2].map(|a| ((high[a] + 0.5).floor() as i32).min(corner[a] + 7));
    let slab = Slab::new(v, normal, 0.5);
    each_block(first, last).filter(|voxel| slab.touches(voxel.map(f64::from))).for_each(&mut see);
}

/// Calls `see` with the voxels of a region whose unit cells a triangle may pass through.
pub fn each_voxel(v: &[Fixed; 3], normal: &Point, region: &Region, mut see: impl FnMut([i32; 3])) {
    each_place(v, normal, region, |block| each_cell(v, normal, block.map(|b| b * 8), &mut see));
}

/// Which cubes of one size the plane of a triangle meets.
struct Slab<'a> {
    normal: &'a Point,
    corner: Point,
    reach: f64,
}

impl<'a> Slab<'a> {
    /// `half`: half a cube's edge (cells).
    fn new(v: &[Fixed; 3], normal: &'a Point, half: f64) -> Self {
        let reach = (half + TOUCH) * normal.iter().map(|value| value.abs()).sum::<f64>();
        Self { normal, corner: v[0].map(|value| f64::from(value) / f64::from(UNITS)), reach }
    }

    fn touches(&self, centre: Point) -> bool {
        dot(self.normal, &sub(centre, self.corner)).abs() <= self.reach
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
