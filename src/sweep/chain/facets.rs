//! The parts of a chain's faces that bound its volume. Where layers overlap, the chain's boundary also has sheets inside the volume:
//! distances must not be measured from those.
//!
//! A point of a face is open if the chain is absent slightly in front of it and present slightly behind it. Faces are small compared with
//! the volume, so one sample decides for a face unless its neighbourhood disagrees; then its corners are sampled too, and the face is
//! clipped where it enters the volume.

use std::sync::atomic::{AtomicU8, Ordering};

use rayon::prelude::*;

use super::facet::{Corners, Facet};
use super::patch::patches;
use super::prism::{Point, Prisms};
use crate::context::Context;
use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::region::extent;
use crate::distance::vectors::{cross, difference, dot, sub};
use crate::error::Result;
use crate::sweep::signed_distance::bins::{Bins, each_voxel, voxel_of};
use crate::sweep::signed_distance::exposure::{BURIED, Exposure, OPEN, THIN};

/// A part of a face, and whether it is known to be open throughout ([`Facet::sure`]).
type Part = (Corners, bool);

/// Distance (fixed-point units) in front of and behind a face at which the chain is sampled; sheets within it count as one. The sides of a
/// sweep are folds of many sheets that are closer together than the sweep's own tolerance.
const HAIR: f64 = 0.005 * UNITS as f64;
/// [`THIN`], in hairs.
const THIN_HAIRS: f64 = THIN * UNITS as f64 / HAIR;
/// Faces longer than this (cells) are sampled at more than one point.
const SMALL: f32 = 1.5;
/// A face is a [`SLIVER`] if it is longer than this (cells) but no line of [`Exposure`] crosses it: these lines run through the voxels,
/// a cell apart, and cross most such faces.
const LONG: f32 = 3.0;
/// Distance between the samples of a long face (fixed-point units).
const SPACING: f64 = 1.2 * UNITS as f64;
/// As [`SPACING`], where a face that is buried at all its samples is sampled again because it has open faces around it.
const CLOSER: f64 = 0.6 * UNITS as f64;
/// Sample points at corners are moved this fraction of the way to the centre, away from the edges shared with neighbours.
const INSET: f64 = 0.05;
/// Bisections that find where an edge enters the volume: to 1/16 of its length.
const HALVINGS: usize = 3;
/// Flag of a bin that is a stack ([`Exposure::stacks`]: many sheets close together), where the surface consists of patches.
const STACK: u8 = 4;
/// Flag of any other bin.
const LOOSE: u8 = 8;
/// Flag of a long face that no line crosses.
const SLIVER: u8 = 16;
/// Flag of a small open face in a stack, which the patches possibly miss.
const SPECK: u8 = 32;
/// The small faces of a stack are sampled only in bins with at most this many faces.
const MANY: usize = 2000;
/// A face in front of which there is a gap narrower than this (hairs) is not open: sheets of successive poses leave such slits, within the
/// motion's tolerance.
const SLIT: f64 = 3.0;
const OPEN_AND_LOOSE: u8 = OPEN | LOOSE;
/// Faces per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 128;

/// Finds the open parts of faces, on one thread.
struct Clipper<'a> {
    bins: &'a Bins,
    exposure: &'a Exposure,
    prisms: Prisms,
}

