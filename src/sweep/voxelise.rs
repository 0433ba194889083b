//! From the boundary of a chain to blocks of signed distances: winding number first, distance second.
//!
//! A face with winding number > 0 on both sides is no surface, and its distance would leave near-zero
//! sheets inside. Seen from a voxel, the winding number just before the nearest face is the voxel's
//! own; behind the face it follows from the face's coefficient: that decides exactly.

use rayon::prelude::*;

use super::chain::Face;
use super::distance::Triangle;
use super::lattice::{Fixed, Lattice, UNITS};
use super::nearest::{Around, Scratch, search};
use super::winding::Lines;
use crate::base::blocks::{Origin, VOXELS, Values};
use crate::error::{Error, Result};

/// How far distances are wanted on each side of the surface (cells).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Inside the solid.
    pub inside: f32,
    /// Outside.
    pub outside: f32,
}

impl Band {
    fn reach(&self) -> f32 {
        self.inside.max(self.outside)
    }
}

/// A block near the surface, or wholly inside.
#[derive(Clone, PartialEq)]
pub enum Piece {
    /// Signed distances in cells, negative inside, cut off at the band.
    Near(Origin, Box<Values>),
    /// Wholly inside, deeper than the band.
    Inside(Origin),
}

impl Piece {
    /// Least corner, in voxels.
    pub fn origin(&self) -> Origin {
        match self {
            Self::Near(origin, _) | Self::Inside(origin) => *origin,
        }
    }
}

/// A chain ready to be turned into blocks.
pub struct Voxeliser {
    lattice: Lattice,
    band: Band,
    faces: Vec<Face>,
    lines: Lines,
    /// Blocks with faces in reach, in units of blocks from the base voxel; ascending.
    near: Vec<[i32; 3]>,
    /// `face_ids[start[i]..start[i + 1]]` are the faces of `near[i]`.
    start: Vec<u32>,
    face_ids: Vec<u32>,
    inside: Vec<[i32; 3]>,
}

/// No block.
const NONE: u32 = u32::MAX;
/// Faces a task sorts into blocks: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;
/// Most blocks a region may span: its index then fits 1 GiB.
const MOST_BLOCKS: u64 = 1 << 28;

impl Voxeliser {
    /// Sorts the faces into blocks and scans the winding numbers, inside the voxel box `low..=high`
    /// (from the lattice's base voxel).
    ///
    /// # Errors
    /// When the box spans more than 2^28 blocks.
    pub fn new(
        faces: Vec<Face>,
        lattice: Lattice,
        band: Band,
        low: [i32; 3],
        high: [i32; 3],
    ) -> Result<Self> {
        let region = Region::around(&faces, band.outside, low, high)?;
        let [lo, hi] = [region.low.map(|b| b * 8), region.high.map(|b| b * 8 + 7)];
        let lines = Lines::scan(&faces, [lo[0], lo[1]], [hi[0], hi[1]]);
        let mut voxeliser = Self {
            lattice,
            band,
            faces,
            lines,
            near: Vec::new(),
            start: vec![0],
            face_ids: Vec::new(),
            inside: Vec::new(),
        };
        let slots = voxeliser.sort_faces(&region);
        voxeliser.find_inside(&region, &slots);
        Ok(voxeliser)
    }

    /// Origins of the blocks near the surface, in the order that [`Voxeliser::piece`] counts.
    pub fn near_blocks(&self) -> Vec<Origin> {
        self.near.iter().map(|&block| self.origin(block)).collect()
    }

    /// Origins of the blocks that have no face in reach and lie inside.
    pub fn inside_blocks(&self) -> Vec<Origin> {
        self.inside.iter().map(|&block| self.origin(block)).collect()
    }

