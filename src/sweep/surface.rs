//! The parts of a chain's faces that bound its volume. The chain's boundary also has sheets inside the
//! volume, where layers overlap: distances must not see them.
//!
//! A point of a face is open when the chain is absent a hair in front of it, and present behind it. Faces are small against
//! what they bound, so one sample speaks for a face unless its neighbourhood disagrees; then its corners
//! are asked, and the face is clipped where it dives into the volume.

use std::sync::atomic::{AtomicU8, Ordering};

use rayon::prelude::*;

use super::cells::{Cells, Point, cross, difference, dot, each_voxel, sub, voxel_of};
use super::exposure::{BURIED, Exposure, OPEN, THIN};
use super::lattice::{Fixed, UNITS};
use super::patch::patches;
use super::prism::Prisms;
use super::region::extent;
use crate::context::Context;
use crate::error::Result;

/// A triangle that bounds the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Corners, counter-clockwise seen from outside.
    pub v: Corners,
    /// The face of the chain that it is a part of.
    pub face: u32,
    /// Whether it is open throughout; else only where it was asked, and buried sheets pass nearby.
    pub sure: bool,
}

/// A part of a face, and whether it is sure.
type Part = (Corners, bool);

/// Corners of a triangle.
pub type Corners = [Fixed; 3];

/// Depth (fixed-point units) up to which a sheet counts as surface: sides of a sweep are folds of many
/// sheets, closer together than the sweep's own tolerance.
const HAIR: f64 = 0.005 * UNITS as f64;
/// [`THIN`], in hairs.
const THIN_HAIRS: f64 = THIN * UNITS as f64 / HAIR;
/// Faces longer than this (cells) are asked at more than one point.
const SMALL: f32 = 1.5;
/// Lines that are a cell apart meet most faces that are longer than this (cells).
const LONG: f32 = 3.0;
/// Distance of the points that a long face is asked at (fixed-point units).
const SPACING: f64 = 1.2 * UNITS as f64;
/// And of those that it is asked at again, where it is buried among open ones.
const CLOSER: f64 = 0.6 * UNITS as f64;
/// A corner is asked for this part of the way to the middle, away from what it shares with neighbours.
const INSET: f64 = 0.05;
/// Halvings that find where an edge dives: to 1/16 of its length.
const HALVINGS: usize = 3;
/// A cell holds a stack, whose surface is made of patches.
const STACK: u8 = 4;
/// A cell holds none.
const LOOSE: u8 = 8;
/// No line meets the face, though it is long.
const SLIVER: u8 = 16;
/// The face is small, in a stack, and open: patches may not reach it.
const SPECK: u8 = 32;
/// Faces in a cell up to which small ones of a stack are asked.
const MANY: usize = 2000;
/// What lies in front of an open face is wider than this (hairs): sheets of successive poses leave slits, narrower than the
/// motion's tolerance.
const SLIT: f64 = 3.0;
const OPEN_AND_LOOSE: u8 = OPEN | LOOSE;
/// Faces a task handles: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 128;

/// Asks where a chain's faces are open, on one thread.
struct Surface<'a> {
    cells: &'a Cells,
    exposure: &'a Exposure,
    prisms: Prisms,
}

/// The surface of a chain near the blocks of its cells.
///
/// # Errors
/// Cancel.
pub fn surface(ctx: &Context, cells: &Cells, exposure: &Exposure) -> Result<Vec<Facet>> {
    let chain = || Surface { cells, exposure, prisms: Prisms::default() };
    let order = order(cells);
    let verdict = |chain: &mut Surface<'_>, &id: &u32| {
        if ctx.check().is_err() { BURIED } else { chain.verdict(id as usize) }
    };
    let sorted: Vec<u8> = order.par_iter().with_min_len(GRAIN).map_init(chain, verdict).collect();
    ctx.check()?;
    let mut verdicts = vec![0; sorted.len()];
    order.iter().zip(sorted).for_each(|(&id, verdict)| verdicts[id as usize] = verdict);
    let (around, seen) = neighbourhoods(cells, exposure, &verdicts);
    let open_parts = |chain: &mut Surface<'_>, ids: &[u32]| {
        let (mut out, mut parts) = (Vec::with_capacity(ids.len()), Vec::new());
        for &face in ids.iter().take_while(|_| ctx.check().is_ok()) {
            let id = face as usize;
            chain.open_parts(id, verdicts[id], seen[id], &around, &mut parts);
            out.extend(parts.drain(..).map(|(v, sure)| Facet { v, face, sure }));
        }
        out
    };
    let parts: Vec<Vec<Facet>> = order.par_chunks(GRAIN).map_init(chain, open_parts).collect();
    ctx.check()?;
    let mut facets = parts.concat();
    facets.extend(patches(ctx, cells, exposure)?);
    Ok(facets)
}

