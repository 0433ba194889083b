//! Where lines through voxels enter and leave the volume: which faces bound it there, and how far a voxel can be from
//! the surface at most.
//!
//! Each line through voxels, along x, y or z, meets the chain's faces in an order that is known exactly; the winding
//! number passes between 0 and 1 at some of them, however many sheets lie close together. Those faces are exposed.
//! Between two neighbouring voxels of opposite sign there is such a place, so both are near it: the level set cannot
//! jump there.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, Ordering};

use rayon::prelude::*;

use super::cells::{Cells, Point, dot};
use super::chain::Face;
use super::columns::Columns;
use super::lattice::floor;
use super::lists::Lists;
use super::winding::{Axis, each_crossing};
use crate::base::blocks::offset;

/// A face is exposed, or less than [`THIN`] below one that is, somewhere.
pub const OPEN: u8 = 1;
/// A face lies deeper, somewhere.
pub const BURIED: u8 = 2;
/// Depth (cells) up to which a sheet counts as surface. What turns about an axis of near symmetry sweeps bundles of
/// sheets that nearly coincide: each is outermost only in slivers between its neighbours, as far below the
/// others as the motion's tolerance lets it be.
pub const THIN: f64 = 0.05;

/// Faces that a task scans: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;
/// Crossings near a voxel and its six neighbours from which on its cell is a stack of sheets: a single one meets
/// at most some ten of their lines.
const STACK: u32 = 40;
/// Sheets this close together (cells) are a bundle.
const CLOSE: f64 = 0.1;
/// How many of them do.
const BUNDLE: usize = 3;
/// Faces in a cell from which on a stack is crowded.
const CROWD: usize = 32;
/// Gaps between sheets that are narrower than this (cells), and do not hold a voxel, are none.
const CLOSED: f64 = 0.01;
/// How steeply a line meets a face whose plane it speaks for, against the steepest of the three axes.
const STEEPEST: f64 = 0.9;

/// What lines through voxels see of a chain.
pub struct Exposure {
    /// [`OPEN`] and [`BURIED`], for each face; 0 for one that no line meets.
    pub faces: Vec<u8>,
    /// What lines see along each axis.
    along: Vec<Along>,
    /// Whether each cell holds a stack: so many sheets that its surface is made of patches alone.
    pub stacks: Vec<bool>,
    /// Whether each cell holds a stack, or a bundle: sheets so close together that patches are added.
    bundles: Vec<bool>,
}

/// Where the lines along an axis meet the surface.
struct Along {
    axis: Axis,
    columns: Columns,
    /// Of each line, ascending.
    meetings: Lists<Meeting>,
}

/// See [`Spot`].
#[derive(Debug, Clone, Copy, Default)]
struct Meeting {
    place: f64,
    face: u32,
    enters: bool,
}

/// Where a line meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    /// Direction of the line.
    pub axis: Axis,
    /// The line's coordinates.
    pub line: [i32; 2],
    /// The place along it (cells from the base voxel).
    pub place: f64,
    /// Whether the line enters the volume there, going upward.
    pub enters: bool,
    /// The face that is outermost there.
    pub face: u32,
}

impl Spot {
    /// Position (cells from the base voxel).
    pub fn at(&self) -> Point {
        let mut at = self.axis.voxel(self.line, 0).map(f64::from);
        at[self.axis.index()] = self.place;
        at
    }
}

/// A face crossing a line.
#[derive(Debug, Clone, Copy, Default)]
struct Crossing {
    at: f64,
    change: i32,
    face: u32,
}

/// What lines tell of faces and cells, from many tasks at once.
struct Marks {
    faces: Vec<AtomicU8>,
    /// Crossings in each cell.
    counts: Vec<AtomicU16>,
    bundles: Vec<AtomicBool>,
}

impl Exposure {
    /// Scans the faces along all lines through the voxels of the cells' blocks.
    pub fn scan(cells: &Cells) -> Self {
        let marks = Marks {
            faces: cells.faces.iter().map(|_| AtomicU8::new(0)).collect(),
            counts: (0..cells.count()).map(|_| AtomicU16::new(0)).collect(),
            bundles: (0..cells.count()).map(|_| AtomicBool::new(false)).collect(),
        };
        let along: Vec<Along> =
            Axis::ALL.into_par_iter().map(|axis| Along::new(cells, axis, &marks)).collect();
        let stacks = stacks(cells, &marks.counts);
        let bundles = marks.bundles.into_iter().map(AtomicBool::into_inner);
        Self {
            faces: marks.faces.into_iter().map(AtomicU8::into_inner).collect(),
            along,
            bundles: bundles.zip(&stacks).map(|(bundle, stack)| bundle | stack).collect(),
            stacks,
        }
    }

