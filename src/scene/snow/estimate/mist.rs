//! Forecast of the memory and disk space of mist. The cost of a cell of air is known, but not how far mist will spread. So the count of
//! cells is taken from mist that the output folder already holds, even if only of the shot's first frames or of coarser cells. Without any
//! it is a rough estimate: the cells in the bounding boxes of all objects along their paths, as high as grains as fast as the object's
//! fastest vertex could be thrown above the snow, for as long as mist lasts.

use std::collections::HashMap;

use serde::Serialize;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::scene::Scene;
use crate::scene::run::DoneFrames;
use crate::scene::snow::estimate::disk::states_kept;
use crate::scene::snow::inspect::object_path::ObjectPath;
use crate::scene::snow::keys::mist::mist_params;
use crate::snow::mist::{self, MIN_DENSITY, Params};
use crate::vdb::file;

/// Cells along the edge of a tile, and in a tile. Air is simulated in whole tiles: those that hold mist and one layer around them.
const EDGE: f64 = 8.0;
const CELLS: u64 = 512;
/// Bytes of a cell while a frame is written and the next one made: copies of velocity, pressure and density with their neighbours (40);
/// density and velocity as blocks, as grids and as a file (16 each), for up to three frames; and what the heap keeps of freed memory (170).
const BYTES_WRITING: u64 = 40 + 3 * 3 * 16 + 170;
/// Bytes of a cell in mist/ (density and velocity) in 32 and in 16 bits, and in fog/, in 32 bits: they hardly compress.
const BYTES_IN_MIST: u64 = 16;
const BYTES_IN_HALF_MIST: u64 = 8;
const BYTES_IN_FOG: u64 = 4;
/// Bytes of a cell in an exact state.
const BYTES_IN_STATE: u64 = 40;
/// Maximum count of cubes (of one tile) in a box: for larger boxes the cubes are larger.
const MAX_CUBES: f64 = 4096.0;
/// Maximum count of intervals that a shot is divided into: in longer shots an interval has several frames.
const MAX_INTERVALS: usize = 512;

/// Estimated memory and disk of the mist stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MistForecast {
    /// Edge of a cell of air (m).
    pub cell_m: f64,
    /// Memory that a step reserves for each cell (bytes): a step that would need more than the limit is refused.
    pub step_bytes_per_cell: u64,
    /// Memory of the run for each cell (bytes), including data being written.
    pub memory_bytes_per_cell: u64,
    /// Maximum disk space of each cell in the files of a frame (bytes).
    pub disk_bytes_per_cell: u64,
    /// The last frame of existing mist, if the count of cells comes from it; `None` if it comes from the objects' boxes.
    pub made_to_frame: Option<i32>,
    /// Maximum cells at one time.
    pub cells: u64,
    /// Their volume (m3).
    pub air_m3: f64,
    /// Memory of that many cells (bytes), besides the base layer and the grains.
    pub memory_bytes: u64,
    /// Maximum disk space of all frames and states with that many cells (bytes).
    pub disk_bytes: u64,
}

impl MistForecast {
    /// Forecast for a scene with these objects, from the mist in a folder if there is some. `None` for a scene without mist.
    ///
    /// # Errors
    /// A damaged report or file of that mist; cancel.
    pub(in crate::scene::snow) fn of(
        ctx: &Context,
        scene: &Scene,
        paths: &[ObjectPath],
        stored: Option<&DoneFrames>,
    ) -> Result<Option<Self>> {
        let Some(params) = mist_params(&scene.values) else { return Ok(None) };
        let last = scene.shot.frames.last;
        let existing = stored.map(|stored| existing_cells(stored, params.cell, last)).transpose()?.flatten();
        let of_frames = match existing {
            Some((_, cells)) => vec![cells; scene.shot.frames.count()],
            None => cells_in_boxes(ctx, scene, paths, &params, scene.shot.frames.first)?,
        };
        // The maximum number of cells at one time, and the sum over all frames.
        let (max, total) = (of_frames.iter().copied().fold(0.0, f64::max), of_frames.iter().sum::<f64>());
        let output = scene.output;
        let in_mist = match (output.mist, output.mist_half) {
            (false, _) => 0,
            (true, true) => BYTES_IN_HALF_MIST,
            (true, false) => BYTES_IN_MIST,
        };
        let in_fog = if output.volumes.fog_mist { BYTES_IN_FOG } else { 0 };
        let [step, in_files] = [mist::memory(1) / CELLS, in_mist + in_fog];
        let cells = max.ceil() as u64;
        Ok(Some(Self {
            cell_m: params.cell,
            step_bytes_per_cell: step,
            memory_bytes_per_cell: step + BYTES_WRITING,
            disk_bytes_per_cell: in_files,
            made_to_frame: existing.map(|(frame, _)| frame),
            cells,
            air_m3: max * params.cell.powi(3),
            memory_bytes: cells.saturating_mul(step + BYTES_WRITING),
            disk_bytes: ((total * in_files as f64) as u64)
                .saturating_add((states_kept(scene, &of_frames) * BYTES_IN_STATE as f64) as u64),
        }))
    }

