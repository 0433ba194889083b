//! Skins that fold inside out.
//!
//! Where a pose winds around a point negatively, outward motion only brings the point back to 0: it is not swept, though
//! the surface passed it outward. Swept is what a winding number reaches 1 at some time, so what passes outward near such
//! places is asked, at points of it, what the pose before winds around them, and what passes them earlier in the same
//! step; what comes from below 0 does not count. A point that the first pose winds around negatively starts below 0 in the
//! chain too: what brings it to 0 for the first time counts.

use std::borrow::Cow;
use std::collections::HashSet;

use rayon::prelude::*;

use super::chain::{Face, Window};
use super::lattice::{Fixed, UNITS};
use super::passages::{Change, Passage, Place, Poses, Step, Still, face, place};
use super::region::{Region, each_block, extent};
use super::topology::{Simplex, Topology};
use super::winding::Lines;
use crate::base::DVec3;
use crate::context::Context;
use crate::error::Result;

/// Negative stretches of a line that are shorter than this (cells) are none.
const SHORT: f64 = 1e-3;
/// Triangles or edges that a task handles.
const GRAIN: usize = 4096;
/// Points that a task asks.
const FEW: usize = 64;
/// Clears the bits (see [`super::chain`]) of tetrahedra through which the surface only comes back from inside out.
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
    let first: HashSet<Place> = first_ones(ctx, &poses, early)?.into_iter().collect();
    for place in found.iter().flat_map(|found| &found.places).filter(|place| !first.contains(place)) {
        outward[place.triangle as usize * steps + place.step as usize] &= !(1 << place.part);
    }
    Ok(())
}

/// Where to look for passages that come back from inside out.
enum Folded {
    /// The poses are the first one, moved as a whole, and these triangles are near what it winds around negatively.
    Rigid(Vec<u32>),
    /// The blocks near what each pose winds around negatively.
    Blocks(Vec<HashSet<[i32; 3]>>),
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
        let (asked, window) =
            if rigid { (&levels[..1], &come_from(levels, window)) } else { (levels, window) };
        let blocks: Vec<HashSet<[i32; 3]>> = asked
            .par_iter()
            .map(|level| folded_blocks(ctx, topology, level, window))
            .collect::<Result<_>>()?;
        if blocks.iter().all(HashSet::is_empty) {
            return Ok(None);
        }
        Ok(Some(if rigid {
            Self::Rigid(touching(topology, &levels[0], &blocks[0]))
        } else {
            Self::Blocks(blocks)
        }))
    }

    /// The triangles that may come back in a step, ascending.
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

/// Where what comes into a window is at the first pose.
fn come_from(levels: &[Vec<Fixed>], window: &Window) -> Window {
    let way = |level: &Vec<Fixed>| {
        let ways =
            levels[0].iter().zip(level).map(|(from, to)| [0, 1, 2].map(|axis| from[axis].abs_diff(to[axis])));
        ways.fold([0; 3], |most, way| [0, 1, 2].map(|axis| most[axis].max(way[axis])))
    };
    let most =
        levels.par_iter().map(way).reduce(|| [0; 3], |a, b| [0, 1, 2].map(|axis| a[axis].max(b[axis])));
    let [min, max] = [window.min, window.max];
    Window {
        min: [0, 1, 2].map(|axis| min[axis].saturating_sub_unsigned(most[axis])),
        max: [0, 1, 2].map(|axis| max[axis].saturating_add_unsigned(most[axis])),
    }
}

/// The triangles of a pose that touch these blocks, ascending.
fn touching(topology: &Topology, level: &[Fixed], blocks: &HashSet<[i32; 3]>) -> Vec<u32> {
    if blocks.is_empty() {
        return Vec::new();
    }
    let block = |cells: [f32; 3]| cells.map(|value| (value / 8.0).floor() as i32);
    let touches = |simplex: &Simplex| {
        let (low, high) = extent(&simplex.v.map(|vertex| level[vertex as usize]));
        each_block(block(low), block(high)).any(|block| blocks.contains(&block))
    };
    (0..topology.simplices.len() as u32).filter(|&id| touches(&topology.simplices[id as usize])).collect()
}

