//! The flow: nothing is lost, depths stay within their columns, and the same scene makes the same liquid however it lies.

use frazil::shallow::Params;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames, assert_same_depths, at_all_levels};
use crate::common::shallow::{
    Turn, busy, context, covered, extreme, extreme_frame, ground, hash, source, turnable, violations,
};

#[test]
fn no_unit_is_lost_while_liquid_comes_and_goes() {
    let ctx = context();
    let plan = busy([61, 45]);
    let mut liquid = plan.make(&ctx, Turn::NONE);
    let mut dice = Dice(5);
    for frame in 0..240 {
        let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
        plan.pour(&mut liquid, Turn::NONE, corners, dice.between(-1e-4, 1e-4));
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(liquid.balance().error, 0, "frame {frame}");
        assert_eq!(violations(&liquid), 0, "frame {frame}");
    }
    // Everything was at work.
    let all = liquid.balance();
    for (what, volume) in [
        ("poured", all.poured.abs()),
        ("sourced", all.sourced),
        ("drained", all.drained),
        ("absorbed", all.absorbed),
        ("lost", all.lost),
    ] {
        assert!(volume > 0.0, "nothing was {what}");
    }
    assert!(all.absorbed <= 2.0e-6, "gauze takes what it holds: {}", all.absorbed);
}

#[test]
fn depths_stay_within_their_columns_whatever_is_asked() {
    let ctx = context();
    let mut worked = [0; 2];
    for seed in 0..300 {
        let (plan, step) = extreme(seed);
        let mut liquid = plan.make(&ctx, Turn::NONE);
        for frame in 0..6 {
            let report = extreme_frame(&ctx, &mut liquid, step, frame);
            assert_eq!(violations(&liquid), 0, "scene {seed}, frame {frame}");
            assert_eq!(liquid.balance().error, 0, "scene {seed}, frame {frame}");
            worked = [worked[0] + report.emptied, worked[1] + report.filled];
        }
    }
    assert!(worked[0] > 0 && worked[1] > 0, "K_min and K_max were at work in {worked:?} rows");
}

#[test]
fn a_scene_that_is_turned_or_mirrored_flows_the_same() {
    let ctx = context();
    let (mut links, mut worked) = (0, [0; 2]);
    for seed in 0..12 {
        let plan = turnable(seed);
        links += plan.links();
        let mut liquids = Turn::ALL.map(|turn| plan.make(&ctx, turn));
        for frame in 0..10 {
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            // Strips fall asleep where all is taken, which lie otherwise when the scene is turned.
            let depth = [-1.0, -1.0, 1e-4, 0.0][dice.below(4)];
            let mut depths = Vec::new();
            for (liquid, turn) in liquids.iter_mut().zip(Turn::ALL) {
                plan.pour(liquid, turn, corners, depth);
                let report = liquid.step(&ctx, FRAME).unwrap();
                worked = [worked[0] + report.emptied, worked[1] + report.filled];
                depths.push(plan.depths_of(liquid, turn));
            }
            assert_same_depths(&depths, &format!("scene {seed}, frame {frame}"));
        }
    }
    assert!(links > 0 && worked[0] > 0 && worked[1] > 0, "{links} links, {worked:?} rows scaled");
}

#[test]
fn recorded_steps_make_the_same_frames_again() {
    let ctx = context();
    for seed in 0..12 {
        let plan = turnable(seed);
        let (mut run, mut again) = (plan.make(&ctx, Turn::NONE), plan.make(&ctx, Turn::NONE));
        for frame in 0..10 {
            run.step(&ctx, FRAME).unwrap();
            let steps = run.last_steps().to_vec();
            assert!(!steps.is_empty());
            again.replay(&ctx, &steps).unwrap();
            assert_eq!(hash(&run), hash(&again), "scene {seed}, frame {frame}");
            assert_eq!(run.time().to_bits(), again.time().to_bits(), "scene {seed}, frame {frame}");
        }
    }
}

#[test]
fn more_threads_make_the_same_liquid() {
    // Wide enough to be divided.
    let plan = busy([421, 303]);
    let hashes = [0, 1, 2, 3].map(|threads| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let mut liquid = plan.make(&ctx, Turn::NONE);
        liquid.frames(&ctx, FRAME, 8);
        hash(&liquid)
    });
    assert_eq!(hashes, [hashes[0]; 4]);
}

/// Set in the processes of [`all_instruction_sets_make_the_same_liquid`], which only print hashes.
const PRINTS: &str = "FRAZIL_TEST_PRINTS_HASHES";

#[test]
fn all_instruction_sets_make_the_same_liquid() {
    if std::env::var_os(PRINTS).is_some() {
        return print_hashes();
    }
    let liquids = at_all_levels("shallow::flow::all_instruction_sets_make_the_same_liquid", PRINTS);
    assert_eq!(liquids[0].len(), 12);
    assert_eq!([&liquids[1], &liquids[2]], [&liquids[0]; 2]);
}

fn print_hashes() {
    let ctx = context();
    // Behind the name of the test, which ends without a new line.
    println!();
    for seed in 0..12 {
        let mut liquid = turnable(seed).make(&ctx, Turn::NONE);
        liquid.frames(&ctx, FRAME, 10);
        println!("liquid {seed} {:016x}", hash(&liquid));
    }
}

