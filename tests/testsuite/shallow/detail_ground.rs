//! Level of detail where all cells are near, where ground moves, and where bodies cross the edge.

use frazil::geometry::DVec3;
use frazil::shallow::params::{Friction, TimeStepping};
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::FlowPoint;
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Detail, Params, Shallow};

use crate::common::flowing::{FRAME, Frames, bridged, four_points};
use crate::common::shallow::{context, floors, ground, violations};

const CELL: f64 = 0.001;
const SIZE: [usize; 2] = [48, 36];

/// Rough ground, and a bridge.
fn terrain(phase: f64) -> Solids {
    bridged(SIZE, |x| 1e-3 * libm::sin(phase + 80.0 * x))
}

fn points() -> Vec<FlowPoint> {
    four_points([0.02, 0.015])
}

/// Nothing is missing, no column is over its brim, and there is as much as before but for what flow points have moved.
fn check(detail: &Detail, poured: f64, what: &str) {
    let balance = detail.balance();
    assert_eq!(balance.error, 0, "{what}: {balance:?}");
    assert_eq!(violations(detail.fine()) + violations(detail.coarse()), 0, "{what}");
    let all = balance.inside + balance.held + balance.lost + balance.drained + balance.absorbed;
    let came = poured + balance.sourced + balance.gained;
    assert!((all / came - 1.0).abs() < 1e-12, "{what}: {all} of {came}");
}

#[test]
fn all_cells_may_be_near() {
    let ctx = context();
    for (border, pace, friction, rest) in [
        (Border::Closed, TimeStepping::Realtime(0.003), Friction::Ground, 0.0),
        (Border::Open, TimeStepping::Realtime(0.004), Friction::Ground, 1e-6),
        (Border::Absorbing, TimeStepping::Realtime(0.002), Friction::Walls, 0.0),
    ] {
        let params = Params { border, pace, friction, rest, ..Params::default() };
        let whole = [0..SIZE[0], 0..SIZE[1]];
        let mut detail = Detail::new(&ctx, &terrain(0.0), params.clone(), whole.clone()).unwrap();
        let mut plain = Shallow::new(&ctx, &terrain(0.0), params).unwrap();
        assert_eq!(detail.coarse().columns().count(), 0);
        let name = |at: usize| format!("point {at}");
        detail.fill(0.001);
        plain.fill(0.001);
        detail.set_flows(&points(), name).unwrap();
        plain.set_flows(&points(), name).unwrap();
        let bodies = |frame: usize| {
            let at = DVec3::new(-0.02 + 0.001 * frame as f64, 0.004, 0.0);
            [Shape::Sphere { centre: at, radius: 0.006 }]
        };
        for frame in 0..60 {
            if frame == 20 {
                let taken = detail.pour_at([0.004, 0.0, 0.004], 0.004, 2e-7).unwrap();
                assert_eq!(taken, plain.pour_at([0.004, 0.0, 0.004], 0.004, 2e-7).unwrap());
            }
            if frame > 30 {
                detail.set_bodies(&bodies(frame)).unwrap();
                plain.set_bodies(&bodies(frame)).unwrap();
            }
            if frame > 45 {
                let solids = terrain(0.1 * frame as f64);
                detail.update_terrain(&solids).unwrap();
                plain.update_terrain(&solids).unwrap();
            }
            let [own, other] = [detail.step(&ctx, FRAME).unwrap(), plain.step(&ctx, FRAME).unwrap()];
            assert_eq!(own, other, "{border:?}, frame {frame}");
            assert!(detail.fine().save() == plain.save(), "{border:?}, frame {frame}");
            assert_eq!(detail.balance(), plain.balance(), "{border:?}, frame {frame}");
        }
        let poured = detail.balance().poured;
        for near in [[10..30, 8..24], whole.clone(), [0..48, 0..18], [0..2, 34..36], whole.clone()] {
            detail.set_near(near.clone()).unwrap();
            check(&detail, poured, &format!("{border:?}, {near:?}"));
            assert_eq!(detail.coarse().columns().count() == 0, near == whole);
            for _ in 0..10 {
                detail.step(&ctx, FRAME).unwrap();
                check(&detail, poured, &format!("{border:?}, {near:?}"));
            }
        }
    }
}

