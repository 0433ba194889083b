//! What the liquid carries: amounts add up to the last one, and concentrations stay between those that came in.

use frazil::geometry::DVec3;
use frazil::shallow::columns::grid::Grid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::Kind;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Law, Params, Scalar, Shallow, Snapshot};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, FRAME, Frames, from_corner, point, pour_each, stacked};
use crate::common::shallow::{Plan, Turn, busy, context, turnable};

/// Levels in a range.
const LEVELS: f64 = (1 << 20) as f64;

/// A dye, an age, and a warmth that goes.
fn three() -> [Scalar; 3] {
    let scalar = |name: &str, law, range| Scalar { name: name.into(), law, range };
    [Scalar::dye("dye"), scalar("age", Law::Ages, 30.0), scalar("warmth", Law::Decays(0.5), 50.0)]
}

/// A scene whose liquid carries scalars from the beginning.
fn scene(ctx: &Context, plan: &Plan, turn: Turn, scalars: &[Scalar], poured: &[f64]) -> Shallow {
    let mut liquid = Plan { depths: Vec::new(), ..plan.clone() }.make(ctx, turn);
    liquid.set_scalars(scalars).unwrap();
    liquid.set_poured(poured).unwrap();
    for (index, depths) in plan.depths.iter().enumerate() {
        let cell = turn.cell([index % plan.size[0], index / plan.size[0]], plan.size);
        for (layer, &depth) in depths.iter().enumerate() {
            if let Some(column) = liquid.columns().column(cell, layer) {
                liquid.pour(column, depth);
            }
        }
    }
    liquid
}

/// A ball somewhere in a domain, or a pillar that leaves no room for what is in its middle, or nothing.
fn body(dice: &mut Dice, liquid: &Shallow) -> Vec<Shape> {
    let Grid { cell, origin, size } = liquid.columns().grid;
    let position = |axis: usize, at: f64| origin[axis] + at * size[axis] as f64 * cell;
    let at =
        [position(0, dice.between(0.0, 1.0)), dice.between(0.0, 0.06), position(1, dice.between(0.0, 1.0))];
    let (centre, radius) = (DVec3::from(at), dice.between(1.0, 6.0) * cell);
    let pillar =
        Shape::Cuboid { centre, axes: [DVec3::x(), DVec3::y(), DVec3::z()], half: [radius, 1.0, radius] };
    let bodies = [vec![], vec![Shape::Sphere { centre, radius }], vec![pillar]];
    bodies[dice.below(3)].clone()
}

fn concentrations(liquid: &Shallow, scalar: usize) -> Vec<f32> {
    let mut out = vec![7.0; liquid.columns().len()];
    liquid.concentrations(scalar, &mut out).unwrap();
    out
}

#[test]
fn sums_are_exact_and_concentrations_stay_between_those_that_came_in() {
    let ctx = context();
    let (mut held, mut dried) = (0.0_f64, 0.0_f64);
    for seed in 0..30 {
        let plan = turnable(seed);
        let mut dice = Dice(seed ^ 0x5ca1);
        let mut liquid = scene(&ctx, &plan, Turn::NONE, &three(), &[0.25, 0.0, -20.0]);
        for (at, point) in plan.points.iter().enumerate() {
            if point.kind == Kind::Source {
                liquid.set_sourced(at, &[0.75, 2.0, 5.0]).unwrap();
            }
        }
        for frame in 0..40 {
            if frame % 3 == 0 {
                liquid.set_poured(&[dice.between(0.25, 0.75), dice.between(0.0, 3.0), 0.0]).unwrap();
                let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
                plan.pour(&mut liquid, Turn::NONE, corners, [-1.0, 1e-4, -1e-5, 1e-3][dice.below(4)]);
            }
            if frame % 5 == 4 {
                let bodies = body(&mut dice, &liquid);
                liquid.set_bodies(&bodies).unwrap();
            }
            liquid.step(&ctx, FRAME).unwrap();
            assert_eq!(liquid.balance().error, 0, "seed {seed}, frame {frame}");
            for (scalar, (low, high)) in [(0.25, 0.75), (0.0, 30.0), (-20.0, 5.0)].into_iter().enumerate() {
                let balance = liquid.scalar_balance(scalar).unwrap();
                assert_eq!(balance.error, 0, "seed {seed}, frame {frame}, scalar {scalar}: {balance:?}");
                held = held.max(balance.held);
                dried = dried.max(balance.dried.abs());
                let range = liquid.scalars()[scalar].range;
                for (index, own) in concentrations(&liquid, scalar).into_iter().enumerate() {
                    let depth = liquid.depths()[index];
                    if depth == 0 {
                        assert_eq!(own, 0.0, "seed {seed}, frame {frame}, scalar {scalar}");
                        continue;
                    }
                    // A level, and half an amount for each pipe; f32.
                    let off = range * ((1.0 + 16.0 / f64::from(depth)) / LEVELS + 1e-7);
                    let within = low - off..=high + off;
                    assert!(
                        within.contains(&f64::from(own)),
                        "seed {seed}, frame {frame}, scalar {scalar}: {own} in {depth} units"
                    );
                }
            }
        }
    }
    assert!(held > 0.0 && dried > 0.0, "nothing waited, or ran dry: {held} {dried}");
}

