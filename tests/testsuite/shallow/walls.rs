//! Friction at walls and ceilings, and between liquids that flow side by side.

use frazil::shallow::material::Liquid;
use frazil::shallow::params::{Friction, Section, TimeStepping};
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, FRAME, Frames, assert_same_depths, at_all_levels, from_corner, stacked};
use crate::common::shallow::{
    Plan, Turn, context, covered, extreme, extreme_frame, ground, hash, turnable, violations,
};

const G: f64 = 9.81;
const CELL: f64 = 0.0005;

/// A liquid with friction at walls that loses nothing else.
fn walled(viscosity: f64) -> Params {
    let (liquid, friction) = (Liquid::new(viscosity), Friction::Walls);
    Params { liquid, friction, kept: 1.0, pace: TimeStepping::Exact, ..Params::default() }
}

/// A scene by chance, with friction at walls.
fn scene(seed: u64) -> Plan {
    let mut plan = turnable(seed);
    plan.params.friction = Friction::Walls;
    plan.params.section = Section::Wetted;
    plan
}

/// The mean velocity of a rectangular duct over that between two plates at its width (White, *Viscous Fluid Flow*, 3-3.3).
fn duct(width: f64, height: f64) -> f64 {
    let term = |n: f64| libm::tanh(n * std::f64::consts::PI * height / (2.0 * width)) / n.powi(5);
    let sum: f64 = (0..100).map(|i| term(f64::from(2 * i + 1))).sum();
    1.0 - 192.0 * width / (std::f64::consts::PI.powi(5) * height) * sum
}

/// Velocities (m/s) across a channel of so many cells between banks, of a depth (m), in which liquid of 1e-4 m2/s is driven along one axis by
/// gravity that leans by 0.02, after a time (s).
fn channel(across: usize, depth: f64, axis: usize, friction: Friction, time: f64) -> Vec<f64> {
    let ctx = context();
    let size = if axis == 0 { [9, across + 2] } else { [across + 2, 9] };
    let is_bank = |at: usize| at == 0 || at == across + 1;
    let solids = stacked(from_corner(CELL, size), [-0.02, 0.1], |cell| {
        vec![[DOWN, if is_bank(cell[1 - axis]) { 0.05 } else { 0.0 }]]
    });
    let heights = solids.heights;
    let mut gravity = [0.0, -G, 0.0];
    gravity[2 * axis] = 0.02 * G;
    let mut liquid = Shallow::new(&ctx, &solids, Params { gravity, friction, ..walled(1e-4) }).unwrap();
    let inside: Vec<usize> =
        liquid.columns().indices().filter(|&i| !is_bank(liquid.columns().cell(i)[1 - axis])).collect();
    for _ in 0..(time / 0.001) as usize {
        // As deep everywhere, whatever has flowed.
        for &column in &inside {
            let has = f64::from(liquid.depths()[column]) * heights.unit;
            liquid.pour(column, depth - has);
        }
        liquid.step(&ctx, 0.001).unwrap();
    }
    let velocity = |at: usize| {
        let cell = if axis == 0 { [4, at] } else { [at, 4] };
        let column = liquid.columns().column(cell, 0).unwrap();
        f64::from(liquid.depths()[column]) * heights.unit / depth * f64::from(liquid.velocity(column)[axis])
    };
    (1..=across).map(velocity).collect()
}

#[test]
fn a_channel_carries_what_theory_says_and_the_same_along_both_axes() {
    for (across, deep, most) in [(8, 8, 0.03), (8, 2, 0.02), (8, 1, 0.02), (4, 1, 0.02), (1, 1, 0.12)] {
        let depth = deep as f64 * CELL;
        let own = channel(across, depth, 0, Friction::Walls, 0.4);
        let wide = 0.02 * G * (across as f64 * CELL).powi(2) / (12.0 * 1e-4);
        let theory = wide * duct(across as f64 * CELL, 2.0 * depth);
        let off = own.iter().sum::<f64>() / across as f64 / theory - 1.0;
        assert!(off.abs() < most, "{across} x {deep} cells: {off}");
        assert_eq!(own, channel(across, depth, 1, Friction::Walls, 0.4), "{across} x {deep} cells");
    }
}

