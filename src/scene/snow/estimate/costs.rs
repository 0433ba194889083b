//! The time that the frames of each stage take, estimated before they are made, so that a run can show how much is left. The seconds were
//! measured on two cores of an AMD EPYC; another computer may be faster or slower, only the ratios of stages and frames count.

use std::path::Path;

use super::grains::counts;
use super::memory;
use super::mist::cells_in_boxes;
use super::removed::removed_snow;
use crate::context::Context;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::{FrameCosts, ToMake};
use crate::scene::snow::Inputs;
use crate::scene::snow::grain_params::params;
use crate::scene::snow::inspect::object_path::ObjectPath;
use crate::scene::snow::inspect::relief::Relief;
use crate::scene::snow::keys::mist::mist_params;
use crate::scene::snow::keys::volumes::Needs;
use crate::snow::render_volumes::united;

/// A frame of the base: for each column of cells, for each face of a cell on a box around what an object passes of the snow, and for each
/// triangle that moves.
const BASE: f64 = 0.01;
const BASE_COLUMN: f64 = 0.35e-6;
const SWEPT_FACE: f64 = 2.8e-6;
const BASE_TRIANGLE: f64 = 0.5e-6;
/// A frame of grains, and in each sub-step for each grain, and for each that is new.
const GRAINS: f64 = 0.12;
const GRAIN: f64 = 0.27e-6;
const NEW_GRAIN: f64 = 3.0e-6;
/// Number of frames in which a grain is new: later it hardly moves.
const NEW: usize = 5;
/// Grains in a frame if their number is not known, because the heights of the snow are not.
const UNKNOWN_GRAINS: f64 = 30_000.0;
/// A frame before there is mist; a frame of mist, mostly for the walls around it; and for each cell.
const NO_MIST: f64 = 0.01;
const MIST: f64 = 0.6;
const MIST_CELL: f64 = 3.3e-6;
/// A frame of volumes: for each column in a mesh, in a level set of snow and in fog; for each grain, and for each cell of mist.
const VOLUMES: f64 = 0.01;
const MESH_COLUMN: f64 = 2.0e-6;
const SNOW_COLUMN: f64 = 2.0e-6;
const FOG_COLUMN: f64 = 2.0e-6;
const VOLUMES_GRAIN: f64 = 3.0e-6;
const FOG_CELL: f64 = 0.1e-6;
/// A frame of objects: for each triangle.
const OBJECTS: f64 = 0.001;
const OBJECTS_TRIANGLE: f64 = 0.5e-6;

/// What the frames of a scene take, in the stages that a run makes. What is not known of grains and mist is taken from the poses of objects.
///
/// # Errors
/// A frame of an object that cannot be read; a damaged record of the base in the folder; cancel.
pub fn costs(
    ctx: &Context,
    scene: &Scene,
    inputs: &Inputs,
    folder: &Path,
    to_make: &[ToMake],
) -> Result<FrameCosts> {
    let frames = scene.shot.frames.count();
    let makes = |stage: &str| to_make.iter().any(|of_stage| of_stage.stage == stage);
    let needs = Needs::of(scene.output.volumes, &scene.values);
    let [needs_grains, needs_mist] = [("grains", needs.grains), ("mist", needs.mist)]
        .map(|(stage, by_volumes)| makes(stage) || makes("volumes") && by_volumes);
    let needs_paths = makes("base") || needs_grains || needs_mist;
    let paths = if needs_paths { ObjectPath::all(ctx, scene, inputs)? } else { Vec::new() };
    let grains = match needs_grains {
        true => grains_of_frames(ctx, scene, inputs, folder, &paths)?,
        false => vec![0.0; frames],
    };
    let cells = match mist_params(&scene.values).filter(|_| needs_mist) {
        Some(params) => {
            let before = grains.iter().take_while(|count| **count < 1.0).count();
            cells_in_boxes(ctx, scene, &paths, &params, scene.shot.frames.first + before as i32)?
        }
        None => vec![0.0; frames],
    };
    let triangles: usize = inputs.bodies.iter().map(|body| body.motion().triangles().len()).sum();
    let (triangles, columns) = (triangles as f64, memory::columns(inputs)?);
    let mut costs = FrameCosts::new(scene.shot.frames.first);
    let always = BASE + columns * BASE_COLUMN + triangles * BASE_TRIANGLE;
    let swept = swept_faces(scene, &paths, inputs.snow.cell);
    costs.add("base", swept.iter().map(|faces| always + faces * SWEPT_FACE).collect());
    costs.add("objects", vec![OBJECTS + triangles * OBJECTS_TRIANGLE; frames]);
    costs.add("grains", grains_costs(scene, inputs, &paths, &grains));
    let of_mist = |cells: &f64| if *cells > 0.0 { MIST + cells * MIST_CELL } else { NO_MIST };
    costs.add("mist", cells.iter().map(of_mist).collect());
    costs.add("volumes", volumes_costs(scene, inputs, columns, &grains, &cells));
    Ok(costs)
}

