//! Faces sorted by the unit cubes (bins) around voxels that they may pass through, and the winding number at any point.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::distance::Face;
use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::region::{Region, extent};
use crate::distance::vectors::{cross, difference, dot, sub};
use crate::distance::winding::Lines;
use crate::geometry::coords::between;
use crate::geometry::lists::Lists;
use crate::sweep::chain::prism::{Point, Prism, Prisms};

/// Faces per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// A block with at most this many faces is one bin.
const FEW: usize = 8;
/// Sentinel: no slot.
const NONE: u32 = u32::MAX;
/// The symbolic shift of voxels (`distance/winding.rs`) as a vector (units): mostly -z, then +x, then +y. It is less than one unit, so that
/// no face lies between a voxel and its shifted position.
const NUDGE: Point = [0.25 / 64.0, 0.25 / 4096.0, -0.25];
/// Tolerance (cells) for a plane that touches the corner of a cube.
const TOUCH: f64 = 1e-5;

/// Faces sorted into the bins around the voxels of some blocks.
pub struct Bins {
    /// Every face near the blocks.
    pub faces: Vec<Face>,
    /// Their normals; the length is twice the face's area (units^2).
    pub normals: Vec<Point>,
    /// The region that contains the blocks.
    pub region: Region,
    /// Winding numbers at the region's voxels.
    pub lines: Lines,
    /// Index in `blocks` of each block of the region, or [`NONE`].
    slots: Vec<u32>,
    blocks: Vec<BlockFaces>,
    count: usize,
    /// Unique in the process.
    id: u64,
}

/// The faces of one block.
struct BlockFaces {
    /// Index of its first bin, among all.
    first: usize,
    /// Its first voxel.
    corner: [i32; 3],
    /// Faces near the block, ascending.
    ids: Vec<u32>,
    /// Their prisms, relative to the block's first voxel.
    prisms: Vec<Prism>,
    /// The faces that may pass through each bin: 512 bins, or one.
    bins: Lists<u32>,
}

impl Bins {
    /// Sorts faces into the bins of the marked blocks.
    pub fn new(faces: Vec<Face>, region: Region, marked: &[bool], lines: Lines) -> Self {
        let normals: Vec<Point> = faces.par_iter().map(normal).collect();
        let mut slots = vec![NONE; marked.len()];
        let wanted: Vec<[i32; 3]> =
            (0..marked.len()).filter(|&block| marked[block]).map(|block| region.block(block)).collect();
        wanted.iter().enumerate().for_each(|(slot, &block)| slots[region.index(block)] = slot as u32);
        let lists = by_block(&faces, &normals, &region, &slots, wanted.len());
        let sort = |(slot, &position)| BlockFaces::new(position, lists.get(slot).to_vec(), &faces, &normals);
        let mut blocks: Vec<BlockFaces> = wanted.par_iter().enumerate().map(sort).collect();
        let mut count = 0;
        for block in &mut blocks {
            block.first = count;
            count += block.bins.count();
        }
        static LAST: AtomicU64 = AtomicU64::new(0);
        let id = LAST.fetch_add(1, Ordering::Relaxed) + 1;
        Self { faces, normals, region, lines, slots, blocks, count, id }
    }

    /// Number of bins.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The blocks.
    pub fn blocks(&self) -> impl Iterator<Item = [i32; 3]> {
        self.blocks.iter().map(|block| block.corner.map(|corner| corner >> 3))
    }

    /// Calls `see` with each bin's index and faces, in parallel.
    pub fn for_each(&self, see: impl Fn(usize, &[u32]) + Sync) {
        self.blocks.par_iter().for_each_init(Vec::new, |ids, block| {
            for bin in 0..block.bins.count() {
                ids.clear();
                ids.extend(block.bins.get(bin).iter().map(|&position| block.ids[position as usize]));
                see(block.first + bin, ids);
            }
        });
    }

    /// Index of the bin around a voxel.
    pub fn of_voxel(&self, voxel: [i32; 3]) -> Option<usize> {
        self.block_of(voxel).map(|block| block.first + block.bin(voxel))
    }

    /// Number of faces in the bin around a voxel.
    pub fn face_count(&self, voxel: [i32; 3]) -> usize {
        self.block_of(voxel).map_or(0, |block| block.bins.get(block.bin(voxel)).len())
    }

