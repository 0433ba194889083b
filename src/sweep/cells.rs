//! Which faces pass through the unit cell around each voxel, and the winding number at any point.

use std::collections::HashMap;
use std::ops::Range;

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::planes::{CLEAR, Planes};
use super::region::{Region, each_block, extent};
use super::winding::Lines;

/// A position or direction in fixed-point units.
pub type Point = [f64; 3];

/// Faces a task sorts: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// A block with at most this many faces is one cell.
const FEW: usize = 8;
/// A cell with more faces than this is divided...
const MANY: usize = 96;
/// ...into so many parts along each edge.
const PARTS: usize = 4;
/// How far the middles of parts are off (cells), lest a face of a regular mesh passes through them.
const OFF: [f64; 3] = [0.007, 0.0042, -0.0021];
/// No slot.
const NONE: u32 = u32::MAX;
/// Where a voxel is taken to be, off its centre (cells): the scan lines' side of faces and edges through it.
const NUDGE: [f32; 3] = [1e-3, 3e-4, -1e-4];
/// Room for rounding where a plane touches a cell's corner (cells).
const TOUCH: f64 = 1e-5;

/// Faces sorted into the unit cells around the voxels of some blocks.
pub struct Cells<'a> {
    faces: &'a [Face],
    normals: &'a [Point],
    region: &'a Region,
    lines: &'a Lines,
    rims: Vec<Rim>,
    /// Place of each block of the region in `blocks`.
    slots: Vec<u32>,
    blocks: Vec<Block>,
    count: usize,
}

/// The faces of one block.
struct Block {
    /// Number of its first cell, among all.
    first: usize,
    /// `start[c]..start[c + 1]` pass through cell c: 512 cells, or one.
    start: Vec<u32>,
    near: NearFaces,
    /// Cells with many faces, divided.
    dense: HashMap<u32, Dense>,
}

/// Faces near a place, with their planes as seen from a block's first voxel.
#[derive(Default)]
struct NearFaces {
    ids: Vec<u32>,
    planes: Planes,
}

/// A cell divided into [`PARTS`]^3, with the winding number in the middle of each: near the apex of a cone
/// thousands of faces meet in one cell.
struct Dense {
    /// `start[p]..start[p + 1]` pass through part p.
    start: Vec<u32>,
    near: NearFaces,
    winding: Vec<i32>,
}

/// Where the winding number is known, to count from.
struct Known {
    voxel: [i32; 3],
    /// From the voxel's centre (cells); none at the voxel itself.
    offset: Option<[f32; 3]>,
    winding: i32,
}

/// The rim of a face: for each edge the inward direction in the face's plane, and how far the edge lies that
/// way from the first corner (cells).
type Rim = [[f32; 4]; 3];