/// The count of grains after each frame of the shot.
fn grains_of_frames(
    ctx: &Context,
    scene: &Scene,
    inputs: &Inputs,
    folder: &Path,
    paths: &[ObjectPath],
) -> Result<Vec<f64>> {
    let removed = removed_snow(ctx, scene, inputs, Some(folder), paths, Relief::new(inputs).as_ref())?;
    let mut counts = counts(scene, inputs, &removed).unwrap_or_default();
    let last = counts.last().copied().unwrap_or(UNKNOWN_GRAINS);
    counts.resize(scene.shot.frames.count(), last);
    Ok(counts)
}

/// Count of faces of cells on boxes around what each object passes of the snow in each frame of the shot.
fn swept_faces(scene: &Scene, paths: &[ObjectPath], cell: f64) -> Vec<f64> {
    let mut faces = vec![0.0; scene.shot.frames.count()];
    for path in paths.iter().filter(|path| path.object().role.removes()) {
        let top = path.top_of_snow().unwrap_or(f64::INFINITY);
        let mut before = None;
        for (frame, corners) in path.boxes_near_snow() {
            let [low, high] = corners;
            let [from, to] = before.replace(corners).unwrap_or(corners);
            let (low, mut high) = (low.inf(&from), high.sup(&to));
            high.y = high.y.min(top);
            let size = high - low;
            if size.y > 0.0 {
                let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
                faces[(frame - scene.shot.frames.first) as usize] += area / (cell * cell);
            }
        }
    }
    faces
}

fn grains_costs(scene: &Scene, inputs: &Inputs, paths: &[ObjectPath], grains: &[f64]) -> Vec<f64> {
    let (params, dt) = (params(scene, inputs.snow.cell), 1.0 / scene.shot.fps);
    let cost = |(at, grains_now): (usize, &f64)| {
        let frame = scene.shot.frames.first + at as i32;
        let moved = paths.iter().map(|path| path.step_to(frame).1).fold(0.0, f64::max);
        let new = (grains_now - grains[at.saturating_sub(NEW)]).max(0.0) / NEW as f64;
        GRAINS + params.sub_steps(dt, moved) as f64 * (grains_now * GRAIN + new * NEW_GRAIN)
    };
    grains.iter().enumerate().map(cost).collect()
}

fn volumes_costs(scene: &Scene, inputs: &Inputs, columns: f64, grains: &[f64], cells: &[f64]) -> Vec<f64> {
    let volumes = scene.output.volumes;
    let needs = Needs::of(volumes, &scene.values);
    let cell = inputs.snow.cell;
    let division = if needs.grains { united::division(cell, params(scene, cell).radius) } else { 1 };
    let of_base = columns
        * (f64::from(volumes.mesh()) * MESH_COLUMN
            + f64::from(volumes.snow) * (division * division) as f64 * SNOW_COLUMN
            + f64::from(volumes.fog_base) * FOG_COLUMN);
    let kinds = f64::from(volumes.fog_grains) + f64::from(needs.grains && volumes.snow);
    let of_mist = f64::from(volumes.fog_mist) * FOG_CELL;
    let cost =
        |(grains, cells): (&f64, &f64)| VOLUMES + of_base + grains * kinds * VOLUMES_GRAIN + cells * of_mist;
    grains.iter().zip(cells).map(cost).collect()
}
