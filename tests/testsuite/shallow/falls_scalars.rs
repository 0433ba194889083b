//! What falls freely carries its scalars with it: none of them is lost in the air, and they land with the liquid.

use frazil::shallow::free_fall::Falls;
use frazil::shallow::sources::Kind;
use frazil::shallow::{Law, Params, Scalar, Shallow};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, FRAME, Frames, from_corner, stacked};
use crate::common::shallow::{Plan, Turn, context, source, turnable};

/// A dye, an age, and a warmth that goes.
fn three() -> [Scalar; 3] {
    let scalar = |name: &str, law, range| Scalar { name: name.into(), law, range };
    [Scalar::dye("dye"), scalar("age", Law::Ages, 30.0), scalar("warmth", Law::Decays(0.05), 50.0)]
}

/// Rough ground, of which liquid falls from ledge to ledge.
fn falling(seed: u64) -> Plan {
    let mut plan = turnable(seed);
    let most = if seed.is_multiple_of(3) { 40 } else { 4000 };
    plan.params.falls = Some(Falls { height: 0.001, drop: 0.0, max_packets: most, ..Falls::default() });
    plan
}

fn carrying(ctx: &Context, plan: &Plan, turn: Turn) -> Shallow {
    let mut liquid = plan.make(ctx, turn);
    liquid.set_scalars(&three()).unwrap();
    for (at, point) in plan.points.iter().enumerate() {
        if point.kind == Kind::Source {
            liquid.set_sourced(at, &[0.75, 2.0, 5.0]).unwrap();
        }
    }
    liquid
}

#[test]
fn a_turned_or_mirrored_scene_carries_the_same_through_the_air() {
    let ctx = context();
    let mut flown = 0.0;
    for seed in 0..30 {
        let plan = falling(seed);
        let mut liquids = Turn::ALL.map(|turn| carrying(&ctx, &plan, turn));
        for frame in 0..12 {
            let all = liquids.iter_mut().zip(Turn::ALL).map(|(liquid, turn)| {
                let mut dice = Dice(seed << 32 | frame);
                let poured = [dice.between(-0.5, 0.75), dice.between(0.0, 3.0), 20.0];
                liquid.set_poured(&poured).unwrap();
                let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
                plan.pour(liquid, turn, corners, [-1.0, 1e-4, 1e-3][dice.below(3)]);
                liquid.step(&ctx, FRAME).unwrap();
                let balances = [0, 1, 2].map(|scalar| liquid.scalar_balance(scalar).unwrap());
                for balance in &balances {
                    assert_eq!(balance.error, 0, "seed {seed}, frame {frame}: {balance:?}");
                }
                let mut drops: Vec<[u64; 4]> = liquid
                    .drops()
                    .map(|drop| {
                        let [dye, age, warmth, _] = drop.concentrations.map(|own| u64::from(own.to_bits()));
                        [drop.position[1].to_bits(), drop.volume.to_bits(), dye << 32 | age, warmth]
                    })
                    .collect();
                drops.sort_unstable();
                (plan.depths_of(liquid, turn), drops, balances)
            });
            let all: Vec<_> = all.collect();
            flown += all[0].2[0].falling.abs();
            assert!(all.iter().all(|other| *other == all[0]), "seed {seed}, frame {frame}");
        }
    }
    assert!(flown > 0.0);
}

/// A shelf over a floor, and a source on it; what falls takes 0.2 s.
fn shelf(ctx: &Context, most: usize) -> Shallow {
    let solids = stacked(from_corner(0.004, [40, 12]), [0.0, 0.4], |[x, _]| {
        vec![[DOWN, if x < 20 { 0.25 } else { 0.05 }]]
    });
    let falls = Falls { drop: 0.0, max_packets: most, ..Falls::default() };
    let mut liquid = Shallow::new(ctx, &solids, Params { falls: Some(falls), ..Params::default() }).unwrap();
    liquid.set_flows(&[source([0.06, 0.25, 0.024], 0.004, 5e-6)], |_| "the source".into()).unwrap();
    liquid.set_scalars(&three()).unwrap();
    liquid.set_sourced(0, &[0.625, 1.0, 0.0]).unwrap();
    liquid
}