    /// Calls `see` with the index and voxel of each bin with at least `min_faces` faces, in parallel.
    pub fn for_each_crowded(&self, min_faces: usize, see: impl Fn(usize, [i32; 3]) + Sync) {
        self.blocks.par_iter().filter(|block| block.bins.count() > 1).for_each(|block| {
            for bin in (0..512).filter(|&bin| block.bins.get(bin).len() >= min_faces) {
                let at = [bin >> 6, bin >> 3 & 7, bin & 7];
                see(block.first + bin, [0, 1, 2].map(|axis| block.corner[axis] + at[axis] as i32));
            }
        });
    }

    fn block_of(&self, voxel: [i32; 3]) -> Option<&BlockFaces> {
        let position = voxel.map(|value| value >> 3);
        let slot = if self.region.holds(position) { self.slots[self.region.index(position)] } else { NONE };
        (slot != NONE).then(|| &self.blocks[slot as usize])
    }

    /// Winding numbers of the chain at a point (fixed-point units) and at `beside`, at most [`crate::sweep::chain::prism::BESIDE`] cells
    /// from it: they are the winding number of the nearest voxel, corrected by the faces in between.
    pub fn windings(&self, point: Point, beside: Point, prisms: &mut Prisms) -> [i32; 2] {
        let voxel = voxel_of(point);
        let mut winding = self.lines.winding(voxel);
        let Some(block) = self.block_of(voxel) else { return [winding; 2] };
        let begin = voxel.map(|value| (value & 7) as f32);
        let local = |p: Point| {
            [0, 1, 2].map(|axis| begin[axis] + (p[axis] / f64::from(UNITS) - f64::from(voxel[axis])) as f32)
        };
        let bin = block.bin(voxel);
        let prism = |&position: &u32| {
            let id = block.ids[position as usize];
            (block.prisms[position as usize], id, self.faces[id as usize].coef)
        };
        let faces = prisms.of(self.id, block.first + bin, || block.bins.get(bin).iter().map(prism));
        let change = faces.query(begin, local(point), local(beside));
        winding += change.along;
        for (id, coef) in faces.unclear() {
            winding += coef * self.exact_crossing(id as usize, voxel, point);
        }
        [winding, winding + change.beside]
    }

    /// 1 if the segment from a voxel to a point enters the chain through a face, -1 if it leaves it, otherwise 0.
    ///
    /// A voxel in the plane of a face or of an edge is shifted as for the scan lines: see [`NUDGE`].
    fn exact_crossing(&self, id: usize, voxel: [i32; 3], end: Point) -> i32 {
        let (normal, v) = (&self.normals[id], self.faces[id].v.map(|p| p.map(f64::from)));
        let centre = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let begin = [0, 1, 2].map(|axis| centre[axis] + NUDGE[axis]);
        let [first, last] = [begin, end].map(|p| dot(*normal, sub(p, v[0])));
        let in_front = in_front(dot(*normal, sub(centre, v[0])), normal);
        if in_front == (last > 0.0) {
            return 0;
        }
        let t = (first / (first - last)).clamp(0.0, 1.0);
        let at = [0, 1, 2].map(|axis| begin[axis] + t * (end[axis] - begin[axis]));
        let inside = (0..3).all(|i| {
            let edge = sub(v[(i + 1) % 3], v[i]);
            dot(cross(*normal, edge), sub(at, v[i])) > 0.0
        });
        match (inside, in_front) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => -1,
        }
    }
}

impl BlockFaces {
    fn new(position: [i32; 3], ids: Vec<u32>, faces: &[Face], normals: &[Point]) -> Self {
        let corner = position.map(|block| block * 8);
        let prism = |&id: &u32| Prism::new(&faces[id as usize].v, &normals[id as usize], corner);
        let prisms = ids.iter().map(prism).collect();
        let bins = if ids.len() <= FEW {
            Lists::one((0..ids.len() as u32).collect())
        } else {
            by_bin(corner, &ids, faces, normals)
        };
        Self { first: 0, corner, ids, prisms, bins }
    }

    fn bin(&self, voxel: [i32; 3]) -> usize {
        if self.bins.count() == 1 { 0 } else { inner(voxel) }
    }
}

