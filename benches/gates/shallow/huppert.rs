//! Gates of a current of viscous liquid down a slope (Huppert 1982, "Flow and instability of a viscous current down a slope"): its
//! front is at x = (9 A^2 g S t / (4 nu (1 + S^2)^2))^(1/3), A being the area of its section along the slope.

use frazil::Context;

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{
    G, between, depth, dry, even, front, ground, power, ratios, run_until, viscous,
};

/// Slope, and kinematic viscosity (m2/s).
const SLOPE: f64 = 0.5;
const VISCOSITY: f64 = 1.0e-3;
/// A (m2), and the first and last position of the front that is measured (m).
const AREA: f64 = 1.0e-4;
const FIRST: f64 = 0.2;
const LAST: f64 = 0.4;
/// From one position of the front that is measured to the last.
const STEPS: u32 = 12;

pub fn measure() -> [(f64, &'static str); 4] {
    let ctx = context(0);
    let [fine, coarse] = [0.25, 4.0].map(|edge| Current::run(&ctx, edge));
    let exponent = |current: &Current| (power(&current.fronts) - 1.0 / 3.0).abs();
    let off = |current: &Current| {
        let off = |[time, front]: &[f64; 2]| 100.0 * (front / front_at(*time) - 1.0).abs();
        current.fronts.iter().map(off).fold(0.0, f64::max)
    };
    let theory = ratios(FIRST, LAST, 40).map(time_at);
    Plot::log("Viscous current down a slope (Huppert 1982)", "time (s)", "front (m)")
        .line("theory, power 1/3", theory.map(|time| [time, front_at(time)]))
        .points("pipes, cells of a quarter of the depth", fine.fronts.iter().copied())
        .points("pipes, cells of 4 depths", coarse.fronts.iter().copied())
        .write("shallow_huppert");
    let end = time_at(LAST);
    let shape = even(0.0, LAST, 80).map(|x| [x, 1e3 * depth_at(x, end)]);
    Plot::linear("Viscous current down a slope: its depth", "along the slope (m)", "depth (mm)")
        .line("theory", shape.chain([[LAST, 0.0]]))
        .points("pipes, cells of 4 depths", coarse.shape.iter().copied())
        .write("shallow_huppert_shape");
    [
        (exponent(&fine), "off 1/3, cells of a quarter of the depth"),
        (exponent(&coarse), "off 1/3, cells of four times the depth"),
        (off(&fine), "cells of a quarter of the depth"),
        (off(&coarse), "cells of four times the depth"),
    ]
}

/// Theory: the front at a time (s).
fn front_at(time: f64) -> f64 {
    (9.0 * AREA * AREA * G * SLOPE * time / (4.0 * slowed())).cbrt()
}

/// Theory: when the front is at a position (m).
fn time_at(front: f64) -> f64 {
    front.powi(3) * 4.0 * slowed() / (9.0 * AREA * AREA * G * SLOPE)
}

/// Theory: the depth behind the front (m).
fn depth_at(x: f64, time: f64) -> f64 {
    (slowed() * x / (G * SLOPE * time)).sqrt()
}

/// The viscosity that acts on the slope.
fn slowed() -> f64 {
    VISCOSITY * (1.0 + SLOPE * SLOPE).powi(2)
}

/// A current that has run.
struct Current {
    /// Times (s) and positions of the front (m).
    fronts: Vec<[f64; 2]>,
    /// Depths (mm) over positions (m), at the end.
    shape: Vec<[f64; 2]>,
}

impl Current {
    /// Runs on cells of so many depths of the front at its last position.
    fn run(ctx: &Context, edge: f64) -> Self {
        let cell = edge * 1.5 * AREA / LAST;
        let count = (1.1 * LAST / cell) as usize;
        let high = SLOPE * cell * count as f64;
        let solids = ground([count, 1], cell, between(0.0, 1.5 * high), |[x, _]| high - SLOPE * x);
        let mut shallow = dry(ctx, &solids, viscous(VISCOSITY));
        let wide = (0.1 * FIRST / cell).ceil();
        for x in 0..wide as usize {
            let column = shallow.columns().column([x, 0], 0).expect("ground everywhere");
            shallow.pour(column, AREA / (wide * cell));
        }
        let mut fronts = Vec::new();
        for time in ratios(FIRST, LAST, STEPS).map(time_at) {
            run_until(&mut shallow, ctx, time, (time_at(LAST) - time_at(FIRST)) / 20.0);
            // Half of the depth of theory behind the front.
            fronts.push([time, front(&shallow, 0, 0.75 * AREA / front_at(time))]);
        }
        let shape = (0..count).map(|x| [(x as f64 + 0.5) * cell, 1e3 * depth(&shallow, [x, 0])]).collect();
        Self { fronts, shape }
    }
}
