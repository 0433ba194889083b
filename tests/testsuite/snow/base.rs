//! The base layer against analytic volumes and against itself.

use crate::common::liquids::context;
use crate::common::shapes::{cuboid, sphere};
use frazil::Context;
use frazil::geometry::{DVec3, Vec3};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::NoiseParams;
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::Body;
use frazil::vdb::file::{WriteOptions, to_bytes};
use frazil::vdb::{FloatGrid, level_set};

const CELL: f64 = 0.01;

fn snow(ctx: &Context) -> FloatGrid {
    let ground = Ground::Plane { height: 0.0, area: [-0.7, -0.5, 0.7, 0.5] };
    layer(ctx, &ground, &[], &Cover::Depth(0.3), CELL, 3.0).unwrap()
}

fn ball(from: [f64; 3], to: [f64; 3], turn: f64) -> Body {
    let key = |time, at, turn| Key { time, at: DVec3::from(at), turn: DVec3::new(0.2, 1.0, 0.5) * turn };
    let keys = Keys::new(vec![key(0.0, from, 0.0), key(1.0, to, turn)]).unwrap();
    Body::new(Box::new(Rigid::new(sphere(0.15, 40), keys)), 0.0).unwrap()
}

fn exact() -> Params {
    Params { noise: None, tolerance: 0.02 }
}

fn mesh_volume(ctx: &Context, grid: &FloatGrid) -> f64 {
    level_set::to_mesh(ctx, grid, 0.0, 0.0).unwrap().volume()
}

#[test]
fn a_plane_and_a_depth_make_a_box_of_snow() {
    let ctx = context(2);
    let volume = mesh_volume(&ctx, &snow(&ctx));
    // Dual meshing rounds the box's edges by less than a cell.
    assert!((volume - 1.4 * 0.3).abs() < 0.001, "{volume}");
}

#[test]
fn what_hangs_over_any_edge_of_the_snow_removes_all_that_it_covers() {
    let ctx = context(2);
    let whole = mesh_volume(&ctx, &snow(&ctx));
    let removed = |at: [f32; 3], size: [f32; 3]| {
        let mut block = cuboid(size);
        block.positions.iter_mut().for_each(|position| *position += Vec3::from(at));
        let body = Body::new(Box::new(Rigid::new(block, Keys::default())), 0.0).unwrap();
        let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
        let report = base.step(&ctx, &[body], 0.0, 1.0, 1).unwrap();
        let left = mesh_volume(&ctx, base.surface());
        assert!((whole - left - report.removed_volume).abs() < 0.02 * whole, "{at:?}: {left} is left");
        report.removed_volume
    };
    // Thick ones cover one half, with a metre beyond the edge.
    for (axis, side) in [(0, 1.0), (0, -1.0), (2, 1.0), (2, -1.0)] {
        let (mut at, mut size) = ([0.0; 3], [4.0; 3]);
        (at[axis], size[axis]) = (side * 0.85, 1.7);
        let half = removed(at, size);
        assert!((half - 0.5 * whole).abs() < 0.02 * whole, "{half} on side {side} of axis {axis}");
    }
    let all = removed([0.0; 3], [4.0; 3]);
    assert!((all - whole).abs() < 0.02 * whole, "{all}");
}

#[test]
fn a_buried_ball_that_moves_removes_a_capsule() {
    let ctx = context(2);
    let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
    // Down to a quarter of the ball above the snow: a capsule cut by a plane is hard, so bury it wholly.
    let small = sphere(0.1, 60);
    let polygonal = small.volume();
    let keys = [(0.0, -0.3), (1.0, 0.3)].map(|(time, x)| Key {
        time,
        at: DVec3::new(x, 0.15, 0.0),
        turn: DVec3::zeros(),
    });
    let body = Body::new(Box::new(Rigid::new(small, Keys::new(keys.to_vec()).unwrap())), 0.0).unwrap();
    let report = base.step(&ctx, &[body], 0.0, 1.0, 7).unwrap();
    let expected = polygonal + std::f64::consts::PI * 0.01 * 0.6;
    let meshed = mesh_volume(&ctx, base.removed());
    assert!((meshed / expected - 1.0).abs() < 0.008, "{meshed} {expected}");
    assert!((report.removed_volume / expected - 1.0).abs() < 0.01, "{} {expected}", report.removed_volume);
}

#[test]
fn what_is_removed_is_what_is_missing() {
    let ctx = context(2);
    let before = mesh_volume(&ctx, &snow(&ctx));
    let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
    let mut removed = 0.0;
    for (frame, x) in [-0.4, -0.1, 0.2].into_iter().enumerate() {
        let body = ball([x, 0.28, 0.0], [x + 0.3, 0.25, 0.05], 0.5);
        base.step(&ctx, &[body], 0.0, 1.0, frame as i32).unwrap();
        removed += mesh_volume(&ctx, base.removed());
    }
    let after = mesh_volume(&ctx, base.surface());
    assert!(((before - after) / removed - 1.0).abs() < 0.01, "{before} {after} {removed}");
}

