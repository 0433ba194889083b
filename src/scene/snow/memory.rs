//! How much memory a scene will need, before any of it is taken.

use super::Inputs;
use crate::error::{Error, Result};
use crate::scene::{BaseMode, Layer, Scene};
use crate::vdb::file;

/// Bytes for each column of cells: two surfaces, each across two leaves, and what making them takes.
const BYTES_PER_COLUMN: f64 = 260.0;
/// Bytes for each triangle that moves: its poses, and what it sweeps in a frame.
const BYTES_PER_TRIANGLE: f64 = 2000.0;
/// Bytes that every run takes.
const FIXED: f64 = 64e6;

/// Estimates a scene's memory (bytes).
///
/// # Errors
/// When the layer's file cannot be read.
pub fn estimate(scene: &Scene, inputs: &Inputs) -> Result<u64> {
    let triangles: usize = inputs.bodies.iter().map(|body| body.motion().triangles().len()).sum();
    let layer = match (&inputs.snow.layer, inputs.area()) {
        (Layer::Grid(path), _) => {
            1.5 * file::describe(path)?.iter().filter_map(|grid| grid.memory).sum::<u64>() as f64
        }
        (_, Some([x0, z0, x1, z1])) => {
            let columns = ((x1 - x0) / inputs.snow.cell + 8.0) * ((z1 - z0) / inputs.snow.cell + 8.0);
            columns * BYTES_PER_COLUMN
        }
        (_, None) => 0.0,
    };
    // Whole frames are written from a copy while the next one is made.
    let output = scene.output;
    let copies = if output.base_restarts() && output.base_mode == BaseMode::Delta { 1.0 } else { 2.0 };
    Ok((layer * copies + triangles as f64 * BYTES_PER_TRIANGLE + FIXED) as u64)
}

/// Refuses a scene that would need more than it may.
///
/// # Errors
/// [`Error::Memory`] names the cell size; or as [`estimate`].
pub fn check(scene: &Scene, inputs: &Inputs, limit: u64) -> Result<()> {
    let needed = estimate(scene, inputs)?;
    if needed > limit {
        return Err(Error::Memory { what: format!("cell = {} m", inputs.snow.cell), needed, limit });
    }
    Ok(())
}
