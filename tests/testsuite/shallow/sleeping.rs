//! Pools come to rest and sleep, and nothing depends on whether they do.

use frazil::geometry::DVec3;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames};
use crate::common::shallow::{Plan, Turn, context, covered, ground, random_params, source, waves};

/// Blood of 2 mm on ground that rolls, after so many frames.
fn pool(ctx: &Context, frames: usize) -> Shallow {
    let cell = 0.001;
    let solids = ground([90, 70], cell, [-0.01, 0.1], |at| 3e-4 * waves(at, cell));
    let mut pool = covered(ctx, &solids, Params { rest: 1e-6, ..Params::default() }, |[x, z], _| {
        2e-3 + 4e-4 * waves([2.0 * z, 2.0 * x], cell)
    });
    pool.frames(ctx, FRAME, frames);
    pool
}

/// Count of pipes that something flows through.
fn flowing(liquid: &Shallow) -> usize {
    liquid.fluxes().into_iter().flatten().filter(|flux| **flux != 0.0).count()
}

#[test]
fn a_pool_comes_to_rest() {
    let ctx = context();
    let mut pool = pool(&ctx, 400);
    assert_eq!(flowing(&pool), 0);
    let before = pool.save();
    let deepest = pool.step(&ctx, FRAME).unwrap().deepest;
    // Nothing but the time has changed.
    let after = pool.save();
    let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
    assert!(before.len() == after.len() && changed < 64, "{changed} bytes");
    // It is level to what a slope of 6e-6 makes over the pool.
    let columns = pool.columns();
    let surfaces = columns.indices().map(|i| columns.bases()[i] + pool.depths()[i]);
    let (low, high) = surfaces.fold((i32::MAX, 0), |(low, high), eta| (low.min(eta), high.max(eta)));
    let off = columns.heights.length(f64::from(high - low));
    assert!(off < 6.2e-6 * 0.16, "{off} m");
    let depth = pool.depths().iter().copied().max().unwrap();
    assert_eq!(deepest, columns.heights.length(f64::from(depth)));
}

#[test]
fn liquid_that_never_rests_stays_awake() {
    let ctx = context();
    let mut pool = pool(&ctx, 0);
    pool.set_params(Params { rest: 0.0, ..Params::default() }).unwrap();
    pool.frames(&ctx, FRAME, 400);
    assert!(flowing(&pool) > 0);
    for rest in [-1e-9, 0.02, f64::NAN] {
        let error = pool.set_params(Params { rest, ..Params::default() }).unwrap_err().to_string();
        assert_eq!(error, format!("rest = {rest} m/s is not within 0 to 0.01"));
    }
}

#[test]
fn whatever_happens_to_it_wakes_a_pool() {
    let ctx = context();
    let asleep = pool(&ctx, 400);
    let saved = asleep.save();
    type Wake = fn(&mut Shallow);
    let wakes: [(&str, Wake); 5] = [
        ("a drop", |pool| {
            pool.pour(pool.columns().column([40, 35], 0).unwrap(), 1e-5);
        }),
        ("a sip", |pool| {
            pool.pour(pool.columns().column([40, 35], 0).unwrap(), -1e-5);
        }),
        ("a source", |pool| {
            pool.set_flows(&[source([0.011, 0.001, -0.02], 0.0, 1e-8)], |_| "it".into()).unwrap();
        }),
        ("a body", |pool| {
            let shape = Shape::Sphere { centre: DVec3::new(0.01, 0.0, 0.01), radius: 0.004 };
            pool.set_bodies(&[shape]).unwrap();
        }),
        ("gravity", |pool| {
            let gravity = [0.02, -9.81, 0.0];
            pool.set_params(Params { gravity, rest: 1e-6, ..Params::default() }).unwrap();
        }),
    ];
    for (what, wake) in wakes {
        // A liquid that knows nothing of sleep does the same.
        let [mut pool, mut other] = [(); 2].map(|()| pool(&ctx, 0));
        other.set_sleepless(true);
        for pool in [&mut pool, &mut other] {
            pool.restore(&saved).unwrap();
            pool.frames(&ctx, FRAME, 3);
            wake(pool);
        }
        let mut most = 0;
        for frame in 0..60 {
            assert_eq!(pool.step(&ctx, FRAME).unwrap(), other.step(&ctx, FRAME).unwrap(), "{what}: {frame}");
            most = most.max(flowing(&pool));
        }
        assert!(pool.save() == other.save(), "{what}");
        assert!(most > 1000, "{what}: {most} pipes");
    }
}

