//! Depths of voxels inside the volume. Facets may extend into the volume, as they are clipped only coarsely: points of them that are not
//! open do not count as surface.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;

use super::bins::Bins;
use super::exposure::Exposure;
use crate::distance::lattice::UNITS;
use crate::distance::nearest::Group;
use crate::distance::triangle::{Offsets, Points, Triangle, to_each};
use crate::distance::vectors::gap;
use crate::sweep::chain::facet::{Corners, Facet};
use crate::sweep::chain::facets::{halves, is_open, is_small, open_parts};
use crate::sweep::chain::prism::Prisms;

/// Two query points on a facet that are closer than this (cells) share one result.
const SAME: f32 = 0.05;
/// How far a nearest point is moved towards its facet's centre (units), away from the edges shared with neighbours.
const INSET: f64 = 0.02 * UNITS as f64;
/// Up to this depth (cells) facets are clipped exactly where that may change the depth by more than [`SLACK`] (cells).
const CLIPPED: f32 = 0.6;
/// See [`CLIPPED`].
const SLACK: f32 = 0.1;

/// The volume in which depths are measured.
#[derive(Clone, Copy)]
pub struct Volume<'a> {
    /// The chain's faces.
    pub bins: &'a Bins,
    /// What lines reveal about the faces.
    pub exposure: &'a Exposure,
    /// The volume's surface.
    pub facets: &'a [Facet],
}

/// The facets in reach of a block.
pub struct NearFacets<'a> {
    volume: Volume<'a>,
    corner: [i32; 3],
    ids: &'a [u32],
    triangles: &'a [Triangle],
    /// Maximum depth (cells) of interest.
    limit: f32,
    /// For each triangle the last query point, and whether it was open there.
    queried: RefCell<Vec<([f32; 3], bool)>>,
    /// Facets that were not open at a query, clipped as far as necessary.
    parts: RefCell<HashMap<u32, Part>>,
    prisms: RefCell<&'a mut Prisms>,
}

impl<'a> NearFacets<'a> {
    /// `ids` are the facets in reach; `triangles` are the same facets, relative to the block's corner.
    pub fn new(
        volume: Volume<'a>,
        corner: [i32; 3],
        ids: &'a [u32],
        triangles: &'a [Triangle],
        limit: f32,
        prisms: &'a mut Prisms,
    ) -> Self {
        let queried = RefCell::new(vec![([f32::INFINITY; 3], false); triangles.len()]);
        let (parts, prisms) = (RefCell::default(), RefCell::new(prisms));
        Self { volume, corner, ids, triangles, limit, queried, parts, prisms }
    }

    /// Whether a point of a facet (cells from the block's corner) bounds the volume.
    fn is_open(&self, index: u32, at: [f32; 3]) -> bool {
        let Facet { v, face, sure } = &self.volume.facets[self.ids[index as usize] as usize];
        if *sure {
            return true;
        }
        let (before, answer) = self.queried.borrow()[index as usize];
        if gap(before, at) < SAME {
            return answer;
        }
        let position = at;
        let units = f64::from(UNITS);
        let at = [0, 1, 2].map(|axis| (f64::from(self.corner[axis]) + f64::from(at[axis])) * units);
        let to_centre =
            [0, 1, 2].map(|axis| v.iter().map(|p| f64::from(p[axis])).sum::<f64>() / 3.0 - at[axis]);
        let length = to_centre.iter().map(|value| value * value).sum::<f64>().sqrt();
        let part = if length > INSET { INSET / length } else { 1.0 };
        let at = [0, 1, 2].map(|axis| at[axis] + part * to_centre[axis]);
        let Volume { bins, exposure, .. } = self.volume;
        let open = is_open(bins, exposure, *face, at, &mut self.prisms.borrow_mut());
        self.queried.borrow_mut()[index as usize] = (position, open);
        open
    }

    /// Distance (cells) of a point from the open parts of a facet, or `limit` if that is smaller.
    fn distance_of_open(&self, index: u32, p: [f32; 3], limit: f32) -> f32 {
        let Volume { bins, exposure, facets } = self.volume;
        let facet = &facets[self.ids[index as usize] as usize];
        let mut parts = self.parts.borrow_mut();
        let whole = parts.entry(index).or_insert_with(|| Part::new(facet.v, self.corner));
        let mut prisms = self.prisms.borrow_mut();
        let mut open = |v: &Corners| open_parts(bins, exposure, facet.face, v, &mut prisms);
        whole.distance_of_open(p, limit, self.corner, &mut open)
    }
}

/// A facet or a part of one, clipped as far as necessary.
struct Part {
    v: Corners,
    triangle: Triangle,
    inner: Inner,
}

