//! Frames end: in so many steps at most, when they are cancelled, and at lengths that they refuse; and nothing is then changed.

use std::time::{Duration, Instant};

use frazil::Context;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Detail, Params, Shallow};

use crate::common::flowing::{DOWN, FRAME, Frames, from_corner, stacked};
use crate::common::shallow::{context, covered, ground, source, waves};

fn exact() -> Params {
    Params { pace: TimeStepping::Exact, ..Params::default() }
}

/// Runs a step that is cancelled after some time, from another thread; how long it took to answer (s), and whether it was cancelled.
fn cancelled<T: std::fmt::Debug>(
    ctx: &Context,
    after: Duration,
    step: impl FnOnce() -> frazil::Result<T>,
) -> (f64, bool) {
    std::thread::scope(|scope| {
        let canceller = scope.spawn(move || {
            std::thread::sleep(after);
            ctx.cancel();
            Instant::now()
        });
        let result = step();
        let ended = Instant::now();
        let asked = canceller.join().unwrap();
        ctx.reset();
        let is_cancelled = matches!(result, Err(frazil::Error::Cancelled));
        assert!(is_cancelled || result.is_ok(), "{result:?}");
        (ended.saturating_duration_since(asked).as_secs_f64(), is_cancelled)
    })
}

/// A film that runs so fast that steps are halved, in the near cells only: the coarse ones are dry, and bound no step.
#[test]
fn steps_of_a_frame_end_where_one_of_two_liquids_is_dry() {
    let ctx = context();
    let solids = ground([40, 40], 0.002, [-0.2, 0.3], |[x, _]| -0.8 * x);
    let params = Params { liquid: Liquid::WATER, kept: 1.0, ..exact() };
    let mut detail = Detail::new(&ctx, &solids, params.clone(), [0..20, 0..40]).unwrap();
    let mut halved = false;
    for frame in 0..12 {
        detail.pour_at([-0.035, 0.03, 0.0], 0.004, 2e-7).unwrap();
        let report = detail.step(&ctx, FRAME).unwrap();
        assert!(report.steps < 2000, "frame {frame}: {} steps", report.steps);
        assert_eq!((detail.balance().error, report.seconds), (0, FRAME));
        halved |= report.slowed > 0 || report.steps > 20;
    }
    assert!(halved, "no film was fast");
    // Dry ground takes one step, however fast the film was that ran off it.
    let mut dry = Detail::new(&ctx, &solids, params, [0..20, 0..40]).unwrap();
    assert_eq!(dry.step(&ctx, FRAME).unwrap().steps, 1);
}

#[test]
fn a_frame_that_takes_long_is_cancelled_within_and_was_never_begun() {
    let ctx = context();
    let solids = ground([60, 60], 0.002, [-0.05, 0.1], |at| 0.004 * waves(at, 0.002));
    for params in [exact(), Params { pace: TimeStepping::Realtime(0.001), ..Params::default() }] {
        let mut liquid = covered(&ctx, &solids, params.clone(), |[x, _], _| if x < 0.0 { 0.01 } else { 0.0 });
        liquid.set_flows(&[source([0.02, 0.0, 0.01], 0.004, 1e-6)], |at| at.to_string()).unwrap();
        liquid.step(&ctx, FRAME).unwrap();
        let (state, steps) = (liquid.save(), liquid.last_steps().to_vec());
        for attempt in 0..3 {
            let (seconds, ended) = cancelled(&ctx, Duration::from_millis(20), || liquid.step(&ctx, 500.0));
            assert!(ended && seconds < 0.2, "attempt {attempt}: {seconds} s, {ended}");
            assert_eq!((liquid.save() == state, liquid.last_steps()), (true, &steps[..]));
        }
        let mut other = covered(&ctx, &solids, params, |_, _| 0.0);
        other.set_flows(&[source([0.02, 0.0, 0.01], 0.004, 1e-6)], |at| at.to_string()).unwrap();
        other.restore(&state).unwrap();
        for _ in 0..3 {
            liquid.step(&ctx, FRAME).unwrap();
            other.step(&ctx, FRAME).unwrap();
        }
        assert!(liquid.save() == other.save());
    }
}

