//! Gates of a preview: a pile of the same snow from grains of twice the diameter has the same volume and slope.

use std::collections::HashMap;

use frazil::geometry::DVec3;
use frazil::snow::grain_friction::of_repose;

use crate::snow::grains::Experiment;

/// Diameter of the fine grains (m).
const D: f64 = 0.005;
/// How many coarse grains are poured; eight fine ones hold as much snow as one of them.
const COARSE: usize = 2_000;
/// In so many frames, as many again to wait.
const FRAMES: usize = 240;
/// Piles of each size.
const SEEDS: u64 = 3;

pub fn measure() -> [(f64, &'static str); 2] {
    let mean = |diameter: f64, count: usize| {
        let (mut volumes, mut angles) = (0.0, 0.0);
        for seed in 1..=SEEDS {
            let mut pile = Experiment::new(2, diameter, of_repose(32.0, false), seed);
            // The same pour for both.
            pile.pour_through(2.5 * 2.0 * D, count, FRAMES, 48);
            let (volume, angle) = (under(&pile), pile.slope());
            println!("# {count} grains of {} mm: {:.4} l, {angle:.2} degrees", diameter * 1e3, volume * 1e3);
            (volumes, angles) = (volumes + volume, angles + angle);
        }
        [volumes, angles].map(|sum| sum / SEEDS as f64)
    };
    let (fine, coarse) = (mean(D, 8 * COARSE), mean(2.0 * D, COARSE));
    let off = |which: usize| (coarse[which] / fine[which] - 1.0) * 100.0;
    println!("# volume {:+.2} %, angle {:+.2} % with coarse grains", off(0), off(1));
    [(off(0).abs(), ""), (off(1).abs(), "")]
}

/// The volume (m3) between the floor and the tops of the balls, as seen from above.
fn under(pile: &Experiment) -> f64 {
    let (step, radius) = (0.25 * D, pile.params.radius);
    let mut heights = HashMap::<[i32; 2], f64>::new();
    for position in pile.heap.positions() {
        let range = |x: f64| ((x - radius) / step).ceil() as i32..=((x + radius) / step).floor() as i32;
        for (x, z) in range(position.x).flat_map(|x| range(position.z).map(move |z| (x, z))) {
            let off = DVec3::new(f64::from(x) * step - position.x, 0.0, f64::from(z) * step - position.z);
            let square = radius * radius - off.norm_squared();
            if square > 0.0 {
                let height = heights.entry([x, z]).or_insert(0.0);
                *height = height.max(position.y + square.sqrt());
            }
        }
    }
    // In the order of the positions, so that sums do not change from run to run.
    let mut heights: Vec<([i32; 2], f64)> = heights.into_iter().collect();
    heights.sort_unstable_by_key(|(at, _)| *at);
    heights.iter().map(|(_, height)| height).sum::<f64>() * step * step
}
