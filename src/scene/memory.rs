//! How much memory a scene will need, before any of it is taken.

use super::{Inputs, Layer, Scene};
use crate::error::{Error, Result};
use crate::vdb::file;

/// Bytes for each column of cells: two surfaces, each across two leaves, and as much again for their copies.
const BYTES_PER_COLUMN: f64 = 320.0;
/// Bytes that every run takes.
const FIXED: f64 = 64e6;

/// Estimates a scene's memory (bytes).
///
/// # Errors
/// When the layer's file cannot be read.
pub fn estimate(scene: &Scene, inputs: &Inputs) -> Result<u64> {
    if let Layer::Grid(path) = &scene.snow.layer {
        let loaded: u64 = file::describe(path)?.iter().filter_map(|grid| grid.memory).sum();
        return Ok((loaded as f64 * 2.0 + FIXED) as u64);
    }
    let [x0, z0, x1, z1] = inputs.area().unwrap_or_default();
    let columns = ((x1 - x0) / scene.snow.cell + 8.0) * ((z1 - z0) / scene.snow.cell + 8.0);
    Ok((columns * BYTES_PER_COLUMN + FIXED) as u64)
}

/// Refuses a scene that would need more than it may.
///
/// # Errors
/// [`Error::Memory`] names the cell size; or as [`estimate`].
pub fn check(scene: &Scene, inputs: &Inputs, limit: u64) -> Result<()> {
    let needed = estimate(scene, inputs)?;
    if needed > limit {
        return Err(Error::Memory { what: format!("cell = {} m", scene.snow.cell), needed, limit });
    }
    Ok(())
}