#[test]
fn a_frame_in_cells_of_two_sizes_is_cancelled_within() {
    let ctx = context();
    let solids = ground([60, 60], 0.002, [-0.05, 0.1], |at| 0.004 * waves(at, 0.002));
    let mut detail = Detail::new(&ctx, &solids, exact(), [20..40, 20..40]).unwrap();
    detail.fill(0.004);
    detail.pour_at([0.0, 0.0, 0.0], 0.01, 3e-6).unwrap();
    detail.step(&ctx, FRAME).unwrap();
    let state = detail.save();
    let (seconds, ended) = cancelled(&ctx, Duration::from_millis(20), || detail.step(&ctx, 500.0));
    assert!(ended && seconds < 0.2, "{seconds} s, {ended}");
    assert!(detail.save() == state);
    detail.step(&ctx, FRAME).unwrap();
    assert_eq!(detail.balance().error, 0);
}

#[test]
fn lengths_that_move_nothing_are_refused() {
    let ctx = context();
    let solids = ground([16, 16], 0.002, [-0.05, 0.1], |_| 0.0);
    let mut liquid = covered(&ctx, &solids, Params::default(), |_, _| 0.002);
    let mut detail = Detail::new(&ctx, &solids, exact(), [4..8, 4..8]).unwrap();
    for (dt, said) in [
        (0.0, "0"),
        (1e-320, "1e-320"),
        (9e-13, "9e-13"),
        (-0.5, "-0.5"),
        (2e6, "2000000"),
        (f64::NAN, "NaN"),
    ] {
        let wanted = format!("a frame of {said} s is not within 1e-12 to 1000000 s");
        assert_eq!(liquid.step(&ctx, dt).unwrap_err().to_string(), wanted);
        assert_eq!(liquid.step_within(&ctx, dt, 1.0).unwrap_err().to_string(), wanted);
        assert_eq!(detail.step(&ctx, dt).unwrap_err().to_string(), wanted);
    }
    let error = liquid.replay(&ctx, &[FRAME, 1e-320]).unwrap_err().to_string();
    assert_eq!(error, "a step of 1e-320 s is not within 1e-12 to 1000000 s");
    for dt in [1e-12, 1e-9, FRAME] {
        assert!(liquid.step(&ctx, dt).unwrap().steps >= 1);
        // A state with so short a last step comes back.
        let state = liquid.save();
        liquid.restore(&state).unwrap();
        assert_eq!(liquid.step(&ctx, dt).unwrap().seconds, dt);
    }
    let many = exact();
    liquid.set_params(many).unwrap();
    let error = liquid.step(&ctx, 1e6).unwrap_err().to_string();
    assert!(
        error.starts_with(
            "a frame of 1000000 s takes over 1000000 steps: after 0 s, the next step is only 0.00"
        ),
        "{error}"
    );
}

/// A cavity of one cell under a lid, walls around it, and room above.
fn cavity(is_shut: bool) -> Solids {
    stacked(from_corner(0.001, [5, 5]), [-0.01, 0.2], |cell| match (cell == [2, 2], is_shut) {
        (true, true) => vec![[DOWN, 0.0], [0.001, 0.01]],
        (true, false) => vec![[DOWN, 0.0]],
        (false, _) => vec![[DOWN, 0.01]],
    })
}

#[test]
fn a_source_in_a_cavity_that_is_full_owes_nothing() {
    let ctx = context();
    let mut liquid = Shallow::new(&ctx, &cavity(true), Params::default()).unwrap();
    let rate = 1e-6;
    let at = source([0.0025, 0.0005, 0.0025], 0.0004, rate);
    liquid.set_flows(&[at], |at| at.to_string()).unwrap();
    for _ in 0..600 {
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(liquid.balance().error, 0);
    }
    // What the cavity holds: a cubic millimetre.
    let full = liquid.moved(0);
    assert!((full - 1e-9).abs() < 1e-12, "{full}");
    liquid.update_terrain(&cavity(false)).unwrap();
    for frame in 1..=6 {
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(liquid.balance().error, 0);
        let come = liquid.moved(0) - full;
        // A step's worth at most beyond what its rate gives.
        let wanted = f64::from(frame) * rate * FRAME;
        assert!(
            come > 0.99 * wanted && come < wanted + 0.004 * rate,
            "frame {frame}: {come} m3 instead of {wanted}"
        );
    }
    // A rate that is turned off has nothing left to give, either.
    liquid.update_terrain(&cavity(true)).unwrap();
    liquid.frames(&ctx, FRAME, 60);
    liquid.set_rate(0, 0.0).unwrap();
    liquid.update_terrain(&cavity(false)).unwrap();
    let before = liquid.moved(0);
    liquid.frames(&ctx, FRAME, 6);
    assert!(liquid.moved(0) - before < 1e-13, "{}", liquid.moved(0) - before);
}