#[test]
fn nothing_outside_the_sweep_changes_and_nothing_grows() {
    let ctx = context(2);
    let fresh = snow(&ctx);
    let mut base = BaseLayer::new(&ctx, snow(&ctx), Params::for_cell(CELL)).unwrap();
    base.step(&ctx, &[ball([0.0, 0.3, 0.0], [0.1, 0.2, 0.0], 0.3)], 0.0, 1.0, 1).unwrap();
    for i in -75..75 {
        for j in -3..33 {
            let (old, new) = (fresh.value([i, j, 3]), base.surface().value([i, j, 3]));
            assert!(new >= old, "snow grew at {i} {j}: {old} {new}");
            let far = (f64::from(i) * CELL - 0.05).abs() > 0.3;
            assert!(!far || new == old, "changed far away at {i} {j}");
        }
    }
}

#[test]
fn the_same_bytes_from_1_2_and_5_threads() {
    let run = |threads: usize| {
        let ctx = context(threads);
        let mut base = BaseLayer::new(&ctx, snow(&ctx), Params::for_cell(CELL)).unwrap();
        base.step(&ctx, &[ball([0.0, 0.3, 0.0], [0.2, 0.2, 0.0], 0.6)], 0.0, 1.0, 1).unwrap();
        let grids = [base.surface(), base.removed(), base.compression(), base.touched()];
        to_bytes(&grids, &WriteOptions::default()).unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn compression_and_touched_show_where_the_snow_was_pressed() {
    let ctx = context(2);
    let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
    let press = Body::new(Box::new(Rigid::new(cuboid([0.3, 0.4, 0.3]), Keys::default())), 0.0).unwrap();
    // The box stands from -0.2 to 0.2: two thirds of the snow's height are gone, and its floor stays.
    base.step(&ctx, &[press], 0.0, 0.0, 12).unwrap();
    assert!(base.compression().value([0, 20, 0]) > 0.6 && base.compression().value([0, 20, 0]) < 0.7);
    assert_eq!(base.touched().value([0, 20, 0]), 12.0);
    assert_eq!(base.touched().value([40, 30, 0]), 0.0);
}

#[test]
fn a_body_wholly_outside_removes_nothing() {
    let ctx = context(1);
    let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
    let report = base.step(&ctx, &[ball([0.0, 3.0, 0.0], [5.0, 3.0, 0.0], 1.0)], 0.0, 1.0, 1).unwrap();
    assert_eq!((report.removed_volume, report.touched_blocks), (0.0, 0));
}

#[test]
fn an_open_mesh_is_closed_before_it_presses() {
    let ctx = context(2);
    let mut open = cuboid([0.3, 0.2, 0.3]);
    let whole = open.volume();
    open.triangles.truncate(10);
    let keys =
        Keys::new(vec![Key { time: 0.0, at: DVec3::new(0.0, 0.15, 0.0), turn: DVec3::zeros() }]).unwrap();
    let body = Body::new(Box::new(Rigid::new(open, keys)), 0.0).unwrap();
    let mut base = BaseLayer::new(&ctx, snow(&ctx), exact()).unwrap();
    let report = base.step(&ctx, &[body], 0.0, 0.0, 1).unwrap();
    assert!((report.removed_volume / whole - 1.0).abs() < 0.05, "{} {whole}", report.removed_volume);
}

#[test]
fn a_cancelled_step_leaves_the_snow_as_it_was() {
    let ctx = context(2);
    let mut base = BaseLayer::new(&ctx, snow(&ctx), Params::for_cell(CELL)).unwrap();
    let before = to_bytes(&[base.surface()], &WriteOptions::default()).unwrap();
    ctx.cancel();
    let result = base.step(&ctx, &[ball([0.0, 0.3, 0.0], [0.2, 0.2, 0.0], 0.6)], 0.0, 1.0, 1);
    assert!(matches!(result, Err(frazil::Error::Cancelled)));
    assert!(before == to_bytes(&[base.surface()], &WriteOptions::default()).unwrap());
}

#[test]
fn noise_that_would_leave_islands_is_refused() {
    let ctx = context(1);
    let noise = NoiseParams { amplitude: 6.0 * CELL, size: 8.0 * CELL, octaves: 3, seed: 0 };
    assert!(BaseLayer::new(&ctx, snow(&ctx), Params { noise: Some(noise), tolerance: 0.02 }).is_err());
}
