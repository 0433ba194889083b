//! Which faces pass through the unit cell around each voxel, and the winding number at any point.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::lists::Lists;
use super::prism::{Prism, Prisms};
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
/// Where a voxel is taken to be, off its centre (units): down, far less to the right, and least of all forward, as
/// the scan lines move it. Less than a unit, lest a face lies between.
const NUDGE: Point = [0.25 / 64.0, 0.25 / 4096.0, -0.25];
/// Room for rounding where a plane touches a cell's corner (cells).
const TOUCH: f64 = 1e-5;

/// Faces sorted into the unit cells around the voxels of some blocks.
pub struct Cells {
    /// Every face near the blocks.
    pub faces: Vec<Face>,
    /// Their normals, as long as twice their areas (units^2).
    pub normals: Vec<Point>,
    /// The region that the blocks are of.
    pub region: Region,
    /// Winding numbers at the region's voxels.
    pub lines: Lines,
    /// Place of each block of the region in `blocks`.
    slots: Vec<u32>,
    blocks: Vec<Block>,
    count: usize,
    /// No others have this number.
    id: u64,
}

/// The faces of one block.
struct Block {
    /// Number of its first cell, among all.
    first: usize,
    /// Its first voxel.
    corner: [i32; 3],
    /// Faces near the block, ascending.
    ids: Vec<u32>,
    /// Their prisms, seen from the block's first voxel.
    prisms: Vec<Prism>,
    /// Which of them pass through each cell: 512 cells, or one.
    cells: Lists<u32>,
}

impl Cells {
    /// Sorts faces into the cells of the marked blocks.
    pub fn new(faces: Vec<Face>, region: Region, marked: &[bool], lines: Lines) -> Self {
        let normals: Vec<Point> = faces.par_iter().map(normal).collect();
        let mut slots = vec![NONE; marked.len()];
        let places: Vec<[i32; 3]> =
            (0..marked.len()).filter(|&block| marked[block]).map(|block| region.place(block)).collect();
        places.iter().enumerate().for_each(|(slot, &block)| slots[region.index(block)] = slot as u32);
        let lists = by_block(&faces, &normals, &region, &slots, places.len());
        let sort = |(slot, &place)| Block::new(place, lists.get(slot).to_vec(), &faces, &normals);
        let mut blocks: Vec<Block> = places.par_iter().enumerate().map(sort).collect();
        let mut count = 0;
        for block in &mut blocks {
            block.first = count;
            count += block.cells.count();
        }
        static LAST: AtomicU64 = AtomicU64::new(0);
        let id = LAST.fetch_add(1, Ordering::Relaxed) + 1;
        Self { faces, normals, region, lines, slots, blocks, count, id }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The blocks.
    pub fn places(&self) -> impl Iterator<Item = [i32; 3]> {
        self.blocks.iter().map(|block| block.corner.map(|corner| corner >> 3))
    }

    /// Calls `see` with each cell's number and faces, in parallel.
    pub fn for_each(&self, see: impl Fn(usize, &[u32]) + Sync) {
        self.blocks.par_iter().for_each_init(Vec::new, |ids, block| {
            for cell in 0..block.cells.count() {
                ids.clear();
                ids.extend(block.cells.get(cell).iter().map(|&place| block.ids[place as usize]));
                see(block.first + cell, ids);
            }
        });
    }

    /// The cell around a voxel.
    pub fn of_voxel(&self, voxel: [i32; 3]) -> Option<usize> {
        self.block_of(voxel).map(|block| block.first + block.cell(voxel))
    }

    /// How many faces may pass through the cell around a voxel.
    pub fn crowd(&self, voxel: [i32; 3]) -> usize {
        self.block_of(voxel).map_or(0, |block| block.cells.get(block.cell(voxel)).len())
    }

    /// Calls `see` with the index and voxel of each cell that `crowd` faces or more may pass through, in parallel.
    pub fn for_each_crowd(&self, crowd: usize, see: impl Fn(usize, [i32; 3]) + Sync) {
        self.blocks.par_iter().filter(|block| block.cells.count() > 1).for_each(|block| {
            for cell in (0..512).filter(|&cell| block.cells.get(cell).len() >= crowd) {
                let at = [cell >> 6, cell >> 3 & 7, cell & 7];
                see(block.first + cell, [0, 1, 2].map(|axis| block.corner[axis] + at[axis] as i32));
            }
        });
    }

    fn block_of(&self, voxel: [i32; 3]) -> Option<&Block> {
        let place = voxel.map(|value| value >> 3);
        let slot = if self.region.holds(place) { self.slots[self.region.index(place)] } else { NONE };
        (slot != NONE).then(|| &self.blocks[slot as usize])
    }

    /// Winding numbers of the chain at a point and at another at most [`super::prism::BESIDE`] cells away
    /// (fixed-point units): the nearest voxel's, and the faces between.
    pub fn windings(&self, point: Point, beside: Point, prisms: &mut Prisms) -> [i32; 2] {
        let voxel = voxel_of(point);
        let mut winding = self.lines.winding(voxel);
        let Some(block) = self.block_of(voxel) else { return [winding; 2] };
        let begin = voxel.map(|value| (value & 7) as f32);
        let local = |p: Point| {
            [0, 1, 2].map(|axis| begin[axis] + (p[axis] / f64::from(UNITS) - f64::from(voxel[axis])) as f32)
        };
        let cell = block.cell(voxel);
        let prism = |&place: &u32| {
            let id = block.ids[place as usize];
            (block.prisms[place as usize], id, self.faces[id as usize].coef)
        };
        let bundle = prisms.of(self.id, block.first + cell, || block.cells.get(cell).iter().map(prism));
        let change = bundle.ask(begin, local(point), local(beside));
        winding += change.along;
        for (id, coef) in bundle.unclear() {
            winding += coef * self.exact_crossing(id as usize, voxel, point);
        }
        [winding, winding + change.beside]
    }

    /// 1 when the way from a voxel to a point enters the chain through a face, -1 when it leaves it, else 0.
    ///
    /// A voxel in the plane of a face, or of an edge, is where the scan lines take it to be: see [`NUDGE`].
    fn exact_crossing(&self, id: usize, voxel: [i32; 3], end: Point) -> i32 {
        let (normal, v) = (&self.normals[id], self.faces[id].v.map(|p| p.map(f64::from)));
        let centre = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let begin = [0, 1, 2].map(|axis| centre[axis] + NUDGE[axis]);
        let [first, last] = [begin, end].map(|p| dot(normal, &sub(p, v[0])));
        let in_front = in_front(dot(normal, &sub(centre, v[0])), normal);
        if in_front == (last > 0.0) {
            return 0;
        }
        let t = (first / (first - last)).clamp(0.0, 1.0);
        let at = [0, 1, 2].map(|axis| begin[axis] + t * (end[axis] - begin[axis]));
        let inside = (0..3).all(|i| {
            let edge = sub(v[(i + 1) % 3], v[i]);
            dot(&cross(*normal, edge), &sub(at, v[i])) > 0.0
        });
        match (inside, in_front) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => -1,
        }
    }
}