#[test]
fn a_uniform_concentration_stays_uniform_to_the_bit() {
    let ctx = context();
    let dyes = ["a", "b", "c", "d"].map(Scalar::dye);
    let of = [1.0, 0.3, -0.7, 1e-6];
    for seed in 0..30 {
        let plan = turnable(seed);
        let mut dice = Dice(seed ^ 0x0a11);
        let mut liquid = scene(&ctx, &plan, Turn::NONE, &dyes, &of);
        for at in 0..plan.points.len() {
            liquid.set_sourced(at, &of).unwrap();
        }
        for frame in 0..30 {
            if frame % 5 == 4 {
                let bodies = body(&mut dice, &liquid);
                liquid.set_bodies(&bodies).unwrap();
            }
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            plan.pour(&mut liquid, Turn::NONE, corners, [-1.0, 1e-4, -1e-5][dice.below(3)]);
            liquid.step(&ctx, FRAME).unwrap();
            for (scalar, of) in of.into_iter().enumerate() {
                let wanted = ((of * LEVELS).round() / LEVELS) as f32;
                let all = concentrations(&liquid, scalar);
                let off = (0..all.len()).find(|&at| liquid.depths()[at] > 0 && all[at] != wanted);
                assert_eq!(off, None, "seed {seed}, frame {frame}, scalar {scalar}");
                assert_eq!(liquid.scalar_balance(scalar).unwrap().dried, 0.0);
            }
        }
    }
}

/// Level ground of so many cells of 2 mm, with walls around.
fn basin(ctx: &Context, size: [usize; 2], scalars: &[Scalar]) -> Shallow {
    let solids = stacked(from_corner(0.002, size), [0.0, 0.1], |_| vec![[DOWN, 0.01]]);
    let params = Params { pace: TimeStepping::Realtime(0.003), ..Params::default() };
    let mut liquid = Shallow::new(ctx, &solids, params).unwrap();
    liquid.set_scalars(scalars).unwrap();
    liquid
}

/// A source and a drain of a rate (m3/s) over a whole basin.
fn through(liquid: &mut Shallow, rate: f64) {
    let point = |kind| self::point(kind, [0.008, 0.01, 0.008], 0.1, rate);
    liquid.set_flows(&[point(Kind::Source), point(Kind::Drain)], |at| at.to_string()).unwrap();
}