    /// Number of faces of the chain's boundary.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    fn origin(&self, block: [i32; 3]) -> Origin {
        [0, 1, 2].map(|axis| self.lattice.base[axis] + block[axis] * 8)
    }

    /// Lists for each block the faces in reach; returns the block index of the region.
    fn sort_faces(&mut self, region: &Region) -> Vec<u32> {
        let pairs: Vec<Vec<(u32, u32)>> = self
            .faces
            .par_chunks(GRAIN)
            .enumerate()
            .map(|(chunk, faces)| {
                let mut out = Vec::new();
                for (index, face) in faces.iter().enumerate() {
                    self.blocks_of(face, (chunk * GRAIN + index) as u32, region, &mut out);
                }
                out
            })
            .collect();
        let mut count = vec![0u32; region.blocks()];
        pairs.iter().flatten().for_each(|&(block, _)| count[block as usize] += 1);
        let mut slots = vec![NONE; count.len()];
        for (block, &count) in count.iter().enumerate().filter(|(_, count)| **count > 0) {
            slots[block] = self.near.len() as u32;
            self.near.push(region.place(block));
            self.start.push(self.start[self.start.len() - 1] + count);
        }
        let mut place = self.start.clone();
        self.face_ids = vec![0; self.start[self.start.len() - 1] as usize];
        for &(block, face) in pairs.iter().flatten() {
            let slot = &mut place[slots[block as usize] as usize];
            self.face_ids[*slot as usize] = face;
            *slot += 1;
        }
        slots
    }

    /// Appends (block, face) for each block of the region that the face may be nearest in.
    fn blocks_of(&self, face: &Face, index: u32, region: &Region, out: &mut Vec<(u32, u32)>) {
        let reach = self.band.reach() + 0.01;
        let (low, high) = extent(&face.v);
        let first = [0, 1, 2].map(|a| block_of(low[a] - reach).max(region.low[a]));
        let last = [0, 1, 2].map(|a| block_of(high[a] + reach).min(region.high[a]));
        if (0..3).any(|axis| first[axis] > last[axis]) || self.is_buried(low, high) {
            return;
        }
        let triangle = Triangle::new(&face.v, first.map(|block| block * 8));
        if triangle.normal == [0.0; 3] {
            return;
        }
        let many = (0..3).map(|axis| last[axis] - first[axis] + 1).product::<i32>() > 2;
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                for z in first[2]..=last[2] {
                    let center = [x - first[0], y - first[1], z - first[2]].map(|b| b as f32 * 8.0 + 3.5);
                    if !many || gap(center, triangle.closest(center)) <= reach + 6.07 {
                        out.push((region.index([x, y, z]) as u32, index));
                    }
                }
            }
        }
    }

    /// Whether a small face lies so deep in the chain that no voxel within two cells is outside it:
    /// it then bounds at most a crack thinner than a voxel.
    fn is_buried(&self, low: [f32; 3], high: [f32; 3]) -> bool {
        if self.lines.is_simple() || (0..3).any(|axis| high[axis] - low[axis] > 6.0) {
            return false;
        }
        let [low, high] = [low.map(|v| v.floor() as i32 - 1), high.map(|v| v.ceil() as i32 + 1)];
        (low[0]..=high[0]).all(|x| (low[1]..=high[1]).all(|y| self.solid_between(x, y, low[2], high[2])))
    }

    fn solid_between(&self, x: i32, y: i32, low: i32, high: i32) -> bool {
        let line = self.lines.line(x, y);
        let below = line.partition_point(|(z, _)| *z < f64::from(low));
        below > 0
            && line[below - 1].1 >= 1
            && line[below..]
                .iter()
                .take_while(|(z, _)| *z < f64::from(high))
                .all(|(_, winding)| *winding >= 1)
    }

    /// Finds the blocks without faces whose first voxel is inside.
    fn find_inside(&mut self, region: &Region, slots: &[u32]) {
        for x in region.low[0]..=region.high[0] {
            for y in region.low[1]..=region.high[1] {
                let line = self.lines.line(x * 8, y * 8);
                for pair in line.windows(2).filter(|pair| pair[0].1 >= 1) {
                    let first = (pair[0].0 / 8.0).ceil().max(f64::from(region.low[2])) as i32;
                    let last = (pair[1].0 / 8.0).floor().min(f64::from(region.high[2])) as i32;
                    let empty = |z: &i32| slots[region.index([x, y, *z])] == NONE;
                    self.inside.extend((first..=last).filter(empty).map(|z| [x, y, z]));
                }
            }
        }
    }

    /// Distances of one of the [`Voxeliser::near_blocks`]; none when it proves to be wholly outside.
    pub fn piece(&self, index: usize, scratch: &mut Scratch) -> Option<Piece> {
        let block = self.near[index];
        let corner = block.map(|b| b * 8);
        let ids = &self.face_ids[self.start[index] as usize..self.start[index + 1] as usize];
        let faces: Vec<&Face> = ids.iter().map(|&id| &self.faces[id as usize]).collect();
        let triangles: Vec<Triangle> = faces.iter().map(|face| Triangle::new(&face.v, corner)).collect();
        let winding = self.windings(corner);
        let limits = winding.map(|w| if w >= 1 { self.band.inside } else { self.band.outside });
        let mut values: Box<Values> =
            Box::new(std::array::from_fn(|v| if winding[v] >= 1 { -limits[v] } else { limits[v] }));
        let mut uniform = true;
        search(&triangles, self.band.reach(), scratch, |around| {
            let voxel = around.voxel;
            let seen = Seen { triangles: &triangles, faces: &faces, voxel, winding: winding[voxel] };
            let distance = seen.distance(around, limits[voxel]);
            uniform &= distance >= limits[voxel];
            values[voxel] = if winding[voxel] >= 1 { -distance } else { distance };
        });
        let mixed = winding.iter().any(|&w| (w >= 1) != (winding[0] >= 1));
        match (uniform && !mixed, winding[0] >= 1) {
            (true, true) => Some(Piece::Inside(self.origin(block))),
            (true, false) => None,
            (false, _) => Some(Piece::Near(self.origin(block), values)),
        }
    }

    fn windings(&self, corner: [i32; 3]) -> [i32; VOXELS] {
        let mut winding = [0; VOXELS];
        for column in 0..64 {
            let line = self.lines.line(corner[0] + (column >> 3), corner[1] + (column & 7));
            let mut next = line.partition_point(|(height, _)| *height < f64::from(corner[2]));
            for z in 0..8 {
                while next < line.len() && line[next].0 < f64::from(corner[2] + z) {
                    next += 1;
                }
                winding[(column << 3 | z) as usize] = if next == 0 { 0 } else { line[next - 1].1 };
            }
        }
        winding
    }
}

