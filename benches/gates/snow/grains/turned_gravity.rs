//! Gates of a deep bed under gravity that turns: the angle at which its top slides.
//!
//! A heap has no periodic boundaries. Instead the bed is long, between walls without friction, and only the middle third of
//! its top is measured. The angle of a bed twice as long is printed too: while both agree, the ends do not matter.

use std::collections::HashMap;

use frazil::geometry::DVec3;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::heap::{Pose, Shell};

use crate::snow::grains::{Experiment, FRAME, Random, rectangle, still, walls};

/// Diameter of a grain (m).
const D: f64 = 0.005;
/// Rate at which gravity turns (degrees/s).
const RATE: f64 = 5.0;
/// Counts of lattice sites from which the bed settles to a depth of 20 diameters or slightly more.
const SITES: [u32; 3] = [74, 52, 8];
/// Spacing of the sites, and range of the offsets from them (diameters): enough to leave no layers.
const LOOSE: [f64; 2] = [1.5, 0.5];
/// Thickness of the top (diameters).
const TOP: f64 = 1.5;

pub fn measure() -> [(f64, &'static str); 2] {
    let mut differences = Vec::new();
    for asked in [25.0, 32.0] {
        let angle = slides(asked, SITES);
        println!("# asked {asked} degrees: {angle:.2}");
        differences.push(angle - asked);
    }
    let long = slides(32.0, [2 * SITES[0], SITES[1], SITES[2]]);
    println!("# asked 32 degrees, a bed twice as long: {long:.2}");
    [
        (differences.iter().copied().fold(f64::MAX, f64::min), ""),
        (differences.iter().copied().fold(f64::MIN, f64::max), ""),
    ]
}

/// A floor with bumps of up to half a diameter, on which no layer slides as a whole.
fn rough(length: f64, width: f64, random: &mut Random) -> (Shell, Pose<'static>) {
    let [columns, rows] = [length, width].map(|size| (size / D).ceil() as u32 + 2);
    let vertices = (0..=columns).flat_map(|x| (0..=rows).map(move |z| (x, z)));
    let positions = vertices.map(|(x, z)| {
        let [x, z] =
            [(x, columns), (z, rows)].map(|(at, count)| (f64::from(at) - 0.5 * f64::from(count)) * D);
        DVec3::new(x, -0.5 * D * random.next(), z)
    });
    let positions: Vec<DVec3> = positions.collect();
    let squares = (0..columns).flat_map(|x| (0..rows).map(move |z| x * (rows + 1) + z));
    let halves = squares.flat_map(|at| {
        let [a, b, c, d] = [at, at + 1, at + rows + 2, at + rows + 1];
        [[a, b, c], [a, c, d]]
    });
    still(1.0, halves.collect(), positions)
}

/// Angle (degrees) at which the top has moved by a diameter on average.
fn slides(asked: f64, sites: [u32; 3]) -> f64 {
    let mut bed = Experiment::new(2, D, of_repose(asked, false), 11);
    bed.params.rests = false;
    bed.colliders.floor = None;
    let [length, width] = [sites[0], sites[2]].map(|count| f64::from(count) * LOOSE[0] * D);
    bed.colliders.shells =
        vec![walls(&rectangle(length, width), 100.0 * D), rough(length, width, &mut bed.random)];
    bed.scatter_apart(LOOSE, sites, |_| true);
    bed.steps(48);
    let positions = |bed: &Experiment| -> HashMap<u32, DVec3> {
        bed.heap.ids().iter().copied().zip(bed.heap.positions()).collect()
    };
    let start = positions(&bed);
    let middle: Vec<(u32, DVec3)> =
        start.into_iter().filter(|(_, position)| position.x.abs() < length / 6.0).collect();
    let mut heights: Vec<f64> = middle.iter().map(|(_, position)| position.y).collect();
    heights.sort_by(f64::total_cmp);
    // Not the highest: a single grain may lie on top.
    let surface = heights[heights.len() * 99 / 100] + 0.5 * D;
    let top: Vec<(u32, DVec3)> =
        middle.into_iter().filter(|(_, position)| position.y > surface - TOP * D).collect();
    println!("# {} grains, {:.1} diameters deep, {} in the top", bed.heap.count(), surface / D, top.len());
    let (mut last, mut frame) = (0.0, 0);
    loop {
        frame += 1;
        bed.turn = RATE * FRAME * f64::from(frame);
        bed.step();
        let now = positions(&bed);
        let way = top.iter().map(|(id, position)| now[id].x - position.x).sum::<f64>() / top.len() as f64 / D;
        if frame % 24 == 0 {
            println!("# {:.0} degrees: {way:.3} diameters", bed.turn);
        }
        if way >= 1.0 || bed.turn > 60.0 {
            return bed.turn - RATE * FRAME * (way - 1.0).max(0.0) / (way - last).max(1.0e-9);
        }
        last = way;
    }
}
