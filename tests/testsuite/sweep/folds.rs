//! Skins that fold inside out.

use crate::common::folded::{Elbow, Mirrored};
use crate::common::shapes;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::{Key, Keys, Motion, Rigid};
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Context, Pool};

const CELL: f64 = 0.006;

/// What a skin sweeps in a second, in a number of sub-steps.
fn volume(skin: impl Motion + 'static, parts: u32) -> f64 {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [Body::new(Box::new(skin), 0.0).unwrap()];
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
        let [one, sixteen] = [1, 16].map(|parts| volume(Elbow::new(bend), parts));
        assert!((one / sixteen - 1.0).abs() < 0.01, "bend {bend:?}: {one} in one step, {sixteen} in sixteen");
    }
    let [one, sixteen] = [1, 16].map(|parts| volume(Mirrored::new(), parts));
    assert!((one / sixteen - 1.0).abs() < 0.01, "mirrored: {one} in one step, {sixteen} in sixteen");
}

#[test]
fn what_only_winds_backward_is_not_swept() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [Body::new(Box::new(Mirrored::new()), 0.0).unwrap()];
    let volume = |to: f64| {
        let grid = sweep::chain(&ctx, &body, 0.0, to, &Settings::new(CELL)).unwrap();
        level_set::measure(&ctx, &grid).unwrap().volume
    };
    let (rest, moved) = (volume(0.0), volume(1.0));
    assert!((moved / rest - 1.0).abs() < 0.01, "{moved}, not {rest}");
}

/// A ball with a smaller one beside it, which may be inside out.
fn with_a_pocket(is_inside_out: bool) -> TriMesh {
    let [mut ball, mut pocket] = [0.05, 0.015].map(|radius| shapes::sphere(radius, 8));
    pocket.positions.iter_mut().for_each(|p| *p += Vec3::new(0.0, 0.08, 0.0));
    ball.append(&if is_inside_out { pocket.reversed() } else { pocket });
    ball
}

#[test]
fn a_part_that_is_inside_out_sweeps_as_one_that_is_not_wherever_it_is_carried() {
    let volume = |mesh: TriMesh, at: DVec3, degrees: f64| {
        let key = |time: f64| Key { time, at: at * time, turn: DVec3::x() * (degrees.to_radians() * time) };
        volume(Rigid::new(mesh, Keys::new(vec![key(0.0), key(1.0)]).unwrap()), 1)
    };
    for (at, degrees) in
        [(DVec3::x() * 0.3, 0.0), (DVec3::x() * 0.1, 720.0), (DVec3::new(0.1, 0.2, 0.1), 300.0)]
    {
        let [right, turned] = [false, true].map(|turned| volume(with_a_pocket(turned), at, degrees));
        let ball = volume(shapes::sphere(0.05, 8), at, degrees);
        assert_eq!(turned, right, "{at:?}, {degrees} degrees");
        assert!(turned > 1.02 * ball, "{at:?}, {degrees} degrees: {turned}, and {ball} without it");
    }
}