#[test]
fn drops_have_the_concentration_of_what_they_come_from_and_age_in_the_air() {
    let ctx = context();
    let mut liquid = shelf(&ctx, 8192);
    liquid.frames(&ctx, FRAME, 120);
    assert!(liquid.drops().len() > 100);
    let mut oldest = 0.0_f64;
    for drop in liquid.drops() {
        let [dye, age, warmth, none] = drop.concentrations.map(f64::from);
        assert!(dye == 0.625 && warmth == 0.0 && none == 0.0, "{drop:?}");
        // It came in as old as a second, and has been in the air since it fell.
        assert!(age >= 1.0 + drop.age - 1e-3 && age < 3.01, "{drop:?}");
        oldest = oldest.max(drop.age);
    }
    assert!(oldest > 0.15);
    let columns = liquid.columns();
    let below = columns.indices().filter(|&i| columns.cell(i)[0] >= 20 && liquid.depths()[i] > 0);
    let below: Vec<usize> = below.collect();
    assert!(below.len() > 20 && below.iter().all(|&i| liquid.concentration(0, i) == 0.625));
    let balance = liquid.scalar_balance(0).unwrap();
    assert!(balance.error == 0 && balance.falling > 1e-8, "{balance:?}");
    assert!((balance.falling / liquid.balance().falling - 0.625).abs() < 1e-9);
}

#[test]
fn a_restored_liquid_and_any_number_of_threads_carry_the_same_through_the_air() {
    let run = |threads: usize, frames: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let solids = stacked(from_corner(0.002, [340, 320]), [0.0, 0.3], |[x, z]| {
            vec![[DOWN, if (x / 20 + z / 3) % 3 == 0 { 0.01 + 1e-5 * x as f64 } else { 0.15 }]]
        });
        let falls = Falls { max_packets: 1 << 16, ..Falls::default() };
        let mut liquid =
            Shallow::new(&ctx, &solids, Params { falls: Some(falls), ..Params::default() }).unwrap();
        liquid.set_scalars(&three()).unwrap();
        for index in liquid.columns().indices().collect::<Vec<_>>() {
            let [x, z] = liquid.columns().cell(index);
            liquid.set_poured(&[0.001 * ((3 * x + z) % 700) as f64, 0.0, 5.0]).unwrap();
            liquid.pour(index, 0.0001 * ((x * x + 5 * z) % 23) as f64);
        }
        liquid.frames(&ctx, FRAME, frames);
        (liquid, ctx)
    };
    let (mut alone, ctx) = run(0, 6);
    let saved = alone.save();
    assert!(alone.drops().len() > 1000 && alone.scalar_balance(0).unwrap().falling > 0.0);
    for threads in [2, 3] {
        assert!(run(threads, 6).0.save() == saved, "{threads} threads");
    }
    let (mut resumed, _) = run(0, 1);
    resumed.restore(&saved).unwrap();
    assert!(resumed.save() == saved);
    for _ in 0..8 {
        resumed.step(&ctx, FRAME).unwrap();
        alone.step(&ctx, FRAME).unwrap();
    }
    assert!(resumed.save() == alone.save());
    for scalar in 0..3 {
        let balance = alone.scalar_balance(scalar).unwrap();
        assert_eq!(balance.error, 0);
        assert_eq!(resumed.scalar_balance(scalar).unwrap(), balance);
    }
}

#[test]
fn what_waits_or_finds_no_room_in_the_air_keeps_its_scalars() {
    let ctx = context();
    let mut liquid = shelf(&ctx, 3);
    for frame in 0..120 {
        liquid.step(&ctx, FRAME).unwrap();
        assert!(liquid.drops().len() <= 3);
        for scalar in 0..3 {
            let balance = liquid.scalar_balance(scalar).unwrap();
            assert_eq!(balance.error, 0, "frame {frame}: {balance:?}");
        }
    }
    // Other scalars begin with nothing, in the air too.
    liquid.set_scalars(&[Scalar::dye("other")]).unwrap();
    let balance = liquid.scalar_balance(0).unwrap();
    assert_eq!((balance.falling, balance.inside, balance.error), (0.0, 0.0, 0));
}
