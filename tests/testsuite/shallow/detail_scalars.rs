//! What liquid in cells of two sizes carries: none of it is lost, what is uniform stays so, and states have it.

use frazil::geometry::DVec3;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Detail, Law, Params, Scalar, Shallow};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, bridged, four_points, near_cells, point, turned_box};
use crate::common::shallow::{Plan, Turn, context, ground, waves};

const CELL: f64 = 0.001;
const SIZE: [usize; 2] = [48, 36];

fn terrain(phase: f64) -> Solids {
    bridged(SIZE, |x| 1e-3 * libm::sin(phase + 80.0 * x))
}

fn scalars() -> Vec<Scalar> {
    let scalar = |name: &str, law, range| Scalar { name: name.into(), law, range };
    vec![
        Scalar::dye("dye"),
        scalar("heat", Law::Decays(0.7), 100.0),
        scalar("age", Law::Ages, 60.0),
        Scalar::dye("none"),
    ]
}

fn points() -> Vec<FlowPoint> {
    four_points([0.02, 0.015])
}

fn scene(border: Border, near: [std::ops::Range<usize>; 2]) -> Detail {
    let params = Params { border, pace: TimeStepping::Realtime(0.003), ..Params::default() };
    let mut detail = Detail::new(&context(), &terrain(0.0), params, near).unwrap();
    detail.set_scalars(&scalars()).unwrap();
    detail.set_poured(&[0.25, -50.0, 3.0, 0.0]).unwrap();
    detail.fill(0.001);
    detail.set_flows(&points(), |at| format!("point {at}")).unwrap();
    detail.set_sourced(0, &[1.0, 100.0, 0.0, 0.0]).unwrap();
    detail.set_sourced(1, &[0.0, 20.0, 0.0, 0.0]).unwrap();
    detail
}

/// Nothing is missing, and concentrations are within those that came in.
fn check(detail: &Detail, what: &str) {
    assert_eq!(detail.balance().error, 0, "{what}");
    for at in 0..4 {
        let balance = detail.scalar_balance(at).unwrap();
        assert_eq!(balance.error, 0, "{what}: scalar {at}: {balance:?}");
    }
    assert_eq!(detail.scalar_balance(3).unwrap().inside, 0.0);
    for liquid in [detail.fine(), detail.coarse()] {
        for column in liquid.columns().indices().filter(|&column| liquid.depths()[column] > 1000) {
            let [dye, heat] = [0, 1].map(|at| liquid.concentration(at, column));
            assert!(
                (-0.001..=1.001).contains(&dye) && (-50.1..=100.1).contains(&heat),
                "{what}: {dye}, {heat}"
            );
        }
    }
}

#[test]
fn nothing_of_a_scalar_is_lost() {
    let ctx = context();
    for border in [Border::Closed, Border::Open, Border::Absorbing] {
        let mut detail = scene(border, [16..32, 8..28]);
        let mut dice = Dice(5);
        for frame in 0..240 {
            let what = format!("{border:?}, frame {frame}");
            if frame % 3 == 0 {
                detail.set_near(near_cells(&mut dice, SIZE)).unwrap();
                check(&detail, &what);
            }
            if frame > 60 {
                let at = DVec3::new(-0.02 + 0.0002 * f64::from(frame), 0.003, 0.0);
                detail.set_bodies(&[Shape::Sphere { centre: at, radius: 0.006 }]).unwrap();
                check(&detail, &what);
            }
            if frame > 120 && frame % 4 == 0 {
                detail.update_terrain(&terrain(0.05 * f64::from(frame))).unwrap();
                check(&detail, &what);
            }
            detail.step(&ctx, FRAME).unwrap();
            check(&detail, &what);
        }
        let balance = detail.scalar_balance(0).unwrap();
        assert!(balance.sourced > 0.0 && balance.drained > 0.0 && balance.absorbed > 0.0, "{balance:?}");
        assert!(balance.dried.abs() < 1e-6 * balance.inside, "{balance:?}");
    }
}

