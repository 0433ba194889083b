//! From the boundary of a chain to blocks of signed distances: winding numbers first, then distances.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::bins::Bins;
use super::depth::{Depths, NearFacets, Volume};
use super::exposure::Exposure;
use crate::context::Context;
use crate::distance::Face;
use crate::distance::lattice::Lattice;
use crate::distance::nearest::{Search, search};
use crate::distance::region::{Region, extent};
use crate::distance::signs::Signs;
use crate::distance::triangle::Triangle;
use crate::distance::vectors::gap;
use crate::distance::winding::Lines;
use crate::error::Result;
use crate::geometry::coords::between;
use crate::geometry::lists::Lists;
use crate::geometry::mesh::drop_marked;
use crate::numeric::blocks::{Mask, Origin, Values};
use crate::numeric::lanes::LANES;
use crate::sweep::chain::facet::Facet;
use crate::sweep::chain::facets::facets;
use crate::sweep::chain::prism::Prisms;

/// Distance from the surface up to which values are wanted, on each side (cells).
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
    /// Signed distances in cells, negative inside, clamped to the band.
    Near(Origin, Box<Values>),
    /// Wholly inside, deeper than the band.
    Inside(Origin),
}

impl Piece {
    /// Minimum corner, in voxels.
    pub fn origin(&self) -> Origin {
        match self {
            Self::Near(origin, _) | Self::Inside(origin) => *origin,
        }
    }
}

/// Working memory of one thread.
#[derive(Default)]
pub struct Scratch {
    search: Search,
    prisms: Prisms,
}

/// A chain ready to be converted to blocks.
pub struct Voxeliser {
    lattice: Lattice,
    band: Band,
    bins: Bins,
    exposure: Exposure,
    facets: Vec<Facet>,
    /// Wanted blocks with facets in reach, in blocks from the origin voxel; ascending.
    near: Vec<[i32; 3]>,
    /// The facets of each of these blocks.
    ids: Lists<u32>,
    inside: Vec<[i32; 3]>,
}

/// For messages: what needs the memory, and how to reduce it.
const REGION: &str = "what the objects sweep (larger cells or a shorter motion need less)";
/// Bytes per block of the region: marks, indices and the column tables of the lines.
const BYTES_PER_BLOCK: usize = 24;
/// Bytes per block near the surface: its distances, its bins with their faces, and their crossings.
const BYTES_PER_NEAR_BLOCK: usize = 12_000;
/// Sentinel: no block.
const NONE: u32 = u32::MAX;
/// Faces per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 1024;
/// Half a block's diagonal between voxel centres (cells), rounded up.
const BLOCK_RADIUS: f32 = 6.07;
/// Radius of a small facet (cells).
const SMALL: f32 = 1.0;
/// A voxel nearer than this (cells) lies on the surface.
const ON_FACE: f32 = 1e-4;
/// Upper bound (cells) on the distances of two neighbouring voxels of opposite sign that have no meeting between them: the surface then
/// touches one of the two.
const UNSEEN: f32 = 1.0;
/// All voxels of a block.
pub const ALL: Mask = [u64::MAX; 8];

impl Voxeliser {
    /// Work units that [`Voxeliser::new`] reports to the context: see [`Context::advance`].
    pub const PARTS: usize = 4;

    /// Sorts the faces into blocks and scans the winding numbers inside the voxel box `low..=high` (from the lattice's origin voxel).
    /// `wanted` returns which blocks, given by their origins, need distances.
    ///
    /// # Errors
    /// When the box spans more than 2^28 blocks; those of `wanted`; cancel.
    pub fn new(
        ctx: &Context,
        faces: Vec<Face>,
        lattice: Lattice,
        band: Band,
        [low, high]: [[i32; 3]; 2],
        wanted: impl Fn(&[Origin]) -> Result<Vec<bool>>,
    ) -> Result<Self> {
        // Whether a face is open depends on the winding numbers of the voxels around it.
        let reach = band.reach() + 2.0;
        let region = Region::around(&faces, reach, low, high)?;
        ctx.allow(REGION, (region.blocks() * BYTES_PER_BLOCK) as u64)?;
        let marked = mark_wanted(&faces, &region, band.reach() + 0.01, |blocks| {
            wanted(&blocks.iter().map(|&block| lattice.block_origin(block)).collect::<Vec<_>>())
        })?;
        let bins = sort_into_bins(ctx, faces, region, &marked, reach)?;
        let exposure = Exposure::scan(&bins);
        ctx.advance();
        ctx.check()?;
        let facets = facets(ctx, &bins, &exposure)?;
        ctx.advance();
        let (near, ids, inside) = (Vec::new(), Lists::one(Vec::new()), Vec::new());
        let mut voxeliser = Self { lattice, band, bins, exposure, facets, near, ids, inside };
        let slots = voxeliser.sort_facets(&marked);
        let inside = voxeliser.find_inside(&slots);
        let wanted = wanted(&inside.iter().map(|&block| lattice.block_origin(block)).collect::<Vec<_>>())?;
        voxeliser.inside =
            inside.into_iter().zip(wanted).filter(|(_, wanted)| *wanted).map(|(block, _)| block).collect();
        Ok(voxeliser)
    }

