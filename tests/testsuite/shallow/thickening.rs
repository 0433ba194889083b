//! Liquid whose viscosity depends on what it carries.

use frazil::Context;
use frazil::Pool;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::{Law, Params, Scalar, Shallow, Thickening};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames, pour_each};
use crate::common::shallow::{Turn, context, covered, ground, turnable};

const SLOPE: f64 = 0.1;
const NU: f64 = 4e-6;

/// A film of 0.3 mm on a slope that goes on for ever: what leaves is poured in again.
fn film(ctx: &Context, thickening: Option<Thickening>, dye: f64) -> Shallow {
    let params = Params {
        liquid: Liquid::new(NU),
        thickening,
        kept: 1.0,
        pace: TimeStepping::Realtime(1e-3),
        ..Params::default()
    };
    let solids = ground([48, 6], 0.001, [-0.05, 0.1], |[x, _]| -SLOPE * x);
    let mut liquid = covered(ctx, &solids, params, |_, _| 0.0);
    liquid.set_scalars(&[Scalar::dye("dye")]).unwrap();
    liquid.set_poured(&[dye]).unwrap();
    pour_each(&mut liquid, |_| 3e-4);
    liquid
}

/// Mean velocity in the middle, before anything comes from the ends.
fn speed(ctx: &Context, liquid: &mut Shallow) -> f64 {
    liquid.frames(ctx, FRAME, 8);
    let middle = liquid.columns().column([24, 3], 0).unwrap();
    f64::from(liquid.velocity(middle)[0])
}

/// Nusselt's film (m/s).
fn nusselt(nu: f64) -> f64 {
    9.81 * SLOPE * 9e-8 / (3.0 * nu * (1.0 + SLOPE * SLOPE).powi(2))
}

#[test]
fn a_film_runs_as_its_concentration_makes_it_thick() {
    let ctx = context();
    let law = Thickening { scalar: 0, from: 0.2, to: 0.7, times: 11.0 };
    for (dye, times) in [(0.0, 1.0), (0.2, 1.0), (0.45, 6.0), (0.7, 11.0), (1.0, 11.0)] {
        let speed = speed(&ctx, &mut film(&ctx, Some(law), dye));
        let wanted = nusselt(NU * times);
        assert!((speed / wanted - 1.0).abs() < 2e-3, "{dye}: {speed}, {wanted} m/s");
    }
    // What thins as it is diluted.
    let law = Thickening { scalar: 0, from: 1.0, to: 0.0, times: 0.25 };
    let wanted = nusselt(NU * 0.625);
    let speed = speed(&ctx, &mut film(&ctx, Some(law), 0.5));
    assert!((speed / wanted - 1.0).abs() < 5e-3, "{speed}, {wanted} m/s");
}

#[test]
fn no_concentration_is_no_change_and_a_frame_leaves_the_pipes_as_they_were() {
    let ctx = context();
    let law = Thickening { scalar: 0, from: 0.5, to: 1.0, times: 1e6 };
    let (mut plain, mut clear) = (film(&ctx, None, 0.0), film(&ctx, Some(law), 0.0));
    let mut clotted = film(&ctx, Some(law), 1.0);
    for frame in 0..30 {
        if frame == 20 {
            let params = Params { thickening: None, ..clotted.params().clone() };
            clotted.set_params(params).unwrap();
        }
        for liquid in [&mut plain, &mut clear, &mut clotted] {
            liquid.step(&ctx, FRAME).unwrap();
        }
        assert!(plain.save() == clear.save(), "frame {frame}");
    }
    // Clotted blood has hardly moved; when it is thin again it runs.
    let middle = clotted.columns().column([24, 3], 0).unwrap();
    assert!(f64::from(clotted.velocity(middle)[0]) > 0.9 * nusselt(NU));
}