impl<'a> Cells<'a> {
    /// Sorts faces into the cells of the marked blocks.
    pub fn new(
        faces: &'a [Face],
        normals: &'a [Point],
        region: &'a Region,
        marked: &[bool],
        lines: &'a Lines,
    ) -> Self {
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
        let mut cells = Self { faces, normals, region, lines, rims, slots, blocks, count };
        let dense: Vec<HashMap<u32, Dense>> =
            cells.blocks.par_iter().zip(&places).map(|(block, &place)| cells.divide(block, place)).collect();
        cells.blocks.iter_mut().zip(dense).for_each(|(block, dense)| block.dense = dense);
        cells
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Calls `see` with each cell's number and faces, in parallel.
    pub fn for_each(&self, see: impl Fn(usize, &[u32]) + Sync) {
        self.blocks.par_iter().for_each(|block| {
            let cells = 0..block.start.len() - 1;
            cells.for_each(|cell| see(block.first + cell, &block.near.ids[block.range(cell)]));
        });
    }

    /// The cell around a voxel.
    pub fn of_voxel(&self, voxel: [i32; 3]) -> Option<usize> {
        self.block_of(voxel).map(|block| block.first + block.cell(voxel))
    }

    fn block_of(&self, voxel: [i32; 3]) -> Option<&Block> {
        let place = voxel.map(|value| value >> 3);
        let slot = if self.region.holds(place) { self.slots[self.region.index(place)] } else { NONE };
        (slot != NONE).then(|| &self.blocks[slot as usize])
    }

    /// Winding number of the chain at a point (fixed-point units): that of the nearest place where it is known,
    /// and the faces between.
    pub fn winding(&self, point: Point) -> i32 {
        let voxel = point.map(|value| (value / f64::from(UNITS)).round() as i32);
        let Some(block) = self.block_of(voxel) else { return self.lines.winding(voxel) };
        if let Some(dense) = block.dense.get(&(inner(voxel) as u32)) {
            let part = [0, 1, 2].map(|axis| {
                let within = point[axis] / f64::from(UNITS) - f64::from(voxel[axis]) + 0.5;
                ((within * PARTS as f64) as usize).min(PARTS - 1)
            });
            let index = (part[0] * PARTS + part[1]) * PARTS + part[2];
            let offset = middle_of(index).map(|value| value as f32);
            let known = Known { voxel, offset: Some(offset), winding: dense.winding[index] };
            let range = dense.start[index] as usize..dense.start[index + 1] as usize;
            return self.count_from(&known, &dense.near, range, point);
        }
        let known = Known { voxel, offset: None, winding: self.lines.winding(voxel) };
        self.count_from(&known, &block.near, block.range(block.cell(voxel)), point)
    }

    /// The winding number at a point from a known one, and the faces near both.
    fn count_from(&self, known: &Known, near: &NearFaces, range: Range<usize>, point: Point) -> i32 {
        let offset = known.offset.unwrap_or_default();
        let local = [0, 1, 2].map(|axis| (known.voxel[axis] & 7) as f32 + offset[axis]);
        let from = known.voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let way = [0, 1, 2].map(|a| ((point[a] - from[a]) / f64::from(UNITS) - f64::from(offset[a])) as f32);
        let mut winding = known.winding;
        near.planes.for_each_met(range, local, way, |index, begin, end| {
            let id = near.ids[index] as usize;
            if !self.passes(id, known, way, begin / (begin - end)) {
                return;
            }
            let begin_in_front = if begin.abs() > CLEAR || known.offset.is_some() {
                begin > 0.0
            } else {
                let (normal, corner) = (&self.normals[id], self.faces[id].v[0].map(f64::from));
                in_front(dot(normal, &sub(from, corner)), normal)
            };
            if begin_in_front != (end > 0.0) {
                let coef = self.faces[id].coef;
                winding += if begin_in_front { coef } else { -coef };
            }
        });
        winding
    }

    /// Whether a segment that meets the plane of a face after the part `t` of its way passes through the face.
    fn passes(&self, id: usize, known: &Known, way: [f32; 3], t: f32) -> bool {
        let corner = &self.faces[id].v[0];
        let (begin, end) = match known.offset {
            None => (NUDGE, way),
            Some(offset) => (offset, [0, 1, 2].map(|axis| offset[axis] + way[axis])),
        };
        let t = t.clamp(0.0, 1.0);
        let at = |axis: usize| {
            let from_corner = (known.voxel[axis] * UNITS - corner[axis]) as f32 / UNITS as f32;
            from_corner + t * end[axis] + (1.0 - t) * begin[axis]
        };
        let [x, y, z] = [at(0), at(1), at(2)];
        let over = |edge: &[f32; 4]| edge[0] * x + edge[1] * y + edge[2] * z > edge[3];
        let rim = &self.rims[id];
        over(&rim[0]) & over(&rim[1]) & over(&rim[2])
    }

    /// Divides the cells of a block that hold many faces.
    fn divide(&self, block: &Block, place: [i32; 3]) -> HashMap<u32, Dense> {
        if block.start.len() == 2 {
            return HashMap::new();
        }
        let many = (0..block.start.len() - 1).filter(|&cell| block.range(cell).len() > MANY);
        many.map(|cell| (cell as u32, self.dense(block, place, cell))).collect()
    }

    fn dense(&self, block: &Block, place: [i32; 3], cell: usize) -> Dense {
        let at = [cell >> 6, cell >> 3 & 7, cell & 7];
        let voxel = [0, 1, 2].map(|axis| place[axis] * 8 + at[axis] as i32);
        let known = Known { voxel, offset: None, winding: self.lines.winding(voxel) };
        let mut dense = Dense { start: vec![0], near: NearFaces::default(), winding: Vec::new() };
        // A part's known middle is a little off its own: both the part and the way from there count.
        let room = 0.5 / PARTS as f64 + OFF[0];
        for index in 0..PARTS * PARTS * PARTS {
            let offset = middle_of(index);
            let middle = [0, 1, 2].map(|axis| f64::from(voxel[axis]) + offset[axis]);
            let point = middle.map(|value| value * f64::from(UNITS));
            dense.winding.push(self.count_from(&known, &block.near, block.range(cell), point));
            for at in block.range(cell) {
                let id = block.near.ids[at];
                let v = &self.faces[id as usize].v;
                let (low, high) = extent(v);
                let overlaps = (0..3).all(|axis| {
                    f64::from(low[axis]) <= middle[axis] + room && f64::from(high[axis]) >= middle[axis] - room
                });
                if overlaps && Slab::new(v, &self.normals[id as usize], room).touches(middle) {
                    dense.near.ids.push(id);
                    dense.near.planes.push(block.near.planes.get(at));
                }
            }
            dense.start.push(dense.near.ids.len() as u32);
        }
        dense
    }
}

/// The middle of a part of a divided cell, from the cell's voxel (cells).
fn middle_of(part: usize) -> [f64; 3] {
    let place = [part / (PARTS * PARTS), part / PARTS % PARTS, part % PARTS];
    [0, 1, 2].map(|axis| (place[axis] as f64 + 0.5) / PARTS as f64 - 0.5 + OFF[axis])
}

impl Block {
    fn new(place: [i32; 3], ids: Vec<u32>, faces: &[Face], normals: &[Point]) -> Self {
        let corner = place.map(|block| block * 8);
        if ids.len() <= FEW {
            let start = vec![0, ids.len() as u32];
            let near = NearFaces::new(ids, corner, faces, normals);
            return Self { first: 0, start, near, dense: HashMap::new() };
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
        let near = NearFaces::new(sorted, corner, faces, normals);
        Self { first: 0, start, near, dense: HashMap::new() }
    }

    fn cell(&self, voxel: [i32; 3]) -> usize {
        if self.start.len() == 2 { 0 } else { inner(voxel) }
    }

    fn range(&self, cell: usize) -> Range<usize> {
        self.start[cell] as usize..self.start[cell + 1] as usize
    }
}

impl NearFaces {
    fn new(ids: Vec<u32>, corner: [i32; 3], faces: &[Face], normals: &[Point]) -> Self {
        let mut planes = Planes::default();
        planes.reserve(ids.len());
        for &id in &ids {
            planes.push(plane(&faces[id as usize], &normals[id as usize], corner));
        }
        Self { ids, planes }
    }
}

/// The plane of a face: unit normal, and the height of a voxel over it (cells).
fn plane(face: &Face, normal: &Point, voxel: [i32; 3]) -> [f32; 4] {
    let length = dot(normal, normal).sqrt();
    let unit = if length > 0.0 { normal.map(|value| value / length) } else { [0.0; 3] };
    let corner = face.v[0].map(|value| f64::from(value) / f64::from(UNITS));
    let height = dot(&unit, &sub(voxel.map(f64::from), corner));
    let [x, y, z] = unit;
    [x as f32, y as f32, z as f32, height as f32]
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