/// The facets that bound a chain's volume near the blocks of its bins.
///
/// # Errors
/// Cancel.
pub fn facets(ctx: &Context, bins: &Bins, exposure: &Exposure) -> Result<Vec<Facet>> {
    let clipper = || Clipper { bins, exposure, prisms: Prisms::default() };
    let order = faces_by_bin(bins);
    let verdict = |clipper: &mut Clipper<'_>, &id: &u32| {
        if ctx.check().is_err() { BURIED } else { clipper.verdict(id as usize) }
    };
    let sorted: Vec<u8> = order.par_iter().with_min_len(GRAIN).map_init(clipper, verdict).collect();
    ctx.check()?;
    let mut verdicts = vec![0; sorted.len()];
    order.iter().zip(sorted).for_each(|(&id, verdict)| verdicts[id as usize] = verdict);
    let (bin_flags, nearby) = neighbourhoods(bins, exposure, &verdicts);
    let open_parts = |clipper: &mut Clipper<'_>, ids: &[u32]| {
        let (mut out, mut parts) = (Vec::with_capacity(ids.len()), Vec::new());
        for &face in ids.iter().take_while(|_| ctx.check().is_ok()) {
            let id = face as usize;
            clipper.open_parts(id, verdicts[id], nearby[id], &bin_flags, &mut parts);
            out.extend(parts.drain(..).map(|(v, sure)| Facet { v, face, sure }));
        }
        out
    };
    let parts: Vec<Vec<Facet>> = order.par_chunks(GRAIN).map_init(clipper, open_parts).collect();
    ctx.check()?;
    let mut facets = parts.concat();
    facets.extend(patches(ctx, bins, exposure)?);
    Ok(facets)
}

/// The faces sorted by bin, so that a bin's prisms stay in the cache.
fn faces_by_bin(bins: &Bins) -> Vec<u32> {
    let position = |id: usize| (bins.of_voxel(voxel_of(middle(&bins.faces[id].v))), id as u32);
    let mut positions: Vec<(Option<usize>, u32)> =
        (0..bins.faces.len()).into_par_iter().map(position).collect();
    positions.par_sort_unstable();
    positions.into_iter().map(|(_, id)| id).collect()
}

/// The flags of each bin: whether it is a stack, and the verdicts of its faces; and for each face the combined flags of its bins.
fn neighbourhoods(bins: &Bins, exposure: &Exposure, verdicts: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let nearby: Vec<AtomicU8> = verdicts.iter().map(|_| AtomicU8::new(0)).collect();
    let bin_flags: Vec<AtomicU8> = (0..bins.count()).map(|_| AtomicU8::new(0)).collect();
    bins.for_each(|bin, ids| {
        let kind = if exposure.stacks[bin] { STACK } else { LOOSE };
        let flags = ids.iter().fold(kind, |flags, &id| flags | verdicts[id as usize] & (OPEN | BURIED));
        bin_flags[bin].store(flags, Ordering::Relaxed);
        for &id in ids {
            nearby[id as usize].fetch_or(flags, Ordering::Relaxed);
        }
    });
    let plain = |flags: Vec<AtomicU8>| flags.into_iter().map(AtomicU8::into_inner).collect();
    (plain(bin_flags), plain(nearby))
}

/// Whether a point (fixed-point units) of a face is open.
pub fn is_open(bins: &Bins, exposure: &Exposure, face: u32, at: Point, prisms: &mut Prisms) -> bool {
    hair(bins, face as usize).is_some_and(|hair| classify(bins, exposure, at, hair, prisms) == OPEN)
}

/// The open parts of a small part of a face.
pub fn open_parts(
    bins: &Bins,
    exposure: &Exposure,
    face: u32,
    v: &Corners,
    prisms: &mut Prisms,
) -> Vec<Corners> {
    let Some(hair) = hair(bins, face as usize) else { return Vec::new() };
    let mut clipper = Clipper { bins, exposure, prisms: std::mem::take(prisms) };
    let mut out = Vec::new();
    clipper.clip(*v, hair, &mut out);
    *prisms = clipper.prisms;
    out.into_iter().map(|(v, _)| v).collect()
}

