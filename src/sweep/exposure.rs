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
use super::winding::{Axis, each_crossing};

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
    /// Where faces are exposed, line after line.
    spots: Vec<Spot>,
    /// Places in `spots`, in the order of faces.
    by_face: Vec<u32>,
    /// For each pair of neighbour voxels with surface between them, how far the first and the second one are from it.
    pairs: Vec<(Pair, [f32; 2])>,
    /// Whether each cell holds a stack: so many sheets that its surface is made of patches alone.
    pub stacks: Vec<bool>,
    /// Whether each cell holds a stack, or a bundle: sheets so close together that patches are added.
    bundles: Vec<bool>,
}

/// A voxel and its neighbour above along an axis.
type Pair = ([i32; 3], u8);

/// Where a line meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    /// Direction of the line.
    pub axis: Axis,
    /// The line's coordinates.
    pub line: [i64; 2],
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

    /// What spots are sorted by.
    fn key(&self) -> (usize, [i64; 2]) {
        (self.axis.index(), self.line)
    }
}

/// A face crossing a line.
struct Crossing {
    line: [i64; 2],
    at: f64,
    change: i32,
    face: u32,
}

/// What the lines of one axis saw.
#[derive(Default)]
struct Seen {
    spots: Vec<Spot>,
    pairs: Vec<(Pair, [f32; 2])>,
}

impl Exposure {
    /// Scans the faces along all lines through the voxels of the cells' blocks.
    pub fn scan(cells: &Cells) -> Self {
        let faces: Vec<AtomicU8> = cells.faces.iter().map(|_| AtomicU8::new(0)).collect();
        let counts: Vec<AtomicU16> = (0..cells.count()).map(|_| AtomicU16::new(0)).collect();
        let none = || -> Vec<AtomicBool> { (0..cells.count()).map(|_| AtomicBool::new(false)).collect() };
        let (stacks, bundles) = (none(), none());
        let (mut spots, mut pairs) = (Vec::new(), Vec::new());
        for axis in Axis::ALL {
            let crossings = crossings(cells, axis, &counts);
            let same_line = |a: &Crossing, b: &Crossing| a.line == b.line;
            let walk = |mut seen: Seen, line: &[Crossing]| {
                walk(cells, axis, line, &faces, &bundles, &mut seen);
                seen
            };
            let parts: Vec<Seen> = crossings.par_chunk_by(same_line).fold(Seen::default, walk).collect();
            for seen in parts {
                spots.extend(seen.spots);
                pairs.extend(seen.pairs);
            }
        }
        let mut by_face: Vec<u32> = (0..spots.len() as u32).collect();
        by_face.par_sort_by_key(|&spot| spots[spot as usize].face);
        pairs.par_sort_unstable_by_key(|(pair, _)| *pair);
        let faces = faces.into_iter().map(AtomicU8::into_inner).collect();
        mark_crowds(cells, &counts, &stacks);
        let plain = |flags: Vec<AtomicBool>| flags.into_iter().map(AtomicBool::into_inner);
        let stacks: Vec<bool> = plain(stacks).collect();
        let bundles = plain(bundles).zip(&stacks).map(|(bundle, stack)| bundle | stack).collect();
        Self { faces, spots, by_face, pairs, stacks, bundles }
    }

    /// Whether the cell around a voxel holds so many sheets, one behind the other, that only exposed ones are kept.
    pub fn is_stack(&self, cells: &Cells, voxel: [i32; 3]) -> bool {
        cells.of_voxel(voxel).is_some_and(|cell| self.stacks[cell])
    }

    /// Whether a face is exposed on a line through a box (cells).
    pub fn within(&self, face: u32, (low, high): ([f32; 3], [f32; 3])) -> bool {
        let spot = |&index: &u32| &self.spots[index as usize];
        let first = self.by_face.partition_point(|index| spot(index).face < face);
        let mut own = self.by_face[first..].iter().map(spot).take_while(|spot| spot.face == face);
        own.any(|spot| {
            let at = spot.at().map(|value| value as f32);
            (0..3).all(|a| at[a] >= low[a] - 0.01 && at[a] <= high[a] + 0.01)
        })
    }

    /// The spots in stacks and bundles where lines meet their faces steeply, cell after cell.
    pub fn spots_of_bundles(&self, cells: &Cells) -> Vec<Spot> {
        let cell = |spot: &Spot| cells.of_voxel(spot.at().map(|value| value.round() as i32));
        let is_steep = |spot: &Spot| {
            let normal = cells.normals[spot.face as usize].map(f64::abs);
            let most = normal.into_iter().fold(0.0, f64::max);
            normal[spot.axis.index()] >= STEEPEST * most
        };
        let wanted = |spot: &Spot| {
            let cell = cell(spot).filter(|&cell| self.bundles[cell])?;
            is_steep(spot).then_some((cell, *spot))
        };
        let mut spots: Vec<(usize, Spot)> = self.spots.par_iter().filter_map(wanted).collect();
        spots.par_sort_by_key(|(cell, _)| *cell);
        spots.into_iter().map(|(_, spot)| spot).collect()
    }

