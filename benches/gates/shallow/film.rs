//! Gates of steady films on slopes, against Nusselt (1916): u = g S H^2 / (3 nu (1 + S^2)^2), H being the vertical depth.

use frazil::Context;

use crate::common::liquids::context;
use crate::harness::Harness;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, dry, ground, pour, ratios, run_until, viscous};

/// Blood (m2/s), as in the thesis.
const BLOOD: f64 = 4.0e-6;
const CELL: f64 = 5.0e-4;
/// The film approaches its speed as exp(-t / settles): it is measured after so many of these times.
const SETTLED: f64 = 40.0;
/// Depths (m), to where 3 u reaches the speed of waves on a slope of 0.1: deeper films are not stable.
const DEPTHS: [f64; 6] = [1.0e-5, 3.0e-5, 1.0e-4, 2.0e-4, 3.0e-4, 4.0e-4];

pub fn run(h: &mut Harness) {
    let ctx = context(0);
    h.measure_all(["shallow.film_exact", "shallow.film_short_steps"], || exact(&ctx));
    h.measure("shallow.film_steep", || steep(&ctx));
}

/// The mean velocity of a steady film on ground that falls by `slope` along x and z, over theory, and its component across over theory; so many
/// frames are computed while the film settles by a factor e.
fn film(ctx: &Context, slope: [f64; 2], thick: f64, frames: f64) -> [f64; 2] {
    let square = slope[0] * slope[0] + slope[1] * slope[1];
    let steep = (1.0 + square) * (1.0 + square);
    let settles = thick * thick * steep / (3.0 * BLOOD);
    // Waves from the border do not reach the middle before the end.
    let around = (1.2 * (G * thick).sqrt() * SETTLED * settles / CELL) as usize + 8;
    let size = slope.map(|slope| if slope == 0.0 { 3 } else { 2 * around + 1 });
    let fall = |size: usize, slope: f64| size as f64 * CELL * slope;
    let high = fall(size[0], slope[0]) + fall(size[1], slope[1]);
    // As fine as for a domain of 1,024 cells: a cell's fall is a whole number of units where only one slope is not 0.
    let range = 1024.0 * CELL * (slope[0] + slope[1]);
    let solids = ground(size, CELL, between(0.0, range), |[x, z]| high - slope[0] * x - slope[1] * z);
    let mut shallow = dry(ctx, &solids, viscous(BLOOD));
    pour(&mut shallow, |_| thick);
    run_until(&mut shallow, ctx, SETTLED * settles, settles / frames);
    let middle = size.map(|size| size / 2);
    let column = shallow.columns().column(middle, 0).expect("ground everywhere");
    let own = depth(&shallow, middle);
    let theory = G * square.sqrt() * own * own / (3.0 * BLOOD * steep);
    let [u, v] = shallow.velocity(column).map(f64::from);
    let along = [slope[0] / square.sqrt(), slope[1] / square.sqrt()];
    [(u * along[0] + v * along[1]) / theory, (v * along[0] - u * along[1]) / theory]
}

/// A slope of 0.1.
fn exact(ctx: &Context) -> [(f64, String); 2] {
    let (mut worst, mut worst_fine) = (0.0f64, 0.0f64);
    let mut points = Vec::new();
    for thick in DEPTHS {
        let [along, fine] = [1.0, 100.0].map(|frames| film(ctx, [0.1, 0.0], thick, frames)[0]);
        println!("# a film of {thick} m flows at {along:.9} of theory, {fine:.9} in short steps");
        worst = worst.max((along - 1.0).abs());
        worst_fine = worst_fine.max((fine - 1.0).abs());
        points.push([thick * 1e3, along * theory(0.1, thick) * 1e3]);
    }
    plot(ctx, points);
    // What a flux still grows by in short steps is less than half of its last bit.
    let of_short = format!("{worst_fine:.1e}; steps of a hundredth of the time in which a film settles");
    [(worst, format!("{worst:.1e}; blood, 0.01 to 0.4 mm deep")), (worst_fine, of_short)]
}

fn theory(slope: f64, thick: f64) -> f64 {
    G * slope * thick * thick / (3.0 * BLOOD * (1.0 + slope * slope).powi(2))
}

fn plot(ctx: &Context, gentle: Vec<[f64; 2]>) {
    let curve = |slope: f64| ratios(1e-5, 4e-4, 40).map(move |d| [d * 1e3, theory(slope, d) * 1e3]);
    let steep =
        DEPTHS.map(|thick| [thick * 1e3, film(ctx, [1.0, 0.0], thick, 1.0)[0] * theory(1.0, thick) * 1e3]);
    Plot::log("Nusselt film of blood", "depth (mm)", "mean velocity (mm/s)")
        .line("theory, slope 0.1", curve(0.1))
        .line("theory, slope 1", curve(1.0))
        .points("pipes, slope 0.1", gentle)
        .points("pipes, slope 1", steep)
        .write("shallow_film");
}

/// Slopes to 45 degrees, along x, z and between.
fn steep(ctx: &Context) -> (f64, &'static str) {
    let mut worst = 0.0f64;
    for slope in [0.25, 0.5, 0.75, 1.0] {
        let diagonal = slope * std::f64::consts::FRAC_1_SQRT_2;
        for slopes in [[slope, 0.0], [0.0, slope], [diagonal, diagonal], [0.8 * slope, 0.6 * slope]] {
            let [along, across] = film(ctx, slopes, 1.0e-4, 1.0);
            worst = worst.max(100.0 * (along - 1.0).abs()).max(100.0 * across.abs());
        }
    }
    (worst, "blood, 0.1 mm deep; slopes 0.25 to 1, along x, z, and at 45 and 37 degrees to x")
}