#[test]
fn a_wall_slows_what_is_beside_it() {
    let own = channel(8, 4.0 * CELL, 0, Friction::Walls, 0.3);
    assert!(own.windows(2).take(3).all(|pair| pair[1] > 1.1 * pair[0]), "{own:?}");
    let mirrored: Vec<f64> = own.iter().rev().copied().collect();
    assert_eq!(own, mirrored);
    let ground = channel(8, 4.0 * CELL, 0, Friction::Ground, 0.3);
    assert!(ground[4] > 1.5 * own[4], "{ground:?} {own:?}");
}

#[test]
fn films_far_thinner_than_a_cell_are_the_same_to_the_bit() {
    let ctx = context();
    let run = |friction: Friction| {
        let solids = ground([40, 24], CELL, [-0.01, 0.1], |[x, z]| 0.02 - 0.3 * x + 0.2 * z);
        let params = Params { friction, ..Params::default() };
        let mut film = covered(&ctx, &solids, params, |[x, _], _| if x < 0.0 { CELL / 40.0 } else { 0.0 });
        film.frames(&ctx, FRAME, 30);
        film
    };
    let (walls, ground) = (run(Friction::Walls), run(Friction::Ground));
    assert!(walls.depths() == ground.depths() && walls.fluxes() == ground.fluxes());
    assert!(walls.bytes() > ground.bytes());
}

#[test]
fn a_scene_that_is_turned_or_mirrored_flows_the_same() {
    let ctx = context();
    let mut acted = 0;
    for seed in 0..12 {
        let plan = scene(seed);
        let mut liquids = Turn::ALL.map(|turn| plan.make(&ctx, turn));
        let mut other =
            Plan { params: Params { friction: Friction::Ground, ..plan.params.clone() }, ..plan.clone() }
                .make(&ctx, Turn::NONE);
        for frame in 0..10 {
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            let depth = [-1.0, -1.0, 1e-4, 0.0][dice.below(4)];
            let mut depths = Vec::new();
            for (liquid, turn) in liquids.iter_mut().zip(Turn::ALL) {
                plan.pour(liquid, turn, corners, depth);
                liquid.step(&ctx, FRAME).unwrap();
                assert_eq!(liquid.balance().error, 0);
                depths.push(plan.depths_of(liquid, turn));
            }
            plan.pour(&mut other, Turn::NONE, corners, depth);
            other.step(&ctx, FRAME).unwrap();
            assert_same_depths(&depths, &format!("scene {seed}, frame {frame}"));
        }
        acted += u32::from(hash(&other) != hash(&liquids[0]));
    }
    assert!(acted > 6, "friction at walls did nothing in {} scenes", 12 - acted);
}

#[test]
fn depths_stay_within_their_columns_whatever_is_asked() {
    let ctx = context();
    for seed in 0..100 {
        let (mut plan, step) = extreme(seed);
        plan.params.friction = Friction::Walls;
        let mut liquid = plan.make(&ctx, Turn::NONE);
        for frame in 0..6 {
            extreme_frame(&ctx, &mut liquid, step, frame);
            assert_eq!(violations(&liquid), 0, "scene {seed}, frame {frame}");
            assert_eq!(liquid.balance().error, 0, "scene {seed}, frame {frame}");
        }
    }
}

/// Waves of 2 mm in basins that overflow into each other, in over 100,000 columns, of a viscosity (m2/s).
fn basins(ctx: &Context, viscosity: f64) -> Shallow {
    let rolling = |[x, z]: [f64; 2]| 0.001 * (libm::sin(900.0 * x) * libm::cos(700.0 * z)) - 0.02 * x;
    let solids = ground([352, 300], CELL, [-0.02, 0.1], rolling);
    let params = Params { pace: TimeStepping::Realtime(0.003), ..walled(viscosity) };
    covered(ctx, &solids, params, |[x, z], _| 0.002 + 0.001 * libm::sin(300.0 * x + 200.0 * z))
}