    /// Whether some spot on a line parallel to that of another faces the same way and lies within `off` cells of a
    /// place on it.
    pub fn agrees(&self, spot: &Spot, line: [i64; 2], place: f64, off: f64) -> bool {
        let key = (spot.axis.index(), line);
        let first = self.spots.partition_point(|other| other.key() < key);
        let on_line = self.spots[first..].iter().take_while(|other| other.key() == key);
        let mut near = on_line.filter(|other| (other.place - place).abs() <= off);
        near.any(|other| other.enters == spot.enters)
    }

    /// Distances (cells) of a voxel, and of its neighbour above along an axis, from the surface between them; none
    /// where no line saw any.
    pub fn between(&self, voxel: [i32; 3], axis: usize) -> Option<[f32; 2]> {
        let key = (voxel, axis as u8);
        self.pairs.binary_search_by_key(&key, |(pair, _)| *pair).ok().map(|index| self.pairs[index].1)
    }
}

/// Marks the cells that hold many sheets one behind the other, from the number of crossings near each.
fn mark_crowds(cells: &Cells, counts: &[AtomicU16], stacks: &[AtomicBool]) {
    cells.for_each_crowd(CROWD, |cell, voxel| {
        let count =
            |voxel| cells.of_voxel(voxel).map_or(0, |cell| u32::from(counts[cell].load(Ordering::Relaxed)));
        let beside = |axis: usize, step: i32| {
            let mut place = voxel;
            place[axis] += step;
            count(place)
        };
        let around: u32 = (0..3).map(|axis| beside(axis, -1) + beside(axis, 1)).sum();
        if count(voxel) + around >= STACK {
            stacks[cell].store(true, Ordering::Relaxed);
        }
    });
}

/// Every crossing of the lines along an axis within the cells' blocks, line after line, upward.
fn crossings(cells: &Cells, axis: Axis, counts: &[AtomicU16]) -> Vec<Crossing> {
    let corner = |block: [i32; 3], more: i32| block.map(|place| place * 8 + more);
    let bounds = axis.bounds(corner(cells.region.low, 0), corner(cells.region.high, 7));
    let parts: Vec<Vec<Crossing>> = cells
        .faces
        .par_chunks(GRAIN)
        .enumerate()
        .map(|(chunk, faces)| {
            let mut out = Vec::with_capacity(faces.len());
            for (index, face) in faces.iter().enumerate() {
                each_crossing(face, axis, bounds, |line, at, change| {
                    let nearest = axis.voxel(line, at.round() as i32);
                    if let Some(cell) = cells.of_voxel(nearest) {
                        let count = &counts[cell];
                        // Saturating, and the same whoever comes first.
                        let _ = count.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
                            (count < u16::MAX).then_some(count + 1)
                        });
                        out.push(Crossing { line, at, change, face: (chunk * GRAIN + index) as u32 });
                    }
                });
            }
            out
        })
        .collect();
    let mut out: Vec<Crossing> = parts.into_iter().flatten().collect();
    out.par_sort_unstable_by(|a, b| {
        a.line.cmp(&b.line).then(a.at.total_cmp(&b.at)).then((a.change, a.face).cmp(&(b.change, b.face)))
    });
    out
}

/// Goes along one line: marks faces, and notes where the winding number passes between 0 and 1.
fn walk(
    cells: &Cells,
    axis: Axis,
    line: &[Crossing],
    faces: &[AtomicU8],
    bundles: &[AtomicBool],
    seen: &mut Seen,
) {
    let coordinates = line[0].line;
    for run in line.chunk_by(|a, b| a.at.floor() == b.at.floor()) {
        let edge = run[0].at.floor() as i32;
        let voxel = axis.voxel(coordinates, edge);
        let mut winding = cells.lines.winding(voxel);
        let begin = seen.spots.len();
        for &Crossing { at, change, face, .. } in run {
            let (before, after) = (winding, winding + change);
            winding = after;
            let enters = after >= 1;
            if (before >= 1) == enters {
                continue;
            }
            // What is entered here was left at the last passage.
            if enters && seen.spots[begin..].last().is_some_and(|last| at - last.place < CLOSED) {
                seen.spots.pop();
            } else {
                seen.spots.push(Spot { axis, line: coordinates, place: at, enters, face });
            }
        }
        let slope = |face: u32| {
            let normal = &cells.normals[face as usize];
            normal[axis.index()].abs() / dot(normal, normal).sqrt()
        };
        let passages = &seen.spots[begin..];
        for spot in passages {
            let slope = slope(spot.face);
            let close = run.iter().filter(|crossing| (crossing.at - spot.place).abs() * slope <= CLOSE);
            if close.count() >= BUNDLE {
                let ends = [edge, edge + 1].map(|along| cells.of_voxel(axis.voxel(coordinates, along)));
                ends.into_iter().flatten().for_each(|cell| bundles[cell].store(true, Ordering::Relaxed));
            }
        }
        for crossing in run {
            let slope = slope(crossing.face);
            let shallow = passages.iter().any(|passage| (crossing.at - passage.place).abs() * slope <= THIN);
            faces[crossing.face as usize].fetch_or(if shallow { OPEN } else { BURIED }, Ordering::Relaxed);
        }
        if let (Some(first), Some(last)) = (passages.first(), passages.last()) {
            let distances = [first.place - f64::from(edge), f64::from(edge) + 1.0 - last.place];
            seen.pairs.push(((voxel, axis.index() as u8), distances.map(|value| value as f32)));
        }
    }
}
