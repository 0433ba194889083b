//! Where lines through voxels enter and leave the volume: which faces bound it there, and an upper bound on each voxel's distance from the
//! surface.
//!
//! Each line through voxels, along x, y or z, crosses the chain's faces in an order that is known exactly. At some crossings (the meetings)
//! the winding number changes between 0 and 1, however many sheets lie close together. The faces there are exposed. Between two
//! neighbouring voxels of opposite sign there is a meeting, within a cell of both, so the level set cannot jump there.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, Ordering};

use rayon::prelude::*;

use super::bins::Bins;
use crate::distance::Face;
use crate::distance::lattice::floor;
use crate::distance::scanlines::Columns;
use crate::distance::vectors::dot;
use crate::distance::winding::{Axis, each_crossing};
use crate::geometry::lists::Lists;
use crate::numeric::blocks::offset;
use crate::sweep::chain::prism::Point;

/// Flag of a face that is, somewhere, exposed or less than [`THIN`] below an exposed face.
pub const OPEN: u8 = 1;
/// Flag of a face that lies deeper somewhere.
pub const BURIED: u8 = 2;
/// Depth (cells) up to which a sheet counts as surface. A body that turns about an axis of near symmetry sweeps bundles of nearly
/// coincident sheets: each is outermost only in slivers, and elsewhere lies below its neighbours by up to the motion's tolerance.
pub const THIN: f64 = 0.05;

/// Faces per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 2048;
/// A bin is a stack if it and its six neighbours contain at least this many crossings: a single sheet crosses at most about ten of their
/// lines.
const STACK: u32 = 40;
/// [`BUNDLE`] sheets within this distance (cells) form a bundle.
const CLOSE: f64 = 0.1;
/// See [`CLOSE`].
const BUNDLE: usize = 3;
/// Only bins with at least this many faces can be stacks.
const MIN_FACES: usize = 32;
/// A gap between sheets that is narrower than this (cells) and contains no voxel counts as closed.
const CLOSED: f64 = 0.01;
/// A patch is made at a spot if the component of the face's normal along the line is at least this fraction of the largest component.
const STEEP: f64 = 0.9;

/// What lines through voxels reveal about a chain.
pub struct Exposure {
    /// [`OPEN`] and [`BURIED`] flags of each face; 0 for a face that no line crosses.
    pub faces: Vec<u8>,
    /// The meetings along each axis.
    along: Vec<Along>,
    /// Whether each bin holds a stack: its surface consists only of patches.
    pub stacks: Vec<bool>,
    /// Whether each bin holds a stack or a bundle: patches are added there.
    bundles: Vec<bool>,
}

/// The lines along an axis and their meetings.
struct Along {
    axis: Axis,
    columns: Columns,
    /// The meetings of each line, ascending.
    meetings: Lists<Meeting>,
}

/// A crossing at which a line enters or leaves the volume; the fields are those of [`Spot`].
#[derive(Debug, Clone, Copy, Default)]
struct Meeting {
    position: f64,
    face: u32,
    enters: bool,
}

/// A meeting with its line: where a line enters or leaves the volume.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    /// Direction of the line.
    pub axis: Axis,
    /// The line's coordinates.
    pub line: [i32; 2],
    /// The position along it (cells from the origin voxel).
    pub position: f64,
    /// Whether the line enters the volume there, in the direction of its axis.
    pub enters: bool,
    /// The outermost face there.
    pub face: u32,
}

