//! Passages that are full up to their ceiling.

use frazil::shallow::columns::grid::{BOTTOMLESS, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};

use crate::common::flowing::{DOWN, Frames, from_corner, stacked};
use crate::common::shallow::context;

/// Edge of a cell (m).
const CELL: f64 = 0.005;
/// Height of the passage (m).
const HIGH: f64 = 0.01;
/// Cells of the passage between two legs of one cell.
const LONG: usize = 12;

/// Two legs that a passage joins below, in one row; filled to these levels (m).
fn u_tube(levels: [f64; 2], params: Params) -> Shallow {
    let solids = stacked(from_corner(CELL, [LONG + 2, 1]), [-0.01, 0.3], |[x, _]| {
        let mut solids = vec![[DOWN, 0.0]];
        if (1..=LONG).contains(&x) {
            solids.push([HIGH, 0.25]);
        }
        solids
    });
    let mut tube = Shallow::new(&context(), &solids, params).unwrap();
    for x in 0..LONG + 2 {
        let depth = [levels[0], HIGH, levels[1]][usize::from(x > 0) + usize::from(x > LONG)];
        let column = tube.columns().column([x, 0], 0).unwrap();
        tube.pour(column, depth);
    }
    tube
}

fn params() -> Params {
    Params { liquid: Liquid::new(0.0), kept: 1.0, pace: TimeStepping::Exact, ..Params::default() }
}

/// Level of the left leg less that of the right one (m).
fn difference(tube: &Shallow) -> f64 {
    let depth = |x: usize| f64::from(tube.depths()[tube.columns().column([x, 0], 0).unwrap()]);
    (depth(0) - depth(LONG + 1)) * tube.columns().heights.unit
}

#[test]
fn a_u_tube_swings_with_the_period_of_its_passage() {
    let mut tube = u_tube([0.0505, 0.0495], params());
    let length = (LONG + 1) as f64 * CELL;
    let period = std::f64::consts::TAU * (CELL * length / (2.0 * 9.81 * HIGH)).sqrt();
    let dt = period / 200.0;
    let (mut last, mut crossings) = (difference(&tube), Vec::new());
    for frame in 1..=800 {
        tube.step(&context(), dt).unwrap();
        let now = difference(&tube);
        if last > 0.0 && now <= 0.0 {
            crossings.push((f64::from(frame) - 1.0 + last / (last - now)) * dt);
        }
        last = now;
    }
    assert_eq!(crossings.len(), 4);
    let measured = (crossings[3] - crossings[0]) / 3.0;
    assert!((measured / period - 1.0).abs() < 0.005, "{measured} s is not {period} s");
    assert!((last - 0.001).abs() < 5e-5, "it swings on as far: {last}");
    assert_eq!(tube.balance().error, 0);
}

#[test]
fn legs_come_to_one_level_and_the_passage_stays_full() {
    let mut tube = u_tube([0.06, 0.04], Params { kept: 0.01, liquid: Liquid::WATER, ..params() });
    tube.frames(&context(), 1.0, 20);
    assert!(difference(&tube).abs() < 5e-7, "{}", difference(&tube));
    let heights = tube.columns().heights;
    for x in 1..=LONG {
        let column = tube.columns().column([x, 0], 0).unwrap();
        let missing =
            tube.columns().ceilings()[column] - tube.columns().bases()[column] - tube.depths()[column];
        assert!((0..=2).contains(&missing), "{missing} units of {} m are missing", heights.unit);
    }
}

#[test]
fn a_passage_without_an_end_lets_nothing_in() {
    // All is full: no head moves anything.
    let grid = from_corner(CELL, [8, 3]);
    let heights = Heights::between(0.0, 0.1).unwrap();
    let solids = Solids::new(grid, heights, (0..24).map(|_| vec![[BOTTOMLESS, 1000], [900_000, 1_000_000]]));
    let mut cave = Shallow::new(&context(), &solids, params()).unwrap();
    let lower: Vec<usize> = cave.columns().indices().filter(|&i| cave.columns().layer(i) == 0).collect();
    for &column in &lower {
        assert!(cave.pour(column, 1.0) > 0.0);
    }
    let before = cave.depths().to_vec();
    cave.frames(&context(), 0.01, 20);
    assert!(before == cave.depths(), "it moved");
    // A gap in it is shared out, to the unit.
    let taken = cave.pour(lower[0], -0.00002);
    assert!(taken < 0.0);
    cave.frames(&context(), 0.01, 50);
    assert_eq!(cave.balance().error, 0);
}