/// Terraces and slabs over some of them, of which most comes to rest soon.
fn sluggish(seed: u64) -> Plan {
    let mut dice = Dice(seed);
    let size = [40 + dice.below(60), 20 + dice.below(30)];
    let cell = 1.0 / 1024.0;
    let (terrace, has_slabs) = (8 + dice.below(16), dice.one_in(2));
    let mut plan = Plan::new(size, cell, [-0.0625, 0.0625], |at| {
        let [x, z] = at.map(|at| (at / (cell * terrace as f64)).floor() as i64);
        let low = 0.002 * (x * 5 + z * 3).rem_euclid(4) as f64;
        let mut solids = vec![[-0.06, low]];
        if has_slabs && (x + z).rem_euclid(3) == 0 {
            solids.push([0.0085, 0.0095]);
        }
        solids
    });
    let depth = [2e-4, 2e-3][dice.below(2)];
    for (solids, depths) in plan.solids.iter().zip(&mut plan.depths) {
        *depths = (0..solids.len()).map(|_| depth * dice.between(0.9, 1.1)).collect();
    }
    for _ in 0..2 {
        let at = [dice.between(2.0, 38.0), 0.004, dice.between(2.0, 18.0)];
        plan.points.push(source(at, 5.0, 1e-6 * dice.between(0.1, 1.0)));
    }
    plan.params = random_params(&mut dice, 0.004);
    plan.params.gravity = [0.0, -9.81, 0.0];
    plan.params.kept = [0.0, 0.01][dice.below(2)];
    plan.params.rest = [1e-4, 1e-3, 0.01][dice.below(3)];
    if dice.one_in(3) {
        plan.params.pace = TimeStepping::Exact;
        plan.params.liquid.viscosity = plan.params.liquid.viscosity.min(1e-3);
    }
    plan
}

#[test]
fn nothing_depends_on_sleep() {
    let ctx = context();
    let mut rested = 0;
    for seed in 1..25 {
        let plan = sluggish(seed);
        let [mut liquid, mut other] = [(); 2].map(|()| plan.make(&ctx, Turn::NONE));
        other.set_sleepless(true);
        // The sources run dry for a while.
        for liquid in [&mut liquid, &mut other] {
            for (at, point) in plan.points.iter().enumerate().filter(|(at, _)| at % 2 == 0) {
                liquid.set_rate(at, 0.01 * point.rate).unwrap();
            }
        }
        for frame in 0..60 {
            if frame % 16 == 9 {
                let cells = [[frame, 3], [frame + 5, 4]];
                for liquid in [&mut liquid, &mut other] {
                    plan.pour(liquid, Turn::NONE, cells, 1e-5);
                }
            }
            let reports = [&mut liquid, &mut other].map(|liquid| liquid.step(&ctx, FRAME).unwrap());
            assert_eq!(reports[0], reports[1], "seed {seed}, frame {frame}");
            assert!(liquid.save() == other.save(), "seed {seed}, frame {frame}");
        }
        rested += usize::from(2 * flowing(&liquid) < liquid.columns().count());
    }
    assert!(rested > 2, "{rested} of 24");
}

#[test]
fn threads_let_the_same_sleep() {
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let cell = 0.0005;
        let solids = ground([400, 300], cell, [-0.01, 0.1], |at| 3e-4 * waves(at, cell));
        let params = Params { rest: 1e-4, ..Params::default() };
        let mut liquid = covered(&ctx, &solids, params, |[x, z], _| {
            1e-3 + if x * x + z * z < 4e-4 { 2e-4 * waves([x, z], cell) } else { 0.0 }
        });
        let reports: Vec<_> = (0..20).map(|_| liquid.step(&ctx, FRAME).unwrap()).collect();
        (liquid.save(), reports)
    };
    let alone = run(0);
    assert!(run(3) == alone);
}