/// The faces, those of one cell after another: what is asked there is then at hand.
fn order(cells: &Cells) -> Vec<u32> {
    let place = |id: usize| (cells.of_voxel(voxel_of(middle(&cells.faces[id].v))), id as u32);
    let mut places: Vec<(Option<usize>, u32)> = (0..cells.faces.len()).into_par_iter().map(place).collect();
    places.par_sort_unstable();
    places.into_iter().map(|(_, id)| id).collect()
}

/// For each cell what its faces said and whether it holds a stack, and for each face that of all its cells.
fn neighbourhoods(cells: &Cells, exposure: &Exposure, verdicts: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let seen: Vec<AtomicU8> = verdicts.iter().map(|_| AtomicU8::new(0)).collect();
    let around: Vec<AtomicU8> = (0..cells.count()).map(|_| AtomicU8::new(0)).collect();
    cells.for_each(|cell, ids| {
        let kind = if exposure.stacks[cell] { STACK } else { LOOSE };
        let said = ids.iter().fold(kind, |said, &id| said | verdicts[id as usize] & (OPEN | BURIED));
        around[cell].store(said, Ordering::Relaxed);
        for &id in ids {
            seen[id as usize].fetch_or(said, Ordering::Relaxed);
        }
    });
    let plain = |flags: Vec<AtomicU8>| flags.into_iter().map(AtomicU8::into_inner).collect();
    (plain(around), plain(seen))
}

/// Whether a point of a face (fixed-point units), moved a hair along its normal, is outside the chain.
pub fn is_open(cells: &Cells, exposure: &Exposure, face: u32, at: Point, prisms: &mut Prisms) -> bool {
    ahead(cells, face as usize).is_some_and(|ahead| ask(cells, exposure, at, ahead, prisms) == OPEN)
}

/// What of a small part of a face is open.
pub fn open_parts(
    cells: &Cells,
    exposure: &Exposure,
    face: u32,
    v: &Corners,
    prisms: &mut Prisms,
) -> Vec<Corners> {
    let Some(ahead) = ahead(cells, face as usize) else { return Vec::new() };
    let mut surface = Surface { cells, exposure, prisms: std::mem::take(prisms) };
    let mut out = Vec::new();
    surface.clip(*v, ahead, &mut out);
    *prisms = surface.prisms;
    out.into_iter().map(|(v, _)| v).collect()
}

/// Whether a point of a face is open: the chain is absent a hair in front of it, and not behind, and not in a slit; of a
/// stack, [`THIN`] in front of it.
fn ask(cells: &Cells, exposure: &Exposure, at: Point, ahead: Point, prisms: &mut Prisms) -> u8 {
    let moved = |side: f64| [0, 1, 2].map(|axis| at[axis] + side * ahead[axis]);
    let [front, back] = cells.windings(moved(1.0), moved(-1.0), prisms);
    if back < 1 {
        return BURIED;
    }
    let mut is_absent = |hairs: f64| cells.windings(moved(hairs), at, prisms)[0] < 1;
    let is_open =
        front < 1 && is_absent(SLIT) || exposure.is_stack(cells, voxel_of(at)) && is_absent(THIN_HAIRS);
    if is_open { OPEN } else { BURIED }
}

/// A hair along a face's normal; none for a face without area.
fn ahead(cells: &Cells, id: usize) -> Option<Point> {
    let normal = cells.normals[id];
    let length = dot(&normal, &normal).sqrt();
    (length > 0.0).then(|| normal.map(|value| value * HAIR / length))
}