    /// Fails if that many cells would need more memory than a limit (bytes).
    ///
    /// # Errors
    /// [`Error::Memory`] names the count of cells and its origin.
    pub fn check(&self, limit: u64) -> Result<()> {
        let from = match self.made_to_frame {
            Some(frame) => format!("as many as it had up to frame {frame}"),
            None => "as many as fill the boxes that objects pass".to_string(),
        };
        Error::check_memory(self.memory_bytes, limit, || {
            format!("mist of {} cells of {} m, {from},", self.cells, rounded(self.cell_m))
        })
    }

    /// The maximum count of cells of a step within a memory limit (bytes).
    pub fn max_cells(&self, limit: u64) -> u64 {
        limit / self.step_bytes_per_cell
    }
}

/// A length rounded to three significant digits.
fn rounded(length: f64) -> f64 {
    format!("{length:.2e}").parse().unwrap_or(length)
}

/// The last frame, up to `last`, of existing mist, and the maximum count of cells in a frame, converted to cells of an edge `cell` (m).
/// `None` if there was no mist yet, or if no file is left that gives the size of its cells.
fn existing_cells(stored: &DoneFrames, cell: f64, last: i32) -> Result<Option<(i32, f64)>> {
    let (mut end, mut counts) = (None, Vec::new());
    for frame in stored.frames().filter(|frame| *frame <= last) {
        let report = stored.report(frame)?;
        counts.extend(report.as_ref().and_then(|report| report.get("cells")?.as_f64()));
        end = Some(frame);
    }
    let max = counts.iter().copied().fold(0.0, f64::max);
    // The whole shot is done, and has no mist.
    if max == 0.0 && end == Some(last) && !counts.is_empty() {
        return Ok(Some((last, 0.0)));
    }
    let Some((end, (frame, _))) = end.zip(stored.files("mist").pop()).filter(|_| max > 0.0) else {
        return Ok(None);
    };
    // A run with --preview has larger cells.
    let grids = file::describe(&stored.file(frame, "mist")?)?;
    let factor = grids.first().map_or(1.0, |grid| grid.voxel / cell);
    Ok(Some((end, max * factor.powi(3))))
}

/// Count of cells at each frame, if mist fills the boxes of all objects that push grains near the snow from a frame on, lasts until it has
/// dissipated, and drifts with a uniform wind.
pub(in crate::scene::snow) fn cells_in_boxes(
    ctx: &Context,
    scene: &Scene,
    paths: &[ObjectPath],
    params: &Params,
    from: i32,
) -> Result<Vec<f64>> {
    let (frames, fps) = (scene.shot.frames, scene.shot.fps);
    let count = frames.count();
    let interval_length = count.div_ceil(MAX_INTERVALS).max(1);
    // The time from full density to one that is negligible.
    let lifetime = params.half_life * libm::log2(1.0 / f64::from(MIN_DENSITY)) * fps;
    let lifetime = (lifetime.ceil() as usize).min(count);
    let tile = EDGE * params.cell;
    let gravity: f64 = scene.values.table("grains").get("gravity");
    let interval_box = |(frame, [low, high]): (i32, [DVec3; 2])| {
        // In a frame of reference that drifts with the wind.
        let drift = DVec3::from(params.wind) * (f64::from(frame) / fps);
        let margin = DVec3::repeat(tile);
        ((frame - frames.first) as usize / interval_length, [low - margin - drift, high + margin - drift])
    };
    let boxes_of = |path: &ObjectPath| {
        let in_reach = |(frame, [low, mut high]): (i32, [DVec3; 2])| {
            let fastest = path.step_to(frame).1 * fps;
            if let Some(top) = path.top_of_snow().filter(|_| gravity < 0.0) {
                high.y = high.y.min(top - fastest * fastest / (2.0 * gravity));
            }
            (frame >= from && low.y <= high.y).then_some((frame, [low, high]))
        };
        united(path.boxes_near_snow().filter_map(in_reach).map(interval_box))
    };
    let pushing = paths.iter().filter(|path| path.object().role.pushes());
    let mut boxes: Vec<(usize, [DVec3; 2])> = pushing.flat_map(boxes_of).collect();
    boxes.sort_by_key(|(at, _)| *at);
    let tiles = |[low, high]: &[DVec3; 2]| (high - low).iter().map(|side| side / tile).product::<f64>();
    let largest = boxes.iter().map(|(_, corners)| tiles(corners)).fold(0.0, f64::max);
    let coarsening = libm::cbrt(largest / MAX_CUBES).ceil().max(1.0);
    let cubes = filled_cubes(
        ctx,
        &boxes,
        tile * coarsening,
        [count, lifetime].map(|frames| frames.div_ceil(interval_length)),
    )?;
    let cells = CELLS as f64 * coarsening.powi(3);
    Ok((0..count).map(|at| cubes[at / interval_length] as f64 * cells).collect())
}