#[test]
fn a_uniform_concentration_stays_so() {
    let ctx = context();
    let solids = ground(SIZE, CELL, [-0.02, 0.1], |at| 2e-3 * waves(at, CELL));
    let mut detail = Detail::new(&ctx, &solids, Params::default(), [16..32, 8..28]).unwrap();
    detail.set_scalars(&[Scalar::dye("dye")]).unwrap();
    detail.set_poured(&[0.625]).unwrap();
    detail.fill(0.003);
    detail.pour_at([0.0, 0.0, 0.0], 0.008, 1e-6).unwrap();
    for frame in 0..60_usize {
        let x = 2 * (frame % 20);
        detail.set_near([x..x + 8, 4..30]).unwrap();
        detail.step(&ctx, FRAME).unwrap();
        for liquid in [detail.fine(), detail.coarse()] {
            for column in liquid.columns().indices().filter(|&column| liquid.depths()[column] > 10_000) {
                let dye = liquid.concentration(0, column);
                assert!((dye - 0.625).abs() < 1e-4, "frame {frame}: {dye}");
            }
        }
    }
    let balance = detail.scalar_balance(0).unwrap();
    assert!((balance.inside + balance.held - 0.625 * detail.balance().poured).abs() < 1e-12, "{balance:?}");
}

#[test]
fn dye_crosses_the_edge() {
    // Down a slope, from coarse cells through fine ones to coarse ones.
    let ctx = context();
    let solids = ground([80, 16], CELL, [-0.05, 0.1], |[x, _]| 0.03 - 0.3 * x);
    let mut detail = Detail::new(&ctx, &solids, Params::default(), [30..50, 0..16]).unwrap();
    detail.set_scalars(&[Scalar::dye("dye")]).unwrap();
    let source = |z: f64| point(Kind::Source, [-0.038, 0.042, z], 0.0015, 1e-6);
    let sources: Vec<FlowPoint> = (0..8).map(|at| source(-0.007 + 0.002 * f64::from(at))).collect();
    detail.set_flows(&sources, |at| format!("point {at}")).unwrap();
    (0..8).for_each(|at| detail.set_sourced(at, &[0.5]).unwrap());
    (0..240).for_each(|_| assert!(detail.step(&ctx, FRAME).unwrap().steps > 0));
    for (liquid, x) in [(detail.coarse(), 12), (detail.fine(), 40), (detail.coarse(), 28)] {
        for z in 0..8 {
            let column = liquid.columns().column([x, z], 0).unwrap();
            let dye = liquid.concentration(0, column);
            assert!(liquid.depths()[column] > 1000 && (dye - 0.5).abs() < 1e-4, "{x}, {z}: {dye}");
        }
    }
}

#[test]
fn all_near_is_a_plain_liquid_and_states_have_what_is_carried() {
    let ctx = context();
    let whole = [0..SIZE[0], 0..SIZE[1]];
    let mut detail = scene(Border::Open, whole.clone());
    let params = Params { border: Border::Open, pace: TimeStepping::Realtime(0.003), ..Params::default() };
    let mut plain = Shallow::new(&ctx, &terrain(0.0), params).unwrap();
    plain.set_scalars(&scalars()).unwrap();
    plain.set_poured(&[0.25, -50.0, 3.0, 0.0]).unwrap();
    plain.fill(0.001);
    plain.set_flows(&points(), |at| format!("point {at}")).unwrap();
    plain.set_sourced(0, &[1.0, 100.0, 0.0, 0.0]).unwrap();
    plain.set_sourced(1, &[0.0, 20.0, 0.0, 0.0]).unwrap();
    for frame in 0..20 {
        assert_eq!(detail.step(&ctx, FRAME).unwrap(), plain.step(&ctx, FRAME).unwrap());
        assert!(detail.fine().save() == plain.save(), "frame {frame}");
        for at in 0..4 {
            assert_eq!(detail.scalar_balance(at).unwrap(), plain.scalar_balance(at).unwrap());
        }
    }
    detail.set_near([16..32, 8..28]).unwrap();
    (0..20).for_each(|_| assert!(detail.step(&ctx, FRAME).unwrap().steps > 0));
    assert!(detail.scalar_balance(0).unwrap().held != 0.0, "something waits");
    let bytes = detail.save();
    for near in [[16..32, 8..28], whole] {
        let mut other = scene(Border::Open, near);
        other.restore(&bytes).unwrap();
        assert!(other.save() == bytes);
        let mut straight = scene(Border::Open, [0..4, 0..4]);
        straight.restore(&bytes).unwrap();
        for _ in 0..10 {
            assert_eq!(other.step(&ctx, FRAME).unwrap(), straight.step(&ctx, FRAME).unwrap());
            check(&other, "restored");
        }
        assert!(other.save() == straight.save());
    }
    let mut fewer = scene(Border::Open, [16..32, 8..28]);
    fewer.set_scalars(&scalars()[..2]).unwrap();
    assert!(fewer.restore(&bytes).is_err());
}