impl Surface<'_> {
    /// Whether a face is open or buried where lines through voxels meet it, and at its middle (a long one where it
    /// passes voxels). Of a stack only the lines are asked, and long faces between them.
    fn verdict(&mut self, id: usize) -> u8 {
        let (v, seen) = (self.cells.faces[id].v, self.exposure.faces[id]);
        let Some(ahead) = ahead(self.cells, id) else { return seen | BURIED };
        if self.is_sliver(id) {
            return SLIVER | self.ask(middle(&v), ahead);
        }
        let stack = self.exposure.is_stack(self.cells, voxel_of(middle(&v)));
        match stack {
            true if is_small(&v) && self.is_speck(middle(&v), ahead) => seen | SPECK,
            true => seen,
            false => seen | self.said(&v, ahead),
        }
    }

    /// Whether a small face of a stack is open at its middle, and not on a slit.
    fn is_speck(&mut self, at: Point, ahead: Point) -> bool {
        if self.cells.crowd(voxel_of(at)) > MANY {
            return false;
        }
        let moved = |side: f64| [0, 1, 2].map(|axis| at[axis] + side * ahead[axis]);
        let [front, back] = self.cells.windings(moved(1.0), moved(-1.0), &mut self.prisms);
        front < 1 && back >= 1 && self.cells.windings(moved(SLIT), at, &mut self.prisms)[0] < 1
    }

    /// Whether a face passes between the lines though it is long: patches do not know of it.
    fn is_sliver(&self, id: usize) -> bool {
        let (low, high) = extent(&self.cells.faces[id].v);
        self.exposure.faces[id] == 0 && (0..3).any(|axis| high[axis] - low[axis] > LONG)
    }

    /// What the samples of a part of a face say.
    fn said(&mut self, v: &Corners, ahead: Point) -> u8 {
        let mut said = 0;
        each_sample(v, SPACING, |at| said |= if self.is_asked(at) { self.ask(at, ahead) } else { 0 });
        said
    }

    /// Adds the open parts of a face, from what it and what all faces in its cells said.
    fn open_parts(&mut self, id: usize, said: u8, seen: u8, around: &[u8], out: &mut Vec<Part>) {
        let (v, Some(ahead)) = (self.cells.faces[id].v, ahead(self.cells, id)) else { return };
        match seen {
            OPEN_AND_LOOSE => out.push((v, true)),
            _ if said & SPECK != 0 => out.push((v, false)),
            _ if said == SLIVER | OPEN && seen & STACK != 0 => out.push((v, false)),
            _ if seen & LOOSE == 0 || seen & !(STACK | LOOSE) == BURIED => {}
            _ => {
                self.cut(id, v, said & (OPEN | BURIED), ahead, around, out);
            }
        }
    }

    /// What all faces said in the cells that a part of a face passes through.
    fn seen_around(&self, id: usize, v: Corners, around: &[u8]) -> u8 {
        let mut seen = 0;
        each_voxel(&v, &self.cells.normals[id], &self.cells.region, |voxel| {
            if let Some(cell) = self.cells.of_voxel(voxel) {
                seen |= around[cell];
            }
        });
        seen
    }

    /// Adds the open parts of a part of a face; says whether it is open throughout, as far as it was asked.
    fn dice(&mut self, id: usize, v: Corners, ahead: Point, around: &[u8], out: &mut Vec<Part>) -> bool {
        match self.seen_around(id, v, around) {
            // Nothing was said where no distance is wanted.
            0 | LOOSE | OPEN_AND_LOOSE => {
                out.push((v, true));
                true
            }
            seen if seen & LOOSE == 0 || seen & !(STACK | LOOSE) == BURIED => false,
            _ => {
                let exposed = self.exposure.within(id as u32, extent(&v));
                let said = self.said(&v, ahead) | if exposed { OPEN } else { 0 };
                self.cut(id, v, said, ahead, around, out)
            }
        }
    }

    /// As [`Surface::dice`], for a part that said this and has open and buried faces, or stacks, around it.
    fn cut(
        &mut self,
        id: usize,
        v: Corners,
        said: u8,
        ahead: Point,
        around: &[u8],
        out: &mut Vec<Part>,
    ) -> bool {
        let begin = out.len();
        if !is_small(&v) {
            let open = match said {
                OPEN => true,
                BURIED if !self.is_missed(&v, ahead, around) => false,
                _ => halves(v).map(|half| self.dice(id, half, ahead, around, out)) == [true; 2],
            };
            if open {
                out.truncate(begin);
                out.push((v, false));
            }
            return open;
        }
        if self.exposure.is_stack(self.cells, voxel_of(middle(&v))) {
            return false;
        }
        self.clip(v, ahead, out);
        if out.len() == begin && self.exposure.within(id as u32, extent(&v)) {
            out.push((v, false));
        }
        out[begin..] == [(v, true)]
    }

    /// Whether a part of a face that is buried where it was asked is open between, in cells with open ones.
    fn is_missed(&mut self, v: &Corners, ahead: Point, around: &[u8]) -> bool {
        let mut missed = false;
        each_sample(v, CLOSER, |at| {
            let cell = self.cells.of_voxel(voxel_of(at)).filter(|_| !missed);
            let is_mixed = cell.is_some_and(|cell| around[cell] & (OPEN | STACK) == OPEN);
            missed |= is_mixed && self.ask(at, ahead) == OPEN;
        });
        missed
    }

    fn corners(&mut self, v: Corners, ahead: Point) -> [u8; 3] {
        let centre = middle(&v);
        v.map(|p| self.ask(between(p.map(f64::from), centre, INSET), ahead))
    }

    /// Adds the open parts of a small triangle.
    fn clip(&mut self, v: Corners, ahead: Point, out: &mut Vec<Part>) {
        let open = self.corners(v, ahead).map(|corner| corner == OPEN);
        let centre = middle(&v);
        let count = open.iter().filter(|open| **open).count();
        let mut middle_open = || self.ask(centre, ahead) == OPEN;
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
            return fan.into_iter().for_each(|part| self.clip_by(part, corners, ahead, out));
        }
        self.clip_by(v, open, ahead, out);
    }

    /// Adds the part of a triangle with open and buried corners that is open, its rim a straight line.
    fn clip_by(&mut self, v: Corners, open: [bool; 3], ahead: Point, out: &mut Vec<Part>) {
        let alone = (0..3).find(|&i| open[i] != open[(i + 1) % 3] && open[i] != open[(i + 2) % 3]);
        let turn = alone.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|i| v[(turn + i) % 3]);
        let [ab, ac] = [b, c].map(|other| self.rim(a, other, open[turn], ahead));
        if open[turn] {
            out.push(([a, ab, ac], true));
        } else {
            out.extend([([ab, b, c], true), ([ab, c, ac], true)]);
        }
    }

    /// Where an edge changes between open and buried: `a` is open or not as said, `b` the other.
    fn rim(&mut self, a: Fixed, b: Fixed, open: bool, ahead: Point) -> Fixed {
        let (a, b) = (a.map(f64::from), b.map(f64::from));
        let (mut first, mut last) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let half = (first + last) / 2.0;
            let same = (self.ask(between(a, b, half), ahead) == OPEN) == open;
            (first, last) = if same { (half, last) } else { (first, half) };
        }
        between(a, b, (first + last) / 2.0).map(|value| value.round() as i32)
    }

    fn ask(&mut self, at: Point, ahead: Point) -> u8 {
        ask(self.cells, self.exposure, at, ahead, &mut self.prisms)
    }

    /// Whether distances may be wanted near a point, and no stack's patches give them.
    fn is_asked(&self, at: Point) -> bool {
        self.cells.of_voxel(voxel_of(at)).is_some_and(|cell| !self.exposure.stacks[cell])
    }
}

