//! The parts of a chain's faces that bound its volume. The chain's boundary also has sheets inside the
//! volume, where layers overlap: distances must not see them.
//!
//! A point of a face is open when the chain is absent a hair in front of it. Faces are small against
//! what they bound, so one sample speaks for a face unless its neighbourhood disagrees; then its corners
//! are asked, and the face is clipped where it dives into the volume.

use std::sync::atomic::{AtomicU8, Ordering};

use rayon::prelude::*;

use super::cells::{Cells, Point, dot, each_cell, normal};
use super::chain::Face;
use super::lattice::{Fixed, UNITS};
use super::region::{Region, extent};
use super::winding::Lines;

/// A triangle that bounds the volume.
pub type Facet = [Fixed; 3];

/// Depth (fixed-point units) up to which a sheet counts as surface: sides of a sweep are folds of many
/// sheets, closer together than the sweep's own tolerance.
const HAIR: f64 = 0.02 * UNITS as f64;
/// Faces longer than this (cells) are asked in every cell that they pass through.
const SMALL: f32 = 1.5;
/// A corner is asked for this part of the way to the middle, away from what it shares with neighbours.
const INSET: f64 = 0.05;
/// Halvings that find where an edge dives: to 1/64 of its length.
const HALVINGS: usize = 6;
/// Faces a task handles: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 512;

/// What the samples of a face or a cell said.
const OPEN: u8 = 1;
const BURIED: u8 = 2;

/// A chain's faces, and how to ask for the winding number near them.
struct Chain<'a> {
    faces: &'a [Face],
    normals: Vec<Point>,
    cells: Cells,
    region: &'a Region,
    lines: &'a Lines,
}

/// The surface of a chain in the marked blocks, where all faces there are given.
pub fn surface(faces: &[Face], region: &Region, marked: &[bool], lines: &Lines) -> Vec<Facet> {
    let normals: Vec<Point> = faces.par_iter().map(normal).collect();
    let cells = Cells::new(faces, &normals, region, marked);
    let chain = Chain { faces, normals, cells, region, lines };
    let verdicts: Vec<u8> =
        (0..faces.len()).into_par_iter().with_min_len(GRAIN).map(|id| chain.verdict(id)).collect();
    let (around, seen) = chain.neighbourhoods(&verdicts);
    let parts: Vec<Vec<Facet>> = verdicts
        .par_chunks(GRAIN)
        .enumerate()
        .map(|(chunk, verdicts)| {
            let mut out = Vec::with_capacity(verdicts.len());
            for (index, &verdict) in verdicts.iter().enumerate() {
                let id = chunk * GRAIN + index;
                chain.open_parts(id, [verdict, seen[id]], &around, &mut out);
            }
            out
        })
        .collect();
    parts.concat()
}