#[test]
fn turned_and_mirrored_dye_is_the_same() {
    let ctx = context();
    let (size, cell) = ([32, 24], 1.0 / 1024.0);
    let plan = Plan::new(size, cell, [0.0, 0.125], |at| {
        let [x, z] = [0, 1].map(|axis| (at[axis] / cell + 0.5 * size[axis] as f64) as usize);
        vec![[0.0, 0.02 + 1e-4 * ((x * 13 + z * 7) % 17) as f64 + 2e-4 * x as f64]]
    });
    let run = |turn: Turn| {
        let solids = plan.solids(turn);
        let origin = solids.grid.origin;
        let near = |cells: [[usize; 2]; 2]| turned_box(turn, cells, size);
        let mut detail = Detail::new(&ctx, &solids, Params::default(), near([[6, 6], [16, 14]])).unwrap();
        detail.set_scalars(&[Scalar::dye("dye")]).unwrap();
        for (position, level) in [([10.0, 10.0], 0.9), ([20.0, 8.0], 0.1)] {
            detail.set_poured(&[level]).unwrap();
            let at = turn.position(position, size);
            let at = [origin[0] + at[0] * cell, 0.03, origin[1] + at[1] * cell];
            detail.pour_at(at, 6.0 * cell, 3e-7).unwrap();
        }
        for frame in 0..12 {
            if frame == 6 {
                detail.set_near(near([[10, 4], [20, 16]])).unwrap();
            }
            detail.step(&ctx, FRAME).unwrap();
        }
        let of = |liquid: &Shallow, size: [usize; 2]| -> Vec<u32> {
            let cells = (0..size[0] * size[1]).map(|index| [index % size[0], index / size[0]]);
            let column = |cell| liquid.columns().column(turn.cell(cell, size), 0);
            cells
                .map(|cell| column(cell).map_or(7, |column| liquid.concentration(0, column).to_bits()))
                .collect()
        };
        assert_eq!(detail.scalar_balance(0).unwrap().error, 0);
        [of(detail.fine(), size), of(detail.coarse(), size.map(|count| count / 2))]
    };
    let straight = run(Turn::NONE);
    for turn in Turn::TURNS.into_iter().chain(Turn::MIRRORS) {
        assert!(run(turn) == straight, "{turn:?}");
    }
}

#[test]
fn bad_scalars_are_a_sentence() {
    let mut detail = scene(Border::Closed, [16..32, 8..28]);
    let error = detail.set_poured(&[1.0]).unwrap_err().to_string();
    assert_eq!(error, "1 concentrations for 4 scalars: one each is needed");
    assert!(detail.set_sourced(9, &[0.0; 4]).unwrap_err().to_string().contains("there is no flow point 9"));
    assert_eq!(detail.scalar_balance(4).unwrap_err().to_string(), "there is no scalar 4 among 4");
    let thickening = frazil::shallow::Thickening { scalar: 0, from: 0.0, to: 1.0, times: 2.0 };
    let params = Params { thickening: Some(thickening), ..detail.fine().params().clone() };
    let error = detail.set_params(params).unwrap_err().to_string();
    assert_eq!(error, "liquid with a level of detail has no scalar that thickens it");
}