/// [`OPEN`] or [`BURIED`], for a point of a face. It is open if the chain is present a hair behind it, and absent both a hair and [`SLIT`]
/// in front of it, or, in a stack, [`THIN`] in front of it.
fn classify(bins: &Bins, exposure: &Exposure, at: Point, hair: Point, prisms: &mut Prisms) -> u8 {
    let moved = |side: f64| [0, 1, 2].map(|axis| at[axis] + side * hair[axis]);
    let [front, back] = bins.windings(moved(1.0), moved(-1.0), prisms);
    if back < 1 {
        return BURIED;
    }
    let mut is_absent = |hairs: f64| bins.windings(moved(hairs), at, prisms)[0] < 1;
    let is_open =
        front < 1 && is_absent(SLIT) || exposure.is_stack(bins, voxel_of(at)) && is_absent(THIN_HAIRS);
    if is_open { OPEN } else { BURIED }
}

/// A vector of one hair along a face's normal; none for a face without area.
fn hair(bins: &Bins, id: usize) -> Option<Point> {
    let normal = bins.normals[id];
    let length = dot(normal, normal).sqrt();
    (length > 0.0).then(|| normal.map(|value| value * HAIR / length))
}

impl Clipper<'_> {
    /// The flags of a face: [`OPEN`] and [`BURIED`], from the lines that cross it and from samples. In a stack only slivers and specks are
    /// sampled.
    fn verdict(&mut self, id: usize) -> u8 {
        let (v, by_lines) = (self.bins.faces[id].v, self.exposure.faces[id]);
        let Some(hair) = hair(self.bins, id) else { return by_lines | BURIED };
        if self.is_sliver(id) {
            return SLIVER | self.classify(middle(&v), hair);
        }
        let stack = self.exposure.is_stack(self.bins, voxel_of(middle(&v)));
        match stack {
            true if is_small(&v) && self.is_speck(middle(&v), hair) => by_lines | SPECK,
            true => by_lines,
            false => by_lines | self.sampled(&v, hair),
        }
    }

    /// Whether a small face of a stack is open at its centre, and not in a slit.
    fn is_speck(&mut self, at: Point, hair: Point) -> bool {
        if self.bins.face_count(voxel_of(at)) > MANY {
            return false;
        }
        let moved = |side: f64| [0, 1, 2].map(|axis| at[axis] + side * hair[axis]);
        let [front, back] = self.bins.windings(moved(1.0), moved(-1.0), &mut self.prisms);
        front < 1 && back >= 1 && self.bins.windings(moved(SLIT), at, &mut self.prisms)[0] < 1
    }

    /// Whether a long face passes between the lines, so that no patch covers it.
    fn is_sliver(&self, id: usize) -> bool {
        let (low, high) = extent(&self.bins.faces[id].v);
        self.exposure.faces[id] == 0 && (0..3).any(|axis| high[axis] - low[axis] > LONG)
    }

    /// [`OPEN`] and [`BURIED`], from the samples of a part of a face.
    fn sampled(&mut self, v: &Corners, hair: Point) -> u8 {
        let mut flags = 0;
        each_sample(v, SPACING, |at| flags |= if self.is_sampled(at) { self.classify(at, hair) } else { 0 });
        flags
    }

    /// Adds the open parts of a face with these flags (`own`), in bins with the flags `nearby`.
    fn open_parts(&mut self, id: usize, own: u8, nearby: u8, bin_flags: &[u8], out: &mut Vec<Part>) {
        let (v, Some(hair)) = (self.bins.faces[id].v, hair(self.bins, id)) else { return };
        match nearby {
            OPEN_AND_LOOSE => out.push((v, true)),
            _ if own & SPECK != 0 => out.push((v, false)),
            _ if own == SLIVER | OPEN && nearby & STACK != 0 => out.push((v, false)),
            _ if is_left_out(nearby) => {}
            _ => {
                self.split(id, v, own & (OPEN | BURIED), hair, bin_flags, out);
            }
        }
    }

    /// The flags of the bins that a part of a face passes through.
    fn nearby_flags(&self, id: usize, v: Corners, bin_flags: &[u8]) -> u8 {
        let mut nearby = 0;
        each_voxel(&v, &self.bins.normals[id], &self.bins.region, |voxel| {
            if let Some(bin) = self.bins.of_voxel(voxel) {
                nearby |= bin_flags[bin];
            }
        });
        nearby
    }

    /// Adds the open parts of a part of a face, halved as far as necessary; returns whether it is open at each of its samples.
    fn dice(&mut self, id: usize, v: Corners, hair: Point, bin_flags: &[u8], out: &mut Vec<Part>) -> bool {
        match self.nearby_flags(id, v, bin_flags) {
            // No flags: no distance is wanted there.
            0 | LOOSE | OPEN_AND_LOOSE => {
                out.push((v, true));
                true
            }
            nearby if is_left_out(nearby) => false,
            _ => {
                let exposed = self.exposure.is_exposed_within(id as u32, extent(&v));
                let own = self.sampled(&v, hair) | if exposed { OPEN } else { 0 };
                self.split(id, v, own, hair, bin_flags, out)
            }
        }
    }

    /// As [`Clipper::dice`], for a part with the flags `own` that has both open and buried faces, or stacks, around it.
    fn split(
        &mut self,
        id: usize,
        v: Corners,
        own: u8,
        hair: Point,
        bin_flags: &[u8],
        out: &mut Vec<Part>,
    ) -> bool {
        let begin = out.len();
        if !is_small(&v) {
            let open = match own {
                OPEN => true,
                BURIED if !self.is_missed(&v, hair, bin_flags) => false,
                _ => halves(v).map(|half| self.dice(id, half, hair, bin_flags, out)) == [true; 2],
            };
            if open {
                out.truncate(begin);
                out.push((v, false));
            }
            return open;
        }
        if self.exposure.is_stack(self.bins, voxel_of(middle(&v))) {
            return false;
        }
        self.clip(v, hair, out);
        if out.len() == begin && self.exposure.is_exposed_within(id as u32, extent(&v)) {
            out.push((v, false));
        }
        out[begin..] == [(v, true)]
    }

    /// Whether a part of a face that is buried at its samples is open between them, in bins with open faces.
    fn is_missed(&mut self, v: &Corners, hair: Point, bin_flags: &[u8]) -> bool {
        let mut missed = false;
        each_sample(v, CLOSER, |at| {
            let bin = self.bins.of_voxel(voxel_of(at)).filter(|_| !missed);
            let is_mixed = bin.is_some_and(|bin| bin_flags[bin] & (OPEN | STACK) == OPEN);
            missed |= is_mixed && self.classify(at, hair) == OPEN;
        });
        missed
    }

    fn classify_corners(&mut self, v: Corners, hair: Point) -> [u8; 3] {
        let centre = middle(&v);
        v.map(|p| self.classify(between(p.map(f64::from), centre, INSET), hair))
    }

    /// Adds the open parts of a small triangle.
    fn clip(&mut self, v: Corners, hair: Point, out: &mut Vec<Part>) {
        let open = self.classify_corners(v, hair).map(|corner| corner == OPEN);
        let centre = middle(&v);
        let count = open.iter().filter(|open| **open).count();
        let mut middle_open = || self.classify(centre, hair) == OPEN;
        if count % 3 == 0 && middle_open() == open[0] {
            if open[0] {
                out.push((v, true));
            }
            return;
        }
        if count % 3 == 0 {
            let centre = centre.map(|value| value.round() as i32);
            let fan = [[v[0], v[1], centre], [v[1], v[2], centre], [v[2], v[0], centre]];
            let corners = [open[0], open[0], !open[0]];
            return fan.into_iter().for_each(|part| self.clip_by(part, corners, hair, out));
        }
        self.clip_by(v, open, hair, out);
    }

    /// Adds the open part of a triangle that has open and buried corners, cut off along a straight line.
    fn clip_by(&mut self, v: Corners, open: [bool; 3], hair: Point, out: &mut Vec<Part>) {
        let alone = (0..3).find(|&i| open[i] != open[(i + 1) % 3] && open[i] != open[(i + 2) % 3]);
        let turn = alone.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|i| v[(turn + i) % 3]);
        let [ab, ac] = [b, c].map(|other| self.transition(a, other, open[turn], hair));
        if open[turn] {
            out.push(([a, ab, ac], true));
        } else {
            out.extend([([ab, b, c], true), ([ab, c, ac], true)]);
        }
    }

    /// The point where an edge changes between open and buried; `open` is whether `a` is open, and `b` is the opposite.
    fn transition(&mut self, a: Fixed, b: Fixed, open: bool, hair: Point) -> Fixed {
        let (a, b) = (a.map(f64::from), b.map(f64::from));
        let (mut first, mut last) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let half = (first + last) / 2.0;
            let same = (self.classify(between(a, b, half), hair) == OPEN) == open;
            (first, last) = if same { (half, last) } else { (first, half) };
        }
        between(a, b, (first + last) / 2.0).map(|value| value.round() as i32)
    }

    fn classify(&mut self, at: Point, hair: Point) -> u8 {
        classify(self.bins, self.exposure, at, hair, &mut self.prisms)
    }

    /// Whether samples are needed at a point: it has a bin, and that is not a stack, whose surface consists only of patches.
    fn is_sampled(&self, at: Point) -> bool {
        self.bins.of_voxel(voxel_of(at)).is_some_and(|bin| !self.exposure.stacks[bin])
    }
}