    /// Origins of the wanted blocks near the surface; [`Voxeliser::piece`] takes an index into them.
    pub fn near_blocks(&self) -> Vec<Origin> {
        self.near.iter().map(|&block| self.lattice.block_origin(block)).collect()
    }

    /// Origins of the wanted blocks that have no surface in reach and lie inside.
    pub fn inside_blocks(&self) -> Vec<Origin> {
        self.inside.iter().map(|&block| self.lattice.block_origin(block)).collect()
    }

    /// Number of faces of the chain's boundary near the wanted blocks.
    pub fn face_count(&self) -> usize {
        self.bins.faces.len()
    }

    /// Lists the facets in reach of each marked block; returns each block's index in `near`, or [`NONE`].
    fn sort_facets(&mut self, marked: &[bool]) -> Vec<u32> {
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
        let mut slots = vec![NONE; marked.len()];
        pairs.iter().flatten().for_each(|&(block, _)| slots[block as usize] = 0);
        for (block, slot) in slots.iter_mut().enumerate().filter(|(_, slot)| **slot != NONE) {
            *slot = self.near.len() as u32;
            self.near.push(self.bins.region.block(block));
        }
        let by_slot = pairs.iter().flatten().map(|&(block, id)| (slots[block as usize], id));
        self.ids = Lists::new(self.near.len(), by_slot);
        slots
    }