/// A voxel and the faces around it.
struct Seen<'a> {
    triangles: &'a [Triangle],
    faces: &'a [&'a Face],
    voxel: usize,
    winding: i32,
}

impl Seen<'_> {
    fn position(&self) -> [f32; 3] {
        [(self.voxel >> 6) as f32, (self.voxel >> 3 & 7) as f32, (self.voxel & 7) as f32]
    }

    /// Whether the chain begins or ends at a face that is reached with this winding number.
    fn is_surface(&self, index: u32, before: i32) -> bool {
        let coef = self.faces[index as usize].coef;
        let front = self.triangles[index as usize].plane_distance(self.position()) > 0.0;
        let behind = if front { before + coef } else { before - coef };
        (before >= 1) != (behind >= 1)
    }

    /// Distance to the nearest face that is a surface, looking through the sheets before it; at most `limit`.
    fn distance(&self, around: &Around<'_>, limit: f32) -> f32 {
        let mut sheets: Vec<u32> = Vec::new();
        let mut next = Some(around.nearest);
        while let Some((squared, index)) = next {
            let distance = squared.sqrt();
            if distance >= limit {
                return limit;
            }
            if !sheets.is_empty() && distance > around.complete_to {
                break;
            }
            if self.ends_at(index, &sheets) {
                return distance;
            }
            sheets.push(index);
            next = around.next_after((squared, index));
        }
        self.distance_among_all(limit)
    }

    /// Whether the face's nearest point is on the surface, when these faces are nearer.
    fn ends_at(&self, index: u32, nearer: &[u32]) -> bool {
        if nearer.is_empty() {
            return self.is_surface(index, self.winding);
        }
        let p = self.position();
        let q = self.triangles[index as usize].closest(p);
        let passed = |&at: &u32| self.triangles[at as usize].passed(p, q) * self.faces[at as usize].coef;
        let crossed: i32 = nearer.iter().map(passed).sum();
        self.is_surface(index, self.winding - crossed)
    }

    /// As [`Seen::distance`], among all faces of the block.
    fn distance_among_all(&self, limit: f32) -> f32 {
        let p = self.position();
        let mut order: Vec<(f32, u32)> = self
            .triangles
            .iter()
            .enumerate()
            .map(|(index, triangle)| (gap(p, triangle.closest(p)), index as u32))
            .filter(|(distance, _)| *distance < limit)
            .collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut nearer: Vec<u32> = Vec::with_capacity(order.len());
        for (distance, index) in order {
            if self.ends_at(index, &nearer) {
                return distance;
            }
            nearer.push(index);
        }
        limit
    }
}