/// Whether a face in bins with these flags has no facets: only patches make the surface there, or all faces are buried.
fn is_left_out(nearby: u8) -> bool {
    nearby & LOOSE == 0 || nearby & !(STACK | LOOSE) == BURIED
}

/// Whether one sample is enough for a part of a face.
pub fn is_small(v: &Corners) -> bool {
    let (low, high) = extent(v);
    (0..3).all(|axis| high[axis] - low[axis] <= SMALL)
}

/// Calls `see` with the centroid of a small triangle, otherwise with points about `spacing` apart in rows along the longest edge.
fn each_sample(v: &Corners, spacing: f64, mut see: impl FnMut(Point)) {
    if is_small(v) {
        return see(middle(v));
    }
    let [a, b, c] = from_longest(v).map(|p| p.map(f64::from));
    let (along, up) = (sub(b, a), sub(c, a));
    let length = dot(along, along).sqrt();
    let area = cross(along, up);
    let height = dot(area, area).sqrt() / length;
    let rows = (height / spacing).ceil().max(1.0);
    for row in 0..rows as usize {
        let t = (row as f64 + 0.5) / rows;
        let (begin, end) = (between(a, c, t), between(b, c, t));
        let count = (length * (1.0 - t) / spacing).ceil().max(1.0);
        (0..count as usize).for_each(|index| see(between(begin, end, (index as f64 + 0.5) / count)));
    }
}

/// A triangle with its corners rotated so that the first edge is the longest.
fn from_longest(v: &Corners) -> Corners {
    let length = |i: usize| {
        let d = difference(v[(i + 1) % 3], v[i]);
        dot(d, d)
    };
    let longest = (1..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
    [0, 1, 2].map(|i| v[(longest + i) % 3])
}

fn middle(v: &Corners) -> Point {
    [0, 1, 2].map(|axis| v.iter().map(|p| f64::from(p[axis])).sum::<f64>() / 3.0)
}

fn between(a: Point, b: Point, t: f64) -> Point {
    [0, 1, 2].map(|axis| a[axis] + t * (b[axis] - a[axis]))
}

/// A triangle split at the midpoint of its longest edge.
pub fn halves(v: Corners) -> [Corners; 2] {
    let [a, b, c] = from_longest(&v);
    let m = between(a.map(f64::from), b.map(f64::from), 0.5).map(|value| value.round() as i32);
    [[a, m, c], [m, b, c]]
}
