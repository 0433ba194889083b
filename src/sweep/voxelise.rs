//! From the boundary of a chain to blocks of signed distances: winding number first, distance second.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::cells::Cells;
use super::chain::Face;
use super::depth::{Chain, Depths, Near};
use super::distance::{Triangle, gap};
use super::exposure::Exposure;
use super::lattice::Lattice;
use super::nearest::{Scratch, search};
use super::region::{Region, each_block, extent};
use super::signs::Signs;
use super::surface::{Facet, surface};
use super::winding::Lines;
use crate::base::blocks::{Mask, Origin, Values};
use crate::base::lanes::LANES;
use crate::context::Context;
use crate::error::Result;

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
    cells: Cells,
    exposure: Exposure,
    facets: Vec<Facet>,
    /// Wanted blocks with facets in reach, in units of blocks from the base voxel; ascending.
    near: Vec<[i32; 3]>,
    /// `ids[start[i]..start[i + 1]]` are the facets of `near[i]`.
    start: Vec<u32>,
    ids: Vec<u32>,
    inside: Vec<[i32; 3]>,
}

/// What memory is asked for, with what makes it less.
const REGION: &str = "what the objects sweep (larger cells or a shorter motion need less)";
/// Bytes of a block of the region: marks, places, and the tables of the columns of lines.
const BYTES_PER_BLOCK: usize = 24;
/// Bytes of a block near the surface: its distances, its cells with their faces, and what lines see of them.
const BYTES_PER_NEAR_BLOCK: usize = 12_000;
/// No block.
const NONE: u32 = u32::MAX;
/// Faces a task sorts into blocks: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// Half a block's diagonal between voxel centres (cells), with room for rounding.
const BLOCK_RADIUS: f32 = 6.07;
/// Radius of a small facet (cells).
const SMALL: f32 = 1.0;
/// A voxel nearer than this (cells) lies on the surface.
const ON_FACE: f32 = 1e-4;
/// How far (cells) a voxel can be from a surface between it and its neighbour that no line has placed: one that touches
/// either of them.
const UNSEEN: f32 = 1.0;
/// All voxels of a block.
pub const ALL: Mask = [u64::MAX; 8];

impl Voxeliser {
    /// Pieces of work that [`Voxeliser::new`] tells a context of.
    pub const PARTS: usize = 4;

    /// Sorts the faces into blocks and scans the winding numbers, inside the voxel box `low..=high`
    /// (from the lattice's base voxel). `wanted` says of blocks, by origin, whether distances are wanted.
    ///
    /// # Errors
    /// When the box spans more than 2^28 blocks; those of `wanted`; cancel.
    pub fn new(
        ctx: &Context,
        mut faces: Vec<Face>,
        lattice: Lattice,
        band: Band,
        [low, high]: [[i32; 3]; 2],
        wanted: impl Fn(&[Origin]) -> Result<Vec<bool>>,
    ) -> Result<Self> {
        // Sides of faces are told with the voxels around them.
        let reach = band.reach() + 2.0;
        let region = Region::around(&faces, reach, low, high)?;
        ctx.allow(REGION, (region.blocks() * BYTES_PER_BLOCK) as u64)?;
        let origin = |block: [i32; 3]| [0, 1, 2].map(|axis| lattice.base[axis] + block[axis] * 8);
        let candidates = candidates(&faces, &region, band.reach() + 0.01);
        let places: Vec<[i32; 3]> =
            (0..candidates.len()).filter(|&b| candidates[b]).map(|block| region.place(block)).collect();
        let origins: Vec<Origin> = places.iter().map(|&block| origin(block)).collect();
        let mut marked = vec![false; region.blocks()];
        for (block, wanted) in places.iter().zip(wanted(&origins)?) {
            marked[region.index(*block)] = wanted;
        }
        let relevant = region.dilated(&marked, (reach / 8.0).ceil() as i32);
        ctx.check()?;
        let near = marked.iter().filter(|&&marked| marked).count();
        ctx.allow(REGION, (region.blocks() * BYTES_PER_BLOCK + near * BYTES_PER_NEAR_BLOCK) as u64)?;
        let lines = Lines::scan(&faces, &region);
        ctx.advance();
        ctx.check()?;
        retain(&mut faces, |face| {
            let (first, last) = region.touched(extent(&face.v), 0.0);
            each_block(first, last).any(|block| relevant[region.index(block)])
        });
        let cells = Cells::new(faces, region, &relevant, lines);
        ctx.advance();
        ctx.check()?;
        let exposure = Exposure::scan(&cells);
        ctx.advance();
        ctx.check()?;
        let facets = surface(ctx, &cells, &exposure)?;
        ctx.advance();
        let mut voxeliser = Self {
            lattice,
            band,
            cells,
            exposure,
            facets,
            near: Vec::new(),
            start: vec![0],
            ids: Vec::new(),
            inside: Vec::new(),
        };
        let slots = voxeliser.sort(&marked);
        let inside = voxeliser.find_inside(&slots);
        let origins: Vec<Origin> = inside.iter().map(|&block| origin(block)).collect();
        let wanted = wanted(&origins)?;
        voxeliser.inside =
            inside.into_iter().zip(wanted).filter(|(_, wanted)| *wanted).map(|(b, _)| b).collect();
        Ok(voxeliser)
    }