impl Block {
    fn new(place: [i32; 3], ids: Vec<u32>, faces: &[Face], normals: &[Point]) -> Self {
        let corner = place.map(|block| block * 8);
        let prism = |&id: &u32| Prism::new(&faces[id as usize].v, &normals[id as usize], corner);
        let prisms = ids.iter().map(prism).collect();
        let cells = if ids.len() <= FEW {
            Lists::one((0..ids.len() as u32).collect())
        } else {
            by_cell(corner, &ids, faces, normals)
        };
        Self { first: 0, corner, ids, prisms, cells }
    }

    fn cell(&self, voxel: [i32; 3]) -> usize {
        if self.cells.count() == 1 { 0 } else { inner(voxel) }
    }
}

/// For each unit cell around a block's voxels which of the block's faces may pass through it.
fn by_cell(corner: [i32; 3], ids: &[u32], faces: &[Face], normals: &[Point]) -> Lists<u32> {
    let mut pairs = Vec::with_capacity(ids.len() * 4);
    for (place, &id) in ids.iter().enumerate() {
        let (v, normal) = (&faces[id as usize].v, &normals[id as usize]);
        each_cell(v, normal, corner, |voxel| pairs.push((inner(voxel) as u32, place as u32)));
    }
    Lists::new(512, &[pairs])
}

/// The voxel nearest to a point (fixed-point units).
pub fn voxel_of(point: Point) -> [i32; 3] {
    // Far above 0, cutting off is rounding down: no call as for `round`.
    const ABOVE: i64 = 1 << 40;
    let unit = i64::from(UNITS);
    point.map(|value| (((value + ABOVE as f64) as i64 + unit / 2).div_euclid(unit) - ABOVE / unit) as i32)
}

/// A voxel's number in its block.
fn inner(voxel: [i32; 3]) -> usize {
    let [x, y, z] = voxel.map(|value| (value & 7) as usize);
    x << 6 | y << 3 | z
}

/// For each block in `slots` the faces that may pass through the unit cells of its voxels, ascending.
fn by_block(faces: &[Face], normals: &[Point], region: &Region, slots: &[u32], count: usize) -> Lists<u32> {
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
    Lists::new(count, &pairs)
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

/// Which side of a face a voxel is on; the scan lines move a voxel in a face's plane down, then right.
pub fn in_front(height: f64, normal: &Point) -> bool {
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