#[test]
fn a_tool_crosses_the_edge_and_pushes_the_liquid() {
    let ctx = context();
    let solids = ground(SIZE, CELL, [-0.02, 0.1], |_| 0.0);
    let mut detail = Detail::new(&ctx, &solids, Params::default(), [16..32, 8..28]).unwrap();
    detail.fill(0.004);
    let poured = detail.balance().poured;
    // In units of which all sums are whole.
    let all = |detail: &Detail| detail.balance().inside + detail.balance().held;
    let tool = |x: f64| {
        let ends = [DVec3::new(x, 0.003, -0.003), DVec3::new(x, 0.003, 0.003)];
        [Shape::Capsule { ends, radius: 0.0035 }]
    };
    for frame in 0..80 {
        let x = -0.02 + 0.0005 * f64::from(frame);
        detail.set_bodies(&tool(x)).unwrap();
        check(&detail, poured, &format!("frame {frame}"));
        assert_eq!(detail.fine().bodies(), detail.coarse().bodies());
        // Nothing is inside of the tool's middle.
        for liquid in [detail.fine(), detail.coarse()] {
            let columns = liquid.columns();
            let cell = columns.grid.cell_at([x, 0.0]).unwrap();
            let wet = |&column: &usize| {
                let [base, top] =
                    [columns.bases()[column], columns.bases()[column] + liquid.depths()[column]];
                let middle = columns.heights.round(0.003);
                base < middle && middle < top
            };
            let inside = columns.of_cell(cell).find(wet);
            assert_eq!(inside, None, "frame {frame}");
        }
        detail.step(&ctx, FRAME).unwrap();
        check(&detail, poured, &format!("frame {frame}, stepped"));
        let off = all(&detail) / poured - 1.0;
        assert!(off.abs() < 1e-12, "frame {frame}: {off}");
        if frame == 40 {
            // What is displaced stands around: over 4 mm of the lake.
            let high = |liquid: &Shallow| {
                let columns = liquid.columns();
                columns.indices().map(|i| columns.bases()[i] + liquid.depths()[i]).max().unwrap()
            };
            let level = solids.heights.round(0.004);
            assert!(high(detail.fine()) > level && high(detail.coarse()) > level);
        }
    }
    detail.set_bodies(&[]).unwrap();
    detail.frames(&ctx, FRAME, 200);
    check(&detail, poured, "without the tool");
    // But for what makes no coarse unit.
    assert!(detail.balance().held < 1e-8 * poured, "{:?}", detail.balance());
}

/// Bases by cell and layer.
fn bases(liquid: &Shallow) -> Vec<(usize, i32)> {
    let columns = liquid.columns();
    columns.indices().map(|i| (columns.grid.index(columns.cell(i)), columns.bases()[i])).collect()
}

#[test]
fn cells_that_change_their_size_have_the_bodies_in_them() {
    let ctx = context();
    let bodies = [
        Shape::Sphere { centre: DVec3::new(-0.008, 0.002, 0.0), radius: 0.006 },
        Shape::Sphere { centre: DVec3::new(0.012, 0.005, 0.004), radius: 0.005 },
    ];
    let boxes = [[16..32, 8..28], [8..20, 8..28], [0..48, 0..36], [30..48, 2..20], [0..4, 0..4]];
    let mut moved = Detail::new(&ctx, &terrain(0.0), Params::default(), boxes[0].clone()).unwrap();
    moved.set_bodies(&bodies).unwrap();
    moved.fill(0.003);
    for near in &boxes[1..] {
        moved.set_near(near.clone()).unwrap();
        let mut made = Detail::new(&ctx, &terrain(0.0), Params::default(), near.clone()).unwrap();
        made.set_bodies(&bodies).unwrap();
        assert_eq!(bases(moved.fine()), bases(made.fine()), "{near:?}");
        assert_eq!(bases(moved.coarse()), bases(made.coarse()), "{near:?}");
        assert_eq!(moved.balance().error, 0);
        // And where the bodies go, the ground is as it was.
        moved.set_bodies(&bodies[..1]).unwrap();
        made.set_bodies(&bodies[..1]).unwrap();
        assert_eq!(bases(moved.fine()), bases(made.fine()), "{near:?}");
        assert_eq!(bases(moved.coarse()), bases(made.coarse()), "{near:?}");
        moved.set_bodies(&bodies).unwrap();
    }
}

#[test]
fn ground_moves_in_cells_of_both_sizes() {
    let ctx = context();
    for (near, has_body) in
        [([16..32, 8..28], false), ([16..32, 8..28], true), ([0..SIZE[0], 0..SIZE[1]], true)]
    {
        let mut detail = Detail::new(&ctx, &terrain(0.0), Params::default(), near.clone()).unwrap();
        detail.fill(0.002);
        let poured = detail.balance().poured;
        if has_body {
            let ball = Shape::Sphere { centre: DVec3::new(-0.008, 0.002, 0.0), radius: 0.006 };
            detail.set_bodies(&[ball]).unwrap();
        }
        for frame in 1..60 {
            detail.update_terrain(&terrain(0.1 * f64::from(frame))).unwrap();
            check(&detail, poured, &format!("{near:?}, frame {frame}"));
            detail.step(&ctx, FRAME).unwrap();
            check(&detail, poured, &format!("{near:?}, frame {frame}, stepped"));
        }
        let bodies = detail.fine().bodies().to_vec();
        let mut made = Detail::new(&ctx, &terrain(5.9), Params::default(), near.clone()).unwrap();
        made.set_bodies(&bodies).unwrap();
        assert_eq!(bases(detail.fine()), bases(made.fine()), "{near:?}");
        assert_eq!(bases(detail.coarse()), bases(made.coarse()), "{near:?}");
    }
}