    /// Origins of the wanted blocks near the surface, in the order that [`Voxeliser::piece`] counts.
    pub fn near_blocks(&self) -> Vec<Origin> {
        self.near.iter().map(|&block| self.origin(block)).collect()
    }

    /// Origins of the wanted blocks that have no surface in reach and lie inside.
    pub fn inside_blocks(&self) -> Vec<Origin> {
        self.inside.iter().map(|&block| self.origin(block)).collect()
    }

    /// Number of faces of the chain's boundary near the wanted blocks.
    pub fn face_count(&self) -> usize {
        self.cells.faces.len()
    }

    fn origin(&self, block: [i32; 3]) -> Origin {
        [0, 1, 2].map(|axis| self.lattice.base[axis] + block[axis] * 8)
    }

    /// Lists for each marked block the facets in reach; returns each block's place in the list.
    fn sort(&mut self, marked: &[bool]) -> Vec<u32> {
        let pairs: Vec<Vec<(u32, u32)>> = self
            .facets
            .par_chunks(GRAIN)
            .enumerate()
            .map(|(chunk, facets)| {
                let mut out = Vec::new();
                for (index, facet) in facets.iter().enumerate() {
                    self.blocks_of(facet, marked, |block| {
                        out.push((block as u32, (chunk * GRAIN + index) as u32));
                    });
                }
                out
            })
            .collect();
        let mut count = vec![0u32; marked.len()];
        pairs.iter().flatten().for_each(|&(block, _)| count[block as usize] += 1);
        let mut slots = vec![NONE; count.len()];
        for (block, &count) in count.iter().enumerate().filter(|(_, count)| **count > 0) {
            slots[block] = self.near.len() as u32;
            self.near.push(self.cells.region.place(block));
            self.start.push(self.start[self.start.len() - 1] + count);
        }
        let mut place = self.start.clone();
        self.ids = vec![0; self.start[self.start.len() - 1] as usize];
        for &(block, id) in pairs.iter().flatten() {
            let slot = &mut place[slots[block as usize] as usize];
            self.ids[*slot as usize] = id;
            *slot += 1;
        }
        slots
    }

    /// Calls `see` with each marked block that the facet may be nearest in.
    fn blocks_of(&self, facet: &Facet, marked: &[bool], mut see: impl FnMut(usize)) {
        let reach = self.band.reach() + 0.01;
        let (first, last) = self.cells.region.touched(extent(&facet.v), reach);
        if (0..3).any(|axis| first[axis] > last[axis]) {
            return;
        }
        // Small facets are told by a ball around them.
        let (low, high) = extent(&facet.v);
        let centre = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
        let radius = gap(low, high) / 2.0;
        let triangle = (radius > SMALL).then(|| Triangle::new(&facet.v, [0; 3]));
        for block in each_block(first, last) {
            let index = self.cells.region.index(block);
            if !marked[index] {
                continue;
            }
            let middle = block.map(|b| b as f32 * 8.0 + 3.5);
            let distance = match &triangle {
                Some(triangle) => gap(middle, triangle.closest(middle)),
                None => gap(middle, centre) - radius,
            };
            if distance <= reach + BLOCK_RADIUS {
                see(index);
            }
        }
    }

    /// Finds the blocks without facets whose first voxel is inside.
    fn find_inside(&self, slots: &[u32]) -> Vec<[i32; 3]> {
        let mut inside = Vec::new();
        let Region { low, high } = self.cells.region;
        for [x, y, _] in each_block([low[0], low[1], 0], [high[0], high[1], 0]) {
            let line = self.cells.lines.line(x * 8, y * 8);
            for pair in line.windows(2).filter(|pair| pair[0].1 >= 1) {
                let first = (pair[0].0 / 8.0).ceil().max(f64::from(low[2])) as i32;
                let last = (pair[1].0 / 8.0).floor().min(f64::from(high[2])) as i32;
                let empty = |z: &i32| slots[self.cells.region.index([x, y, *z])] == NONE;
                inside.extend((first..=last).filter(empty).map(|z| [x, y, z]));
            }
        }
        inside
    }