    /// Whether the cell around a voxel holds so many sheets, one behind the other, that only exposed ones are kept.
    pub fn is_stack(&self, cells: &Cells, voxel: [i32; 3]) -> bool {
        cells.of_voxel(voxel).is_some_and(|cell| self.stacks[cell])
    }

    /// Whether a face is exposed on a line through a box (cells).
    pub fn within(&self, face: u32, (low, high): ([f32; 3], [f32; 3])) -> bool {
        let (low, high) = (low.map(|value| value - 0.01), high.map(|value| value + 0.01));
        self.along.iter().any(|along| along.exposes(face, low, high))
    }

    /// The spots in stacks and bundles where lines meet their faces steeply, cell after cell.
    pub fn spots_of_bundles(&self, cells: &Cells) -> Vec<Spot> {
        let cell = |spot: &Spot| cells.of_voxel(spot.at().map(|value| floor(value + 0.5)));
        let is_steep = |spot: &Spot| {
            let normal = cells.normals[spot.face as usize].map(f64::abs);
            let most = normal.into_iter().fold(0.0, f64::max);
            normal[spot.axis.index()] >= STEEPEST * most
        };
        let wanted = |spot: Spot| {
            let cell = cell(&spot).filter(|&cell| self.bundles[cell])?;
            is_steep(&spot).then_some((cell, spot))
        };
        let mut spots: Vec<(usize, Spot)> =
            self.along.iter().flat_map(Along::spots).filter_map(wanted).collect();
        spots.par_sort_by_key(|(cell, _)| *cell);
        spots.into_iter().map(|(_, spot)| spot).collect()
    }

    /// Whether some spot on a line parallel to that of another faces the same way and lies within `off` cells of a
    /// place on it.
    pub fn agrees(&self, spot: &Spot, line: [i32; 2], place: f64, off: f64) -> bool {
        let mut meetings = self.along[spot.axis.index()].line(line).iter();
        meetings.any(|other| (other.place - place).abs() <= off && other.enters == spot.enters)
    }

    /// Calls `see` with the voxels of a block beside which lines meet the surface, and how far from them (cells, at most 1).
    pub fn each_meeting(&self, corner: [i32; 3], mut see: impl FnMut(usize, f32)) {
        for along in &self.along {
            let axis = along.axis;
            let (first, [p, q]) = (corner[axis.index()], axis.line(corner));
            for line in (0..8).flat_map(|i| (0..8).map(move |j| [p + i, q + j])) {
                let meetings = along.line(line);
                let begin = meetings.partition_point(|meeting| meeting.place < f64::from(first - 1));
                let end = f64::from(first + 8);
                for meeting in meetings[begin..].iter().take_while(|meeting| meeting.place < end) {
                    let below = floor(meeting.place);
                    for place in (below..=below + 1).filter(|place| (first..first + 8).contains(place)) {
                        let [x, y, z] = axis.voxel(line, place).map(|value| (value & 7) as usize);
                        see(offset(x, y, z), (meeting.place - f64::from(place)).abs() as f32);
                    }
                }
            }
        }
    }
}

impl Along {
    /// Scans the faces along the lines of an axis within the cells' blocks.
    fn new(cells: &Cells, axis: Axis, marks: &Marks) -> Self {
        let columns = columns(cells, axis);
        let mut crossings = crossings(cells, axis, &columns, &marks.counts);
        crossings.each_mut(|line| {
            line.sort_unstable_by(|a, b| {
                a.at.total_cmp(&b.at).then((a.change, a.face).cmp(&(b.change, b.face)))
            });
        });
        let meetings = crossings
            .map(|line, crossings, out| walk(cells, axis, columns.coordinates(line), crossings, marks, out));
        Self { axis, columns, meetings }
    }

    /// What a line meets.
    fn line(&self, line: [i32; 2]) -> &[Meeting] {
        self.columns.line(line).map_or(&[], |line| self.meetings.get(line))
    }

    /// Whether a face is exposed within a box (cells).
    fn exposes(&self, face: u32, low: [f32; 3], high: [f32; 3]) -> bool {
        let (first, last) =
            (self.axis.line(low.map(|v| v.ceil() as i32)), self.axis.line(high.map(|v| v.floor() as i32)));
        let along = self.axis.index();
        let inside = |meeting: &Meeting| {
            let place = meeting.place as f32;
            meeting.face == face && place >= low[along] && place <= high[along]
        };
        self.columns.between(first, last).any(|line| self.meetings.get(line).iter().any(inside))
    }

    /// All spots, line after line.
    fn spots(&self) -> impl Iterator<Item = Spot> {
        let Self { axis, columns, meetings } = self;
        (0..meetings.count()).flat_map(move |line| {
            let spot = move |&Meeting { place, face, enters }: &Meeting| Spot {
                axis: *axis,
                line: columns.coordinates(line),
                place,
                enters,
                face,
            };
            meetings.get(line).iter().map(spot)
        })
    }
}

