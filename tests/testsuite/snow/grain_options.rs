//! Options of grains: rest by distance, and drag by local density.

use super::grains::{in_air, on_floor};
use crate::common::liquids::context;
use crate::common::shapes::sphere;
use frazil::Context;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::grains::{Base, Grains, Object, Params};
use frazil::sweep::Body;

/// Radius of the grains and of the ball (m).
const RADIUS: f64 = 0.004;
const BALL: f64 = 0.05;
/// Heights (m) at which it goes over grains on the floor and hits them.
const OVER: f64 = 3.0 * RADIUS;
const UNDER: f64 = RADIUS;
/// The distance of the rule (m).
const DISTANCE: f64 = 0.15;

fn params() -> Params {
    Params { radius: RADIUS, active_distance: Some(DISTANCE), ..Params::for_cell(3.0 * RADIUS) }
}

/// A ball over a height (m) that is at a position along x (m) until a time (s), and a second later at another one.
fn ball(low: f64, time: f64, from: f64, to: f64) -> Body {
    let key = |time, x: f64| Key { time, at: DVec3::new(x, low + BALL, 0.0), turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(time, from), key(time + 1.0, to)]).unwrap();
    Body::new(Box::new(Rigid::new(sphere(BALL as f32, 12), keys)), 0.0).unwrap()
}

/// Steps through a frame on a floor; how many rest then.
fn step(ctx: &Context, grains: &mut Grains, body: Option<&Body>, frame: i32) -> usize {
    let objects: Vec<Object<'_>> = body.map(|body| Object::new(body, 0.3)).into_iter().collect();
    let around = on_floor(Base::Missing, &objects);
    let times = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
    grains.step(ctx, &around, times, frame).unwrap().resting
}

/// Where grains lie on the floor that do not touch (m).
fn row() -> Vec<DVec3> {
    (-200..=200).map(|index| DVec3::new(f64::from(index) * 1.5 * 2.0 * RADIUS, RADIUS, 0.0)).collect()
}

/// The positions of those on the floor that are awake, along x (m).
fn awake(grains: &Grains) -> Vec<f64> {
    let all = grains.positions().zip(grains.awake());
    all.filter(|(position, awake)| *awake && position.y < 1.5 * RADIUS)
        .map(|(position, _)| position.x)
        .collect()
}

#[test]
fn slow_grains_far_from_objects_and_fast_grains_rest_at_once() {
    let ctx = context(2);
    let run = |params: Params, body: &Body, fast: bool| {
        let mut grains = Grains::new(params).unwrap();
        grains.emit(&row(), &[], 0).unwrap();
        if fast {
            grains.emit(&[DVec3::new(1.0, 0.02, 0.0)], &[[0.0, 1.0, 0.0]], 0).unwrap();
        }
        step(&ctx, &mut grains, Some(body), 1);
        step(&ctx, &mut grains, Some(body), 2);
        awake(&grains)
    };
    let still = ball(OVER, 0.0, 0.0, 0.0);
    // They wait for longer than two frames otherwise, and for ever where grains do not rest.
    assert_eq!(run(Params { active_distance: None, ..params() }, &still, false).len(), row().len());
    assert_eq!(run(Params { rests: false, ..params() }, &still, false).len(), row().len());
    // The ball is a little above the floor, and of flat facets; a cell is at most a quarter of the distance wide.
    let (reach, spare) = (0.185, 0.02 + 2.0 * 3f64.sqrt() * 0.25 * DISTANCE);
    let near = |awake: &[f64], middle: f64, distance: f64| {
        let within = |most: f64| move |x: &&f64| (**x - middle).abs() < most;
        let all = row().iter().filter(|position| (position.x - middle).abs() < distance).count();
        assert_eq!(awake.iter().filter(within(distance)).count(), all, "none nearer than the distance rests");
        assert!(all > 20);
        awake.iter().filter(within(distance + spare)).count()
    };
    let some = run(params(), &still, false);
    assert_eq!(near(&some, 0.0, reach), some.len(), "{some:?}");
    // Also near where an object will be at the frame's end: the ball goes 0.5 m in the second frame.
    let moving = ball(OVER, 1.0 / 24.0, 0.0, 12.0);
    let some = run(params(), &moving, false);
    let (first, last) = (near(&some, 0.0, reach), near(&some, 0.5, reach));
    assert!(first + last >= some.len(), "{some:?}");
    let some = run(params(), &still, true);
    let (ball, fast) = (near(&some, 0.0, reach), near(&some, 1.0, 0.9 * DISTANCE));
    assert!(ball + fast >= some.len(), "{some:?}");
}

