//! Meshes that follow particles whose motion is known.

use frazil::base::DVec3;
use frazil::surface::{Params, Tracker, Weighting};

use crate::common::liquids::{ball, context, follow, numbered, turned};

#[test]
fn a_mesh_turns_and_travels_with_its_liquid() {
    let ctx = context(2);
    let ball = ball(7.0, 24, 0.25);
    let params = Params::for_spacing(ball.spacing);
    let motion = |place: DVec3, frame: usize| {
        turned(place, 0.0628 * frame as f64, DVec3::new(0.4, -0.3, 0.2) * (0.01 * frame as f64))
    };
    let (_, errors) = follow(&ctx, &ball, params, 25, motion);
    assert!(errors.mean < 0.02 && errors.p95 < 0.1 && errors.most < 0.5, "{errors:?}");
    assert_eq!(errors.flagged, 0);
    // The mean of the particles' ways lags behind.
    let (_, mean) = follow(&ctx, &ball, Params { weighting: Weighting::Mean, ..params }, 25, motion);
    assert!(mean.mean > 10.0 * errors.mean, "{mean:?}");
}

#[test]
fn a_smooth_mesh_is_stretched_with_its_liquid() {
    let ctx = context(2);
    let ball = ball(8.0, 24, 0.0);
    let params = Params::for_spacing(ball.spacing);
    let motion = |place: DVec3, frame: usize| {
        let by = libm::exp(0.02 * frame as f64);
        DVec3::new(place.x * by, place.y / by.sqrt(), place.z / by.sqrt())
    };
    let (_, errors) = follow(&ctx, &ball, params, 20, motion);
    assert!(errors.mean < 0.1 && errors.p95 < 0.2 && errors.most < 0.5, "{errors:?}");
    assert_eq!(errors.flagged, 0);
}

#[test]
fn nothing_moves_and_the_order_of_particles_does_not_matter() {
    let ctx = context(2);
    let ball = ball(5.0, 12, 0.25);
    let params = Params::for_spacing(ball.spacing);
    let frame = numbered(ball.places.clone());
    let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &frame).unwrap();
    let before = tracker.vertices().to_vec();
    tracker.step(&ctx, &frame, &frame, 0.04).unwrap();
    assert!(tracker.vertices() == before);

    let moved =
        |places: &[DVec3]| places.iter().map(|p| turned(*p, 0.1, DVec3::new(0.01, 0.0, 0.0))).collect();
    let to = numbered(moved(&ball.places));
    tracker.step(&ctx, &frame, &to, 0.04).unwrap();
    let (mut other, mut from, mut then) =
        (Tracker::new(&context(1), params, &ball.mesh, &frame).unwrap(), frame.clone(), to.clone());
    from.places.reverse();
    from.ids.reverse();
    then.places.rotate_left(7);
    then.ids.rotate_left(7);
    other.step(&context(1), &from, &then, 0.04).unwrap();
    assert!(tracker.vertices() == other.vertices());
}

#[test]
fn balls_that_meet_are_flagged_where_they_do() {
    let ctx = context(2);
    let one = ball(5.0, 16, 0.0);
    let apart = 7.0 * one.spacing;
    let two = |distance: f64| {
        let by = DVec3::new(distance, 0.0, 0.0);
        numbered(one.places.iter().map(|p| p - by).chain(one.places.iter().map(|p| p + by)).collect())
    };
    let mut mesh = one.mesh.clone();
    mesh.positions.iter_mut().for_each(|p| p.x -= apart as f32);
    let mut other = one.mesh.clone();
    other.positions.iter_mut().for_each(|p| p.x += apart as f32);
    mesh.append(&other);
    let mut tracker = Tracker::new(&ctx, Params::for_spacing(one.spacing), &mesh, &two(apart)).unwrap();
    let mut flagged = None;
    for frame in 0..20 {
        let at = |frame: i32| two(apart - 0.15 * f64::from(frame) * one.spacing);
        let report = tracker.step(&ctx, &at(frame), &at(frame + 1), 0.04).unwrap();
        if report.jumped > 0 && flagged.is_none() {
            flagged = Some(frame);
            // Only near the plane in which they meet.
            for (vertex, _) in tracker.vertices().iter().zip(tracker.flags()).filter(|(_, flag)| **flag) {
                assert!(vertex.x.abs() < 3.0 * one.spacing, "{vertex:?}");
            }
        }
    }
    assert!(flagged.is_some_and(|frame| frame > 2), "{flagged:?}");
}

#[test]
fn a_mesh_elsewhere_is_refused_and_a_cancelled_step_changes_nothing() {
    let ctx = context(2);
    let ball = ball(5.0, 8, 0.0);
    let params = Params::for_spacing(ball.spacing);
    let frame = numbered(ball.places.clone());
    let mut mesh = ball.mesh.clone();
    mesh.positions.iter_mut().for_each(|p| p.x += 1.0);
    let error = Tracker::new(&ctx, params, &mesh, &frame).err().unwrap().to_string();
    assert!(error.contains("only 0 % of the mesh"), "{error}");

    let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &frame).unwrap();
    let before = tracker.vertices().to_vec();
    let to = numbered(ball.places.iter().map(|p| p * 1.01).collect());
    ctx.cancel();
    assert!(tracker.step(&ctx, &frame, &to, 0.04).is_err());
    ctx.reset();
    assert!(tracker.vertices() == before);
    assert!(tracker.step(&ctx, &frame, &to, -1.0).is_err());
}