#[test]
fn more_threads_make_the_same_liquid() {
    for viscosity in [4e-6, 1e-3] {
        let hashes = [0, 2, 3].map(|threads| {
            let ctx = Context::new(Pool::new(threads).unwrap());
            let mut liquid = basins(&ctx, viscosity);
            liquid.frames(&ctx, FRAME, 3);
            hash(&liquid)
        });
        assert_eq!(hashes, [hashes[0]; 3], "{viscosity} m2/s");
    }
}

#[test]
fn a_restored_liquid_flows_on_to_the_same_bits() {
    let ctx = context();
    for seed in 0..6 {
        let plan = scene(seed);
        let (mut liquid, mut other) = (plan.make(&ctx, Turn::NONE), plan.make(&ctx, Turn::NONE));
        liquid.frames(&ctx, FRAME, 5);
        other.restore(&liquid.save()).unwrap();
        for _ in 0..5 {
            liquid.step(&ctx, FRAME).unwrap();
            other.step(&ctx, FRAME).unwrap();
        }
        assert_eq!(liquid.save(), other.save(), "scene {seed}");
    }
}

#[test]
fn a_lake_of_honey_stays_at_rest_and_a_disturbed_one_only_calms_down() {
    let ctx = context();
    let islands = |[x, z]: [f64; 2]| 0.004 * libm::sin(900.0 * x) * libm::cos(700.0 * z);
    let solids = ground([45, 37], CELL, [-0.01, 0.02], islands);
    let params = Params { pace: TimeStepping::Realtime(0.003), ..walled(0.4) };
    let mut liquid = covered(&ctx, &solids, params, |_, _| 0.0);
    liquid.fill(0.002);
    let before = liquid.depths().to_vec();
    liquid.frames(&ctx, FRAME, 30);
    let differ = liquid.depths().iter().zip(&before).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0);
    // Energy over that at rest, in units of height.
    let energy = |liquid: &Shallow| -> f64 {
        let columns = liquid.columns();
        let of = |column: usize| {
            let (base, depth) = (f64::from(columns.bases()[column]), f64::from(liquid.depths()[column]));
            let [u, v] = liquid.velocity(column).map(f64::from);
            depth * (base + 0.5 * depth) * columns.heights.unit + 0.5 * depth * (u * u + v * v) / G
        };
        columns.indices().map(of).sum()
    };
    for viscosity in [0.4, 1e-3] {
        let params = Params { pace: TimeStepping::Realtime(0.003), ..walled(viscosity) };
        let mut liquid = covered(&ctx, &solids, params, |_, _| 0.0);
        liquid.fill(0.002);
        let rest = energy(&liquid);
        let middle = liquid.columns().column([22, 18], 0).unwrap();
        liquid.pour(middle, 0.001);
        let mut last = energy(&liquid);
        for frame in 0..120 {
            liquid.step(&ctx, FRAME).unwrap();
            let now = energy(&liquid);
            assert!(now <= last + 1e-12 * rest.abs(), "{viscosity} m2/s, frame {frame}: {now} after {last}");
            last = now;
        }
    }
}

/// Set in the processes of [`all_instruction_sets_make_the_same_liquid`], which only print hashes.
const PRINTS: &str = "FRAZIL_TEST_PRINTS_WALLS";

#[test]
fn all_instruction_sets_make_the_same_liquid() {
    if std::env::var_os(PRINTS).is_some() {
        println!();
        for seed in 0..8 {
            let ctx = context();
            let mut liquid = scene(seed).make(&ctx, Turn::NONE);
            liquid.frames(&ctx, FRAME, 8);
            println!("liquid {seed} {:016x}", hash(&liquid));
        }
        return;
    }
    let liquids = at_all_levels("shallow::walls::all_instruction_sets_make_the_same_liquid", PRINTS);
    assert_eq!(liquids[0].len(), 8);
    assert_eq!([&liquids[1], &liquids[2]], [&liquids[0]; 2]);
}

#[test]
fn friction_is_chosen_once() {
    let ctx = context();
    let solids = ground([4, 4], CELL, [-0.01, 0.1], |_| 0.0);
    let mut liquid = covered(&ctx, &solids, Params::default(), |_, _| 0.0);
    let error = liquid.set_params(walled(1e-3)).unwrap_err().to_string();
    assert!(error.contains("friction cannot change"), "{error}");
}