#[test]
fn grains_in_the_air_fall_and_woken_ones_wait() {
    let ctx = context(1);
    let mut grains = Grains::new(Params { air: 1.0, ..params() }).unwrap();
    grains.emit(&row(), &[], 0).unwrap();
    step(&ctx, &mut grains, None, 1);
    // Slow, but on its way: it stands still when the step begins.
    let id = grains.emit(&[DVec3::new(0.0, 0.5, 0.0)], &[], 1).unwrap();
    assert!(step(&ctx, &mut grains, None, 2) > row().len() / 2);
    let at = grains.ids().iter().position(|other| *other == id).unwrap();
    let fallen = 0.5 - grains.positions().nth(at).unwrap().y;
    assert!((fallen / (0.5 * 9.81 / 576.0) - 1.0).abs() < 0.1, "{fallen}");
    // What gravity wakes does not rest in the same step.
    grains.set_params(Params { gravity: -5.0, ..params() }).unwrap();
    assert_eq!(step(&ctx, &mut grains, None, 3), 0);
    assert!(step(&ctx, &mut grains, None, 4) > row().len() / 2);
}

#[test]
fn a_ball_wakes_what_the_rule_put_to_rest() {
    let ctx = context(2);
    let mut grains = Grains::new(params()).unwrap();
    grains.emit(&row(), &[], 0).unwrap();
    let body = ball(UNDER, 0.5, -0.6, 0.6);
    let rests = |grains: &Grains, id: u32| {
        let at = grains.ids().iter().position(|other| *other == id).unwrap();
        (!grains.awake().nth(at).unwrap(), grains.positions().nth(at).unwrap())
    };
    // The one in the middle of the row, which the ball comes to.
    let middle = 200;
    (1..=4).for_each(|frame| _ = step(&ctx, &mut grains, Some(&body), frame));
    let (rested, from) = rests(&grains, middle);
    assert!(rested);
    (5..=26).for_each(|frame| _ = step(&ctx, &mut grains, Some(&body), frame));
    let (rested, to) = rests(&grains, middle);
    assert!(!rested && (to - from).norm() > RADIUS, "{from} {to}");
}

#[test]
fn the_options_give_the_same_bytes_from_one_and_two_threads_and_after_a_resume() {
    let params = Params { air_by_density: true, active_distance: Some(0.05), ..params() };
    let body = ball(UNDER, 0.0, -0.3, 0.3);
    let mut positions = row();
    for layer in 1..5u32 {
        positions.extend(
            row().iter().map(|position| position + DVec3::new(0.0, 2.2 * RADIUS, 0.0) * f64::from(layer)),
        );
    }
    let run = |threads: usize, cut: Option<i32>| {
        let ctx = context(threads);
        let mut grains = Grains::new(params).unwrap();
        grains.emit(&positions, &[], 0).unwrap();
        let mut resting = 0;
        for frame in 1..=20 {
            resting = step(&ctx, &mut grains, Some(&body), frame);
            if cut == Some(frame) {
                grains = Grains::resume(params, &grains.save()).unwrap();
            }
        }
        (grains.save(), resting)
    };
    let once = run(1, None);
    assert!(once.1 > positions.len() / 2 && once.1 < positions.len(), "{}", once.1);
    assert!(once == run(2, None) && once == run(2, Some(9)));
}

#[test]
fn a_grain_among_others_feels_less_of_the_air() {
    let ctx = context(2);
    let dt = 1.0 / 240.0;
    // A cube of grains that all but touch, and one on its own, through which air blows.
    let apart = 2.1 * RADIUS;
    let site = |index: i32| DVec3::from([index / 25, index / 5 % 5, index % 5].map(f64::from)) * apart;
    let mut positions: Vec<DVec3> = (0..125).map(site).collect();
    positions.push(DVec3::new(0.5, 0.5, 0.5));
    let speeds = |air_by_density: bool, sub_steps: u32| -> Vec<f64> {
        let params =
            Params { gravity: 0.0, air: 0.01, air_by_density, sub_steps: Some(sub_steps), ..params() };
        let mut grains = Grains::new(params).unwrap();
        grains.emit(&positions, &vec![[0.0, 1.0, 0.0]; positions.len()], 0).unwrap();
        let around = in_air(Base::Missing, &[]);
        grains.step(&ctx, &around, [0.0, dt], 1).unwrap();
        let mut speeds = vec![0.0; positions.len()];
        grains
            .ids()
            .iter()
            .zip(grains.velocities())
            .for_each(|(id, v)| speeds[*id as usize] = f64::from(v[1]));
        speeds
    };
    let lone = 0.01f64.powf(dt);
    assert!(speeds(false, 4).iter().all(|speed| (speed - lone).abs() < 1e-6));
    for sub_steps in [1, 4, 40] {
        let speeds = speeds(true, sub_steps);
        for (index, speed) in (0..).zip(&speeds) {
            let sides = [index / 25, index / 5 % 5, index % 5].map(|at| if at % 4 == 0 { 1.0 } else { 2.0 });
            let neighbours = if index == 125 { 0.0 } else { sides.iter().sum::<f64>() };
            let kept = lone.powf(1.0 - neighbours / 6.0);
            assert!((speed - kept).abs() < 1e-5, "{index} with {neighbours}: {speed} {kept}");
        }
    }
}

#[test]
fn distances_out_of_range_are_refused() {
    for distance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Grains::new(Params { active_distance: Some(distance), ..params() }).err().unwrap();
        assert!(error.to_string().contains("active_distance"), "{error}");
    }
}