impl Spot {
    /// Position (cells from the origin voxel).
    pub fn at(&self) -> Point {
        let mut at = self.axis.voxel(self.line, 0).map(f64::from);
        at[self.axis.index()] = self.position;
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

/// Results of the scan for faces and bins, written by many tasks at once.
struct Marks {
    faces: Vec<AtomicU8>,
    /// Crossings in each bin.
    counts: Vec<AtomicU16>,
    bundles: Vec<AtomicBool>,
}

impl Exposure {
    /// Scans the faces along all lines through the voxels of the bins' blocks.
    pub fn scan(bins: &Bins) -> Self {
        let marks = Marks {
            faces: bins.faces.iter().map(|_| AtomicU8::new(0)).collect(),
            counts: (0..bins.count()).map(|_| AtomicU16::new(0)).collect(),
            bundles: (0..bins.count()).map(|_| AtomicBool::new(false)).collect(),
        };
        let along: Vec<Along> =
            Axis::ALL.into_par_iter().map(|axis| Along::new(bins, axis, &marks)).collect();
        let stacks = stacks(bins, &marks.counts);
        let bundles = marks.bundles.into_iter().map(AtomicBool::into_inner);
        Self {
            faces: marks.faces.into_iter().map(AtomicU8::into_inner).collect(),
            along,
            bundles: bundles.zip(&stacks).map(|(bundle, stack)| bundle | stack).collect(),
            stacks,
        }
    }

    /// Whether the bin around a voxel is a stack.
    pub fn is_stack(&self, bins: &Bins, voxel: [i32; 3]) -> bool {
        bins.of_voxel(voxel).is_some_and(|bin| self.stacks[bin])
    }

    /// Whether a face is exposed on a line through a box (cells).
    pub fn is_exposed_within(&self, face: u32, (low, high): ([f32; 3], [f32; 3])) -> bool {
        let (low, high) = (low.map(|value| value - 0.01), high.map(|value| value + 0.01));
        self.along.iter().any(|along| along.exposes(face, low, high))
    }

    /// The spots in stacks and bundles where lines are steep to their faces, sorted by bin.
    pub fn spots_of_bundles(&self, bins: &Bins) -> Vec<Spot> {
        let bin = |spot: &Spot| bins.of_voxel(spot.at().map(|value| floor(value + 0.5)));
        let is_steep = |spot: &Spot| {
            let normal = bins.normals[spot.face as usize].map(f64::abs);
            let max = normal.into_iter().fold(0.0, f64::max);
            normal[spot.axis.index()] >= STEEP * max
        };
        let wanted = |spot: Spot| {
            let bin = bin(&spot).filter(|&bin| self.bundles[bin])?;
            is_steep(&spot).then_some((bin, spot))
        };
        let mut spots: Vec<(usize, Spot)> =
            self.along.iter().flat_map(Along::spots).filter_map(wanted).collect();
        spots.par_sort_by_key(|(bin, _)| *bin);
        spots.into_iter().map(|(_, spot)| spot).collect()
    }

    /// Whether the line at `line`, parallel to that of `spot`, has a meeting of the same direction within `off` cells of `position`.
    pub fn has_meeting_near(&self, spot: &Spot, line: [i32; 2], position: f64, off: f64) -> bool {
        let mut meetings = self.along[spot.axis.index()].line(line).iter();
        meetings.any(|other| (other.position - position).abs() <= off && other.enters == spot.enters)
    }

    /// Calls `see` with each voxel of a block that is within a cell of a meeting on a line through the voxel, and with their distance
    /// (cells).
    pub fn each_meeting(&self, corner: [i32; 3], mut see: impl FnMut(usize, f32)) {
        for along in &self.along {
            let axis = along.axis;
            let (first, [p, q]) = (corner[axis.index()], axis.line(corner));
            for line in (0..8).flat_map(|i| (0..8).map(move |j| [p + i, q + j])) {
                let meetings = along.line(line);
                let begin = meetings.partition_point(|meeting| meeting.position < f64::from(first - 1));
                let end = f64::from(first + 8);
                for meeting in meetings[begin..].iter().take_while(|meeting| meeting.position < end) {
                    let below = floor(meeting.position);
                    for position in
                        (below..=below + 1).filter(|position| (first..first + 8).contains(position))
                    {
                        let [x, y, z] = axis.voxel(line, position).map(|value| (value & 7) as usize);
                        see(offset(x, y, z), (meeting.position - f64::from(position)).abs() as f32);
                    }
                }
            }
        }
    }
}

impl Along {
    /// Scans the faces along the lines of an axis within the bins' blocks.
    fn new(bins: &Bins, axis: Axis, marks: &Marks) -> Self {
        let columns = columns(bins, axis);
        let mut crossings = crossings(bins, axis, &columns, &marks.counts);
        crossings.each_mut(|line| {
            line.sort_unstable_by(|a, b| {
                a.at.total_cmp(&b.at).then((a.change, a.face).cmp(&(b.change, b.face)))
            });
        });
        let meetings = crossings.map(|line, crossings, out| {
            scan_line(bins, axis, columns.coordinates(line), crossings, marks, out)
        });
        Self { axis, columns, meetings }
    }

    /// The meetings of a line.
    fn line(&self, line: [i32; 2]) -> &[Meeting] {
        self.columns.line(line).map_or(&[], |line| self.meetings.get(line))
    }

    /// Whether a face is exposed within a box (cells).
    fn exposes(&self, face: u32, low: [f32; 3], high: [f32; 3]) -> bool {
        let (first, last) =
            (self.axis.line(low.map(|v| v.ceil() as i32)), self.axis.line(high.map(|v| v.floor() as i32)));
        let along = self.axis.index();
        let inside = |meeting: &Meeting| {
            let position = meeting.position as f32;
            meeting.face == face && position >= low[along] && position <= high[along]
        };
        self.columns.between(first, last).any(|line| self.meetings.get(line).iter().any(inside))
    }

    /// All spots, line after line.
    fn spots(&self) -> impl Iterator<Item = Spot> {
        let Self { axis, columns, meetings } = self;
        (0..meetings.count()).flat_map(move |line| {
            let spot = move |&Meeting { position, face, enters }: &Meeting| Spot {
                axis: *axis,
                line: columns.coordinates(line),
                position,
                enters,
                face,
            };
            meetings.get(line).iter().map(spot)
        })
    }
}

/// The columns of the lines along an axis through the bins' blocks.
fn columns(bins: &Bins, axis: Axis) -> Columns {
    let mut columns = Columns::new(axis.line(bins.region.low), axis.line(bins.region.high));
    bins.blocks().for_each(|block| columns.add(axis.line(block)));
    columns
}

/// Every crossing of the lines along an axis within the bins' blocks, and the number of them in each bin.
fn crossings(bins: &Bins, axis: Axis, columns: &Columns, counts: &[AtomicU16]) -> Lists<Crossing> {
    let corner = |block: [i32; 3], more: i32| block.map(|position| position * 8 + more);
    let bounds = axis.bounds(corner(bins.region.low, 0), corner(bins.region.high, 7));
    let cross = |(chunk, faces): (usize, &[Face])| {
        let mut out = Vec::with_capacity(faces.len());
        for (face, own) in (chunk * GRAIN..).zip(faces) {
            each_crossing(own, axis, bounds, |line, at, change| {
                let Some(bin) = bins.of_voxel(axis.voxel(line, floor(at + 0.5))) else { return };
                // Saturating; the order of tasks does not matter.
                let _ = counts[bin].fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
                    (count < u16::MAX).then_some(count + 1)
                });
                let line = columns.line(line).expect("a line through a bin's block");
                out.push((line as u32, Crossing { at, change, face: face as u32 }));
            });
        }
        out
    };
    let parts: Vec<Vec<(u32, Crossing)>> = bins.faces.par_chunks(GRAIN).enumerate().map(cross).collect();
    Lists::new(columns.lines(), parts.iter().flatten().copied())
}

