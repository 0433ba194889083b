//! Gate of a hole in the ground, against Torricelli's law.

use frazil::shallow::sources::{FlowPoint, Kind};

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, dry, even, ground, pour, viscous};

/// Edge of the basin (cells), and of a cell (m).
const EDGE: usize = 50;
const CELL: f64 = 0.002;
/// Area of the hole (m2), and the share of it that the jet fills.
const AREA: f64 = 2.0e-5;
const DISCHARGE: f64 = 0.62;
/// Depth at the start and at the end (m).
const LEVELS: [f64; 2] = [0.04, 0.005];
const FRAME: f64 = 1.0 / 60.0;

/// The rate of a basin of water that runs empty, against Cd a (2 g H)^(1/2) of the mean depth.
pub fn measure() -> (f64, String) {
    let ctx = context(0);
    let solids = ground([EDGE; 2], CELL, between(-0.01, 0.1), |_| 0.0);
    let mut basin = dry(&ctx, &solids, viscous(1.0e-6));
    pour(&mut basin, |_| LEVELS[0]);
    let middle = 0.5 * EDGE as f64 * CELL;
    let hole = FlowPoint {
        kind: Kind::Orifice(DISCHARGE * AREA),
        at: [middle, 0.0, middle],
        radius: 0.01,
        rate: 1.0,
        pulse: None,
    };
    basin.set_flows(&[hole], |_| "the hole".into()).expect("a hole");
    let area = (EDGE as f64 * CELL).powi(2);
    let law = |depth: f64| DISCHARGE * AREA * (2.0 * G * depth).sqrt();
    let (mut worst, mut points) = (0.0f64, Vec::new());
    let mut before = basin.balance();
    while before.inside > LEVELS[1] * area {
        // Over half a second: the basin still swings a little.
        (0..30).for_each(|_| {
            basin.step(&ctx, FRAME).expect("a frame");
        });
        let after = basin.balance();
        let rate = (after.drained - before.drained) / (30.0 * FRAME);
        let depth = 0.5 * (before.inside + after.inside) / area;
        // The first waves, as the hole opens at once, are not the level's fall.
        if basin.time() > 2.0 {
            worst = worst.max(100.0 * (rate / law(depth) - 1.0).abs());
            points.push([1e3 * depth, 1e6 * rate]);
        }
        before = after;
    }
    let note = format!("40 to 5 mm of water in {:.1} s; {} rates", basin.time(), points.len());
    let curve = even(LEVELS[1], LEVELS[0], 40);
    Plot::linear("A basin runs empty through a hole", "depth (mm)", "ml/s")
        .line("theory, Cd a (2 g H)^1/2", curve.map(|depth| [1e3 * depth, 1e6 * law(depth)]))
        .points("an orifice", points)
        .write("shallow_orifice");
    (worst, note)
}
