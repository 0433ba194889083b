//! The exact sweep against what can be known otherwise: formulas, sampled poses, and what must not matter.

use crate::common::liquids::context;
use crate::common::shapes;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::{Key, Keys, Morph, Motion, Rigid};
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, file, level_set};
use frazil::{Context, Pool};
use nalgebra::Rotation3;

const CELL: f64 = 0.01;

fn body(motion: impl Motion + 'static) -> Body {
    Body::new(Box::new(motion), 0.0).unwrap()
}

fn sweep(ctx: &Context, body: Body) -> FloatGrid {
    sweep::chain(ctx, &[body], 0.0, 1.0, &Settings::new(CELL)).unwrap()
}

fn keys(by: DVec3, turn: DVec3) -> Keys {
    let key = |time: f64| Key { time, at: by * time, turn: turn * time };
    Keys::new(vec![key(0.0), key(1.0)]).unwrap()
}

/// Signed distance to a box of these half edges about the origin.
fn box_distance(p: DVec3, half: DVec3) -> f64 {
    let q = p.abs() - half;
    q.map(|value| value.max(0.0)).norm() + q.max().min(0.0)
}

/// Every voxel within `reach` cells of the box `low..high` (m), with its value in cells.
fn each_voxel(grid: &FloatGrid, low: DVec3, high: DVec3, mut see: impl FnMut(DVec3, f64)) {
    let [first, last] = [low, high].map(|p| (p / CELL).map(|value| value.round() as i32));
    for x in first.x..=last.x {
        for y in first.y..=last.y {
            for z in first.z..=last.z {
                let value = f64::from(grid.value([x, y, z])) / CELL;
                see(DVec3::new(x.into(), y.into(), z.into()) * CELL, value);
            }
        }
    }
}

#[test]
fn a_slid_box_has_the_distances_of_a_longer_box() {
    let grid = sweep(
        &context(2),
        body(Rigid::new(shapes::cuboid([0.2, 0.1, 0.15]), keys(DVec3::x() * 0.313, DVec3::zeros()))),
    );
    // From the first box's corner to the last's.
    let (low, high) = (DVec3::zeros(), DVec3::new(0.513, 0.1, 0.15));
    let offset = shapes::cuboid([0.2, 0.1, 0.15]).bounds().unwrap().0.cast::<f64>();
    let (middle, half) = ((low + high) / 2.0 + offset, (high - low) / 2.0);
    let margin = DVec3::repeat(2.0 * CELL);
    each_voxel(&grid, low + offset - margin, high + offset + margin, |p, value| {
        let exact = (box_distance(p - middle, half) / CELL).clamp(-3.0, 3.0);
        assert!((value - exact).abs() < 0.02, "at {p}: {value}, not {exact}");
    });
}

#[test]
fn a_turning_cube_is_the_union_of_its_poses() {
    let half = DVec3::repeat(0.1);
    let turn = DVec3::new(0.25, 0.5, -0.3);
    let by = DVec3::new(0.05, 0.12, -0.03);
    let motion = Rigid::new(centred(0.2), keys(by, turn));
    let grid = sweep(&context(2), body(motion));
    let poses: Vec<(Rotation3<f64>, DVec3)> =
        (0..=400).map(|i| keys(by, turn).at(f64::from(i) / 400.0)).collect();
    let (mut inside, mut outside) = (0, 0);
    each_voxel(&grid, DVec3::new(-0.2, -0.2, -0.25), DVec3::new(0.25, 0.35, 0.2), |p, value| {
        let distances = poses.iter().map(|(turned, at)| box_distance(turned.inverse() * (p - at), half));
        let exact = distances.fold(f64::INFINITY, f64::min) / CELL;
        if exact > 0.0 {
            // Outside, the distance to a union is the least distance.
            assert!((value - exact.min(3.0)).abs() < 0.1, "at {p}: {value}, not {exact}");
            outside += usize::from(exact < 3.0);
        } else {
            // Inside, it is at least as deep as in any pose.
            assert!(value < exact.max(-3.0) + 0.1, "at {p}: {value}, not below {exact}");
            inside += 1;
        }
    });
    assert!(inside > 10_000 && outside > 5_000, "{inside} {outside}");
}

