//! How much memory a scene needs, estimated before anything is allocated.

use super::inputs::Inputs;
use super::{Ground, Layer, Scene};
use crate::base::TriMesh;
use crate::error::{Error, Result};

/// Bytes of a level set under each square cell of its surface: a band of 6 voxels crosses 1.6 blocks of 8 on
/// average, each voxel of them takes 4 bytes and a bit, and a surface that is not level crosses more.
const BYTES_PER_CELL: f64 = 64.0;
/// The layer, the blocks of a step and of its compression and times, and a file while it is written.
const COPIES: f64 = 3.0;
/// Bytes of a moving mesh for each of its triangles: poses, trees, tetrahedra of the sweep.
const BYTES_PER_TRIANGLE: f64 = 400.0;

/// Bytes that a level set of a surface takes.
pub fn shell_bytes(area: f64, cell: f64) -> f64 {
    area / (cell * cell) * BYTES_PER_CELL
}

/// Bytes that a scene needs at most, from the areas of its layer and of what moves through it.
pub fn estimate(scene: &Scene, inputs: &Inputs) -> u64 {
    let cell = scene.snow.cell;
    let layer = COPIES * layer_bytes(scene, inputs);
    let meshes = inputs.meshes().map(|mesh| {
        // A sweep is at most some times as large as what is swept.
        2.0 * shell_bytes(mesh.area(), cell) + BYTES_PER_TRIANGLE * mesh.triangles.len() as f64
    });
    (layer + meshes.sum::<f64>()).min(1.0e18) as u64
}

fn layer_bytes(scene: &Scene, inputs: &Inputs) -> f64 {
    let area = |mesh: &Option<TriMesh>| mesh.as_ref().map_or(0.0, TriMesh::area);
    let ground = match &scene.snow.ground {
        Some(Ground::Plane { area: [x0, z0, x1, z1], .. }) => (x1 - x0) * (z1 - z0),
        _ => area(&inputs.ground),
    };
    let rim = match (&scene.snow.ground, &scene.snow.layer) {
        (Some(Ground::Plane { area: [x0, z0, x1, z1], .. }), Layer::Depth(depth)) => {
            2.0 * (x1 - x0 + z1 - z0) * depth
        }
        _ => 0.0,
    };
    match &scene.snow.layer {
        Layer::Depth(_) => shell_bytes(2.0 * ground + rim, scene.snow.cell),
        Layer::Top(_) => shell_bytes(ground + area(&inputs.top), scene.snow.cell),
        Layer::Grid(_) => inputs.layer.as_ref().map_or(0.0, |grid| grid.memory_bytes() as f64),
    }
}

/// Refuses a scene that needs more than `limit` bytes.
///
/// # Errors
/// `Memory`, with a cell size that would do.
pub(super) fn check(scene: &Scene, inputs: &Inputs, limit: u64) -> Result<()> {
    let needed = estimate(scene, inputs);
    if needed <= limit {
        return Ok(());
    }
    let cell = scene.snow.cell;
    // Memory goes with the inverse square of the cell; two digits are enough for advice.
    let enough = cell * (needed as f64 / limit.max(1) as f64).sqrt() * 1.05;
    let digits = 10f64.powi(1 - enough.log10().floor() as i32);
    let enough = (enough * digits).ceil() / digits;
    let what = format!("{}: `cell` = {cell} in [snow] (`cell` = {enough} would do)", scene.path.display());
    Err(Error::Memory { what, needed, limit })
}
