//! How deep voxels lie inside a chain. Facets that are clipped too wide reach into the volume: their points there are not
//! its surface.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;

use super::cells::Cells;
use super::distance::{Offsets, Points, Triangle, gap, to_each};
use super::exposure::Exposure;
use super::lattice::UNITS;
use super::nearest::Group;
use super::prism::Prisms;
use super::surface::{Corners, Facet, halves, is_open, is_small, open_parts};

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
    /// Those that said no, in parts.
    parts: RefCell<HashMap<u32, Part>>,
    prisms: RefCell<&'a mut Prisms>,
}

impl<'a> Near<'a> {
    /// The facets of a chain with these places in it, and as triangles from the corner.
    pub fn new(
        chain: Chain<'a>,
        corner: [i32; 3],
        ids: &'a [u32],
        triangles: &'a [Triangle],
        limit: f32,
        prisms: &'a mut Prisms,
    ) -> Self {
        let asked = RefCell::new(vec![([f32::INFINITY; 3], false); triangles.len()]);
        let (parts, prisms) = (RefCell::default(), RefCell::new(prisms));
        Self { chain, corner, ids, triangles, limit, asked, parts, prisms }
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
        let open = is_open(cells, exposure, *face, at, &mut self.prisms.borrow_mut());
        self.asked.borrow_mut()[index as usize] = (place, open);
        open
    }

    /// Distance (cells) of a place from what is open of a facet, where that is less than `most`; else `most`.
    fn distance_of_open(&self, index: u32, p: [f32; 3], most: f32) -> f32 {
        let Chain { cells, exposure, facets } = self.chain;
        let facet = &facets[self.ids[index as usize] as usize];
        let mut parts = self.parts.borrow_mut();
        let whole = parts.entry(index).or_insert_with(|| Part::new(facet.v, self.corner));
        let mut prisms = self.prisms.borrow_mut();
        let mut open = |v: &Corners| open_parts(cells, exposure, facet.face, v, &mut prisms);
        whole.distance_of_open(p, most, self.corner, &mut open)
    }
}

/// A facet, or a part of one, as far as it was asked where it is open.
struct Part {
    v: Corners,
    triangle: Triangle,
    inner: Inner,
}

/// What is known of a part.
enum Inner {
    /// Nothing.
    Unasked,
    /// It was too large to be asked as one.
    Halves(Box<[Part; 2]>),
    /// What of it is open.
    Open(Vec<Triangle>),
}

impl Part {
    fn new(v: Corners, corner: [i32; 3]) -> Self {
        Self { v, triangle: Triangle::new(&v, corner), inner: Inner::Unasked }
    }

    /// As [`Near::distance_of_open`]; `open` gives the open parts of a small one.
    fn distance_of_open(
        &mut self,
        p: [f32; 3],
        most: f32,
        corner: [i32; 3],
        open: &mut impl FnMut(&Corners) -> Vec<Corners>,
    ) -> f32 {
        if gap(p, self.triangle.closest(p)) >= most {
            return most;
        }
        if matches!(self.inner, Inner::Unasked) {
            self.inner = if is_small(&self.v) {
                Inner::Open(open(&self.v).iter().map(|part| Triangle::new(part, corner)).collect())
            } else {
                Inner::Halves(Box::new(halves(self.v).map(|half| Self::new(half, corner))))
            };
        }
        match &mut self.inner {
            Inner::Unasked => most,
            Inner::Halves(halves) => {
                halves.iter_mut().fold(most, |most, half| half.distance_of_open(p, most, corner, open))
            }
            Inner::Open(parts) => parts.iter().map(|part| gap(p, part.closest(p))).fold(most, f32::min),
        }
    }
}

/// Depths of a group's voxels: distances to their nearest facets; where a facet's nearest point does not bound the
/// volume, because it was clipped too wide, to the nearest that does.
pub struct Depths<'a, 'n> {
    near: &'a Near<'n>,
    group: &'a Group<'a>,
    /// The near triangles, and those within the limit, with the voxels' offsets from them, once they are needed.
    candidates: [Option<Candidates<'a>>; 2],
}

/// Triangles, and the offsets of a group's voxels from them.
struct Candidates<'a> {
    ids: Cow<'a, [u32]>,
    offsets: Vec<Offsets>,
}

impl<'a> Candidates<'a> {
    fn new(near: &Near<'_>, group: &Group<'_>, ids: Cow<'a, [u32]>) -> Self {
        let mut offsets = Vec::new();
        to_each(near.triangles, &ids, &group.points, &mut offsets);
        Self { ids, offsets }
    }
}

impl<'a, 'n> Depths<'a, 'n> {
    /// Of one group.
    pub fn new(near: &'a Near<'n>, group: &'a Group<'a>) -> Self {
        Self { near, group, candidates: [None, None] }
    }

    /// Depth (cells) of a voxel, from the distance of its nearest facet.
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

impl Near<'_> {
    /// Distance (cells) of a voxel at `p` from the nearest point that bounds the volume, of some triangles.
    fn nearest_open(&self, lane: usize, p: [f32; 3], Candidates { ids, offsets }: &Candidates<'_>) -> f32 {
        let squares = offsets.iter().map(|offset| offset.squared[lane]).zip(0..);
        let mut order: Vec<(f32, usize)> =
            squares.filter(|(square, _)| *square < self.limit * self.limit).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let open = |(_, place): &(f32, usize)| {
            let Offsets { x, y, z, .. } = &offsets[*place];
            self.is_open(ids[*place], [p[0] - x[lane], p[1] - y[lane], p[2] - z[lane]])
        };
        let first = order.iter().position(open).unwrap_or(order.len());
        let mut best = order.get(first).map_or(self.limit, |(square, _)| square.sqrt());
        // Those before it are open elsewhere.
        for (square, place) in &order[..first] {
            let distance = square.sqrt();
            if distance > CLIPPED || distance > best - SLACK {
                break;
            }
            best = self.distance_of_open(ids[*place], p, best);
        }
        best
    }
}
