//! Gate of the swing of a liquid in a parabolic bowl, b = D (r / L)^2, against Thacker (1981): a level surface that swings with a period of
//! 2 pi L / (2 g D)^(1/2), at any amplitude; here 2 %, where what pipes leave out, momentum that is carried along, is small.

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, dry, even, ground, pour, swing, viscous};

/// Radius of the puddle and depth in its middle (m).
const RADIUS: f64 = 0.1;
const DEEP: f64 = 0.01;
const AMPLITUDE: f64 = 0.02;
/// Cells along an edge of the domain, that is three radii.
const CELLS: usize = 120;
/// Periods, and frames in each.
const PERIODS: usize = 6;
const FRAMES: usize = 400;

pub fn measure() -> (f64, String) {
    let ctx = context(0);
    let cell = 3.0 * RADIUS / CELLS as f64;
    let from_middle = |at: [f64; 2]| at.map(|x| x - 1.5 * RADIUS);
    let height = |at: [f64; 2]| {
        let [x, z] = from_middle(at);
        DEEP * (x * x + z * z) / (RADIUS * RADIUS)
    };
    let solids = ground([CELLS; 2], cell, between(0.0, 0.06), height);
    let mut shallow = dry(&ctx, &solids, viscous(0.0));
    let surface = |x: f64| DEEP + 2.0 * AMPLITUDE * DEEP * x / RADIUS;
    pour(&mut shallow, |at| (surface(from_middle(at)[0]) - height(at)).max(0.0));
    let middle = |shallow: &frazil::shallow::Shallow| {
        let (mut sum, mut moment) = (0.0, 0.0);
        for cell in (0..CELLS * CELLS).map(|i| [i % CELLS, i / CELLS]) {
            let depth = depth(shallow, cell);
            sum += depth;
            moment += depth * from_middle(solids.grid.centre(cell))[0];
        }
        moment / sum
    };
    let period = std::f64::consts::TAU * RADIUS / (2.0 * G * DEEP).sqrt();
    let dt = period / FRAMES as f64;
    let (positions, own) = swing(&mut shallow, &ctx, dt, PERIODS * FRAMES, middle);
    let last = positions[(PERIODS - 1) * FRAMES..].iter().map(|position| position[1]).fold(0.0, f64::max);
    let first = positions[0][1];
    let note = format!("the last swing is {:.3} of the first", last / first);
    let theory = even(0.0, 6.0, 600).map(|t| [t, 1e3 * first * (std::f64::consts::TAU * t).cos()]);
    Plot::linear(
        "Swing in a parabolic bowl (Thacker 1981)",
        "time (periods of theory)",
        "centre of mass (mm)",
    )
    .line("theory", theory)
    .points("pipes", positions.iter().step_by(FRAMES / 10).map(|[time, x]| [time / period, 1e3 * x]))
    .write("shallow_bowl");
    (100.0 * (own / period - 1.0).abs(), note)
}