/// The blocks in which a pose winds negatively, and those around them.
fn folded_blocks(
    ctx: &Context,
    topology: &Topology,
    level: &[Fixed],
    window: &Window,
) -> Result<HashSet<[i32; 3]>> {
    ctx.check()?;
    let wanted = |face: &Face| {
        let [a, b, c] = face.v;
        let of_corners =
            |pick: fn(i32, i32) -> i32| [0, 1, 2].map(|axis| pick(pick(a[axis], b[axis]), c[axis]));
        window.wants(of_corners(i32::min), of_corners(i32::max))
    };
    let simplices = topology.simplices.par_iter().with_min_len(GRAIN);
    let faces: Vec<Face> = simplices.map(|simplex| face(simplex, level)).filter(wanted).collect();
    let around = |block: [i32; 3]| {
        let [low, high] = [-1, 1].map(|by| block.map(|place| place + by));
        each_block(low, high)
    };
    Ok(negative_blocks(&faces, window).into_iter().flat_map(around).collect())
}

/// Whether all poses are the first one, moved as a whole.
fn is_rigid(topology: &Topology, levels: &[Vec<Fixed>]) -> bool {
    let length = |level: &[Fixed], [i, j]: [u32; 2]| {
        let [a, b] = [i, j].map(|vertex| place(level[vertex as usize]));
        (a - b).norm()
    };
    let keeps_length = |edge: &[u32; 2]| {
        let first = length(&levels[0], *edge);
        levels[1..].iter().all(|level| (length(level, *edge) - first).abs() < 4.0)
    };
    topology.edges.par_iter().with_min_len(GRAIN).all(keeps_length)
}

/// The blocks in which closed faces wind negatively around points on lines through voxels.
fn negative_blocks(faces: &[Face], window: &Window) -> Vec<[i32; 3]> {
    let cells = |p: Fixed| p.map(|value| value.div_euclid(UNITS));
    let Ok(region) = Region::around(faces, 0.0, cells(window.min), cells(window.max)) else {
        return Vec::new();
    };
    let mut out = Vec::new();
    let lines = Lines::scan(faces, &region);
    if lines.least_winding() >= 0 {
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

/// What comes back in a step.
#[derive(Default)]
struct Returns {
    places: Vec<Place>,
    /// Points of them that the first pose winds around negatively, and that may come to 0 for the first time.
    early: Vec<Early>,
}

/// A point of a tetrahedron.
#[derive(Clone, Copy)]
struct Early {
    place: Place,
    at: DVec3,
}

/// The outward passages of some triangles in a step that do not count anywhere.
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
    let (during, first) = (Step::new(poses, step, &points), Still::new(poses, 0, &points));
    let ask = |passage: &Passage| {
        let mut early = Vec::new();
        for at in passage.samples() {
            match during.change(passage.place, &at) {
                Change::Counts => return None,
                Change::Rises if first.winding(&at) < 0 => early.push(Early { place: passage.place, at }),
                Change::Rises | Change::Returns => {}
            }
        }
        Some((passage.place, early))
    };
    let found: Vec<_> = passages.par_iter().with_min_len(FEW).filter_map(ask).collect();
    let places = found.iter().map(|(place, _)| *place).collect();
    Ok(Returns { places, early: found.into_iter().flat_map(|(_, early)| early).collect() })
}

/// Those whose points no earlier step brings to 0.
fn first_ones(ctx: &Context, poses: &Poses<'_>, mut early: Vec<Early>) -> Result<Vec<Place>> {
    let mut first = Vec::new();
    for step in 0..poses.levels.len() - 1 {
        early.retain(|point| {
            let is_now = point.place.step as usize == step;
            first.extend(is_now.then_some(point.place));
            !is_now
        });
        if early.is_empty() {
            break;
        }
        ctx.check()?;
        let points: Vec<DVec3> = early.iter().map(|point| point.at).collect();
        let during = Step::new(poses, step, &points);
        early = early.into_par_iter().with_min_len(FEW).filter(|point| during.is_below(&point.at)).collect();
    }
    Ok(first)
}
