//! Gate of what films of blood deliver over an open border, against Nusselt (1916).

use frazil::Context;
use frazil::shallow::Params;
use frazil::shallow::pipes::Border;

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, dry, ground, ratios, run_until, viscous};

/// Blood (m2/s), as in the thesis.
const BLOOD: f64 = 4.0e-6;
/// The slope of thin films. Deeper ones flow on half the slope at which 3 u, the speed of long waves on a film, reaches that of free waves,
/// (g H)^(1/2): on steeper ground a film is not steady, but breaks into rolls.
const SLOPE: f64 = 0.5;
/// Least range of heights (m): what a real scene has, so that the thinnest films move a part of a unit in a step.
const RANGE: f64 = 0.1;
const FRAME: f64 = 1.0 / 60.0;
const DEPTHS: [f64; 7] = [1.0e-6, 3.0e-6, 1.0e-5, 3.0e-5, 1.0e-4, 3.0e-4, 1.0e-3];

pub fn measure() -> (f64, String) {
    let ctx = context(0);
    let mut worst = 0.0f64;
    let mut points = Vec::new();
    for thick in DEPTHS {
        let share = delivered(&ctx, thick);
        println!("# a film of {thick} m on a slope of {:.3} delivers {share:.9} of theory", slope_for(thick));
        worst = worst.max((share - 1.0).abs());
        points.push([thick * 1e3, share * 1e6 * G * thick.powi(3) / (3.0 * BLOOD)]);
    }
    let curve = ratios(1e-6, 1e-3, 40).map(|d| [d * 1e3, 1e6 * G * d.powi(3) / (3.0 * BLOOD)]);
    Plot::log("Blood that a film delivers", "depth (mm)", "ml/s for a metre of width, times (1 + S2)2 / S")
        .line("theory, g H3 / (3 nu)", curve)
        .points("pipes, over an open border", points)
        .write("shallow_delivery");
    (worst, format!("{worst:.1e}; blood, 1 um to 1 mm deep"))
}

/// The slope that a film flows on.
fn slope_for(thick: f64) -> f64 {
    SLOPE.min(0.5 * BLOOD / (G.sqrt() * thick.powf(1.5)))
}

/// (1 + S^2)^2 of a slope.
fn steep(slope: f64) -> f64 {
    (1.0 + slope * slope).powi(2)
}

/// Discharge over the border at the foot of a gutter in which a film flows, over that of theory.
fn delivered(ctx: &Context, thick: f64) -> f64 {
    let slope = slope_for(thick);
    let per_width = |thick: f64| G * slope * thick.powi(3) / (3.0 * BLOOD * steep(slope));
    let fastest = 3.0 * per_width(thick) / thick;
    let spread = G * thick.powi(3) / (3.0 * BLOOD);
    // Cells as wide as a steady film near an edge needs, but not finer than 0.5 mm.
    let cell = (5.0 * thick).max(5.0e-4);
    // By then the film flows steadily, also in its last cell, and where it is drawn down before the edge.
    let settles =
        [thick * thick * steep(slope) / (3.0 * BLOOD), cell / fastest, 4.0 * spread / (fastest * fastest)];
    let begin = 16.0 * settles.into_iter().fold(0.0, f64::max);
    let end = 3.0 * begin;
    // The wall above is not felt before the end.
    let count = ((1.1 * fastest * end + 6.0 * (2.0 * spread * end).sqrt()) / cell) as usize + 30;
    let high = slope * cell * count as f64;
    let wall = high + 0.1 * RANGE;
    let solids = ground([count, 3], cell, between(0.0, RANGE.max(wall)), |[x, z]| {
        let is_gutter = x > cell && z > cell && z < 2.0 * cell;
        if is_gutter { high - slope * x } else { wall }
    });
    let mut shallow = dry(ctx, &solids, Params { border: Border::Open, ..viscous(BLOOD) });
    for x in 1..count {
        let column = shallow.columns().column([x, 1], 0).expect("ground everywhere");
        shallow.pour(column, thick);
    }
    let own = depth(&shallow, [count / 2, 1]);
    run_until(&mut shallow, ctx, begin, FRAME);
    let before = shallow.balance().lost;
    let first = shallow.time();
    run_until(&mut shallow, ctx, end, FRAME);
    let rate = (shallow.balance().lost - before) / (shallow.time() - first) / cell;
    rate / per_width(own)
}