#[test]
fn irrigation_thins_a_well_mixed_basin_by_the_exponential() {
    let ctx = context();
    let mut liquid = basin(&ctx, [8, 8], &[Scalar::dye("dye"), Scalar::dye("water")]);
    liquid.set_poured(&[1.0, 0.0]).unwrap();
    liquid.fill(0.012);
    // 512 mm3 are exchanged each four seconds.
    through(&mut liquid, 512e-9 / 4.0);
    liquid.set_sourced(0, &[0.0, 1.0]).unwrap();
    for frame in 1..=600 {
        liquid.step(&ctx, FRAME).unwrap();
        let gone = libm::exp(-f64::from(frame) * FRAME / 4.0);
        let everywhere = [[-1.0; 3], [1.0; 3]];
        let [dye, water] =
            [0, 1].map(|at| liquid.view().mean_concentration(at, everywhere[0], everywhere[1]).unwrap());
        // A step exchanges a 1,333rd, which counts half as much twice.
        assert!((dye / gone - 1.0).abs() < 1.2e-3, "{dye} for {gone} after frame {frame}");
        assert!((dye + water - 1.0).abs() < 1e-5, "{dye} + {water}");
    }
}

#[test]
fn liquid_ages_by_the_time_and_decays_by_its_half_life() {
    let ctx = context();
    let [_, age, warmth] = three();
    let mut liquid = basin(&ctx, [8, 8], &[age, warmth]);
    liquid.set_poured(&[0.5, 40.0]).unwrap();
    liquid.fill(0.0101);
    for frame in 1..=120 {
        liquid.step(&ctx, FRAME).unwrap();
        let time = f64::from(frame) * FRAME;
        let [age, warmth] = [0, 1].map(|scalar| f64::from(liquid.concentration(scalar, 3)));
        assert!((age - 0.5 - time).abs() < 60.0 / LEVELS + 1e-6, "{age} after {time} s");
        let wanted = 40.0 * libm::exp2(-time / 0.5);
        assert!((warmth - wanted).abs() < 50.0 * (0.5 / 1024.0 + 3.0 / LEVELS), "{warmth} for {wanted}");
    }
    // No older than its range; and none of it is lost.
    liquid.step(&ctx, 60.0).unwrap();
    assert_eq!(liquid.concentration(0, 3), 30.0);
    assert_eq!([0, 1].map(|at| liquid.scalar_balance(at).unwrap().error), [0; 2]);
    // In the mean, liquid that is exchanged is as old as the exchange takes.
    let mut liquid = basin(&ctx, [8, 8], &three()[1..2]);
    liquid.fill(0.012);
    through(&mut liquid, 512e-9 / 0.5);
    liquid.frames(&ctx, FRAME, 300);
    assert!((liquid.concentration(0, 3) - 0.5).abs() < 0.004, "{}", liquid.concentration(0, 3));
}

/// A wide scene of dye and age that flows through several bands of rows.
fn wide(ctx: &Context, plan: &Plan, turn: Turn) -> Shallow {
    let mut liquid = scene(ctx, plan, turn, &three(), &[0.5, 1.0, 10.0]);
    for (at, point) in plan.points.iter().enumerate() {
        let sourced = [0.1 * at as f64, 0.0, 7.0];
        liquid.set_sourced(at, if point.kind == Kind::Source { &sourced } else { &[0.0; 3] }).unwrap();
    }
    liquid
}

#[test]
fn any_number_of_threads_carries_the_same() {
    let mut plan = busy([517, 403]);
    // Liquid with stripes of dye under it.
    plan.params.border = Border::Absorbing;
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let mut liquid = wide(&ctx, &plan, Turn::NONE);
        for stripe in 0..20 {
            liquid.set_poured(&[0.05 * f64::from(stripe), 0.0, 0.0]).unwrap();
            let row = 20 * stripe as usize;
            plan.pour(&mut liquid, Turn::NONE, [[0, row], [516, row + 19]], 1e-3);
        }
        liquid.frames(&ctx, FRAME, 3);
        liquid
    };
    let alone = run(0);
    for scalar in 0..3 {
        assert_eq!(alone.scalar_balance(scalar).unwrap().error, 0);
    }
    for threads in [2, 3, 5] {
        let other = run(threads);
        assert!(alone.save() == other.save(), "{threads} threads");
        for scalar in 0..3 {
            assert!(concentrations(&alone, scalar) == concentrations(&other, scalar));
            assert_eq!(alone.scalar_balance(scalar).unwrap(), other.scalar_balance(scalar).unwrap());
        }
    }
}