    /// Calls `see` with each marked block in which the facet may be the nearest one.
    fn blocks_of(&self, facet: &Facet, marked: &[bool], mut see: impl FnMut(usize)) {
        let reach = self.band.reach() + 0.01;
        let (first, last) = self.bins.region.touched(extent(&facet.v), reach);
        if (0..3).any(|axis| first[axis] > last[axis]) {
            return;
        }
        // Small facets are tested by their bounding sphere.
        let (low, high) = extent(&facet.v);
        let centre = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
        let radius = gap(low, high) / 2.0;
        let triangle = (radius > SMALL).then(|| Triangle::new(&facet.v, [0; 3]));
        for block in between(first, last) {
            let index = self.bins.region.index(block);
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

    /// Finds the blocks without facets that lie inside, by their first voxel.
    fn find_inside(&self, slots: &[u32]) -> Vec<[i32; 3]> {
        let mut inside = Vec::new();
        let Region { low, high } = self.bins.region;
        for [x, y, _] in between([low[0], low[1], 0], [high[0], high[1], 0]) {
            let line = self.bins.lines.line(x * 8, y * 8);
            for pair in line.windows(2).filter(|pair| pair[0].1 >= 1) {
                let first = (pair[0].0 / 8.0).ceil().max(f64::from(low[2])) as i32;
                let last = (pair[1].0 / 8.0).floor().min(f64::from(high[2])) as i32;
                let empty = |z: &i32| slots[self.bins.region.index([x, y, *z])] == NONE;
                inside.extend((first..=last).filter(empty).map(|z| [x, y, z]));
            }
        }
        inside
    }

    /// Distances at the wanted voxels of one of the [`Voxeliser::near_blocks`], and the band's limit at the others; none if all wanted
    /// voxels are farther outside than the band.
    pub fn piece(&self, index: usize, wanted: &Mask, scratch: &mut Scratch) -> Option<Piece> {
        if *wanted == [0; 8] {
            return None;
        }
        let block = self.near[index];
        let signs = Signs::new(&self.bins.lines, block.map(|b| b * 8));
        let inside = signs.inside();
        let mut distances = self.limits(&inside);
        let found = self.find_distances(index, wanted, &inside, &mut distances, scratch);
        let lowered = self.lower_by_lines(block, wanted, &signs, &mut distances);
        let origin = self.lattice.block_origin(block);
        if !found && !lowered {
            match (0..8).map(|x| inside[x] & wanted[x]).eq(wanted.iter().copied()) {
                true => return Some(Piece::Inside(origin)),
                false if (0..8).all(|x| inside[x] & wanted[x] == 0) => return None,
                false => {}
            }
        }
        set_signs(&mut distances, &inside);
        Some(Piece::Near(origin, distances))
    }

    /// The band's limits at the voxels of a block.
    fn limits(&self, inside: &Mask) -> Box<Values> {
        let limits = [self.band.outside, self.band.inside];
        Box::new(std::array::from_fn(|voxel| limits[usize::from(holds(inside, voxel))]))
    }

    /// Lowers distances from the band's limits to those of the nearest facets; returns whether any was lowered.
    fn find_distances(
        &self,
        index: usize,
        wanted: &Mask,
        inside: &Mask,
        distances: &mut Values,
        scratch: &mut Scratch,
    ) -> bool {
        let corner = self.near[index].map(|b| b * 8);
        let ids = self.ids.get(index);
        let triangles: Vec<Triangle> =
            ids.iter().map(|&id| Triangle::new(&self.facets[id as usize].v, corner)).collect();
        let (bins, exposure, facets) = (&self.bins, &self.exposure, &self.facets[..]);
        let reach = self.band.inside;
        let Scratch { search: search_scratch, prisms } = scratch;
        let near = NearFacets::new(Volume { bins, exposure, facets }, corner, ids, &triangles, reach, prisms);
        let mut found = false;
        search(&triangles, self.band.reach(), wanted, search_scratch, |group| {
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

    /// Lowers distances to those of the nearest meetings on lines through the voxels; returns whether any was lowered.
    fn lower_by_lines(&self, block: [i32; 3], wanted: &Mask, signs: &Signs, distances: &mut Values) -> bool {
        let mut lowered = false;
        let mut lower = |voxel: usize, upper: f32| {
            if holds(wanted, voxel) && upper < distances[voxel] {
                distances[voxel] = upper;
                lowered = true;
            }
        };
        self.exposure.each_meeting(block.map(|b| b * 8), &mut lower);
        signs.each_change(|voxel| lower(voxel, UNSEEN));
        lowered
    }
}

/// Marks the blocks for which `wanted` is true, of those within `reach` cells of faces.
fn mark_wanted(
    faces: &[Face],
    region: &Region,
    reach: f32,
    wanted: impl Fn(&[[i32; 3]]) -> Result<Vec<bool>>,
) -> Result<Vec<bool>> {
    let near = mark_near(faces, region, reach);
    let blocks: Vec<[i32; 3]> =
        (0..near.len()).filter(|&block| near[block]).map(|block| region.block(block)).collect();
    let mut marked = vec![false; region.blocks()];
    for (block, wanted) in blocks.iter().zip(wanted(&blocks)?) {
        marked[region.index(*block)] = wanted;
    }
    Ok(marked)
}

/// Scans the winding numbers, and sorts the faces within `reach` cells of marked blocks into bins.
fn sort_into_bins(
    ctx: &Context,
    mut faces: Vec<Face>,
    region: Region,
    marked: &[bool],
    reach: f32,
) -> Result<Bins> {
    let relevant = region.dilated(marked, (reach / 8.0).ceil() as i32);
    ctx.check()?;
    let near = marked.iter().filter(|&&marked| marked).count();
    ctx.allow(REGION, (region.blocks() * BYTES_PER_BLOCK + near * BYTES_PER_NEAR_BLOCK) as u64)?;
    let lines = Lines::scan(&faces, &region);
    ctx.advance();
    ctx.check()?;
    let is_far = |face: &Face| {
        let (first, last) = region.touched(extent(&face.v), 0.0);
        !between(first, last).any(|block| relevant[region.index(block)])
    };
    let are_far: Vec<bool> = faces.par_iter().with_min_len(GRAIN).map(is_far).collect();
    drop_marked(&mut faces, &are_far);
    let bins = Bins::new(faces, region, &relevant, lines);
    ctx.advance();
    ctx.check()?;
    Ok(bins)
}

/// Marks the blocks within `reach` cells of a face's bounding box.
fn mark_near(faces: &[Face], region: &Region, reach: f32) -> Vec<bool> {
    let marks: Vec<AtomicBool> = (0..region.blocks()).map(|_| AtomicBool::new(false)).collect();
    faces.par_iter().with_min_len(GRAIN).for_each(|face| {
        let (first, last) = region.touched(extent(&face.v), reach);
        between(first, last).for_each(|block| marks[region.index(block)].store(true, Ordering::Relaxed));
    });
    marks.into_iter().map(AtomicBool::into_inner).collect()
}

/// Makes the distances of inside voxels negative.
fn set_signs(distances: &mut Values, inside: &Mask) {
    for (voxel, value) in distances.iter_mut().enumerate() {
        *value = match *value {
            // Otherwise rounding would scatter specks of volume over a face that coincides with voxel centres.
            distance if distance < ON_FACE => 0.0,
            distance if holds(inside, voxel) => -distance,
            distance => distance,
        };
    }
}

/// Whether a voxel's bit is set.
fn holds(mask: &Mask, voxel: usize) -> bool {
    mask[voxel >> 6] >> (voxel & 63) & 1 == 1
}
