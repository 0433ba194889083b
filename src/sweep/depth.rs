//! How deep voxels lie inside a chain. Facets that are clipped too wide reach into the volume: their points there are not
//! its surface.

use std::cell::RefCell;
use std::collections::HashMap;

use super::cells::Cells;
use super::distance::{Offsets, Points, Triangle, gap, to_each};
use super::exposure::Exposure;
use super::lattice::UNITS;
use super::nearest::Group;
use super::prism::Bundle;
use super::surface::{Facet, clipped, is_open};

/// Points of a facet nearer together than this (cells) say the same.
const SAME: f32 = 0.05;
/// How far a nearest point is moved into its facet (units), away from what it shares with neighbours.
const INSET: f64 = 0.02 * UNITS as f64;
/// Up to here (cells) depths are told from clipped facets, where that may change them by more than [`SLACK`].
const CLIPPED: f32 = 0.6;
/// See [`CLIPPED`].
const SLACK: f32 = 0.1;

/// A chain, and the facets that bound it.
#[derive(Clone, Copy)]
pub struct Chain<'a> {
    /// Its faces by the cells that they pass through.
    pub cells: &'a Cells,
    /// What lines see of it.
    pub exposure: &'a Exposure,
    /// The parts of its faces that bound it.
    pub facets: &'a [Facet],
}

/// The facets in reach of a block.
pub struct Near<'a> {
    chain: Chain<'a>,
    corner: [i32; 3],
    ids: &'a [u32],
    triangles: &'a [Triangle],
    /// How deep (cells) a voxel is told.
    limit: f32,
    /// Where each triangle was asked last, and what it said.
    asked: RefCell<Vec<([f32; 3], bool)>>,
    /// The open parts of those that said no.
    clipped: RefCell<HashMap<u32, Vec<Triangle>>>,
    bundle: RefCell<Bundle>,
}

impl<'a> Near<'a> {
    /// The facets of a chain with these places in it, and as triangles from the corner. Takes the bundle until
    /// [`Near::into_bundle`].
    pub fn new(
        chain: Chain<'a>,
        corner: [i32; 3],
        ids: &'a [u32],
        triangles: &'a [Triangle],
        limit: f32,
        bundle: &mut Bundle,
    ) -> Self {
        let mut bundle = std::mem::take(bundle);
        bundle.forget();
        let asked = RefCell::new(vec![([f32::INFINITY; 3], false); triangles.len()]);
        let (clipped, bundle) = (RefCell::default(), RefCell::new(bundle));
        Self { chain, corner, ids, triangles, limit, asked, clipped, bundle }
    }

    /// The bundle that it was given.
    pub fn into_bundle(self) -> Bundle {
        self.bundle.into_inner()
    }

    /// Whether a point of a facet (cells from the block's corner) bounds the volume.
    fn is_open(&self, index: u32, at: [f32; 3]) -> bool {
        let Facet { v, face, sure } = &self.chain.facets[self.ids[index as usize] as usize];
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
        let Chain { cells, exposure, .. } = self.chain;
        let open = is_open(cells, exposure, *face, at, &mut self.bundle.borrow_mut());
        self.asked.borrow_mut()[index as usize] = (place, open);
        open
    }

    /// Distance (cells) of a place from the open parts of a facet.
    fn distance_of_open(&self, index: u32, p: [f32; 3]) -> f32 {
        let mut all = self.clipped.borrow_mut();
        let parts = all.entry(index).or_insert_with(|| {
            let Chain { cells, exposure, facets } = self.chain;
            let facet = &facets[self.ids[index as usize] as usize];
            let parts = clipped(cells, exposure, facet, &mut self.bundle.borrow_mut());
            parts.iter().map(|part| Triangle::new(part, self.corner)).collect()
        });
        parts.iter().map(|part| gap(p, part.closest(p))).fold(f32::INFINITY, f32::min)
    }
}

/// Depths of a group's voxels: distances to their nearest facets; where a facet's nearest point does not bound the
/// volume, because it was clipped too wide, to the nearest that does.
pub struct Depths<'a> {
    near: &'a Near<'a>,
    group: &'a Group<'a>,
    /// Offsets of the voxels from the near triangles, and from all, once they are needed.
    offsets: [Vec<Offsets>; 2],
}

impl<'a> Depths<'a> {
    /// Of one group.
    pub fn new(near: &'a Near<'a>, group: &'a Group<'a>) -> Self {
        Self { near, group, offsets: [Vec::new(), Vec::new()] }
    }

    /// Depth (cells) of a voxel, from the distance of its nearest facet.
    pub fn at(&mut self, lane: usize, distance: f32) -> f32 {
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
        let limit = self.near.limit;
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