#[test]
fn turned_and_mirrored_scenes_carry_the_same() {
    let ctx = context();
    for seed in 0..20 {
        let plan = turnable(seed);
        let of = |liquid: &Shallow, turn: Turn| {
            let mut out = Vec::new();
            for index in 0..plan.solids.len() {
                let cell = turn.cell([index % plan.size[0], index / plan.size[0]], plan.size);
                for column in liquid.columns().of_cell(cell) {
                    out.push([0, 1, 2].map(|scalar| liquid.concentration(scalar, column).to_bits()));
                }
            }
            out
        };
        let mut liquids = Turn::ALL.map(|turn| (wide(&ctx, &plan, turn), turn));
        for frame in 0..25 {
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            let (depth, dye) = ([-1.0, 1e-4, 0.0][dice.below(3)], dice.between(0.0, 1.0));
            for (liquid, turn) in &mut liquids {
                liquid.set_poured(&[dye, 0.0, 1.0]).unwrap();
                plan.pour(liquid, *turn, corners, depth);
                liquid.step(&ctx, FRAME).unwrap();
            }
            let wanted = of(&liquids[0].0, Turn::NONE);
            for (liquid, turn) in &liquids[1..] {
                assert!(of(liquid, *turn) == wanted, "seed {seed}, frame {frame}, {turn:?}");
            }
        }
    }
}

#[test]
fn a_restored_liquid_carries_on_to_the_same_bytes() {
    let ctx = context();
    for seed in 0..12 {
        let plan = turnable(seed);
        let mut straight = wide(&ctx, &plan, Turn::NONE);
        let mut resumed: Option<Shallow> = None;
        for frame in 0..30 {
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            let depth = [-1.0, 1e-4, 0.0][dice.below(3)];
            for liquid in std::iter::once(&mut straight).chain(&mut resumed) {
                liquid.set_poured(&[0.9, 2.0, -3.0]).unwrap();
                plan.pour(liquid, Turn::NONE, corners, depth);
                liquid.step(&ctx, FRAME).unwrap();
            }
            let saved = straight.save();
            if let Some(resumed) = &resumed {
                assert!(resumed.save() == saved, "seed {seed}, frame {frame}");
                for scalar in 0..3 {
                    assert_eq!(
                        resumed.scalar_balance(scalar).unwrap(),
                        straight.scalar_balance(scalar).unwrap()
                    );
                }
            }
            if frame == 11 {
                let mut other = wide(&ctx, &plan, Turn::NONE);
                other.step(&ctx, 0.1).unwrap();
                other.restore(&saved).unwrap();
                assert!(other.save() == saved);
                resumed = Some(other);
            }
        }
    }
}

#[test]
fn a_state_of_other_scalars_is_refused() {
    let ctx = context();
    let mut liquid = basin(&ctx, [8, 8], &three());
    liquid.set_poured(&[0.5, 1.0, 2.0]).unwrap();
    liquid.fill(0.011);
    liquid.step(&ctx, FRAME).unwrap();
    let saved = liquid.save();
    let refusal = |scalars: &[Scalar]| {
        let mut other = basin(&ctx, [8, 8], scalars);
        let before = other.save();
        let refusal = other.restore(&saved).unwrap_err().to_string();
        assert!(other.save() == before);
        refusal
    };
    let same = "set the same ones first";
    assert_eq!(refusal(&[]), format!("the saved state has 3 scalars, and the liquid 0: {same}"));
    let [dye, age, warmth] = three();
    let other = Scalar { law: Law::Decays(0.6), ..warmth.clone() };
    let law = refusal(&[dye.clone(), age.clone(), other]);
    assert_eq!(law, "the saved state has another law for scalar 2 than the liquid");
    let range = refusal(&[dye, Scalar { range: 20.0, ..age.clone() }, warmth.clone()]);
    assert_eq!(range, "the saved state has another range for scalar 1 than the liquid");
    // Names are the host's.
    let mut named = basin(&ctx, [8, 8], &[Scalar::dye("ink"), age, warmth]);
    named.restore(&saved).unwrap();
    assert!(named.save() == saved);
}