impl Chain<'_> {
    /// Whether a face is open or buried at its middle; a long one where it passes voxels.
    fn verdict(&self, id: usize) -> u8 {
        let face = &self.faces[id];
        let Some(ahead) = self.ahead(id) else { return BURIED };
        let mut verdict = self.ask(middle(&face.v), ahead);
        if !is_small(&face.v) {
            each_cell(&face.v, &self.normals[id], |voxel| {
                if self.cells.of_voxel(voxel, self.region).is_some() && let Some(at) = self.foot(id, voxel) {
                    verdict |= self.ask(at, ahead);
                }
            });
        }
        verdict
    }

    /// For each cell what its faces said, and for each face what was said in its cells.
    fn neighbourhoods(&self, verdicts: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let seen: Vec<AtomicU8> = verdicts.iter().map(|_| AtomicU8::new(0)).collect();
        let gather = |cell: usize| {
            let ids = self.cells.faces(cell);
            let said = ids.iter().fold(0, |said, &id| said | verdicts[id as usize]);
            ids.iter().for_each(|&id| drop(seen[id as usize].fetch_or(said, Ordering::Relaxed)));
            said
        };
        let around = (0..self.cells.count()).into_par_iter().with_min_len(8 * GRAIN).map(gather).collect();
        (around, seen.into_iter().map(AtomicU8::into_inner).collect())
    }

    /// Adds the open parts of a face whose own samples gave a verdict.
    fn open_parts(&self, id: usize, [verdict, seen]: [u8; 2], around: &[u8], out: &mut Vec<Facet>) {
        let (v, Some(ahead)) = (self.faces[id].v, self.ahead(id)) else { return };
        match seen {
            OPEN => out.push(v),
            BURIED => {}
            _ if is_small(&v) => self.clip(v, ahead, out),
            _ if self.corners(v, ahead).iter().all(|&corner| corner == verdict) => {
                if verdict == OPEN {
                    out.push(v);
                }
            }
            _ => {
                self.dice(id, v, ahead, around, out);
            }
        }
    }

    /// What all faces said in the cells that a part of a face passes through.
    fn seen_around(&self, id: usize, v: Facet, around: &[u8]) -> u8 {
        let mut seen = 0;
        each_cell(&v, &self.normals[id], |voxel| {
            if let Some(cell) = self.cells.of_voxel(voxel, self.region) {
                seen |= around[cell];
            }
        });
        seen
    }

    /// Adds the open parts of a long part of a face; says whether it is open throughout.
    fn dice(&self, id: usize, v: Facet, ahead: Point, around: &[u8], out: &mut Vec<Facet>) -> bool {
        let begin = out.len();
        let open = match self.seen_around(id, v, around) {
            // Nothing was said where no distance is wanted.
            0 | OPEN => true,
            BURIED => false,
            _ if is_small(&v) => {
                self.clip(v, ahead, out);
                out[begin..] == [v]
            }
            _ => halves(v).map(|half| self.dice(id, half, ahead, around, out)) == [true; 2],
        };
        if open {
            out.truncate(begin);
            out.push(v);
        }
        open
    }

    fn corners(&self, v: Facet, ahead: Point) -> [u8; 3] {
        let centre = middle(&v);
        v.map(|p| self.ask(between(p.map(f64::from), centre, INSET), ahead))
    }

    /// Adds the open parts of a small triangle.
    fn clip(&self, v: Facet, ahead: Point, out: &mut Vec<Facet>) {
        let open = self.corners(v, ahead).map(|corner| corner == OPEN);
        let centre = middle(&v);
        let count = open.iter().filter(|open| **open).count();
        if count % 3 == 0 && (self.ask(centre, ahead) == OPEN) == open[0] {
            if open[0] {
                out.push(v);
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
    fn clip_by(&self, v: Facet, open: [bool; 3], ahead: Point, out: &mut Vec<Facet>) {
        let alone = (0..3).find(|&i| open[i] != open[(i + 1) % 3] && open[i] != open[(i + 2) % 3]);
        let turn = alone.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|i| v[(turn + i) % 3]);
        let [ab, ac] = [b, c].map(|other| self.rim(a, other, open[turn], ahead));
        if open[turn] {
            out.push([a, ab, ac]);
        } else {
            out.extend([[ab, b, c], [ab, c, ac]]);
        }
    }

    /// Where an edge changes between open and buried: `a` is open or not as said, `b` the other.
    fn rim(&self, a: Fixed, b: Fixed, open: bool, ahead: Point) -> Fixed {
        let (a, b) = (a.map(f64::from), b.map(f64::from));
        let (mut first, mut last) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let half = (first + last) / 2.0;
            let same = (self.ask(between(a, b, half), ahead) == OPEN) == open;
            (first, last) = if same { (half, last) } else { (first, half) };
        }
        between(a, b, (first + last) / 2.0).map(|value| value.round() as i32)
    }

    /// Whether a point is open, with the way `ahead` of its face.
    fn ask(&self, at: Point, ahead: Point) -> u8 {
        let point = [0, 1, 2].map(|axis| at[axis] + ahead[axis]);
        let winding = self.cells.winding(point, self.faces, &self.normals, self.region, self.lines);
        if winding < 1 { OPEN } else { BURIED }
    }

    /// A hair along a face's normal; none for a face without area.
    fn ahead(&self, id: usize) -> Option<Point> {
        let normal = self.normals[id];
        let length = dot(&normal, &normal).sqrt();
        (length > 0.0).then(|| normal.map(|value| value * HAIR / length))
    }

    /// The foot of the perpendicular from a voxel, where it lies in the face.
    fn foot(&self, id: usize, voxel: [i32; 3]) -> Option<Point> {
        let (v, normal) = (&self.faces[id].v, &self.normals[id]);
        let p = voxel.map(|value| f64::from(value) * f64::from(UNITS));
        let height = dot(normal, &super::cells::sub(p, v[0].map(f64::from))) / dot(normal, normal);
        let foot = [0, 1, 2].map(|axis| p[axis] - height * normal[axis]);
        super::cells::is_over(v, normal, foot).then_some(foot)
    }
}

fn is_small(v: &Facet) -> bool {
    let (low, high) = extent(v);
    (0..3).all(|axis| high[axis] - low[axis] <= SMALL)
}

fn middle(v: &Facet) -> Point {
    [0, 1, 2].map(|axis| v.iter().map(|p| f64::from(p[axis])).sum::<f64>() / 3.0)
}

fn between(a: Point, b: Point, t: f64) -> Point {
    [0, 1, 2].map(|axis| a[axis] + t * (b[axis] - a[axis]))
}

/// A triangle cut across its longest edge.
fn halves(v: Facet) -> [Facet; 2] {
    let length = |i: usize| {
        let d = super::cells::difference(&v[(i + 1) % 3], &v[i]);
        dot(&d, &d)
    };
    let longest = (1..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
    let [a, b, c] = [0, 1, 2].map(|i| v[(longest + i) % 3]);
    let m = between(a.map(f64::from), b.map(f64::from), 0.5).map(|value| value.round() as i32);
    [[a, m, c], [m, b, c]]
}
