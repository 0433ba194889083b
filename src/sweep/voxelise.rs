//! From the boundary of a chain to blocks of signed distances: winding number first, distance second.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::cells::Cells;
use super::chain::Face;
use super::distance::{LANES, Offsets, Points, Triangle, to_each};
use super::exposure::Exposure;
use super::lattice::{Lattice, UNITS};
use super::nearest::{Group, Scratch, search};
use super::prism::Bundle;
use super::region::{Region, each_block, extent};
use super::signs::{Signs, beside};
use super::surface::{Facet, clipped, is_open, surface};
use super::winding::Lines;
use crate::base::blocks::{Mask, Origin, Values};
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
/// Bytes of a block of the region: marks and places.
const BYTES_PER_BLOCK: usize = 16;
/// Bytes of a block near the surface: its distances, and what they are found with.
const BYTES_PER_NEAR_BLOCK: usize = 6000;
/// No block.
const NONE: u32 = u32::MAX;
/// Faces a task sorts into blocks: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// Half a block's diagonal between voxel centres (cells), with room for rounding.
const BLOCK_RADIUS: f32 = 6.07;
/// Radius of a small facet (cells).
const SMALL: f32 = 1.0;
/// Points of a facet nearer together than this (cells) say the same.
const SAME: f32 = 0.05;
/// How far a nearest point is moved into its facet (units), away from what it shares with neighbours.
const INSET: f64 = 0.02 * UNITS as f64;
/// Up to here (cells) depths are told from clipped facets, where that may change them by more than [`SLACK`].
const CLIPPED: f32 = 0.6;
const SLACK: f32 = 0.1;
/// A voxel nearer than this (cells) lies on the surface.
const ON_FACE: f32 = 1e-4;
/// How far (cells) a voxel can be from a surface between it and its neighbour that no line has placed: one that touches
/// either of them.
const UNSEEN: f32 = 1.0;
/// How far (cells) two neighbours of opposite sign may be from the surface between them, added up: 1, with room for
/// what the faces and the motion are approximated by.
const MOST_APART: f32 = 1.2;
/// All voxels of a block.
pub const ALL: Mask = [u64::MAX; 8];

impl Voxeliser {
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
        ctx.check()?;
        retain(&mut faces, |face| {
            let (first, last) = region.touched(extent(&face.v), 0.0);
            each_block(first, last).any(|block| relevant[region.index(block)])
        });
        let cells = Cells::new(faces, region, &relevant, lines);
        ctx.check()?;
        let exposure = Exposure::scan(&cells);
        ctx.check()?;
        let facets = surface(ctx, &cells, &exposure)?;
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
        let corner = block.map(|b| b * 8);
        let ids = &self.ids[self.start[index] as usize..self.start[index + 1] as usize];
        let triangles: Vec<Triangle> =
            ids.iter().map(|&id| Triangle::new(&self.facets[id as usize].v, corner)).collect();
        let signs = Signs::new(&self.cells.lines, corner);
        let inside = signs.inside();
        let is_inside = |voxel: usize| inside[voxel >> 6] >> (voxel & 63) & 1 == 1;
        let limit = |voxel: usize| if is_inside(voxel) { self.band.inside } else { self.band.outside };
        let signed = |voxel: usize, distance: f32| match distance {
            // Else rounding would scatter specks of volume over a face that lies on voxels.
            _ if distance < ON_FACE => 0.0,
            _ if is_inside(voxel) => -distance,
            _ => distance,
        };
        let mut values: Box<Values> = Box::new(std::array::from_fn(|voxel| signed(voxel, limit(voxel))));
        let mut uniform = true;
        let asked = RefCell::new(vec![([f32::INFINITY; 3], false); triangles.len()]);
        let mut bundle = std::mem::take(&mut scratch.bundle);
        bundle.forget();
        let bundle = RefCell::new(bundle);
        let near = Near {
            voxeliser: self,
            corner,
            ids,
            triangles: &triangles,
            asked,
            clipped: RefCell::default(),
            bundle,
        };
        search(&triangles, self.band.reach(), wanted, scratch, |group| {
            let mut depths = Depths::new(&near, group);
            for lane in 0..LANES {
                let voxel = group.voxel(lane);
                if wanted[voxel >> 6] >> (voxel & 63) & 1 == 0 {
                    continue;
                }
                let limit = limit(voxel);
                let mut distance = group.squared[lane].sqrt();
                if is_inside(voxel) && distance < limit {
                    distance = depths.at(lane, distance);
                }
                uniform &= distance >= limit;
                values[voxel] = signed(voxel, distance.min(limit));
            }
        });
        scratch.bundle = near.bundle.into_inner();
        // Neighbours of opposite sign that are too far from the surface between them: lines have met it.
        let before = values.clone();
        signs.each_change(|voxel, axis, above| {
            let beside = beside(voxel, axis, above).map_or(0.0, |other| before[other].abs());
            let is_wanted = wanted[voxel >> 6] >> (voxel & 63) & 1 == 1;
            if is_wanted && before[voxel].abs() + beside > MOST_APART {
                let most = self.most_distance(corner, voxel, axis, above);
                values[voxel] = signed(voxel, values[voxel].abs().min(most));
                uniform = false;
            }
        });
        let all = |bits: &dyn Fn(usize) -> u64| (0..8).all(|x| bits(x) & wanted[x] == wanted[x]);
        match (uniform && all(&|x| inside[x]), uniform && all(&|x| !inside[x])) {
            (true, _) => Some(Piece::Inside(self.origin(block))),
            (_, true) => None,
            _ => Some(Piece::Near(self.origin(block), values)),
        }
    }

    /// How far (cells) a voxel can be from the surface, where its neighbour along an axis, above or below, is on the
    /// other side.
    fn most_distance(&self, corner: [i32; 3], voxel: usize, axis: usize, above: bool) -> f32 {
        let mut lower = [0, 1, 2].map(|a| corner[a] + (voxel >> (6 - 3 * a) & 7) as i32);
        lower[axis] -= i32::from(!above);
        self.exposure.between(lower, axis).map_or(UNSEEN, |distances| distances[usize::from(!above)])
    }
}