/// Three seconds of blood on a slope that rolls, as in the thesis' Fig. 4.13, where disturbances run at over the speed of waves: the greatest depth
/// (m), the volume on the slope (ml), and rows in which films were held back.
fn rolling_film(edge: usize, pace: TimeStepping) -> (f64, f64, u64) {
    let ctx = context();
    let rolling = |[x, z]: [f64; 2]| {
        let bumps = libm::sin(150.0 * x + 1.0) * libm::sin(170.0 * z) + 0.6 * libm::sin(310.0 * z + 90.0 * x);
        -0.35 * x + 0.0006 * bumps
    };
    let solids = ground([edge; 2], 0.1 / edge as f64, [-0.05, 0.1], rolling);
    let params = Params { border: Border::Open, pace, ..Params::default() };
    let mut liquid = covered(&ctx, &solids, params, |_, _| 0.0);
    liquid.set_flows(&[source([-0.04, 0.02, 0.0], 0.007, 1e-6)], |_| "the source".into()).unwrap();
    let mut slowed = 0;
    for _ in 0..180 {
        slowed += liquid.step(&ctx, FRAME).unwrap().slowed;
    }
    let deepest = liquid.depths().iter().copied().max().unwrap();
    assert_eq!(liquid.balance().error, 0);
    (f64::from(deepest) * solids.heights.unit, 1e6 * liquid.balance().inside, slowed)
}

#[test]
fn a_fast_film_on_a_rolling_slope_does_not_break_into_ridges() {
    let (deepest, inside, _) = rolling_film(100, TimeStepping::Exact);
    assert!((0.7e-3..0.9e-3).contains(&deepest), "{deepest} m");
    assert!((1.5..1.8).contains(&inside), "{inside} ml");
}

#[test]
fn a_film_that_is_too_fast_for_real_time_is_held_back_and_stays_smooth() {
    let (deepest, inside, slowed) = rolling_film(200, TimeStepping::Realtime(0.003));
    assert!((0.9e-3..1.2e-3).contains(&deepest), "{deepest} m");
    assert!((1.9..2.1).contains(&inside), "{inside} ml, where exact steps leave 1.6");
    assert!(slowed > 1000, "{slowed} rows");
    let (_, _, slowed) = rolling_film(100, TimeStepping::Realtime(0.001));
    assert_eq!(slowed, 0, "steps of 1 ms are short enough for cells of 1 mm");
}

#[test]
fn a_hole_in_the_ground_drains_as_torricelli_says() {
    let ctx = context();
    let solids = ground([40; 2], 0.002, [-0.01, 0.1], |_| 0.0);
    let hole = |opening, rate| FlowPoint {
        kind: Kind::Orifice(opening),
        radius: 0.008,
        rate,
        ..source([0.0; 3], 0.0, 0.0)
    };
    let drained = |point: FlowPoint, time: f64| {
        let params = Params { liquid: Liquid::WATER, pace: TimeStepping::Exact, ..Params::default() };
        let mut liquid = covered(&ctx, &solids, params, |_, _| 0.02);
        liquid.set_flows(&[point], |_| "the hole".into()).unwrap();
        liquid.frames(&ctx, FRAME, (time / FRAME) as usize);
        assert_eq!(liquid.balance().error, 0);
        liquid.balance().drained
    };
    // The root of the depth falls evenly: from 20 mm, with Cd a of 12 mm2 on 64 cm2.
    let left = |time: f64| (0.02f64.sqrt() - 1.2e-5 / 6.4e-3 * (0.5 * 9.81f64).sqrt() * time).powi(2);
    let (ours, theory) = (drained(hole(1.2e-5, 1.0), 10.0), 6.4e-3 * (0.02 - left(10.0)));
    assert!((ours / theory - 1.0).abs() < 0.01, "{ours} m3, not {theory}");
    // What is behind it may let less through.
    let ours = drained(hole(1.2e-5, 1e-6), 2.0);
    assert!((ours / 2e-6 - 1.0).abs() < 1e-3, "{ours} m3, not 2 ml");
}

#[test]
fn a_lake_at_rest_stays_as_it_is_to_the_last_unit() {
    let ctx = context();
    let islands = |[x, z]: [f64; 2]| 0.02 * (libm::sin(90.0 * x) * libm::cos(70.0 * z)).max(-0.5);
    let solids = ground([45, 37], 0.005, [-0.05, 0.2], islands);
    let mut liquid = covered(&ctx, &solids, Params::default(), |_, _| 0.0);
    liquid.fill(0.015);
    let before = liquid.depths().to_vec();
    liquid.frames(&ctx, FRAME, 30);
    let differ = liquid.depths().iter().zip(&before).filter(|(a, b)| a != b).count();
    let dry = liquid.columns().indices().filter(|&column| before[column] == 0).count();
    assert!(dry > 0 && dry < liquid.columns().count(), "there are islands in it");
    assert_eq!(differ, 0);
}

#[test]
fn a_film_of_a_few_units_is_not_frozen() {
    // Blood of 1 um on a slope of 0.5 moves a thirtieth of a unit a step.
    let ctx = context();
    let cell = 0.0005;
    let solids = ground([64, 3], cell, [-0.01, 0.1], |[x, _]| 0.03 - 0.5 * x);
    let params = Params { liquid: Liquid::BLOOD, kept: 1.0, ..Params::default() };
    let mut liquid = covered(&ctx, &solids, params, |_, _| 1e-6);
    let top = liquid.columns().column([0, 1], 0).unwrap();
    let first = liquid.depths()[top];
    liquid.frames(&ctx, FRAME, 120);
    // u H t / dx of Nusselt's film, on that slope.
    let nu = Liquid::BLOOD.viscosity;
    let flux = 9.81 * 0.5 * 1e-18 / (3.0 * nu) / 1.25f64.powi(2);
    let lost = flux * 2.0 / cell / solids.heights.unit;
    let is = f64::from(first - liquid.depths()[top]);
    assert!((is - lost).abs() <= 2.0, "{is} units of {lost}");
}