/// For each bin of a block, the block's faces that may pass through it.
fn by_bin(corner: [i32; 3], ids: &[u32], faces: &[Face], normals: &[Point]) -> Lists<u32> {
    let mut pairs = Vec::with_capacity(ids.len() * 4);
    for (position, &id) in ids.iter().enumerate() {
        let (v, normal) = (&faces[id as usize].v, &normals[id as usize]);
        each_bin(v, normal, corner, |voxel| pairs.push((inner(voxel) as u32, position as u32)));
    }
    Lists::new(512, pairs.iter().copied())
}

/// The voxel nearest to a point (fixed-point units).
pub fn voxel_of(point: Point) -> [i32; 3] {
    // Truncating a large positive number rounds down, and avoids the function call that `round` is in the baseline instruction set.
    const ABOVE: i64 = 1 << 40;
    let unit = i64::from(UNITS);
    point.map(|value| (((value + ABOVE as f64) as i64 + unit / 2).div_euclid(unit) - ABOVE / unit) as i32)
}

/// Index of a voxel in its block.
fn inner(voxel: [i32; 3]) -> usize {
    let [x, y, z] = voxel.map(|value| (value & 7) as usize);
    x << 6 | y << 3 | z
}

/// For each block in `slots`, the faces that may pass through its bins, ascending.
fn by_block(faces: &[Face], normals: &[Point], region: &Region, slots: &[u32], count: usize) -> Lists<u32> {
    let pairs: Vec<Vec<(u32, u32)>> = faces
        .par_chunks(GRAIN)
        .enumerate()
        .map(|(chunk, faces)| {
            let mut out = Vec::with_capacity(faces.len() * 2);
            for (index, face) in faces.iter().enumerate() {
                let id = chunk * GRAIN + index;
                each_block(&face.v, &normals[id], region, |block| {
                    let slot = slots[region.index(block)];
                    if slot != NONE {
                        out.push((slot, id as u32));
                    }
                });
            }
            out
        })
        .collect();
    Lists::new(count, pairs.iter().flatten().copied())
}

/// Calls `see` with the blocks of a region whose bins a triangle may pass through.
fn each_block(v: &[Fixed; 3], normal: &Point, region: &Region, mut see: impl FnMut([i32; 3])) {
    let (first, last) = region.touched(extent(v), 0.5);
    let slab = Slab::new(v, normal, 4.0);
    between(first, last)
        .filter(|block| slab.touches(block.map(|b| f64::from(b) * 8.0 + 3.5)))
        .for_each(&mut see);
}

/// Calls `see` with the voxels of a block whose bins a triangle may pass through.
fn each_bin(v: &[Fixed; 3], normal: &Point, corner: [i32; 3], mut see: impl FnMut([i32; 3])) {
    let (low, high) = extent(v);
    let first = [0, 1, 2].map(|a| ((low[a] - 0.5).ceil() as i32).max(corner[a]));
    let last = [0, 1, 2].map(|a| ((high[a] + 0.5).floor() as i32).min(corner[a] + 7));
    let slab = Slab::new(v, normal, 0.5);
    between(first, last).filter(|voxel| slab.touches(voxel.map(f64::from))).for_each(&mut see);
}

/// Calls `see` with the voxels of a region whose bins a triangle may pass through.
pub fn each_voxel(v: &[Fixed; 3], normal: &Point, region: &Region, mut see: impl FnMut([i32; 3])) {
    each_block(v, normal, region, |block| each_bin(v, normal, block.map(|b| b * 8), &mut see));
}

/// Tests whether the plane of a triangle intersects cubes of a given size.
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
        dot(*self.normal, sub(centre, self.corner)).abs() <= self.reach
    }
}

/// Normal of a face; its length is twice the face's area (units^2).
pub fn normal(face: &Face) -> Point {
    cross(difference(face.v[1], face.v[0]), difference(face.v[2], face.v[0]))
}

/// Whether a voxel at this height over a face is in front of it; at height 0 the symbolic shift decides.
pub fn in_front(height: f64, normal: &Point) -> bool {
    let towards = [height, -normal[2], normal[0], normal[1]];
    towards.into_iter().find(|value| *value != 0.0).is_some_and(|value| value > 0.0)
}
