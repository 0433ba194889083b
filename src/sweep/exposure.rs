//! Where lines through voxels enter and leave the volume: which faces bound it there, and how far a voxel can be from
//! the surface at most.
//!
//! Each line through voxels, along x, y or z, meets the chain's faces in an order that is known exactly; the winding
//! number passes between 0 and 1 at some of them, however many sheets lie close together. Those faces are exposed.
//! Between two neighbouring voxels of opposite sign there is such a place, so both are near it: the level set cannot
//! jump there.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, Ordering};

use rayon::prelude::*;

use super::cells::{Cells, Point, dot, in_front};
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
const STACK: u32 = 96;
/// Faces in a cell from which on a stack is crowded.
const CROWD: usize = 96;
/// How far a crossing on a voxel is moved to the side that it counts for (cells).
const ON_VOXEL: f64 = 1e-7;

/// What lines through voxels see of a chain.
pub struct Exposure {
    /// [`OPEN`] and [`BURIED`], for each face; 0 for one that no line meets.
    pub faces: Vec<u8>,
    /// Where faces are exposed (cells from the base voxel), in the order of faces.
    points: Vec<(u32, [f32; 3])>,
    /// For each pair of neighbour voxels with surface between them, how far the first and the second one are from it.
    pairs: Vec<(Pair, [f32; 2])>,
    /// Whether each cell holds a stack.
    stacks: Vec<bool>,
}

/// A voxel and its neighbour above along an axis.
type Pair = ([i32; 3], u8);

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
    points: Vec<(u32, [f32; 3])>,
    pairs: Vec<(Pair, [f32; 2])>,
}

impl Exposure {
    /// Scans the faces along all lines through the voxels of the cells' blocks.
    pub fn scan(cells: &Cells) -> Self {
        let faces: Vec<AtomicU8> = cells.faces.iter().map(|_| AtomicU8::new(0)).collect();
        let counts: Vec<AtomicU16> = (0..cells.count()).map(|_| AtomicU16::new(0)).collect();
        let (mut points, mut pairs) = (Vec::new(), Vec::new());
        for axis in Axis::ALL {
            let crossings = crossings(cells, axis, &counts);
            let same_line = |a: &Crossing, b: &Crossing| a.line == b.line;
            let walk = |mut seen: Seen, line: &[Crossing]| {
                walk(cells, axis, line, &faces, &mut seen);
                seen
            };
            let parts: Vec<Seen> = crossings.par_chunk_by(same_line).fold(Seen::default, walk).collect();
            for seen in parts {
                points.extend(seen.points);
                pairs.extend(seen.pairs);
            }
        }
        points.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| order(a.1, b.1)));
        pairs.par_sort_unstable_by_key(|(pair, _)| *pair);
        let faces = faces.into_iter().map(AtomicU8::into_inner).collect();
        let counts: Vec<u16> = counts.into_iter().map(AtomicU16::into_inner).collect();
        Self { faces, points, pairs, stacks: stacks(cells, &counts) }
    }

    /// Whether the cell around a voxel holds so many sheets, one behind the other, that only exposed ones are kept.
    pub fn is_stack(&self, cells: &Cells, voxel: [i32; 3]) -> bool {
        cells.of_voxel(voxel).is_some_and(|cell| self.stacks[cell])
    }

    /// Whether a face is exposed on a line through a box (cells).
    pub fn within(&self, face: u32, (low, high): ([f32; 3], [f32; 3])) -> bool {
        let first = self.points.partition_point(|(other, _)| *other < face);
        let mut own = self.points[first..].iter().take_while(|(other, _)| *other == face);
        own.any(|(_, p)| (0..3).all(|a| p[a] >= low[a] - 0.01 && p[a] <= high[a] + 0.01))
    }

    /// Distances (cells) of a voxel, and of its neighbour above along an axis, from the surface between them; none
    /// where no line saw any.
    pub fn between(&self, voxel: [i32; 3], axis: usize) -> Option<[f32; 2]> {
        let key = (voxel, axis as u8);
        self.pairs.binary_search_by_key(&key, |(pair, _)| *pair).ok().map(|index| self.pairs[index].1)
    }
}

/// Which cells hold many sheets one behind the other, from the number of crossings near each.
fn stacks(cells: &Cells, counts: &[u16]) -> Vec<bool> {
    let stacks: Vec<AtomicBool> = counts.iter().map(|_| AtomicBool::new(false)).collect();
    cells.for_each_crowd(CROWD, |cell, voxel| {
        let count = |voxel| cells.of_voxel(voxel).map_or(0, |cell| u32::from(counts[cell]));
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

fn order(a: [f32; 3], b: [f32; 3]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
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
                let normal = &cells.normals[chunk * GRAIN + index];
                each_crossing(face, axis, bounds, |line, at, change| {
                    let at = beside_voxel(at, axis, normal);
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

/// Where a crossing lies that may be on a voxel itself: below or above it, as the symbolic shift of the voxels says.
fn beside_voxel(at: f64, axis: Axis, normal: &Point) -> f64 {
    if at != at.round() {
        return at;
    }
    let voxel_is_above = in_front(0.0, normal) == (normal[axis.index()] > 0.0);
    if voxel_is_above { at - ON_VOXEL } else { at + ON_VOXEL }
}

/// Goes along one line: marks faces, and notes where the winding number passes between 0 and 1.
fn walk(cells: &Cells, axis: Axis, line: &[Crossing], faces: &[AtomicU8], seen: &mut Seen) {
    let coordinates = line[0].line;
    for run in line.chunk_by(|a, b| a.at.floor() == b.at.floor()) {
        let edge = run[0].at.floor() as i32;
        let voxel = axis.voxel(coordinates, edge);
        let mut winding = cells.lines.winding(voxel);
        let mut places: Vec<f64> = Vec::new();
        for crossing in run {
            let after = winding + crossing.change;
            if (winding < 1) != (after < 1) {
                places.push(crossing.at);
                let mut point = axis.voxel(coordinates, 0).map(|value| value as f32);
                point[axis.index()] = crossing.at as f32;
                seen.points.push((crossing.face, point));
            }
            winding = after;
        }
        for crossing in run {
            let normal = &cells.normals[crossing.face as usize];
            let slope = normal[axis.index()].abs() / dot(normal, normal).sqrt();
            let depth = |place: &f64| (crossing.at - place).abs() * slope;
            let shallow = places.iter().any(|place| depth(place) <= THIN);
            faces[crossing.face as usize].fetch_or(if shallow { OPEN } else { BURIED }, Ordering::Relaxed);
        }
        if let (Some(first), Some(last)) = (places.first(), places.last()) {
            let distances = [first - f64::from(edge), f64::from(edge) + 1.0 - last];
            seen.pairs.push(((voxel, axis.index() as u8), distances.map(|value| value as f32)));
        }
    }
}
