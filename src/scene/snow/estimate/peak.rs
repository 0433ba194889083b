//! Forecast of the memory that a run takes at its peak: what each stage was measured to take, with the stages that are made at the same time.
//! The bounds by which a run is refused are apart: [`super::memory`].

use super::memory::{self, at_once, keeps_changes};
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::snow::Inputs;

/// Bytes that every run takes.
const FIXED: f64 = 64e6;
/// How many layers the stage base takes, and if only changes are written; more where most of the layer changes in each frame.
const LAYERS: f64 = 2.5;
const LAYERS_OF_CHANGES: f64 = 2.0;
/// Bytes for each triangle that moves.
const TRIANGLE: f64 = 800.0;
/// Bytes for each grain: in a step 900, copies that wait for the writer, their points and files.
const GRAIN: f64 = 1350.0;
/// Bytes that mist takes however little there is, mostly for the walls around it; and for each of its cells, in a step and while it is written.
const MIST: f64 = 80e6;
const CELL: f64 = 550.0;
/// Share of the bound of volumes that they take.
const VOLUMES: f64 = 0.75;

/// How many grains and cells of mist there are at one time.
pub(in crate::scene::snow) struct Counts {
    /// Grains.
    pub grains: u64,
    /// Cells.
    pub cells: u64,
}

/// Peak of a run's memory (bytes), if one process makes all frames.
///
/// # Errors
/// A layer file that cannot be read.
pub(in crate::scene::snow) fn peak(scene: &Scene, inputs: &Inputs, counts: &Counts) -> Result<u64> {
    let triangles: usize = inputs.bodies.iter().map(|body| body.motion().triangles().len()).sum();
    let (layer, objects) = (memory::layer(inputs)?, triangles as f64 * TRIANGLE);
    let volumes = memory::of_volumes(scene, inputs, counts.grains)? as f64;
    let volumes = VOLUMES * (volumes - memory::FIXED).max(0.0);
    let base = if keeps_changes(scene) { LAYERS_OF_CHANGES } else { LAYERS } * layer + objects;
    let grains = 2.0 * layer + objects + counts.grains as f64 * GRAIN;
    let mist = if counts.cells > 0 { layer + objects + MIST + counts.cells as f64 * CELL } else { 0.0 };
    Ok((FIXED + at_once(scene, [base, grains, mist, volumes])) as u64)
}