/// Which bins are stacks, from the number of crossings near each.
fn stacks(bins: &Bins, counts: &[AtomicU16]) -> Vec<bool> {
    let stacks: Vec<AtomicBool> = counts.iter().map(|_| AtomicBool::new(false)).collect();
    bins.for_each_crowded(MIN_FACES, |bin, voxel| {
        let count =
            |voxel| bins.of_voxel(voxel).map_or(0, |bin| u32::from(counts[bin].load(Ordering::Relaxed)));
        let beside = |axis: usize, step: i32| {
            let mut position = voxel;
            position[axis] += step;
            count(position)
        };
        let around: u32 = (0..3).map(|axis| beside(axis, -1) + beside(axis, 1)).sum();
        stacks[bin].store(count(voxel) + around >= STACK, Ordering::Relaxed);
    });
    stacks.into_iter().map(AtomicBool::into_inner).collect()
}

/// Walks along one line, marks faces and collects the meetings.
fn scan_line(
    bins: &Bins,
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
            winding = bins.lines.winding(axis.voxel(coordinates, edge));
        }
        // The list has no crossings in other blocks.
        known = (edge & 7 != 7).then_some(edge + 1);
        let begin = out.len();
        for &Crossing { at, change, face } in run {
            let (before, after) = (winding, winding + change);
            winding = after;
            let enters = after >= 1;
            if (before >= 1) == enters {
                continue;
            }
            // The line enters again right after it left: a closed gap.
            if enters && out[begin..].last().is_some_and(|last| at - last.position < CLOSED) {
                out.pop();
            } else {
                out.push(Meeting { position: at, enters, face });
            }
        }
        let slope = |face: u32| {
            let normal = &bins.normals[face as usize];
            normal[axis.index()].abs() / dot(*normal, *normal).sqrt()
        };
        let meetings = &out[begin..];
        for meeting in meetings {
            let slope = slope(meeting.face);
            let close = run.iter().filter(|crossing| (crossing.at - meeting.position).abs() * slope <= CLOSE);
            if close.count() >= BUNDLE {
                let ends = [edge, edge + 1].map(|along| bins.of_voxel(axis.voxel(coordinates, along)));
                ends.into_iter().flatten().for_each(|bin| marks.bundles[bin].store(true, Ordering::Relaxed));
            }
        }
        for crossing in run {
            let slope = slope(crossing.face);
            let shallow =
                meetings.iter().any(|meeting| (crossing.at - meeting.position).abs() * slope <= THIN);
            let mark = if shallow { OPEN } else { BURIED };
            marks.faces[crossing.face as usize].fetch_or(mark, Ordering::Relaxed);
        }
    }
}