/// A box of blocks, from the base voxel.
struct Region {
    low: [i32; 3],
    high: [i32; 3],
}

impl Region {
    fn around(faces: &[Face], margin: f32, low: [i32; 3], high: [i32; 3]) -> Result<Self> {
        let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for face in faces {
            let (low, high) = extent(&face.v);
            for axis in 0..3 {
                least[axis] = least[axis].min(low[axis]);
                most[axis] = most[axis].max(high[axis]);
            }
        }
        let mut region = Self {
            low: [0, 1, 2].map(|a| block_of(least[a] - margin).max(low[a].div_euclid(8))),
            high: [0, 1, 2].map(|a| block_of(most[a] + margin).min(high[a].div_euclid(8))),
        };
        if (0..3).any(|axis| region.low[axis] > region.high[axis]) {
            region = Self { low: [0; 3], high: [-1; 3] };
        }
        let blocks = region.size().iter().map(|&size| size as u64).product::<u64>();
        if blocks > MOST_BLOCKS {
            let what = "the region that the objects sweep (make the cell larger or the motion shorter)";
            return Err(Error::Memory { what: what.into(), needed: blocks * 8, limit: MOST_BLOCKS * 8 });
        }
        Ok(region)
    }

    fn size(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| (self.high[axis] - self.low[axis] + 1).max(0) as usize)
    }

    fn blocks(&self) -> usize {
        self.size().iter().product()
    }

    fn index(&self, block: [i32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| (block[axis] - self.low[axis]) as usize);
        let [_, ny, nz] = self.size();
        (x * ny + y) * nz + z
    }

    fn place(&self, index: usize) -> [i32; 3] {
        let [_, ny, nz] = self.size();
        let at = [index / (ny * nz), index / nz % ny, index % nz];
        [0, 1, 2].map(|axis| self.low[axis] + at[axis] as i32)
    }
}

fn extent(v: &[Fixed; 3]) -> ([f32; 3], [f32; 3]) {
    let cell = |value: i32| value as f32 / UNITS as f32;
    let low = [0, 1, 2].map(|a| cell(v[0][a].min(v[1][a]).min(v[2][a])));
    let high = [0, 1, 2].map(|a| cell(v[0][a].max(v[1][a]).max(v[2][a])));
    (low, high)
}

/// Block of a coordinate (cells), saturating where there is none.
fn block_of(cells: f32) -> i32 {
    (cells / 8.0).floor() as i32
}

fn gap(p: [f32; 3], q: [f32; 3]) -> f32 {
    let d = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}