/// The boxes of an object (m, ascending by interval), united to one in each interval.
fn united(boxes: impl Iterator<Item = (usize, [DVec3; 2])>) -> Vec<(usize, [DVec3; 2])> {
    let mut all: Vec<(usize, [DVec3; 2])> = Vec::new();
    for (at, [low, high]) in boxes {
        match all.last_mut() {
            Some((interval, corners)) if *interval == at => {
                *corners = [corners[0].inf(&low), corners[1].sup(&high)];
            }
            _ => all.push((at, [low, high])),
        }
    }
    all
}

/// Number of cubes with an edge of `edge` (m) that are filled in each of `count` intervals: those in any box (m, ascending by interval) of
/// that interval or of the `lifetime` intervals before it.
fn filled_cubes(
    ctx: &Context,
    boxes: &[(usize, [DVec3; 2])],
    edge: f64,
    [count, lifetime]: [usize; 2],
) -> Result<Vec<i64>> {
    // The last interval in which each cube was in a box, and the change of their number in each interval.
    let mut latest: HashMap<[i32; 3], usize> = HashMap::new();
    let mut change = vec![0i64; count];
    for (at, [low, high]) in boxes {
        ctx.check()?;
        let [first, last] =
            [low, high].map(|corner| [0, 1, 2].map(|axis| (corner[axis] / edge).floor() as i32));
        let on = move |axis: usize| first[axis]..=last[axis];
        for cube in on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| [x, y, z]))) {
            let before = latest.insert(cube, *at);
            if before.is_some_and(|before| *at <= before + lifetime) {
                continue;
            }
            change[*at] += 1;
            if let Some(before) = before {
                change[before + lifetime + 1] -= 1;
            }
        }
    }
    for before in latest.into_values() {
        if let Some(change) = change.get_mut(before + lifetime + 1) {
            *change -= 1;
        }
    }
    (1..count).for_each(|at| change[at] += change[at - 1]);
    Ok(change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;

    #[test]
    fn boxes_of_a_moment_are_one_around_them() {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let at = |interval: usize, x: f64| (interval, [corner(x, -x), corner(x + 1.0, 1.0 - x)]);
        let one = united([at(0, 0.0), at(0, 2.0), at(0, 1.0), at(1, 3.0), at(3, 4.0)].into_iter());
        let around = (0, [corner(0.0, -2.0), corner(3.0, 1.0)]);
        assert_eq!(one, [around, at(1, 3.0), at(3, 4.0)]);
    }

    #[test]
    fn a_length_has_three_digits() {
        assert_eq!([0.04 / 3.0, 0.03, 0.1 * 3.0, 1234.5].map(rounded), [0.0133, 0.03, 0.3, 1230.0]);
    }

    #[test]
    fn cubes_are_filled_from_when_a_box_is_there_until_mist_is_gone() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let at = |frame: usize, x: f64| (frame, [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.5, 0.5, 0.5)]);
        let filled_cubes = |boxes: &[(usize, [DVec3; 2])], lifetime: usize| {
            filled_cubes(&ctx, boxes, 1.0, [8, lifetime]).unwrap()
        };
        // Two cubes at once, for that frame and two more.
        assert_eq!(filled_cubes(&[at(1, 0.0)], 2), [0, 2, 2, 2, 0, 0, 0, 0]);
        // A box that moves by one cube a frame, and one that comes back after, or before, its cubes are empty again.
        assert_eq!(filled_cubes(&[at(0, 0.0), at(1, 1.0), at(2, 2.0)], 1), [2, 3, 3, 2, 0, 0, 0, 0]);
        assert_eq!(filled_cubes(&[at(0, 0.0), at(5, 0.0)], 2), [2, 2, 2, 0, 0, 2, 2, 2]);
        assert_eq!(filled_cubes(&[at(0, 0.0), at(3, 0.0)], 2), [2, 2, 2, 2, 2, 2, 0, 0]);
        assert_eq!(filled_cubes(&[at(0, 0.0), at(0, 0.0), at(2, 0.0)], 8), [2; 8]);
    }
}