/// Whether a part of a face is asked as one.
pub fn is_small(v: &Corners) -> bool {
    let (low, high) = extent(v);
    (0..3).all(|axis| high[axis] - low[axis] <= SMALL)
}

/// Calls `see` with the middle of a small triangle; with points about `spacing` apart in rows along its longest edge
/// otherwise.
fn each_sample(v: &Corners, spacing: f64, mut see: impl FnMut(Point)) {
    if is_small(v) {
        return see(middle(v));
    }
    let [a, b, c] = from_longest(v).map(|p| p.map(f64::from));
    let (along, up) = (sub(b, a), sub(c, a));
    let length = dot(&along, &along).sqrt();
    let area = cross(along, up);
    let height = dot(&area, &area).sqrt() / length;
    let rows = (height / spacing).ceil().max(1.0);
    for row in 0..rows as usize {
        let t = (row as f64 + 0.5) / rows;
        let (begin, end) = (between(a, c, t), between(b, c, t));
        let count = (length * (1.0 - t) / spacing).ceil().max(1.0);
        (0..count as usize).for_each(|index| see(between(begin, end, (index as f64 + 0.5) / count)));
    }
}

/// A triangle turned so that its first edge is the longest.
fn from_longest(v: &Corners) -> Corners {
    let length = |i: usize| {
        let d = difference(&v[(i + 1) % 3], &v[i]);
        dot(&d, &d)
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

/// A triangle cut across its longest edge.
pub fn halves(v: Corners) -> [Corners; 2] {
    let [a, b, c] = from_longest(&v);
    let m = between(a.map(f64::from), b.map(f64::from), 0.5).map(|value| value.round() as i32);
    [[a, m, c], [m, b, c]]
}