/// What is known about a part.
enum Inner {
    /// Nothing.
    Unknown,
    /// It was too large for a single sample.
    Halves(Box<[Part; 2]>),
    /// Its open parts.
    Open(Vec<Triangle>),
}

impl Part {
    fn new(v: Corners, corner: [i32; 3]) -> Self {
        Self { v, triangle: Triangle::new(&v, corner), inner: Inner::Unknown }
    }

    /// As [`NearFacets::distance_of_open`]; `open` returns the open parts of a small part.
    fn distance_of_open(
        &mut self,
        p: [f32; 3],
        limit: f32,
        corner: [i32; 3],
        open: &mut impl FnMut(&Corners) -> Vec<Corners>,
    ) -> f32 {
        if gap(p, self.triangle.closest(p)) >= limit {
            return limit;
        }
        if matches!(self.inner, Inner::Unknown) {
            self.inner = if is_small(&self.v) {
                Inner::Open(open(&self.v).iter().map(|part| Triangle::new(part, corner)).collect())
            } else {
                Inner::Halves(Box::new(halves(self.v).map(|half| Self::new(half, corner))))
            };
        }
        match &mut self.inner {
            Inner::Unknown => limit,
            Inner::Halves(halves) => {
                halves.iter_mut().fold(limit, |limit, half| half.distance_of_open(p, limit, corner, open))
            }
            Inner::Open(parts) => parts.iter().map(|part| gap(p, part.closest(p))).fold(limit, f32::min),
        }
    }
}

/// Depths of a group's voxels: distances to their nearest facets or, where the nearest point of a facet is not open, to the nearest open
/// point.
pub struct Depths<'a, 'n> {
    near: &'a NearFacets<'n>,
    group: &'a Group<'a>,
    /// The near triangles, then all within the limit; built on demand.
    candidates: [Option<Candidates<'a>>; 2],
}

/// Triangles, and the offsets of a group's voxels from them.
struct Candidates<'a> {
    ids: Cow<'a, [u32]>,
    offsets: Vec<Offsets>,
}

impl<'a> Candidates<'a> {
    fn new(near: &NearFacets<'_>, group: &Group<'_>, ids: Cow<'a, [u32]>) -> Self {
        let mut offsets = Vec::new();
        to_each(near.triangles, &ids, &group.points, &mut offsets);
        Self { ids, offsets }
    }
}

impl<'a, 'n> Depths<'a, 'n> {
    /// The depths of one group.
    pub fn new(near: &'a NearFacets<'n>, group: &'a Group<'a>) -> Self {
        Self { near, group, candidates: [None, None] }
    }

    /// Depth (cells) of a voxel, given the distance of its nearest facet.
    pub fn at(&mut self, lane: usize, distance: f32) -> f32 {
        let Self { near, group, candidates: [few, all] } = self;
        let Points { x, y, z } = &group.points;
        let p = [x[lane], y[lane], z[lane]];
        let nearest = group.nearest[lane];
        if near.is_open(nearest, near.triangles[nearest as usize].closest(p)) {
            return distance;
        }
        let few = few.get_or_insert_with(|| Candidates::new(near, group, Cow::Borrowed(group.near)));
        let depth = near.nearest_open(lane, p, few);
        if depth <= group.complete {
            return depth;
        }
        let all =
            all.get_or_insert_with(|| Candidates::new(near, group, Cow::Owned(group.within(near.limit))));
        near.nearest_open(lane, p, all)
    }
}

impl NearFacets<'_> {
    /// Distance (cells) of a voxel at `p` from the nearest open point of some triangles.
    fn nearest_open(&self, lane: usize, p: [f32; 3], Candidates { ids, offsets }: &Candidates<'_>) -> f32 {
        let squares = offsets.iter().map(|offset| offset.squared[lane]).zip(0..);
        let mut order: Vec<(f32, usize)> =
            squares.filter(|(square, _)| *square < self.limit * self.limit).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let open = |(_, position): &(f32, usize)| {
            let Offsets { x, y, z, .. } = &offsets[*position];
            self.is_open(ids[*position], [p[0] - x[lane], p[1] - y[lane], p[2] - z[lane]])
        };
        let first = order.iter().position(open).unwrap_or(order.len());
        let mut best = order.get(first).map_or(self.limit, |(square, _)| square.sqrt());
        // Nearer facets are not open at their nearest point, but may be open elsewhere.
        for (square, position) in &order[..first] {
            let distance = square.sqrt();
            if distance > CLIPPED || distance > best - SLACK {
                break;
            }
            best = self.distance_of_open(ids[*position], p, best);
        }
        best
    }
}
