//! The thesis' ways to sweep (Fig. 3.3) beside the chain, on a ball whose sweep is a capsule.

use crate::common::shapes;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::sweep::{self, Body, SamplesSettings, Settings};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Context, Pool};
use std::f64::consts::PI;

const RADIUS: f64 = 0.1;
const TRAVEL: f64 = 0.4;
const CELL: f64 = 0.01;

fn ball(travel: f64) -> Body {
    let key = |time: f64| Key { time, at: DVec3::x() * (time * travel), turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(0.0), key(1.0)]).unwrap();
    Body::new(Box::new(Rigid::new(shapes::sphere(RADIUS as f32, 24), keys)), 0.0).unwrap()
}

#[test]
fn the_chain_is_the_capsule_and_the_baselines_fall_short_as_in_the_thesis() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [ball(TRAVEL)];
    let capsule = PI * RADIUS.powi(2) * TRAVEL + 4.0 / 3.0 * PI * RADIUS.powi(3);
    let part = |grid: FloatGrid| level_set::measure(&ctx, &grid).unwrap().volume / capsule;
    let sampled = |settings: &SamplesSettings| part(sweep::samples(&ctx, &body, 0.0, 1.0, settings).unwrap());
    let chain = part(sweep::chain(&ctx, &body, 0.0, 1.0, &Settings::new(CELL)).unwrap());
    let one_step = sampled(&SamplesSettings::one_step(CELL));
    let sub_steps = sampled(&SamplesSettings::sub_steps(CELL, 4));
    let samples = sampled(&SamplesSettings { samples: 4, ..SamplesSettings::new(CELL) });
    println!("of the capsule: chain {chain}, one step {one_step}, sub-steps {sub_steps}, samples {samples}");
    // The ball is a polyhedron inside the sphere.
    assert!((0.985..1.005).contains(&chain), "chain {chain}");
    // Two balls apart.
    assert!((one_step - 8.0 / 3.0 * PI * RADIUS.powi(3) / capsule).abs() < 0.02, "one step {one_step}");
    // Five balls a radius apart: dents.
    assert!((0.88..0.97).contains(&sub_steps), "sub-steps {sub_steps}");
    // Dilated by a cell: the dents are filled, the rest is fat.
    assert!(samples > chain && samples < 1.25, "samples {samples}");
}