    /// Distances at the wanted voxels of one of the [`Voxeliser::near_blocks`], the band's limit at the others;
    /// none when all wanted ones prove to be outside.
    pub fn piece(&self, index: usize, wanted: &Mask, scratch: &mut Scratch) -> Option<Piece> {
        if *wanted == [0; 8] {
            return None;
        }
        let block = self.near[index];
        let signs = Signs::new(&self.cells.lines, block.map(|b| b * 8));
        let inside = signs.inside();
        let limits = [self.band.outside, self.band.inside];
        let mut distances: Box<Values> =
            Box::new(std::array::from_fn(|voxel| limits[usize::from(holds(&inside, voxel))]));
        let found = self.find_distances(index, wanted, &inside, &mut distances, scratch);
        let lowered = self.lower_by_lines(block, wanted, &signs, &mut distances);
        let all = |bits: &dyn Fn(usize) -> u64| (0..8).all(|x| bits(x) & wanted[x] == wanted[x]);
        if !found && !lowered && all(&|x| inside[x]) {
            return Some(Piece::Inside(self.origin(block)));
        }
        if !found && !lowered && all(&|x| !inside[x]) {
            return None;
        }
        for (voxel, value) in distances.iter_mut().enumerate() {
            *value = match *value {
                // Else rounding would scatter specks of volume over a face that lies on voxels.
                distance if distance < ON_FACE => 0.0,
                distance if holds(&inside, voxel) => -distance,
                distance => distance,
            };
        }
        Some(Piece::Near(self.origin(block), distances))
    }

    /// Lowers distances from the band's limits to those of the nearest facets; whether any is lower.
    fn find_distances(
        &self,
        index: usize,
        wanted: &Mask,
        inside: &Mask,
        distances: &mut Values,
        scratch: &mut Scratch,
    ) -> bool {
        let corner = self.near[index].map(|b| b * 8);
        let ids = &self.ids[self.start[index] as usize..self.start[index + 1] as usize];
        let triangles: Vec<Triangle> =
            ids.iter().map(|&id| Triangle::new(&self.facets[id as usize].v, corner)).collect();
        let (cells, exposure, facets) = (&self.cells, &self.exposure, &self.facets[..]);
        let reach = self.band.inside;
        let Scratch { search: memory, prisms } = scratch;
        let near = Near::new(Chain { cells, exposure, facets }, corner, ids, &triangles, reach, prisms);
        let mut found = false;
        search(&triangles, self.band.reach(), wanted, memory, |group| {
            let mut depths = Depths::new(&near, group);
            for lane in 0..LANES {
                let voxel = group.voxel(lane);
                if !holds(wanted, voxel) {
                    continue;
                }
                let mut distance = group.squared[lane].sqrt();
                if holds(inside, voxel) && distance < distances[voxel] {
                    distance = depths.at(lane, distance);
                }
                found |= distance < distances[voxel];
                distances[voxel] = distances[voxel].min(distance);
            }
        });
        found
    }

    /// Lowers distances to where lines through the voxels meet the surface beside them; whether any was larger.
    fn lower_by_lines(&self, block: [i32; 3], wanted: &Mask, signs: &Signs, distances: &mut Values) -> bool {
        let mut lowered = false;
        let mut lower = |voxel: usize, most: f32| {
            if holds(wanted, voxel) && most < distances[voxel] {
                distances[voxel] = most;
                lowered = true;
            }
        };
        self.exposure.each_meeting(block.map(|b| b * 8), &mut lower);
        signs.each_change(|voxel| lower(voxel, UNSEEN));
        lowered
    }
}

/// Marks the blocks within `reach` cells of a face's box.
fn candidates(faces: &[Face], region: &Region, reach: f32) -> Vec<bool> {
    let marks: Vec<AtomicBool> = (0..region.blocks()).map(|_| AtomicBool::new(false)).collect();
    faces.par_iter().with_min_len(GRAIN).for_each(|face| {
        let (first, last) = region.touched(extent(&face.v), reach);
        each_block(first, last).for_each(|block| marks[region.index(block)].store(true, Ordering::Relaxed));
    });
    marks.into_iter().map(AtomicBool::into_inner).collect()
}

/// Keeps the faces for which `keep` holds, in order.
fn retain(faces: &mut Vec<Face>, keep: impl Fn(&Face) -> bool + Send + Sync) {
    let kept: Vec<bool> = faces.par_iter().with_min_len(GRAIN).map(keep).collect();
    let mut kept = kept.into_iter();
    faces.retain(|_| kept.next().unwrap_or(false));
}

/// Whether a voxel's bit is set.
fn holds(mask: &Mask, voxel: usize) -> bool {
    mask[voxel >> 6] >> (voxel & 63) & 1 == 1
}