/// The facets in reach of a block.
struct Near<'a> {
    voxeliser: &'a Voxeliser,
    corner: [i32; 3],
    ids: &'a [u32],
    triangles: &'a [Triangle],
    /// Where each triangle was asked last, and what it said.
    asked: RefCell<Vec<([f32; 3], bool)>>,
    /// The open parts of those that said no.
    clipped: RefCell<HashMap<u32, Vec<Triangle>>>,
    bundle: RefCell<Bundle>,
}

impl Near<'_> {
    /// Whether a point of a facet (cells from the block's corner) bounds the volume.
    fn is_open(&self, index: u32, at: [f32; 3]) -> bool {
        let Facet { v, face, sure } = &self.voxeliser.facets[self.ids[index as usize] as usize];
        if *sure {
            return true;
        }
        let (before, said) = self.asked.borrow()[index as usize];
        if gap(before, at) < SAME {
            return said;
        }
        let place = at;
        let cells = f64::from(UNITS);
        let at = [0, 1, 2].map(|axis| (f64::from(self.corner[axis]) + f64::from(at[axis])) * cells);
        let way = [0, 1, 2].map(|axis| v.iter().map(|p| f64::from(p[axis])).sum::<f64>() / 3.0 - at[axis]);
        let length = way.iter().map(|value| value * value).sum::<f64>().sqrt();
        let part = if length > INSET { INSET / length } else { 1.0 };
        let at = [0, 1, 2].map(|axis| at[axis] + part * way[axis]);
        let open = is_open(
            &self.voxeliser.cells,
            &self.voxeliser.exposure,
            *face,
            at,
            &mut self.bundle.borrow_mut(),
        );
        self.asked.borrow_mut()[index as usize] = (place, open);
        open
    }
}

impl Near<'_> {
    /// Distance (cells) of a place from the open parts of a facet.
    fn distance_of_open(&self, index: u32, p: [f32; 3]) -> f32 {
        let mut all = self.clipped.borrow_mut();
        let parts = all.entry(index).or_insert_with(|| {
            let Voxeliser { cells, exposure, facets, .. } = self.voxeliser;
            let facet = &facets[self.ids[index as usize] as usize];
            let parts = clipped(cells, exposure, facet, &mut self.bundle.borrow_mut());
            parts.iter().map(|part| Triangle::new(part, self.corner)).collect()
        });
        parts.iter().map(|part| gap(p, part.closest(p))).fold(f32::INFINITY, f32::min)
    }
}

/// Depths of a group's voxels: distances to their nearest facets; where a facet's nearest point does not bound the
/// volume, because it was clipped too wide, to the nearest that does.
struct Depths<'a> {
    near: &'a Near<'a>,
    group: &'a Group<'a>,
    /// Offsets of the voxels from the near triangles, and from all, once they are needed.
    offsets: [Vec<Offsets>; 2],
}

impl<'a> Depths<'a> {
    fn new(near: &'a Near<'a>, group: &'a Group<'a>) -> Self {
        Self { near, group, offsets: [Vec::new(), Vec::new()] }
    }

    fn at(&mut self, lane: usize, distance: f32) -> f32 {
        let Points { x, y, z } = &self.group.points;
        let p = [x[lane], y[lane], z[lane]];
        let nearest = self.group.nearest[lane];
        if self.near.is_open(nearest, self.near.triangles[nearest as usize].closest(p)) {
            return distance;
        }
        let depth = self.nearest_open(lane, p, 0, self.group.near);
        if depth <= self.group.complete {
            return depth;
        }
        let all: Vec<u32> = (0..self.near.triangles.len() as u32).collect();
        self.nearest_open(lane, p, 1, &all)
    }

    /// Distance (cells) of a voxel at `p` from the nearest point that bounds the volume, of the listed triangles.
    fn nearest_open(&mut self, lane: usize, p: [f32; 3], which: usize, list: &[u32]) -> f32 {
        let offsets = &mut self.offsets[which];
        if offsets.is_empty() {
            to_each(self.near.triangles, list, &self.group.points, offsets);
        }
        let limit = self.near.voxeliser.band.inside;
        let squares = offsets.iter().map(|offset| offset.squared[lane]).zip(0..);
        let mut order: Vec<(f32, usize)> = squares.filter(|(square, _)| *square < limit * limit).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let open = |(_, place): &(f32, usize)| {
            let Offsets { x, y, z, .. } = &offsets[*place];
            self.near.is_open(list[*place], [p[0] - x[lane], p[1] - y[lane], p[2] - z[lane]])
        };
        let first = order.iter().position(open).unwrap_or(order.len());
        let mut best = order.get(first).map_or(limit, |(square, _)| square.sqrt());
        // Those before it are open elsewhere.
        for (square, place) in &order[..first] {
            let distance = square.sqrt();
            if distance > CLIPPED || distance > best - SLACK {
                break;
            }
            best = best.min(self.near.distance_of_open(list[*place], p));
        }
        best
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

fn gap(p: [f32; 3], q: [f32; 3]) -> f32 {
    let d = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}
