//! Forecast of the memory and disk space of mist. The cost of a cell of air is known; how far mist spreads is not, until it is made. So the
//! count of cells is taken from the mist that a folder already holds, even if only of the shot's first frames or of coarser cells; without
//! any, it is a rough estimate: the cells that fill the boxes of all objects, along their paths while mist lasts.

use std::collections::HashMap;

use serde::Serialize;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::scene::Scene;
use crate::scene::run::DoneFrames;
use crate::scene::snow::inspect::object_path::ObjectPath;
use crate::scene::snow::keys::mist::mist_params;
use crate::snow::mist::{self, MIN_DENSITY, Params};
use crate::vdb::file;

/// Cells along the edge of a tile, and in a tile. Air is computed in whole tiles, plus one more layer around those that hold mist.
const EDGE: f64 = 8.0;
const CELLS: u64 = 512;
/// Bytes of a cell while a frame is written and the next one made: a copy of velocity, pressure and density with their neighbours (40);
/// density and velocity as blocks, as grids and as a file (16 each).
const WRITING: u64 = 40 + 3 * 16;
/// Bytes of a cell in mist/ (density and velocity), and in fog/: 32-bit floats, which hardly compress.
const IN_MIST: u64 = 16;
const IN_FOG: u64 = 4;
/// Bytes of a cell in an exact state, and number of states kept.
const IN_STATE: u64 = 40;
const STATES: u64 = 2;
/// Maximum cubes counted in a box: larger boxes are counted in larger cubes.
const COUNTED: f64 = 4096.0;
/// Maximum moments of a shot at which boxes are counted: in longer shots several frames count as one.
const MOMENTS: usize = 512;

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
    /// The last frame of existing mist, if the count of cells is from that; `None`: it is from the objects' boxes.
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
        courses: &[ObjectPath],
        stored: Option<&DoneFrames>,
    ) -> Result<Option<Self>> {
        let Some(params) = mist_params(&scene.values) else { return Ok(None) };
        let last = scene.shot.frames.last;
        let made = stored.map(|stored| made(stored, params.cell, last)).transpose()?.flatten();
        // The maximum number of cells at one time, and the sum over all frames.
        let (most, all) = match made {
            Some((_, cells)) => (cells, cells * scene.shot.frames.count() as f64),
            None => {
                let of_frames = in_boxes(ctx, scene, courses, &params)?;
                (of_frames.iter().copied().fold(0.0, f64::max), of_frames.iter().sum())
            }
        };
        let output = scene.output;
        let in_mist = if output.mist { IN_MIST } else { 0 };
        let in_fog = if output.volumes.fog_mist { IN_FOG } else { 0 };
        let [step, in_files] = [mist::memory(1) / CELLS, in_mist + in_fog];
        let cells = most.ceil() as u64;
        Ok(Some(Self {
            cell_m: params.cell,
            step_bytes_per_cell: step,
            memory_bytes_per_cell: step + WRITING,
            disk_bytes_per_cell: in_files,
            made_to_frame: made.map(|(frame, _)| frame),
            cells,
            air_m3: most * params.cell.powi(3),
            memory_bytes: cells.saturating_mul(step + WRITING),
            disk_bytes: ((all * in_files as f64) as u64)
                .saturating_add(cells.saturating_mul(STATES * IN_STATE)),
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

    /// The maximum cells of a step under a memory limit (bytes).
    pub fn most_cells(&self, limit: u64) -> u64 {
        limit / self.step_bytes_per_cell
    }
}

/// A length rounded to three significant digits.
fn rounded(length: f64) -> f64 {
    format!("{length:.2e}").parse().unwrap_or(length)
}

/// The last frame of existing mist, up to `last`, and the maximum cells of its frames, converted to cells of an edge `cell` (m); `None` if
/// no mist was raised yet, or no file is left that states the size of its cells.
fn made(stored: &DoneFrames, cell: f64, last: i32) -> Result<Option<(i32, f64)>> {
    let (mut end, mut counts) = (None, Vec::new());
    for frame in stored.frames().filter(|frame| *frame <= last) {
        let report = stored.report(frame)?;
        counts.extend(report.as_ref().and_then(|report| report.get("cells")?.as_f64()));
        end = Some(frame);
    }
    let most = counts.iter().copied().fold(0.0, f64::max);
    // No frame is left in which it might be raised.
    if most == 0.0 && end == Some(last) && !counts.is_empty() {
        return Ok(Some((last, 0.0)));
    }
    let Some((end, (frame, _))) = end.zip(stored.files("mist").pop()).filter(|_| most > 0.0) else {
        return Ok(None);
    };
    // A run with --preview has larger cells.
    let grids = file::describe(&stored.file(frame, "mist")?)?;
    let factor = grids.first().map_or(1.0, |grid| grid.voxel / cell);
    Ok(Some((end, most * factor.powi(3))))
}

/// The cells at each frame, if mist fills the boxes of all objects that push grains near the snow, from then until it has dissipated, and
/// drifts with a uniform wind.
fn in_boxes(ctx: &Context, scene: &Scene, courses: &[ObjectPath], params: &Params) -> Result<Vec<f64>> {
    let (frames, fps) = (scene.shot.frames, scene.shot.fps);
    let count = frames.count();
    let each = count.div_ceil(MOMENTS).max(1);
    // From full density to the density that counts as none.
    let lasts = params.half_life * libm::log2(1.0 / f64::from(MIN_DENSITY)) * fps;
    let lasts = (lasts.ceil() as usize).min(count);
    let tile = EDGE * params.cell;
    let of_air = |(frame, [low, high]): (i32, [DVec3; 2])| {
        // In the frame of reference of the air.
        let drift = DVec3::from(params.wind) * (f64::from(frame) / fps);
        let margin = DVec3::repeat(tile);
        ((frame - frames.first) as usize / each, [low - margin - drift, high + margin - drift])
    };
    let of_course = |course: &ObjectPath| joined(course.passing().map(of_air));
    let mut boxes: Vec<(usize, [DVec3; 2])> = courses.iter().flat_map(of_course).collect();
    boxes.sort_by_key(|(at, _)| *at);
    let tiles = |[low, high]: &[DVec3; 2]| (high - low).iter().map(|side| side / tile).product::<f64>();
    let largest = boxes.iter().map(|(_, corners)| tiles(corners)).fold(0.0, f64::max);
    let wide = libm::cbrt(largest / COUNTED).ceil().max(1.0);
    let cubes = filled(ctx, &boxes, tile * wide, [count, lasts].map(|frames| frames.div_ceil(each)))?;
    let cells = CELLS as f64 * wide.powi(3);
    Ok((0..count).map(|at| cubes[at / each] as f64 * cells).collect())
}

/// The boxes of an object (m, ascending by moment), those of a moment united.
fn joined(boxes: impl Iterator<Item = (usize, [DVec3; 2])>) -> Vec<(usize, [DVec3; 2])> {
    let mut all: Vec<(usize, [DVec3; 2])> = Vec::new();
    for (at, [low, high]) in boxes {
        match all.last_mut() {
            Some((moment, corners)) if *moment == at => {
                *corners = [corners[0].inf(&low), corners[1].sup(&high)];
            }
            _ => all.push((at, [low, high])),
        }
    }
    all
}

/// Number of cubes of an edge (m) that are filled at each of `count` moments: those in any box (m, ascending by moment) of that moment or
/// of the `lasts` moments before it.
fn filled(
    ctx: &Context,
    boxes: &[(usize, [DVec3; 2])],
    edge: f64,
    [count, lasts]: [usize; 2],
) -> Result<Vec<i64>> {
    // The moment when each was last in a box, and the change in their number at each moment.
    let mut latest: HashMap<[i32; 3], usize> = HashMap::new();
    let mut more = vec![0i64; count];
    for (at, [low, high]) in boxes {
        ctx.check()?;
        let [first, last] =
            [low, high].map(|corner| [0, 1, 2].map(|axis| (corner[axis] / edge).floor() as i32));
        let on = move |axis: usize| first[axis]..=last[axis];
        for cube in on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| [x, y, z]))) {
            let before = latest.insert(cube, *at);
            if before.is_some_and(|before| *at <= before + lasts) {
                continue;
            }
            more[*at] += 1;
            if let Some(before) = before {
                more[before + lasts + 1] -= 1;
            }
        }
    }
    for before in latest.into_values() {
        if let Some(more) = more.get_mut(before + lasts + 1) {
            *more -= 1;
        }
    }
    (1..count).for_each(|at| more[at] += more[at - 1]);
    Ok(more)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;

    #[test]
    fn boxes_of_a_moment_are_one_around_them() {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let at = |moment: usize, x: f64| (moment, [corner(x, -x), corner(x + 1.0, 1.0 - x)]);
        let one = joined([at(0, 0.0), at(0, 2.0), at(0, 1.0), at(1, 3.0), at(3, 4.0)].into_iter());
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
        let filled =
            |boxes: &[(usize, [DVec3; 2])], lasts: usize| filled(&ctx, boxes, 1.0, [8, lasts]).unwrap();
        // Two cubes at once, for that frame and two more.
        assert_eq!(filled(&[at(1, 0.0)], 2), [0, 2, 2, 2, 0, 0, 0, 0]);
        // A box that moves by one cube a frame, and one that comes back after, or before, its cubes are empty again.
        assert_eq!(filled(&[at(0, 0.0), at(1, 1.0), at(2, 2.0)], 1), [2, 3, 3, 2, 0, 0, 0, 0]);
        assert_eq!(filled(&[at(0, 0.0), at(5, 0.0)], 2), [2, 2, 2, 0, 0, 2, 2, 2]);
        assert_eq!(filled(&[at(0, 0.0), at(3, 0.0)], 2), [2, 2, 2, 2, 2, 2, 0, 0]);
        assert_eq!(filled(&[at(0, 0.0), at(0, 0.0), at(2, 0.0)], 8), [2; 8]);
    }
}
