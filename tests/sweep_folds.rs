//! Skins that fold inside out.

#[path = "common/elbow.rs"]
#[allow(dead_code)]
mod elbow;
#[path = "common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use elbow::Elbow;
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Context, Pool};

const CELL: f64 = 0.004;

/// What an elbow sweeps while it bends from one angle to another (radians), in a number of sub-steps.
fn volume(bend: [f64; 2], parts: u32) -> f64 {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [Body::new(Box::new(Elbow::new(bend, 0.02)), 0.0).unwrap()];
    let mut all: Option<FloatGrid> = None;
    for part in 0..parts {
        let [from, to] = [part, part + 1].map(|part| f64::from(part) / f64::from(parts));
        let grid = sweep::chain(&ctx, &body, from, to, &Settings::new(CELL)).unwrap();
        match &mut all {
            Some(all) => level_set::union(&ctx, all, grid).unwrap(),
            None => all = Some(grid),
        }
    }
    level_set::measure(&ctx, &all.unwrap()).unwrap().volume
}

#[test]
fn a_fold_sweeps_the_same_in_one_step_as_in_sixteen() {
    for bend in [[0.0, 2.4], [2.4, 0.6], [1.4, 2.5]] {
        let [one, sixteen] = [1, 16].map(|parts| volume(bend, parts));
        assert!((one / sixteen - 1.0).abs() < 0.01, "bend {bend:?}: {one} in one step, {sixteen} in sixteen");
    }
}