#[test]
fn blood_that_ages_comes_to_rest_on_a_slope() {
    let ctx = context();
    let law = Thickening { scalar: 0, from: 0.2, to: 0.6, times: 1e5 };
    let mut liquid = film(&ctx, Some(law), 0.0);
    liquid.set_scalars(&[Scalar { name: "age".into(), law: Law::Ages, range: 60.0 }]).unwrap();
    liquid.frames(&ctx, FRAME, 60);
    let middle = liquid.columns().column([10, 3], 0).unwrap();
    assert!(liquid.depths()[middle] > 0 && liquid.velocity(middle)[0].abs() < 1e-5);
    assert!(liquid.concentration(0, middle) > 0.9);
}

#[test]
fn a_turned_scene_any_number_of_threads_and_a_restored_liquid_thicken_the_same() {
    let law = Some(Thickening { scalar: 0, from: 0.0, to: 1.0, times: 50.0 });
    let ctx = context();
    for seed in 0..20 {
        let mut plan = turnable(seed);
        plan.params.liquid = Liquid::new(1e-5);
        plan.params.thickening = law;
        let mut liquids = Turn::ALL.map(|turn| plan.make(&ctx, turn));
        liquids.iter_mut().for_each(|liquid| liquid.set_scalars(&[Scalar::dye("dye")]).unwrap());
        for frame in 0..10 {
            let all = liquids.iter_mut().zip(Turn::ALL).map(|(liquid, turn)| {
                let mut dice = Dice(seed << 32 | frame);
                liquid.set_poured(&[dice.between(0.0, 1.0)]).unwrap();
                let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
                plan.pour(liquid, turn, corners, [-1.0, 1e-4, 1e-3][dice.below(3)]);
                liquid.step(&ctx, FRAME).unwrap();
                plan.depths_of(liquid, turn)
            });
            let all: Vec<_> = all.collect();
            assert!(all.iter().all(|other| *other == all[0]), "seed {seed}, frame {frame}");
        }
    }
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let solids = ground([360, 300], 0.001, [-0.1, 0.1], |[x, z]| 0.02 * (x + z));
        let params = Params { thickening: law, ..Params::default() };
        let mut liquid = covered(&ctx, &solids, params, |_, _| 0.0);
        liquid.set_scalars(&[Scalar::dye("dye")]).unwrap();
        for column in liquid.columns().indices().collect::<Vec<_>>() {
            let [x, z] = liquid.columns().cell(column);
            liquid.set_poured(&[((x / 30 + z / 20) % 5) as f64 / 4.0]).unwrap();
            liquid.pour(column, 1e-3);
        }
        liquid.frames(&ctx, FRAME, 4);
        (liquid, ctx)
    };
    let (mut alone, ctx) = run(0);
    let saved = alone.save();
    assert!(run(2).0.save() == saved);
    let (mut resumed, _) = run(0);
    resumed.step(&ctx, FRAME).unwrap();
    resumed.restore(&saved).unwrap();
    for liquid in [&mut alone, &mut resumed] {
        (0..4).for_each(|_| assert!(liquid.step(&ctx, FRAME).is_ok()));
    }
    assert!(alone.save() == resumed.save());
}

#[test]
fn wrong_numbers_are_a_sentence() {
    let ctx = context();
    let law = Thickening { scalar: 1, from: 0.0, to: 1.0, times: 2.0 };
    let mut liquid = film(&ctx, Some(law), 0.0);
    let before = liquid.save();
    let error = liquid.step(&ctx, FRAME).unwrap_err().to_string();
    assert!(error.contains("no scalar 1 among 1"), "{error}");
    assert!(liquid.save() == before);
    for (law, what) in [
        (Thickening { to: 0.0, ..law }, "thickening.from = 0 and thickening.to = 0"),
        (Thickening { from: f64::NAN, ..law }, "thickening.from = NaN"),
        (Thickening { times: 0.0, ..law }, "thickening.times = 0 is not within 1e-6 to 1e9"),
    ] {
        let error = Params { thickening: Some(law), ..Params::default() }.validate().unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    let thin = Params { liquid: Liquid::new(0.0), thickening: Some(law), ..Params::default() };
    assert_eq!(thin.validate().unwrap_err().to_string(), "a liquid without viscosity does not thicken");
}
