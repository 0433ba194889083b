//! Estimates the disk space of a shot's files.

use super::memory;
use crate::scene::snow::Inputs;
use crate::scene::snow::keys::volumes::Needs;
use crate::scene::snow::stages::grain_files::WHOLE_EVERY;
use crate::scene::{BaseMode, Scene};

/// Bytes of a whole base file for each column of cells; bytes of a frame's changes and removed snow.
const BYTES_PER_COLUMN: f64 = 20.0;
const BYTES_PER_CHANGE: f64 = 4e5;
/// Bytes of a whole base file for each leaf: over 64 columns, the two surfaces cross 3.2 leaves.
const BYTES_PER_LEAF: f64 = BYTES_PER_COLUMN * 64.0 / 3.2;
/// Bytes for each vertex of an object in a USD and a .ply file.
const USD_PER_VERTEX: f64 = 50.0;
const PLY_PER_VERTEX: f64 = 50.0;
/// Bytes of a pair of texture coordinates and of a corner's index of a pair in a USD file, and of a pair in a .ply file.
const USD_PER_POSITION: f64 = 8.0;
const USD_PER_INDEX: f64 = 2.0;
const PLY_PER_POSITION: f64 = 8.0;
/// Bytes of a grain in each kind of file, and in a packed state; the value for files of changes was measured while a character walks.
const GRAIN_VDB: f64 = 49.0;
const GRAIN_CHANGES: f64 = 28.0;
const GRAIN_PLY: f64 = 50.0;
const GRAIN_USD: f64 = 40.0;
const GRAIN_STATE: f64 = 90.0;
/// Bytes of a grain in a fog and in a united surface.
const GRAIN_FOG: f64 = 190.0;
const GRAIN_UNITED: f64 = 60.0;
/// Size of the base as fog, as a fraction of a whole base file.
const FOG_SHARE: f64 = 0.3;
/// Bytes for each column of cells in a mesh of the base.
const MESH_PLY: f64 = 90.0;
const MESH_USD: f64 = 65.0;

/// Estimates the disk space of grains' files and states (bytes), from the count of grains after each frame.
pub(in crate::scene::snow) fn of_grains(scene: &Scene, counts: &[f64]) -> u64 {
    let output = scene.output;
    let vdb = |frame: usize| match output.grains_delta && !frame.is_multiple_of(WHOLE_EVERY as usize) {
        true => GRAIN_CHANGES,
        false => GRAIN_VDB,
    };
    let each = |frame: usize| {
        f64::from(output.grains_vdb) * vdb(frame)
            + f64::from(output.grains_ply) * GRAIN_PLY
            + f64::from(output.grains_usd) * GRAIN_USD
            + f64::from(output.volumes.fog_grains) * GRAIN_FOG
            + f64::from(output.volumes.snow) * GRAIN_UNITED
    };
    let files: f64 = counts.iter().enumerate().map(|(frame, grains)| grains * each(frame)).sum();
    (files + states_kept(scene, counts) * GRAIN_STATE) as u64
}

/// Sum of the amounts (grains or cells) in the states that are kept, from those after each frame: the last two, here the largest ones, and
/// every Nth.
pub(super) fn states_kept(scene: &Scene, amounts: &[f64]) -> f64 {
    const LAST: f64 = 2.0;
    let every = scene.output.keep_states as usize;
    let kept: f64 = if every == 0 { 0.0 } else { amounts.iter().step_by(every).sum() };
    kept + LAST * amounts.iter().copied().fold(0.0, f64::max)
}

/// Estimates the disk space of all files (bytes) except those of grains.
pub fn estimate(scene: &Scene, inputs: &Inputs) -> u64 {
    let (output, frames) = (scene.output, scene.shot.frames.count() as f64);
    let whole = whole_base(inputs) * if output.half { 0.6 } else { 1.0 };
    let base = match (output.base, output.base_mode) {
        (false, _) => 0.0,
        (true, BaseMode::Full) => whole * frames,
        (true, BaseMode::Delta) => whole,
    };
    let objects = inputs.bodies.iter().map(|body| {
        let drawn = body.motion().drawn();
        let vertices = drawn.vertices as f64;
        let (positions, corners) = drawn.uvs.map_or((0.0, 0.0), |uvs| {
            (uvs.coordinates.len() as f64, uvs.corners.as_ref().map_or(0.0, |corners| corners.len() as f64))
        });
        let usd = vertices * USD_PER_VERTEX + positions * USD_PER_POSITION + corners * USD_PER_INDEX;
        let ply = vertices * PLY_PER_VERTEX + positions.max(corners) * PLY_PER_POSITION;
        f64::from(output.objects_usd) * usd + f64::from(output.objects_ply) * ply
    });
    let objects = objects.sum::<f64>() * frames;
    (base + objects + frames * (BYTES_PER_CHANGE + of_volumes(scene, inputs))) as u64
}

/// Bytes of a frame's volumes and meshes of the base.
fn of_volumes(scene: &Scene, inputs: &Inputs) -> f64 {
    let (volumes, whole) = (scene.output.volumes, whole_base(inputs));
    let columns = whole / BYTES_PER_COLUMN;
    let is_fine = Needs::of(volumes, &scene.values).grains;
    let fine = if is_fine { memory::division(scene, inputs) as f64 } else { 1.0 };
    f64::from(volumes.fog_base) * whole * FOG_SHARE
        + f64::from(volumes.snow) * whole * fine * fine
        + f64::from(volumes.mesh_ply) * columns * MESH_PLY
        + f64::from(volumes.mesh_usd) * columns * MESH_USD
}

/// Bytes of a whole base file: by its columns, or by the leaves of a layer given as a level set.
fn whole_base(inputs: &Inputs) -> f64 {
    match (inputs.given(), inputs.area()) {
        (Some(grid), _) => grid.leaf_count() as f64 * BYTES_PER_LEAF,
        (None, Some([x0, z0, x1, z1])) => (x1 - x0) * (z1 - z0) / inputs.snow.cell.powi(2) * BYTES_PER_COLUMN,
        (None, None) => 0.0,
    }
}