#[test]
fn near_cells_may_lie_where_there_is_no_ground() {
    let ctx = context();
    let solids = floors(SIZE, CELL, [-0.02, 0.1], 1, |[x, _], _| (x > 0.0).then_some([0.0, 0.0]));
    let params = Params { border: Border::Closed, ..Params::default() };
    let mut detail = Detail::new(&ctx, &solids, params, [0..8, 0..8]).unwrap();
    detail.fill(0.002);
    let poured = detail.balance().poured;
    detail.update_terrain(&solids).unwrap();
    for near in [[30..40, 4..20], [0..24, 0..36], [24..48, 0..36], [2..8, 2..8]] {
        detail.set_near(near.clone()).unwrap();
        detail.update_terrain(&solids).unwrap();
        detail.step(&ctx, FRAME).unwrap();
        check(&detail, poured, &format!("{near:?}"));
    }
}

#[test]
fn bad_ground_changes_nothing() {
    let ctx = context();
    let mut detail = Detail::new(&ctx, &terrain(0.0), Params::default(), [16..32, 8..28]).unwrap();
    detail.fill(0.002);
    detail.step(&ctx, FRAME).unwrap();
    let state = |detail: &Detail| {
        let both = [detail.fine(), detail.coarse()];
        (both.map(Shallow::save), both.map(bases), detail.near().clone())
    };
    let before = state(&detail);
    let other = ground([SIZE[0] + 2, SIZE[1]], CELL, [-0.02, 0.1], |_| 0.0);
    let error = detail.update_terrain(&other).unwrap_err().to_string();
    assert_eq!(error, "the terrain's cells or heights are not those of the liquid");
    let none = floors(SIZE, CELL, [-0.02, 0.1], 1, |_, _| None);
    let error = detail.update_terrain(&none).unwrap_err().to_string();
    assert_eq!(error, "the terrain has no surface that faces up within the domain");
    let bad = [Shape::Sphere { centre: DVec3::new(0.0, f64::NAN, 0.0), radius: 0.006 }];
    assert!(detail.set_bodies(&bad).is_err());
    let mut off = points();
    off[3].at = [1.0, 0.0, 0.0];
    let error = detail.set_flows(&off, |at| format!("point {at}")).unwrap_err().to_string();
    let what = "point 3: at (1, 0, 0) there is only solid, or it lies outside of the domain; the nearest ground is at (";
    assert!(error.starts_with(what), "{error}");
    assert!(detail.set_rate(0, 1.0).is_err());
    assert!(detail.set_near([0..3, 0..2]).is_err());
    assert!(detail.step(&ctx, -1.0).is_err());
    assert!(state(&detail) == before);
}

#[test]
fn what_waits_for_room_stays_where_the_near_cells_move() {
    let ctx = context();
    let solids = ground(SIZE, CELL, [-0.02, 0.02], |_| 0.0);
    let mut detail = Detail::new(&ctx, &solids, Params::default(), [16..32, 8..28]).unwrap();
    detail.fill(0.018);
    let poured = detail.balance().poured;
    // A closed pit all around the domain: with the block on it there is no room.
    let block = Shape::Cuboid {
        centre: DVec3::new(0.0, 0.0, 0.0),
        axes: [DVec3::x(), DVec3::y(), DVec3::z()],
        half: [0.1, 0.03, 0.1],
    };
    detail.set_bodies(&[block]).unwrap();
    check(&detail, poured, "with the block");
    let held = detail.balance().held;
    for near in [[0..8, 0..8], [0..48, 0..36], [20..40, 4..10]] {
        detail.set_near(near.clone()).unwrap();
        check(&detail, poured, &format!("{near:?}"));
        assert_eq!((detail.balance().held, detail.balance().lost), (held, 0.0), "{near:?}");
    }
    detail.set_bodies(&[]).unwrap();
    detail.frames(&ctx, FRAME, 400);
    check(&detail, poured, "at the end");
    assert_eq!(detail.balance().lost, 0.0);
}