#[test]
fn snapshots_and_boxes_show_concentrations() {
    let ctx = context();
    let mut liquid = basin(&ctx, [40, 8], &[Scalar::dye("dye")]);
    liquid.fill(0.012);
    liquid.set_poured(&[1.0]).unwrap();
    let column = liquid.columns().column([35, 4], 0).unwrap();
    liquid.pour(column, 0.002);
    let mut snapshot = Snapshot::new(&liquid);
    assert_eq!((snapshot.concentrations(0)[column], snapshot.concentrations(1).len()), (0.5, 0));
    // Of the lower half of the column as much as of all.
    let (low, high) = ([0.070, 0.01, 0.008], [0.072, 0.012, 0.010]);
    for view in [liquid.view(), snapshot.view()] {
        assert_eq!(view.mean_concentration(0, low, high).unwrap(), 0.5);
        let all = view.mean_concentration(0, [-1.0; 3], [1.0; 3]).unwrap();
        assert!((all * 321.0 - 1.0).abs() < 1e-6, "{all}");
        assert_eq!(view.mean_concentration(0, [0.0, 0.05, 0.0], [1.0; 3]).unwrap(), 0.0);
        assert!(view.mean_concentration(1, low, high).unwrap_err().to_string().contains("no scalar 1"));
    }
    for _ in 0..3 {
        liquid.step(&ctx, FRAME).unwrap();
        snapshot.take(&liquid);
        assert!(snapshot.concentrations(0) == concentrations(&liquid, 0));
    }
    // Where it has run dry since, it is forgotten.
    pour_each(&mut liquid, |_| -1.0);
    liquid.frames(&ctx, FRAME, 2);
    snapshot.take(&liquid);
    assert!(snapshot.concentrations(0).iter().all(|own| *own == 0.0));
    liquid.set_scalars(&[]).unwrap();
    snapshot.take(&liquid);
    assert!(snapshot.concentrations(0).is_empty());
}

#[test]
fn wrong_scalars_are_a_sentence() {
    let ctx = context();
    let mut liquid = basin(&ctx, [4, 4], &[Scalar::dye("dye")]);
    let five: Vec<Scalar> = (0..5).map(|at| Scalar::dye(&at.to_string())).collect();
    assert_eq!(liquid.set_scalars(&five).unwrap_err().to_string(), "5 scalars: at most 4 are allowed");
    let twice = [Scalar::dye("dye"), Scalar::dye("dye")];
    assert!(liquid.set_scalars(&twice).unwrap_err().to_string().contains("\"dye\""));
    for (scalar, what) in [
        (Scalar::dye(""), "scalar 0: name is empty"),
        (Scalar { range: f64::NAN, ..Scalar::dye("a") }, "scalar 0: range = NaN is not within 1e-9 to 1e9"),
        (
            Scalar { law: Law::Decays(0.0), ..Scalar::dye("a") },
            "scalar 0: a half-life of 0 s is not within 1e-6 to 1e12",
        ),
    ] {
        assert_eq!(liquid.set_scalars(&[scalar]).unwrap_err().to_string(), what);
    }
    assert_eq!(liquid.scalars(), [Scalar::dye("dye")]);
    let not_one = "2 concentrations for 1 scalars: one each is needed";
    assert_eq!(liquid.set_poured(&[0.0, 0.0]).unwrap_err().to_string(), not_one);
    let nan = "a concentration of NaN of \"dye\" is not within -1 to 1";
    assert_eq!(liquid.set_poured(&[f64::NAN]).unwrap_err().to_string(), nan);
    assert!(liquid.set_sourced(0, &[1.0]).unwrap_err().to_string().contains("no flow point 0"));
    assert!(liquid.scalar_balance(1).unwrap_err().to_string().contains("no scalar 1 among 1"));
    assert!(liquid.concentrations(0, &mut [0.0; 3]).unwrap_err().to_string().contains("room for 3"));
}
