//! Gates of lakes over islands and below bridges: at rest they stay as they are, bit by bit; disturbed, they come to rest.
//!
//! What a wave leaves on an island drains for ever: the film in a cell thins as H = (3 nu dx / (2 g S t))^(1/2) and leaves it at dx / (2 t), whatever
//! its viscosity and the slope. So the speed of a disturbed lake is that of its columns over 1 mm.

use frazil::Context;
use frazil::shallow::columns::grid::BOTTOMLESS;
use frazil::shallow::{Params, Shallow};

use crate::common::liquids::context;
use crate::harness::Harness;
use crate::plots::Plot;
use crate::shallow::ground::{between, dry, ground, pour, run_until, terrain, viscous};

/// Water (m2/s).
const WATER: f64 = 1.0e-6;
const CELLS: usize = 64;
const CELL: f64 = 0.01;
/// The surface over the ground (m).
const DEEP: f64 = 0.1;
/// Columns that are less deep (m) are films.
const FILM: f64 = 1.0e-3;

pub fn run(h: &mut Harness) {
    let ctx = context(0);
    h.measure_all(["shallow.lake_rest", "shallow.lake_same"], || at_rest(&ctx));
    h.measure("shallow.lake_disturbed", || disturbed(&ctx));
    h.measure("shallow.lake_storm", || storm(&ctx));
}

/// Lakes that nothing disturbs.
fn at_rest(ctx: &Context) -> [(f64, &'static str); 2] {
    let (mut speed, mut same) = (0.0f64, true);
    for lift in [0.0, 1.0] {
        let mut lake = lake(ctx, lift);
        let before = lake.depths().to_vec();
        for _ in 0..60 {
            lake.step(ctx, 1.0 / 60.0).expect("a frame");
            speed = speed.max(fastest(&lake, 0.0));
        }
        same &= before == lake.depths();
    }
    [(speed, "on the ground, and lifted by 1 m"), (f64::from(same), "")]
}

/// A column of 1 cm of water falls into the lake.
fn disturbed(ctx: &Context) -> (f64, String) {
    let mut lake = lake(ctx, 0.0);
    let bump = lake.columns().column([CELLS / 2, CELLS / 2], 0).expect("ground everywhere");
    lake.pour(bump, 0.01);
    let (mut deep, mut films) = (Vec::new(), Vec::new());
    for _ in 0..60 {
        let next = lake.time() + 1.0;
        run_until(&mut lake, ctx, next, 1.0 / 60.0);
        deep.push([lake.time(), fastest(&lake, FILM)]);
        films.push([lake.time(), fastest(&lake, 0.0)]);
    }
    let speed = deep[deep.len() - 1][1];
    let note = format!("{speed:.1e}; films on the islands {:.1e}", films[films.len() - 1][1]);
    Plot::log("A disturbed lake", "time (s)", "greatest speed (m/s)")
        .line("films, dx / (2 t)", [[1.0, 0.5 * CELL], [60.0, 0.5 * CELL / 60.0]])
        .line("what must be kept after 60 s", [[1.0, 1e-6], [60.0, 1e-6]])
        .points("columns over 1 mm", deep)
        .points("all columns", films)
        .write("shallow_lake");
    (speed, note)
}

/// A block of water, 0.3 m high, falls into a basin of 0.05 m.
fn storm(ctx: &Context) -> (f64, &'static str) {
    const BASIN: usize = 96;
    let solids = ground([BASIN; 2], CELL, between(0.0, 1.0), |_| 0.0);
    let mut basin = dry(ctx, &solids, Params { kept: 0.5, ..viscous(WATER) });
    let side = BASIN as f64 * CELL;
    let is_block =
        |[x, z]: [f64; 2]| (x - 0.5 * side).abs() < 0.15 * side && (z - 0.45 * side).abs() < 0.15 * side;
    pour(&mut basin, |at| if is_block(at) { 0.3 } else { 0.05 });
    run_until(&mut basin, ctx, 30.0, 1.0 / 60.0);
    (fastest(&basin, FILM), "after 30 s")
}

/// Islands, a bridge that lies in the water and one over it.
fn lake(ctx: &Context, lift: f64) -> Shallow {
    let heights = between(lift - 0.01, lift + 0.3);
    let solids = terrain([CELLS; 2], CELL, heights, |at| {
        let [x, z] = at.map(|at| (at as f64 + 0.5) * CELL);
        let hills = 0.1 * ((20.0 * x).sin() * (17.0 * z).cos() + 0.6);
        let mut solids = vec![[BOTTOMLESS, heights.round(lift + hills.max(0.0))]];
        let slab = |low: f64, high: f64| [heights.round(lift + low), heights.round(lift + high)];
        if (0.2..0.26).contains(&x) {
            solids.push(slab(0.05, 0.07));
        }
        if (0.4..0.46).contains(&z) {
            solids.push(slab(0.16, 0.18));
        }
        solids
    });
    let mut lake = dry(ctx, &solids, Params { kept: 0.5, ..viscous(WATER) });
    lake.fill(lift + DEEP);
    lake
}

/// The greatest speed of columns deeper than this (m).
fn fastest(lake: &Shallow, least: f64) -> f64 {
    let unit = lake.columns().heights.unit;
    let deep = lake.columns().indices().filter(|&i| f64::from(lake.depths()[i]) * unit > least);
    deep.flat_map(|i| lake.velocity(i)).fold(0.0, |most, u| most.max(f64::from(u.abs())))
}
