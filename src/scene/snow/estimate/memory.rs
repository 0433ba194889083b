//! Bounds of a scene's memory before it is allocated, by which a run is refused. What a run is expected to take is in [`super::peak`].

use crate::error::{Error, Result};
use crate::scene::snow::grain_params::params;
use crate::scene::snow::keys::volumes::Needs;
use crate::scene::snow::{Inputs, has_grains};
use crate::scene::{BaseMode, Layer, Scene};
use crate::snow;
use crate::vdb::file;

/// Bytes for each column of cells of a layer: two surfaces, each across two leaves, and temporary data while they are made.
const BYTES_PER_COLUMN: f64 = 260.0;
/// How many layers the stage base holds: those before and after a frame, and copies and files of whole frames that are written meanwhile.
const LAYERS_OF_BASE: f64 = 4.5;
const LAYERS_OF_CHANGES: f64 = 3.0;
/// Bytes for each triangle that moves: its poses, and its sweep in a frame.
const BYTES_PER_TRIANGLE: f64 = 2000.0;
/// Bytes for each grain besides those of a step: copies of the grains that are written while the next frame is made, their points and files.
const BYTES_PER_GRAIN: u64 = 1000;
/// Bytes for each column of cells in a mesh of the base, and in its files.
const BYTES_PER_MESH_COLUMN: f64 = 500.0;
/// Bytes for each grain: as a point read from a file, and in each kind of volume with its file.
const BYTES_PER_POINT: u64 = 150;
const BYTES_PER_FOG_GRAIN: u64 = 1200;
const BYTES_PER_UNITED_GRAIN: u64 = 700;
/// Bytes that every run takes.
pub(super) const FIXED: f64 = 76e6;

/// Estimates a scene's memory (bytes), without mist, and without grains that come from the snow: their number is known only once the base
/// exists, see [`Forecast`](super::grains::Forecast).
///
/// # Errors
/// A layer file that cannot be read.
pub fn estimate(scene: &Scene, inputs: &Inputs) -> Result<u64> {
    let initial = inputs.initial_grains.as_ref().map_or(0, |initial| initial.positions.len() as u64);
    with_grains(scene, inputs, initial)
}

/// As [`estimate`], with this many grains at one time.
///
/// # Errors
/// As there.
pub(in crate::scene::snow) fn with_grains(scene: &Scene, inputs: &Inputs, grains: u64) -> Result<u64> {
    let layers = if keeps_changes(scene) { LAYERS_OF_CHANGES } else { LAYERS_OF_BASE };
    let base = layer(inputs)? * layers + besides_layers(inputs);
    let volumes = of_volumes(scene, inputs, grains)? as f64;
    let grains = if has_grains(&scene.values) { of_grains(inputs, grains)? as f64 } else { 0.0 };
    let besides = [base, grains, 0.0, volumes].map(|bytes| (bytes - FIXED).max(0.0));
    Ok((FIXED + at_once(scene, besides)) as u64)
}

/// Bytes of the stages base, grains, mist and volumes that are made at the same time, at most: volumes are made beside the stage that comes
/// after the last one that they need.
pub(super) fn at_once(scene: &Scene, [base, grains, mist, volumes]: [f64; 4]) -> f64 {
    let needs = Needs::of(scene.output.volumes, &scene.values);
    let all = match (needs.grains, needs.mist) {
        (_, true) => [base, grains, mist, volumes],
        (true, false) => [base, grains, mist + volumes, 0.0],
        (false, false) => [base, grains + volumes, mist, 0.0],
    };
    all.into_iter().fold(0.0, f64::max)
}

/// Whether only the changes of the base are written.
pub(super) fn keeps_changes(scene: &Scene) -> bool {
    let output = scene.output;
    output.base_restarts() && output.base_mode == BaseMode::Delta
}

/// Estimates the memory (bytes) of the stage volumes with this many grains; 0 without that stage.
///
/// # Errors
/// As [`estimate`].
pub(in crate::scene::snow) fn of_volumes(scene: &Scene, inputs: &Inputs, grains: u64) -> Result<u64> {
    let volumes = scene.output.volumes;
    let needs = Needs::of(volumes, &scene.values);
    let (layer, columns) = (layer(inputs)?, columns(inputs)?);
    let fine = if needs.grains { division(scene, inputs) as f64 } else { 1.0 };
    let base = f64::from(needs.base) * layer
        + f64::from(volumes.fog_base) * 2.0 * layer
        + f64::from(volumes.snow) * layer * fine * fine
        + f64::from(volumes.mesh()) * columns * BYTES_PER_MESH_COLUMN;
    let each = u64::from(needs.grains) * BYTES_PER_POINT
        + u64::from(volumes.fog_grains) * BYTES_PER_FOG_GRAIN
        + u64::from(needs.grains && volumes.snow) * BYTES_PER_UNITED_GRAIN;
    let has_volumes = needs.base || needs.grains;
    Ok(if has_volumes { (base + FIXED) as u64 + grains * each } else { 0 })
}

/// Voxels of the united surface along the edge of a cell.
pub(in crate::scene::snow) fn division(scene: &Scene, inputs: &Inputs) -> usize {
    let cell = inputs.snow.cell;
    snow::render_volumes::united::division(cell, params(scene, cell).radius)
}

/// Estimates the memory (bytes) of the stage grains with this many grains: it holds the base before and after a frame, and passes copies of
/// the grains to the writer.
///
/// # Errors
/// As [`estimate`].
pub(in crate::scene::snow) fn of_grains(inputs: &Inputs, grains: u64) -> Result<u64> {
    Ok((2.0 * layer(inputs)? + besides_layers(inputs)) as u64
        + snow::grains::memory(grains as usize)
        + grains * BYTES_PER_GRAIN)
}

/// Bytes of a run besides its layers.
fn besides_layers(inputs: &Inputs) -> f64 {
    let triangles: usize = inputs.bodies.iter().map(|body| body.motion().triangles().len()).sum();
    triangles as f64 * BYTES_PER_TRIANGLE + FIXED
}

/// Count of columns of a layer.
pub(super) fn columns(inputs: &Inputs) -> Result<f64> {
    Ok(layer(inputs)? / BYTES_PER_COLUMN)
}

/// Bytes of a layer.
pub(super) fn layer(inputs: &Inputs) -> Result<f64> {
    Ok(match (&inputs.snow.layer, inputs.area()) {
        (Layer::Grid(path), _) => {
            1.5 * file::describe(path)?.iter().filter_map(|grid| grid.memory).sum::<u64>() as f64
        }
        (_, Some([x0, z0, x1, z1])) => {
            let columns = ((x1 - x0) / inputs.snow.cell + 8.0) * ((z1 - z0) / inputs.snow.cell + 8.0);
            columns * BYTES_PER_COLUMN
        }
        (_, None) => 0.0,
    })
}

/// Refuses a scene that would need more memory than the limit.
///
/// # Errors
/// [`Error::Memory`] names the cell size; or as [`estimate`].
pub fn check(scene: &Scene, inputs: &Inputs, limit: u64) -> Result<()> {
    Error::check_memory(estimate(scene, inputs)?, limit, || format!("cell = {} m", inputs.snow.cell))
}
