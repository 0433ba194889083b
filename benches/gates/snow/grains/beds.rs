//! Gates of a deep bed: sixty layers of grains that settle from the packing in which they are born, between walls.

use frazil::snow::grain_friction::of_repose;

use crate::harness::Harness;
use crate::snow::grains::{Experiment, rectangle, walls};

/// Diameter of a grain (m).
const D: f64 = 0.005;
/// Width of the bed (diameters).
const WIDTH: f64 = 14.0;
/// How much of the bed counts as its end (diameters): the layers that the floor orders, and the uneven top.
const ENDS: [f64; 2] = [3.0, 4.0];

pub fn run(h: &mut Harness) {
    let [overlap, height] = ["snow.grains.bed_overlap", "snow.grains.bed_height"];
    if !h.wants(overlap) && !h.wants(height) {
        return;
    }
    let bed = settled(5);
    let mut overlaps = bed.heap.overlaps();
    overlaps.sort_by(f32::total_cmp);
    h.gate(overlap, f64::from(overlaps[overlaps.len() * 99 / 100]) * 100.0, "");
    if h.wants(height) {
        let missing = [missing(&bed), missing(&settled(6)), missing(&settled(7))];
        let note = format!("mean of three beds: {missing:.3?}");
        h.gate(height, missing.iter().sum::<f64>() / 3.0, &note);
    }
}

fn settled(seed: u64) -> Experiment {
    let mut bed = Experiment::new(2, D, of_repose(32.0, false), seed);
    bed.colliders.shells = vec![walls(&rectangle(WIDTH * D, WIDTH * D), 100.0 * D)];
    bed.scatter([12, 52, 12], |_| true);
    for frame in 0..72 {
        bed.step();
        if frame % 12 == 0 {
            let top = bed.heap.positions().map(|position| position.y).fold(0.0, f64::max) / D;
            println!("# frame {frame}: {top:.1} diameters high, fastest {:.3} m/s", bed.heap.fastest());
        }
    }
    bed
}

/// How much lower (%) the bed between its ends stands than its grains would at the packing of its upper third. That height is
/// the volume of the grains over packing and ground: the packing of the third over that of the whole says it all. Below 0 the lower part is the looser one.
fn missing(bed: &Experiment) -> f64 {
    let heights: Vec<f64> = bed.heap.positions().map(|position| position.y / D).collect();
    let top = heights.iter().copied().fold(0.0, f64::max) + 0.5;
    let [low, high] = [ENDS[0], top - ENDS[1]];
    let packing = |low: f64, high: f64| {
        let filled: f64 = heights.iter().map(|height| below(high - height) - below(low - height)).sum();
        filled / (WIDTH * WIDTH * (high - low))
    };
    for part in 0..6 {
        let at = |part: i32| low + (high - low) * f64::from(part) / 6.0;
        println!(
            "# packing from {:.1} to {:.1}: {:.4}",
            at(part),
            at(part + 1),
            packing(at(part), at(part + 1))
        );
    }
    let (upper, all) = (packing(high - (high - low) / 3.0, high), packing(low, high));
    (1.0 - upper / all) * 100.0
}

/// Volume (cubes of the diameter) of a ball of diameter 1 below a height over its centre.
fn below(height: f64) -> f64 {
    let y = height.clamp(-0.5, 0.5) + 0.5;
    std::f64::consts::PI * y * y * (0.5 - y / 3.0)
}
