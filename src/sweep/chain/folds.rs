//! Self-inverting surfaces in a sweep.
//!
//! A point is swept when its winding number reaches 1 at some time. Where the winding number of a pose is negative, because the surface is
//! inside out, outward motion only brings it back to 0: the point is not swept, although the surface passed it outward. Near such positions
//! each outward passage is therefore tested at sample points: the winding number of the pose before, plus the passages earlier in the same
//! step, must not be negative, or the passage does not count. Where the first pose has a negative winding number, the chain also starts
//! below 0: the passage that first brings it to 0 counts.

use std::borrow::Cow;
use std::collections::HashSet;

use rayon::prelude::*;

use crate::context::Context;
use crate::distance::Face;
use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::region::{Region, extent};
use crate::distance::winding::Lines;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::geometry::coords::{around, between};
use crate::sweep::moving_mesh::passages::{
    Change, Passage, PassageId, Poses, PreparedPose, PreparedStep, face, to_f64,
};
use crate::sweep::moving_mesh::topology::{Simplex, Topology};
use crate::sweep::window::Window;

/// Intervals of negative winding number on a line that are shorter than this (cells) are ignored.
const SHORT: f64 = 1e-3;
/// Triangles or edges per task.
const GRAIN: usize = 4096;
/// Passages or points per task.
const FEW: usize = 64;

/// Some blocks.
type Blocks = HashSet<[i32; 3]>;

/// Clears the bits (see [`crate::sweep::chain`]) of tetrahedra in which the surface only returns from being inside out.
///
/// # Errors
/// Cancel.
pub fn drop_returns(
    ctx: &Context,
    topology: &Topology,
    levels: &[Vec<Fixed>],
    window: &Window,
    outward: &mut [u8],
) -> Result<()> {
    let Some(folded) = Folded::find(ctx, topology, levels, window)? else { return Ok(()) };
    let poses = Poses { topology, levels };
    let steps = levels.len() - 1;
    let found: Vec<Returns> = (0..steps)
        .into_par_iter()
        .map(|step| returns(ctx, &poses, step, &folded.triangles(topology, levels, step)))
        .collect::<Result<_>>()?;
    let early: Vec<Early> = found.iter().flat_map(|found| found.early.iter().copied()).collect();
    let first: HashSet<PassageId> = first_rises(ctx, &poses, early)?.into_iter().collect();
    for id in found.iter().flat_map(|found| &found.ids).filter(|id| !first.contains(id)) {
        outward[id.triangle as usize * steps + id.step as usize] &= !(1 << id.part);
    }
    Ok(())
}

/// Where to look for passages that return from being inside out.
enum Folded {
    /// All poses are rigid motions of the first one; the triangles near its negative winding numbers.
    Rigid(Vec<u32>),
    /// For each pose the blocks near negative winding numbers.
    Blocks(Vec<Blocks>),
}

impl Folded {
    /// None when nothing folds.
    fn find(
        ctx: &Context,
        topology: &Topology,
        levels: &[Vec<Fixed>],
        window: &Window,
    ) -> Result<Option<Self>> {
        let rigid = is_rigid(topology, levels);
        let (levels_to_scan, window) =
            if rigid { (&levels[..1], &grown(window, levels)) } else { (levels, window) };
        let blocks: Vec<Blocks> = levels_to_scan
            .par_iter()
            .map(|level| folded_blocks(ctx, topology, level, window))
            .collect::<Result<_>>()?;
        if blocks.iter().all(Blocks::is_empty) {
            return Ok(None);
        }
        Ok(Some(if rigid {
            Self::Rigid(touching(topology, &levels[0], &blocks[0]))
        } else {
            Self::Blocks(blocks)
        }))
    }

    /// The triangles that may return in a step, ascending.
    fn triangles(&self, topology: &Topology, levels: &[Vec<Fixed>], step: usize) -> Cow<'_, [u32]> {
        match self {
            Self::Rigid(triangles) => Cow::Borrowed(triangles),
            Self::Blocks(blocks) => {
                let [mut before, after] =
                    [step, step + 1].map(|level| touching(topology, &levels[level], &blocks[level]));
                before.extend(after);
                before.sort_unstable();
                before.dedup();
                Cow::Owned(before)
            }
        }
    }
}

/// A window grown by the largest displacement from the first pose: vertices that enter the window later are inside the grown one at the
/// first pose.
fn grown(window: &Window, levels: &[Vec<Fixed>]) -> Window {
    let displacement = |level: &Vec<Fixed>| {
        let displacements =
            levels[0].iter().zip(level).map(|(from, to)| [0, 1, 2].map(|axis| from[axis].abs_diff(to[axis])));
        displacements.fold([0; 3], |max, own| [0, 1, 2].map(|axis| max[axis].max(own[axis])))
    };
    let margin = levels
        .par_iter()
        .map(displacement)
        .reduce(|| [0; 3], |a, b| [0, 1, 2].map(|axis| a[axis].max(b[axis])));
    let [min, max] = [window.min, window.max];
    Window {
        min: [0, 1, 2].map(|axis| min[axis].saturating_sub_unsigned(margin[axis])),
        max: [0, 1, 2].map(|axis| max[axis].saturating_add_unsigned(margin[axis])),
    }
}

