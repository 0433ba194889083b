//! The snow before anything moves, against the volumes that it must have.

use crate::common::liquids::context;
use crate::common::shapes::cuboid;
use frazil::geometry::{TriMesh, Vec3};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::vdb::{FloatGrid, level_set};

const CELL: f64 = 0.02;

/// A square metre of n x n squares at heights h(x, z).
fn sheet(n: usize, height: impl Fn(f32, f32) -> f32) -> TriMesh {
    let at = |i: usize| i as f32 / n as f32;
    let positions = (0..(n + 1) * (n + 1)).map(|k| (at(k / (n + 1)), at(k % (n + 1))));
    let square = |k: usize| {
        let a = ((k / n) * (n + 1) + k % n) as u32;
        let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32 + 2);
        [[a, b, d], [a, d, c]]
    };
    TriMesh {
        positions: positions.map(|(x, z)| Vec3::new(x, height(x, z), z)).collect(),
        triangles: (0..n * n).flat_map(square).collect(),
    }
}

fn hills(x: f32, z: f32) -> f32 {
    0.1 * (7.0 * x).sin() * (5.0 * z).cos() + 0.2 * x
}

fn plane() -> Ground {
    Ground::Plane { height: 0.0, area: [0.0, 0.0, 1.0, 1.0] }
}

/// A cube on the plane, away from the rim.
fn block() -> TriMesh {
    let mut mesh = cuboid([0.4, 0.3, 0.4]);
    let (low, _) = mesh.bounds().unwrap();
    mesh.positions.iter_mut().for_each(|p| *p += Vec3::new(0.31, 0.0, 0.29) - low);
    mesh
}

fn soup(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        positions: mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect(),
        triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    }
}

#[track_caller]
fn holds(ground: &Ground, statics: &[TriMesh], cover: &Cover, volume: f64) -> FloatGrid {
    let ctx = context(2);
    let grid = layer(&ctx, ground, statics, cover, CELL, 3.0).unwrap();
    let found = level_set::measure(&ctx, &grid).unwrap().volume;
    assert!((found / volume - 1.0).abs() < 0.015, "{found} m3, not {volume}");
    grid
}

#[test]
fn a_depth_over_hills_is_that_deep_everywhere() {
    let cover = Cover::Depth(0.25);
    holds(&Ground::Mesh(sheet(24, hills)), &[], &cover, 0.25);
    holds(&Ground::Mesh(sheet(24, hills).reversed()), &[], &cover, 0.25);
    holds(&Ground::Mesh(soup(&sheet(24, hills))), &[], &cover, 0.25);
}

#[test]
fn snow_lies_on_static_objects_and_not_in_them() {
    let cover = Cover::Depth(0.2);
    // The top of the block carries as much as the ground that it covers.
    for mesh in [block(), block().reversed(), soup(&block())] {
        let grid = holds(&plane(), &[mesh], &cover, 0.2);
        let at = |x: f64, y: f64, z: f64| grid.value([x, y, z].map(|value| (value / CELL).round() as i32));
        assert!(at(0.5, 0.15, 0.5) > 0.0 && at(0.5, 0.4, 0.5) < 0.0, "inside and on the block");
        assert!(at(0.5, 0.56, 0.5) > 0.0 && at(0.1, 0.1, 0.1) < 0.0, "above it and beside it");
    }
}

#[test]
fn a_wall_that_leans_by_a_hair_holds_no_snow() {
    let ctx = context(2);
    let volume = |wider: f32| {
        let mut block = cuboid([1.0, 1.0, 1.0]);
        block
            .positions
            .iter_mut()
            .filter(|p| p.y < 0.5)
            .for_each(|p| *p = Vec3::new(wider * p.x, p.y, wider * p.z));
        let grid = layer(&ctx, &Ground::Mesh(block), &[], &Cover::Depth(0.3), CELL, 3.0).unwrap();
        level_set::measure(&ctx, &grid).unwrap().volume
    };
    let (upright, leans) = (volume(1.0), volume(1.001));
    assert!((leans / upright - 1.0).abs() < 1.0e-3, "{leans} m3, not {upright}");
}

#[test]
fn two_static_objects_inside_each_other_hold_no_snow() {
    let mut other = block();
    other.positions.iter_mut().for_each(|p| p.x += 0.1);
    let grid = holds(&plane(), &[block(), other], &Cover::Depth(0.2), 0.2);
    assert!(grid.value([27, 5, 25]) > 0.0);
}

#[test]
fn a_top_surface_bounds_what_lies_over_the_ground() {
    let top = sheet(24, |x, z| 0.4 + 0.1 * hills(x, z));
    let mean = (0..10_000).map(|k| ((k / 100) as f32 / 99.5, (k % 100) as f32 / 99.5));
    let mean = mean.map(|(x, z)| 0.4 - 0.9 * f64::from(hills(x, z))).sum::<f64>() / 1e4;
    holds(&Ground::Mesh(sheet(24, hills)), &[], &Cover::Top(top.clone()), mean);
    holds(&Ground::Mesh(sheet(24, hills)), &[], &Cover::Top(top.reversed()), mean);
}

#[test]
fn no_snow_and_no_depth_are_refused() {
    let ctx = context(2);
    let sunk = Cover::Top(sheet(4, |_, _| -1.0));
    for cover in [Cover::Depth(0.0), Cover::Depth(f64::NAN), sunk] {
        assert!(layer(&ctx, &plane(), &[], &cover, CELL, 3.0).is_err());
    }
}
