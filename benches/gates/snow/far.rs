//! Gates of scenes far from the origin: the demonstration's walk, moved by whole cells.

use frazil::geometry::DVec3;
use frazil::snow::base_layer::Params;

use crate::harness::Harness;
use crate::scenes::{self, WALK_CELL, context, layer};

/// Cells that the scene is moved by: 1.2 km and 60 km.
const POSITIONS: [i32; 2] = [160_000, 8_000_000];
const FRAMES: i32 = 48;
/// Half the square of snow (m).
const HALF: f64 = 3.6;

/// All of them.
pub fn run(h: &mut Harness) {
    if h.wants("reliability.far_noise") {
        let (snow, removed, walk) = worst(Params::for_cell(WALK_CELL));
        let note =
            "snow left after each frame; the noise is fixed in the world: each place has another part of it";
        h.gate("reliability.far_noise", snow, note);
        let note = "removed in a frame, of those that remove over a litre";
        h.gate("reliability.far_noise_removed", removed, note);
        h.gate("reliability.far_noise_walk", walk, "removed in all");
    }
    if h.wants("reliability.far") {
        let (snow, removed, walk) = worst(scenes::EXACT);
        let worst = snow.max(removed).max(walk);
        let note = format!(
            "{worst:.1e}: snow left and removed, each frame and in all, at 1.2 and 60 km against the origin"
        );
        h.gate("reliability.far", worst, &note);
    }
}

/// Largest relative differences to the walk at the origin: of the snow left, of what a frame removes, and of all removed.
fn worst(params: Params) -> (f64, f64, f64) {
    let near = volumes(0, params);
    let (mut snow, mut removed, mut walk) = (0.0f64, 0.0f64, 0.0f64);
    let sum = |volumes: &[(f64, f64)]| volumes.iter().map(|(_, removed)| removed).sum::<f64>();
    for position in POSITIONS {
        let far = volumes(position, params);
        for (near, far) in near.iter().zip(&far) {
            snow = snow.max((far.0 / near.0 - 1.0).abs());
            if near.1 > 1e-3 {
                removed = removed.max((far.1 / near.1 - 1.0).abs());
            }
        }
        walk = walk.max((sum(&far) / sum(&near) - 1.0).abs());
    }
    (snow, removed, walk)
}

/// Snow left and removed (m3) at each frame of the walk, moved by so many cells in x and z.
fn volumes(cells: i32, params: Params) -> Vec<(f64, f64)> {
    let ctx = context(2);
    let along = f64::from(cells) * WALK_CELL;
    let area = [along - HALF, along - HALF, along + HALF, along + HALF];
    let mut base = layer(&ctx, 0.0, area, 0.3, WALK_CELL, params);
    let bodies = scenes::walkers_at(DVec3::new(along, 0.0, along));
    let step = |frame: i32| {
        let from = f64::from((frame - 1).max(1));
        let report = base.step(&ctx, &bodies, from, f64::from(frame), frame).expect("step");
        (report.base_volume, report.removed_volume)
    };
    (1..=FRAMES).map(step).collect()
}