#[test]
fn a_twisting_bar_is_the_union_of_its_poses() {
    // A bar of 12 triangles whose far end turns: every side is a curved patch.
    let bar = shapes::cuboid([0.1, 0.1, 0.4]);
    let (low, high) = bar.bounds().unwrap();
    let middle = (low + high) / 2.0;
    let twisted = bar.positions.iter().map(|p| {
        let angle = if p.z > middle.z { 0.6 } else { 0.0 };
        Rotation3::from_axis_angle(&Vec3::z_axis(), angle) * (p - middle) + middle
    });
    let morph = Morph::new(bar.clone(), twisted.collect()).unwrap();
    let ctx = context(2);
    let mut posed = Vec::new();
    let mut union: Option<FloatGrid> = None;
    for i in 0..=40 {
        morph.pose(f64::from(i) / 40.0, &mut posed).unwrap();
        let mesh =
            TriMesh { positions: posed.iter().map(|p| p.cast()).collect(), triangles: bar.triangles.clone() };
        let solid = sweep::voxelise(&ctx, mesh, &Settings::new(CELL)).unwrap();
        match &mut union {
            None => union = Some(solid),
            Some(union) => level_set::union(&ctx, union, solid).unwrap(),
        }
    }
    let union = union.unwrap();
    let grid = sweep(&ctx, body(morph));
    let margin = Vec3::repeat(0.05);
    each_voxel(&grid, (low - margin).cast(), (high + margin).cast(), |p, value| {
        let sampled = f64::from(union.value((p / CELL).map(|v| v.round() as i32).into())) / CELL;
        // Outside, the distance to a union is the least distance; inside, it is at least as deep as in any pose.
        if sampled > 0.0 && sampled < 2.5 {
            assert!((value - sampled).abs() < 0.1, "at {p}: {value}, not {sampled}");
        } else if sampled < 0.0 {
            assert!(value < sampled.max(-2.9) + 0.1, "at {p}: {value}, not below {sampled}");
        }
    });
}

#[test]
fn sheets_inside_are_not_seen() {
    let mut mesh = centred(0.3);
    let mut other = centred(0.3);
    other.positions.iter_mut().for_each(|p| p.x += 0.15);
    mesh.append(&other);
    let turn = DVec3::new(0.0, 0.1, 0.0);
    let grid = sweep(&context(2), body(Rigid::new(mesh, keys(DVec3::x() * 0.05, turn))));
    // On the faces of each box that lie within the other, and on every later pose of them.
    for x in [0.0, 0.02, 0.1, 0.13, 0.15, 0.17, 0.2] {
        let value = grid.value([(x / CELL) as i32, 0, 0]);
        assert!(value <= -2.99 * CELL as f32, "a sheet shows at x = {x}: {value}");
    }
}

/// Volume of what a mesh sweeps.
fn volume(ctx: &Context, mesh: TriMesh) -> f64 {
    let turn = DVec3::new(0.1, 0.3, 0.0);
    let grid = sweep(ctx, body(Rigid::new(mesh, keys(DVec3::new(0.1, 0.02, 0.0), turn))));
    level_set::measure(ctx, &grid).unwrap().volume
}

#[test]
fn duplicates_soup_and_reversed_faces_sweep_the_same() {
    let ctx = context(2);
    let mesh = shapes::blob(0.3, 8);
    let whole = volume(&ctx, mesh.clone());
    let mut twice = mesh.clone();
    twice.append(&mesh);
    let reversed =
        TriMesh { triangles: mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..mesh.clone() };
    let soup = TriMesh {
        positions: mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect(),
        triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    };
    let mut degenerate = mesh.clone();
    degenerate.triangles.extend([[0, 0, 1], [2, 2, 2]]);
    for (name, other) in
        [("twice", twice), ("reversed", reversed), ("soup", soup), ("degenerate", degenerate)]
    {
        let other = volume(&ctx, other);
        assert!((other / whole - 1.0).abs() < 1e-4, "{name}: {other}, not {whole}");
    }
    let mut open = mesh.clone();
    open.triangles.drain(0..40);
    let open = volume(&ctx, open);
    assert!((open / whole - 1.0).abs() < 0.1 && open < whole, "open: {open}, not nearly {whole}");
}

#[test]
fn the_same_bytes_from_one_and_from_many_threads() {
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let turn = DVec3::new(0.4, 0.3, 0.2);
        let grid = sweep(&ctx, body(Rigid::new(shapes::blob(0.3, 12), keys(DVec3::x() * 0.1, turn))));
        file::to_bytes(&[&grid], &file::WriteOptions::default()).unwrap()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(7));
}

/// A cube about the origin.
fn centred(edge: f32) -> TriMesh {
    let mut mesh = shapes::cuboid([edge; 3]);
    let (low, high) = mesh.bounds().unwrap();
    mesh.positions.iter_mut().for_each(|p| *p -= (low + high) / 2.0);
    mesh
}

#[test]
fn a_box_whose_faces_lie_on_voxels_is_one_piece() {
    let ctx = context(2);
    let mut mesh = shapes::cuboid([0.6, 0.2, 0.4]);
    let (low, _) = mesh.bounds().unwrap();
    mesh.positions.iter_mut().for_each(|p| *p -= low);
    let grid = sweep::voxelise(&ctx, mesh, &Settings::new(CELL)).unwrap();
    let mesh = level_set::to_mesh(&ctx, &grid, 0.0, 0.0).unwrap();
    assert_eq!(mesh.euler_characteristic(), 2);
    assert!((mesh.volume() / 0.048 - 1.0).abs() < 0.01, "{}", mesh.volume());
}