/// The columns of the lines along an axis through the cells' blocks.
fn columns(cells: &Cells, axis: Axis) -> Columns {
    let mut columns = Columns::new(axis.line(cells.region.low), axis.line(cells.region.high));
    cells.places().for_each(|block| columns.add(axis.line(block)));
    columns
}

/// Every crossing of the lines along an axis within the cells' blocks, upward.
fn crossings(cells: &Cells, axis: Axis, columns: &Columns, counts: &[AtomicU16]) -> Lists<Crossing> {
    let corner = |block: [i32; 3], more: i32| block.map(|place| place * 8 + more);
    let bounds = axis.bounds(corner(cells.region.low, 0), corner(cells.region.high, 7));
    let cross = |(chunk, faces): (usize, &[Face])| {
        let mut out = Vec::with_capacity(faces.len());
        for (face, own) in (chunk * GRAIN..).zip(faces) {
            each_crossing(own, axis, bounds, |line, at, change| {
                let Some(cell) = cells.of_voxel(axis.voxel(line, floor(at + 0.5))) else { return };
                // Saturating, and the same whoever comes first.
                let _ = counts[cell].fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
                    (count < u16::MAX).then_some(count + 1)
                });
                let line = columns.line(line).expect("a line through a cell's block");
                out.push((line as u32, Crossing { at, change, face: face as u32 }));
            });
        }
        out
    };
    let parts: Vec<Vec<(u32, Crossing)>> = cells.faces.par_chunks(GRAIN).enumerate().map(cross).collect();
    Lists::new(columns.lines(), &parts)
}

/// The cells that hold many sheets one behind the other, from the number of crossings near each.
fn stacks(cells: &Cells, counts: &[AtomicU16]) -> Vec<bool> {
    let stacks: Vec<AtomicBool> = counts.iter().map(|_| AtomicBool::new(false)).collect();
    cells.for_each_crowd(CROWD, |cell, voxel| {
        let count =
            |voxel| cells.of_voxel(voxel).map_or(0, |cell| u32::from(counts[cell].load(Ordering::Relaxed)));
        let beside = |axis: usize, step: i32| {
            let mut place = voxel;
            place[axis] += step;
            count(place)
        };
        let around: u32 = (0..3).map(|axis| beside(axis, -1) + beside(axis, 1)).sum();
        stacks[cell].store(count(voxel) + around >= STACK, Ordering::Relaxed);
    });
    stacks.into_iter().map(AtomicBool::into_inner).collect()
}

/// Goes along one line: marks faces, and notes where the winding number passes between 0 and 1.
fn walk(
    cells: &Cells,
    axis: Axis,
    coordinates: [i32; 2],
    line: &[Crossing],
    marks: &Marks,
    out: &mut Vec<Meeting>,
) {
    let (mut winding, mut known) = (0, None);
    for run in line.chunk_by(|a, b| floor(a.at) == floor(b.at)) {
        let edge = floor(run[0].at);
        if known != Some(edge) {
            winding = cells.lines.winding(axis.voxel(coordinates, edge));
        }
        // What lies in other blocks is not among the crossings.
        known = (edge & 7 != 7).then_some(edge + 1);
        let begin = out.len();
        for &Crossing { at, change, face } in run {
            let (before, after) = (winding, winding + change);
            winding = after;
            let enters = after >= 1;
            if (before >= 1) == enters {
                continue;
            }
            // What is entered here was left at the last passage.
            if enters && out[begin..].last().is_some_and(|last| at - last.place < CLOSED) {
                out.pop();
            } else {
                out.push(Meeting { place: at, enters, face });
            }
        }
        let slope = |face: u32| {
            let normal = &cells.normals[face as usize];
            normal[axis.index()].abs() / dot(normal, normal).sqrt()
        };
        let passages = &out[begin..];
        for passage in passages {
            let slope = slope(passage.face);
            let close = run.iter().filter(|crossing| (crossing.at - passage.place).abs() * slope <= CLOSE);
            if close.count() >= BUNDLE {
                let ends = [edge, edge + 1].map(|along| cells.of_voxel(axis.voxel(coordinates, along)));
                ends.into_iter()
                    .flatten()
                    .for_each(|cell| marks.bundles[cell].store(true, Ordering::Relaxed));
            }
        }
        for crossing in run {
            let slope = slope(crossing.face);
            let shallow = passages.iter().any(|passage| (crossing.at - passage.place).abs() * slope <= THIN);
            let mark = if shallow { OPEN } else { BURIED };
            marks.faces[crossing.face as usize].fetch_or(mark, Ordering::Relaxed);
        }
    }
}
