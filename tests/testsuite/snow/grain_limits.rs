//! Limits of the motion of grains: pushes in a crowd, closing gaps, objects that jump.

use super::grains::on_floor;
use crate::common::liquids::context;
use crate::common::shapes::sphere;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::base_layer::{BaseLayer, Params as BaseParams};
use frazil::snow::grains::heap::{Colliders, Division, Heap};
use frazil::snow::grains::{Base, Grains, Object, Params};
use frazil::sweep::Body;

const FRAME: f64 = 1.0 / 24.0;

fn ball(positions: &[[f64; 3]]) -> Body {
    let key = |(frame, at): (i32, &[f64; 3])| Key {
        time: f64::from(frame) * FRAME,
        at: DVec3::from(*at),
        turn: DVec3::zeros(),
    };
    let keys = Keys::new((0..).zip(positions).map(key).collect()).unwrap();
    Body::new(Box::new(Rigid::new(sphere(0.1, 24), keys)), 0.0).unwrap()
}

#[test]
fn grains_that_lie_in_each_other_part_by_half_a_diameter_in_a_sub_step() {
    let params = Params { gravity: 0.0, ..Params::for_cell(1.5) };
    let mut heap = Heap::new(2.0 * params.radius);
    let d = diameter(&params);
    let positions: Vec<DVec3> = (0..13)
        .map(|id: i32| {
            let turn = f64::from(id) * 2.4;
            DVec3::repeat(4.0) * d + DVec3::new(turn.cos(), 0.2 * f64::from(id - 6), turn.sin()) * 0.1 * d
        })
        .collect();
    for (id, position) in (0..).zip(&positions) {
        heap.add(id, *position, [0.0; 3]).unwrap();
    }
    let division = Division { dt: 1.0e-3, sub_steps: 1 };
    let coefficients = params.coefficients(&division);
    let ctx = context(2);
    let step = || heap.step(&ctx, division, coefficients, &mut Colliders::default());
    ctx.step(1, || ctx.phase("move", step)).unwrap();
    let ids = heap.ids().to_vec();
    let ways: Vec<f64> = ids
        .iter()
        .zip(heap.positions())
        .map(|(id, position)| (position - positions[*id as usize]).norm())
        .collect();
    let farthest = ways.iter().copied().fold(0.0, f64::max) / d;
    assert!((0.2..0.501).contains(&farthest), "{farthest} diameters");
}

fn diameter(params: &Params) -> f64 {
    2.0 * params.radius
}

/// Largest speed (m/s) of a grain in six frames in which a ball is drawn through snow at a speed (m/s).
fn fastest(speed: f64, sub_steps: u32) -> f64 {
    let ctx = context(2);
    let cell = 0.02;
    let ground = Ground::Plane { height: 0.0, area: [-0.4, -0.3, 0.4, 0.3] };
    let snow = layer(&ctx, &ground, &[], &Cover::Depth(0.15), cell, 3.0).unwrap();
    let mut base = BaseLayer::new(&ctx, snow, BaseParams::for_cell(cell)).unwrap();
    let positions: Vec<[f64; 3]> =
        (0..=6).map(|frame| [f64::from(frame) * speed * FRAME - 0.25, 0.1, 0.0]).collect();
    let body = ball(&positions);
    let params = Params { sub_steps: Some(sub_steps), compression: 0.5, ..Params::for_cell(cell) };
    let mut grains = Grains::new(params).unwrap();
    let mut fastest = 0.0f64;
    for frame in 1..=6 {
        let times = [f64::from(frame - 1) * FRAME, f64::from(frame) * FRAME];
        let before = base.surface().deep_copy().unwrap();
        base.step(&ctx, std::slice::from_ref(&body), times[0], times[1], frame).unwrap();
        let objects = [Object::new(&body, 0.3)];
        let around = on_floor(Base::Whole([&before, base.surface()]), &objects);
        let report = grains.step(&ctx, &around, times, frame).unwrap();
        fastest = fastest.max(f64::from(report.fastest));
    }
    assert!(grains.count() > 300, "{}", grains.count());
    fastest
}

#[test]
fn shorter_sub_steps_do_not_squeeze_grains_out_faster() {
    for sub_steps in [8, 200] {
        let fastest = fastest(1.7, sub_steps);
        assert!(fastest < 1.4 * 1.7, "{fastest} m/s with {sub_steps} sub-steps");
    }
}

#[test]
fn an_object_that_jumps_carries_no_grains_along() {
    let ctx = context(2);
    let params = Params::for_cell(0.03);
    let mut grains = Grains::new(params).unwrap();
    let d = diameter(&params);
    let positions: Vec<DVec3> = (0..40 * 40)
        .map(|n: i32| DVec3::new(f64::from(n % 40 - 20) * d, 0.5 * d, f64::from(n / 40 - 20) * d))
        .collect();
    grains.emit(&positions, &[], 0).unwrap();
    let body = ball(&[[0.0, 0.3, 0.0], [0.0, 0.3, 0.0], [90.0, 0.1, 0.0], [90.0, 0.1, 0.0]]);
    for frame in 1..=3 {
        let objects = [Object::new(&body, 0.3)];
        let around = on_floor(Base::Missing, &objects);
        let times = [f64::from(frame - 1) * FRAME, f64::from(frame) * FRAME];
        let report = grains.step(&ctx, &around, times, frame).unwrap();
        assert!(report.fastest < 1.0 && report.dropped == 0, "frame {frame}: {} m/s", report.fastest);
    }
}
