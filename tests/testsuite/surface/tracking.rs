//! Meshes that follow particles whose motion is known.

use frazil::geometry::DVec3;
use frazil::surface::{Params, Tracker, Weighting};

use crate::common::liquids::{ball, context, filled, follow, numbered, turned};

#[test]
fn a_mesh_turns_and_travels_with_its_liquid() {
    let ctx = context(2);
    let ball = ball(7.0, 24, 0.25);
    let params = Params::for_spacing(ball.spacing);
    let motion = |position: DVec3, frame: usize| {
        turned(position, 0.0628 * frame as f64, DVec3::new(0.4, -0.3, 0.2) * (0.01 * frame as f64))
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
    let motion = |position: DVec3, frame: usize| {
        let by = libm::exp(0.02 * frame as f64);
        DVec3::new(position.x * by, position.y / by.sqrt(), position.z / by.sqrt())
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
    let frame = numbered(ball.positions.clone());
    let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &frame).unwrap();
    let before = tracker.vertices().to_vec();
    tracker.step(&ctx, &frame, &frame, 0.04).unwrap();
    assert!(tracker.vertices() == before);

    let moved =
        |positions: &[DVec3]| positions.iter().map(|p| turned(*p, 0.1, DVec3::new(0.01, 0.0, 0.0))).collect();
    let to = numbered(moved(&ball.positions));
    tracker.step(&ctx, &frame, &to, 0.04).unwrap();
    let (mut other, mut from, mut then) =
        (Tracker::new(&context(1), params, &ball.mesh, &frame).unwrap(), frame.clone(), to.clone());
    from.positions.reverse();
    from.ids.reverse();
    then.positions.rotate_left(7);
    then.ids.rotate_left(7);
    other.step(&context(1), &from, &then, 0.04).unwrap();
    assert!(tracker.vertices() == other.vertices());
}

#[test]
fn drops_apart_and_bubbles_inside_are_listed() {
    let ctx = context(2);
    let ball = ball(9.0, 20, 0.0);
    let spacing = ball.spacing;
    let still = numbered(ball.positions.clone());
    let mut tracker = Tracker::new(&ctx, Params::for_spacing(spacing), &ball.mesh, &still).unwrap();
    let report = tracker.step(&ctx, &still, &still, 0.04).unwrap();
    assert!(report.uncovered_parts.is_empty(), "{:?}", report.uncovered_parts);
    // A hole in the middle, and a drop beside.
    let beside = DVec3::new(18.0 * spacing, 0.0, 0.0);
    let mut then = still.clone();
    let middle: Vec<usize> =
        (0..then.positions.len()).filter(|n| then.positions[*n].norm() < 4.6 * spacing).collect();
    for (n, at) in middle.iter().zip(filled(spacing, 0.1, 5.0 * spacing, |p| p.norm() < 4.6 * spacing)) {
        then.positions[*n] = at + beside;
    }
    let report = tracker.step(&ctx, &then, &then, 0.04).unwrap();
    assert_eq!((report.uncovered_parts.len(), report.flagged()), (2, 0), "{:?}", report.uncovered_parts);
    let [drop, bubble] = if report.uncovered_parts[0].volume > 0.0 { [0, 1] } else { [1, 0] }
        .map(|n| report.uncovered_parts[n]);
    assert!((drop.position - beside).norm() < 0.2 * spacing && drop.volume > 0.0, "{drop:?}");
    assert!(bubble.position.norm() < 0.2 * spacing && bubble.volume < 0.0, "{bubble:?}");
    let unit = 4.0 / 3.0 * std::f64::consts::PI * (4.6 * spacing).powi(3);
    assert!((0.6..1.5).contains(&(drop.volume / unit)) && (0.2..1.2).contains(&(-bubble.volume / unit)));
}

#[test]
fn detail_fades_with_time_and_strain_but_where_it_is_painted_to_last() {
    let ctx = context(2);
    let ball = ball(5.0, 12, 0.25);
    let still = numbered(ball.positions.clone());
    let usual = Params::for_spacing(ball.spacing);
    let begin = |params: Params| {
        let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &still).unwrap();
        let painted = ball.mesh.positions.iter().map(|position| if position.x > 0.0 { 1.0 } else { 0.0 });
        tracker.set_detail_retention(painted.collect()).unwrap();
        tracker
    };
    let shares = |before: &[f32], tracker: &Tracker| -> [f32; 2] {
        let mut out = [f32::NAN; 2];
        for (vertex, position) in ball.mesh.positions.iter().enumerate() {
            out[usize::from(position.x > 0.0)] = tracker.delta()[vertex] / before[vertex];
        }
        out
    };
    // Half a second at a half-life of one, in four steps.
    let mut tracker = begin(Params { half_life: 1.0, ..usual });
    let before = tracker.delta().to_vec();
    (0..4).for_each(|_| drop(tracker.step(&ctx, &still, &still, 0.125).unwrap()));
    let [faded, kept] = shares(&before, &tracker);
    assert!((faded - 0.5f32.sqrt()).abs() < 1e-4 && kept == 1.0, "{faded} {kept}");
    let resumed = Tracker::resume(usual, &ball.mesh, &tracker.save()).unwrap();
    assert_eq!((resumed.delta(), resumed.vertices()), (tracker.delta(), tracker.vertices()));
    // A ball that swells by a factor of 1.2 along all axes.
    let mut tracker = begin(Params { fade: 2.0, ..usual });
    let swollen = numbered(ball.positions.iter().map(|position| position * 1.2).collect());
    tracker.step(&ctx, &still, &swollen, 0.125).unwrap();
    let [faded, kept] = shares(&before, &tracker);
    assert!((faded - 1.0 / 1.44).abs() < 0.02 && kept == 1.0, "{faded} {kept}");
    assert!(
        tracker.set_detail_retention(vec![0.5]).is_err()
            && tracker.set_detail_retention(vec![2.0; before.len()]).is_err()
    );
}

#[test]
fn balls_that_meet_are_flagged_where_they_do() {
    let ctx = context(2);
    let one = ball(5.0, 16, 0.0);
    let apart = 7.0 * one.spacing;
    let two = |distance: f64| {
        let by = DVec3::new(distance, 0.0, 0.0);
        numbered(one.positions.iter().map(|p| p - by).chain(one.positions.iter().map(|p| p + by)).collect())
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
    let frame = numbered(ball.positions.clone());
    let mut mesh = ball.mesh.clone();
    mesh.positions.iter_mut().for_each(|p| p.x += 1.0);
    let error = Tracker::new(&ctx, params, &mesh, &frame).err().unwrap().to_string();
    assert!(error.contains("only 0 % of the mesh"), "{error}");

    let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &frame).unwrap();
    let before = tracker.vertices().to_vec();
    let to = numbered(ball.positions.iter().map(|p| p * 1.01).collect());
    ctx.cancel();
    assert!(tracker.step(&ctx, &frame, &to, 0.04).is_err());
    ctx.reset();
    assert!(tracker.vertices() == before);
    assert!(tracker.step(&ctx, &frame, &to, -1.0).is_err());
}