/// The triangles of a pose that touch these blocks, ascending.
fn touching(topology: &Topology, level: &[Fixed], blocks: &Blocks) -> Vec<u32> {
    if blocks.is_empty() {
        return Vec::new();
    }
    let block = |cells: [f32; 3]| cells.map(|value| (value / 8.0).floor() as i32);
    let touches = |simplex: &Simplex| {
        let (low, high) = extent(&simplex.v.map(|vertex| level[vertex as usize]));
        between(block(low), block(high)).any(|block| blocks.contains(&block))
    };
    (0..topology.simplices.len() as u32).filter(|&id| touches(&topology.simplices[id as usize])).collect()
}

/// The blocks of a pose with negative winding numbers, and those around them.
fn folded_blocks(ctx: &Context, topology: &Topology, level: &[Fixed], window: &Window) -> Result<Blocks> {
    ctx.check()?;
    let wanted = |face: &Face| {
        let [a, b, c] = face.v;
        let of_corners =
            |pick: fn(i32, i32) -> i32| [0, 1, 2].map(|axis| pick(pick(a[axis], b[axis]), c[axis]));
        window.wants(of_corners(i32::min), of_corners(i32::max))
    };
    let simplices = topology.simplices.par_iter().with_min_len(GRAIN);
    let faces: Vec<Face> = simplices.map(|simplex| face(simplex, level)).filter(wanted).collect();
    Ok(negative_blocks(&faces, window).into_iter().flat_map(around).collect())
}

/// Whether all poses are rigid motions of the first one.
fn is_rigid(topology: &Topology, levels: &[Vec<Fixed>]) -> bool {
    let length = |level: &[Fixed], [i, j]: [u32; 2]| {
        let [a, b] = [i, j].map(|vertex| to_f64(level[vertex as usize]));
        (a - b).norm()
    };
    let keeps_length = |edge: &[u32; 2]| {
        let first = length(&levels[0], *edge);
        levels[1..].iter().all(|level| (length(level, *edge) - first).abs() < 4.0)
    };
    topology.edges.par_iter().with_min_len(GRAIN).all(keeps_length)
}

/// The blocks in which the winding number of closed faces is negative on a line through voxels.
fn negative_blocks(faces: &[Face], window: &Window) -> Vec<[i32; 3]> {
    let cells = |p: Fixed| p.map(|value| value.div_euclid(UNITS));
    let Ok(region) = Region::around(faces, 0.0, cells(window.min), cells(window.max)) else {
        return Vec::new();
    };
    let mut out = Vec::new();
    let lines = Lines::scan(faces, &region);
    if lines.min_winding() >= 0 {
        return out;
    }
    lines.each_line(|[x, y], line| {
        let negative = line.windows(2).filter(|pair| pair[0].1 < 0 && pair[1].0 - pair[0].0 > SHORT);
        for pair in negative {
            let [first, last] = [pair[0].0, pair[1].0].map(|z| (z / 8.0).floor() as i32);
            out.extend((first..=last).map(|z| [x >> 3, y >> 3, z]));
        }
    });
    out.dedup();
    out
}

/// The passages of a step that return from being inside out.
#[derive(Default)]
struct Returns {
    ids: Vec<PassageId>,
    /// Their sample points with a negative winding number at the first pose, where the passage may be the first to bring it to 0.
    early: Vec<Early>,
}

/// A sample point of a passage.
#[derive(Clone, Copy)]
struct Early {
    id: PassageId,
    at: DVec3,
}

/// The outward passages of some triangles in a step that count at none of their sample points.
fn returns(ctx: &Context, poses: &Poses<'_>, step: usize, triangles: &[u32]) -> Result<Returns> {
    ctx.check()?;
    let passages: Vec<Passage> = triangles
        .iter()
        .flat_map(|&triangle| poses.passages(step, triangle))
        .filter(|passage| passage.sign > 0)
        .collect();
    if passages.is_empty() {
        return Ok(Returns::default());
    }
    let points: Vec<DVec3> = passages.iter().flat_map(Passage::samples).collect();
    let (during, first) = (PreparedStep::new(poses, step, &points), PreparedPose::new(poses, 0, &points));
    let test = |passage: &Passage| -> Result<Option<(PassageId, Vec<Early>)>> {
        // A point that many faces pass takes a long time.
        ctx.check()?;
        let mut early = Vec::new();
        for at in passage.samples() {
            match during.change(passage.id, &at) {
                Change::Counts => return Ok(None),
                Change::Rises if first.winding(&at) < 0 => early.push(Early { id: passage.id, at }),
                Change::Rises | Change::Returns => {}
            }
        }
        Ok(Some((passage.id, early)))
    };
    let tested = passages.par_iter().with_min_len(FEW).map(test).filter_map(Result::transpose);
    let found: Vec<_> = tested.collect::<Result<_>>()?;
    let ids = found.iter().map(|(id, _)| *id).collect();
    Ok(Returns { ids, early: found.into_iter().flat_map(|(_, early)| early).collect() })
}

/// The passages with a point whose winding number no earlier step brings to 0.
fn first_rises(ctx: &Context, poses: &Poses<'_>, mut early: Vec<Early>) -> Result<Vec<PassageId>> {
    let mut first = Vec::new();
    for step in 0..poses.levels.len() - 1 {
        early.retain(|point| {
            let is_now = point.id.step as usize == step;
            first.extend(is_now.then_some(point.id));
            !is_now
        });
        if early.is_empty() {
            break;
        }
        ctx.check()?;
        let points: Vec<DVec3> = early.iter().map(|point| point.at).collect();
        let during = PreparedStep::new(poses, step, &points);
        early = early.into_par_iter().with_min_len(FEW).filter(|point| during.is_below(&point.at)).collect();
    }
    Ok(first)
}
