//! Gates of a puddle of viscous liquid that spreads on level ground (Huppert 1982, "The propagation of two-dimensional and axisymmetric
//! viscous gravity currents over a rigid horizontal surface"): its radius is 0.894 (g V^3 / (3 nu))^(1/8) t^(1/8).

use frazil::shallow::Shallow;

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, dry, even, ground, pour, power, ratios, run_until, viscous};

const CELL: f64 = 1.0e-3;
/// Viscosity (m2/s) and volume (m3).
const VISCOSITY: f64 = 1.0e-2;
const VOLUME: f64 = 4.0e-6;
/// Radius at first, and the first and last that are measured (cells).
const START: f64 = 20.5;
const FIRST: f64 = 50.0;
const LAST: f64 = 100.0;
/// Radii are this much apart.
const RATIO: f64 = 1.06;
/// The front is where the depth is this share of that in the middle.
const SHARE: f64 = 0.5;
/// Directions in which it is measured.
const DIRECTIONS: usize = 360;

pub fn measure() -> [(f64, String); 2] {
    let ctx = context(0);
    let count = 2 * (1.08 * LAST) as usize + 1;
    let solids = ground([count; 2], CELL, between(0.0, 0.1), |_| 0.01);
    let mut shallow = dry(&ctx, &solids, viscous(VISCOSITY));
    let middle = 0.5 * count as f64 * CELL;
    let radius = |[x, z]: [f64; 2]| ((x - middle).powi(2) + (z - middle).powi(2)).sqrt();
    let disc = (0..count * count)
        .filter(|i| radius(solids.grid.centre([i % count, i / count])) < START * CELL)
        .count();
    let first = VOLUME / (disc as f64 * CELL * CELL);
    pour(&mut shallow, |at| if radius(at) < START * CELL { first } else { 0.0 });
    let (mut radii, mut round, mut off) = (Vec::new(), 0.0f64, 0.0f64);
    let mut cells = START;
    while cells < LAST {
        cells = (cells * RATIO).min(LAST);
        let (wanted, time) = (cells * CELL, time_at(cells * CELL));
        run_until(&mut shallow, &ctx, time, time);
        if cells < FIRST {
            continue;
        }
        let front = front(&shallow, time);
        let mean = front.iter().sum::<f64>() / front.len() as f64;
        let [least, most] =
            [front.iter().copied().fold(f64::MAX, f64::min), front.iter().copied().fold(0.0, f64::max)];
        println!(
            "# t {time:.3} s: radius {:.4} of theory, {:.3} % out of round",
            mean / wanted,
            100.0 * (most / least - 1.0)
        );
        round = round.max(100.0 * (most / least - 1.0));
        off = off.max(100.0 * (mean / wanted - 1.0).abs());
        radii.push([time, mean]);
    }
    let exponent = (power(&radii) - 0.125).abs();
    let note = format!("off 1/8; radii of {FIRST} to {LAST} cells, off theory by {off:.2} %");
    let theory = ratios(FIRST * CELL, LAST * CELL, 40).map(|r| [time_at(r), 1e3 * r]);
    Plot::log("Viscous puddle on level ground (Huppert 1982)", "time (s)", "radius (mm)")
        .line("theory, power 1/8", theory)
        .points("pipes", radii.iter().map(|[time, radius]| [*time, 1e3 * radius]))
        .write("shallow_spread");
    let end = radii[radii.len() - 1][0];
    let shape = even(0.0, LAST * CELL, 100).map(|x| [1e3 * x, 1e3 * depth_at(x, end)]);
    let own = (0..count)
        .map(|x| [1e3 * (x as f64 + 0.5 - 0.5 * count as f64) * CELL, 1e3 * depth(&shallow, [x, count / 2])]);
    Plot::linear("Viscous puddle on level ground: its depth", "from the middle (mm)", "depth (mm)")
        .line("theory", shape)
        .points("pipes", own.filter(|[x, _]| *x > -1e-9))
        .write("shallow_spread_shape");
    [(exponent, note), (round, "greatest radius over least".into())]
}

/// 0.894: (2^10 / (3^4 pi^3))^(1/8).
fn factor() -> f64 {
    (1024.0 / (81.0 * std::f64::consts::PI.powi(3))).powf(0.125)
}

/// Theory: when the radius is this (m).
fn time_at(radius: f64) -> f64 {
    (radius / factor()).powi(8) * 3.0 * VISCOSITY / (G * VOLUME.powi(3))
}

/// Theory: the radius at a time (s).
fn radius_at(time: f64) -> f64 {
    factor() * (G * VOLUME.powi(3) * time / (3.0 * VISCOSITY)).powf(0.125)
}

/// Theory: the depth at a distance from the middle (m).
fn depth_at(distance: f64, time: f64) -> f64 {
    let radius = radius_at(time);
    let inner = (1.0 - (distance / radius).powi(2)).max(0.0);
    4.0 / 3.0 * VOLUME / (std::f64::consts::PI * radius * radius) * inner.cbrt()
}

/// The radius of the front in each direction (m), from where the depth falls through a share of that in the middle: there theory is at
/// (1 - share^3)^(1/2) of the radius. The cube of the depth falls evenly near the front.
fn front(shallow: &Shallow, time: f64) -> Vec<f64> {
    let count = shallow.columns().grid.size[0];
    let half = (count / 2) as f64;
    let cube = |x: f64, z: f64| depth(shallow, [x as usize, z as usize]).powi(3);
    let at = |x: f64, z: f64| {
        let [cx, cz] = [x.floor(), z.floor()];
        let [fx, fz] = [x - cx, z - cz];
        let row = |z: f64| (1.0 - fx) * cube(cx, z) + fx * cube(cx + 1.0, z);
        (1.0 - fz) * row(cz) + fz * row(cz + 1.0)
    };
    let edge = (SHARE * depth_at(0.0, time)).powi(3);
    let radius = |i: usize| {
        let (sin, cos) = (i as f64 / DIRECTIONS as f64 * std::f64::consts::TAU).sin_cos();
        let step = 0.05;
        let mut r = 0.5 * radius_at(time) / CELL;
        while at(half + (r + step) * cos, half + (r + step) * sin) > edge {
            r += step;
        }
        let [before, behind] = [r, r + step].map(|r| at(half + r * cos, half + r * sin));
        (r + step * (before - edge) / (before - behind)) * CELL / (1.0 - SHARE.powi(3)).sqrt()
    };
    (0..DIRECTIONS).map(radius).collect()
}
