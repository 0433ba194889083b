//! What turns keeps its narrow band: neighbour voxels of opposite sign have values that fit together.

use crate::common::shapes;
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Context, Pool};

const CELL: f64 = 0.02;

/// What a body sweeps while it turns by some degrees about x, y and z and moves by `by` (m).
fn swept(mesh: TriMesh, degrees: DVec3, by: DVec3) -> FloatGrid {
    let ctx = Context::new(Pool::new(2).unwrap());
    let key = |time: f64| Key { time, at: by * time, turn: degrees * time * std::f64::consts::PI / 180.0 };
    let keys = Keys::new(vec![key(0.0), key(1.0)]).unwrap();
    let body = Body::new(Box::new(Rigid::new(mesh, keys)), 0.0).unwrap();
    sweep::chain(&ctx, &[body], 0.0, 1.0, &Settings::new(CELL)).unwrap()
}

/// Pairs of neighbour voxels of opposite sign, and how many of them differ by over 1.3 cells.
fn pairs_and_jumps(grid: &FloatGrid) -> (usize, usize) {
    let (mut pairs, mut jumps) = (0, 0);
    for leaf in grid.leaves().unwrap() {
        for index in 0..512 {
            let at = [0, 1, 2].map(|axis| leaf.origin[axis] + (index >> (6 - 3 * axis) & 7) as i32);
            for axis in 0..3 {
                let mut next = at;
                next[axis] += 1;
                let (a, b) = (f64::from(leaf.values[index]), f64::from(grid.value(next)));
                if (a < 0.0) != (b < 0.0) {
                    pairs += 1;
                    jumps += usize::from((a - b).abs() > 1.3 * CELL);
                }
            }
        }
    }
    (pairs, jumps)
}

#[test]
fn bodies_of_revolution_that_spin_keep_their_walls() {
    let bodies: [(&str, TriMesh); 4] = [
        ("globe", shapes::globe(0.2, 48, 24)),
        ("wheel of 64", shapes::wheel(0.2, 0.1, 64)),
        ("wheel of 32", shapes::wheel(0.2, 0.1, 32)),
        ("torus", shapes::torus(0.15, 0.06, 40, 20)),
    ];
    for (name, mesh) in bodies {
        for degrees in [20.0, 30.0, 45.0, 60.0, 90.0, 180.0] {
            let grid = swept(mesh.clone(), DVec3::y() * degrees, DVec3::zeros());
            let (pairs, jumps) = pairs_and_jumps(&grid);
            assert!(pairs > 500 && jumps == 0, "{name} by {degrees} degrees: {jumps} jumps of {pairs}");
        }
    }
}

#[test]
fn turns_about_several_axes_and_rolling_keep_their_walls() {
    for degrees in [30.0, 60.0, 90.0] {
        let turn = DVec3::new(1.0, 0.7, -0.6) * degrees;
        let (_, jumps) = pairs_and_jumps(&swept(shapes::globe(0.2, 48, 24), turn, DVec3::zeros()));
        assert_eq!(jumps, 0, "three axes, {degrees} degrees");
        let way = DVec3::z() * (0.2 * degrees * std::f64::consts::PI / 180.0);
        let (_, jumps) = pairs_and_jumps(&swept(shapes::wheel(0.2, 0.1, 32), DVec3::x() * degrees, way));
        assert_eq!(jumps, 0, "rolling, {degrees} degrees");
    }
}

#[test]
fn a_wheel_that_spins_has_the_volume_of_a_cylinder() {
    for degrees in [30.0, 60.0, 90.0] {
        let grid = swept(shapes::wheel(0.2, 0.1, 64), DVec3::y() * degrees, DVec3::zeros());
        let ctx = Context::new(Pool::new(1).unwrap());
        let volume = level_set::measure(&ctx, &grid).unwrap().volume;
        let exact = std::f64::consts::PI * 0.04 * 0.1;
        assert!((volume / exact - 1.0).abs() < 0.02, "{degrees} degrees: {volume}, not {exact}");
    }
}

#[test]
fn a_bar_that_turns_once_and_more_sweeps_a_disc() {
    let (length, width) = (0.4f64, 0.06f64);
    let radius = (length * length + width * width).sqrt() / 2.0;
    let ctx = Context::new(Pool::new(2).unwrap());
    let volume = |grid: FloatGrid| level_set::measure(&ctx, &grid).unwrap().volume;
    // A disc's level set at this cell is 1.7 % larger than the disc.
    let disc = volume(swept(shapes::wheel(radius as f32, 0.1, 512), DVec3::zeros(), DVec3::zeros()));
    for degrees in [180.0, 350.0, 360.0, 370.0, 719.0, 1440.0] {
        let bar = shapes::cuboid([length as f32, 0.1, width as f32]);
        let bar = volume(swept(bar, DVec3::y() * degrees, DVec3::zeros()));
        assert!((bar / disc - 1.0).abs() < 0.005, "{degrees} degrees: {bar}, not {disc}");
    }
}

/// A cuboid about the origin whose faces are cut into n x n squares of two triangles.
fn fine_cuboid(size: DVec3, n: usize) -> TriMesh {
    let mut mesh = TriMesh::default();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, -0.5), (axis, 0.5)]) {
        let first = mesh.positions.len() as u32;
        for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
            let mut p = DVec3::zeros();
            p[axis] = side;
            p[(axis + 1) % 3] = i as f64 / n as f64 - 0.5;
            p[(axis + 2) % 3] = j as f64 / n as f64 - 0.5;
            mesh.positions.push(p.component_mul(&size).cast());
        }
        let row = n as u32 + 1;
        for (i, j) in (0..n as u32).flat_map(|i| (0..n as u32).map(move |j| (i, j))) {
            let [a, b, c, d] = [0, row, row + 1, 1].map(|step| first + i * row + j + step);
            let both = [[a, b, c], [a, c, d]];
            mesh.triangles.extend(both.map(|[a, b, c]| if side > 0.0 { [a, b, c] } else { [a, c, b] }));
        }
    }
    mesh
}

#[test]
fn a_small_body_of_many_faces_has_exact_distances_outside() {
    let size = DVec3::new(3.1, 4.3, 2.3) * CELL;
    let mut worst = (0.0, String::new());
    for (turn, by) in [
        (DVec3::new(40.0, 28.0, -24.0), DVec3::zeros()),
        (DVec3::y() * 120.0, DVec3::zeros()),
        (DVec3::x() * 25.0, DVec3::new(3.0, 1.0, 0.5) * CELL),
    ] {
        let grid = swept(fine_cuboid(size, 16), turn, by);
        let poses: Vec<_> = (0..=600)
            .map(|step| {
                let (time, turn) = (
                    f64::from(step) / 600.0,
                    turn * std::f64::consts::PI / 180.0 * (f64::from(step) / 600.0),
                );
                (nalgebra::Rotation3::from_euler_angles(turn.x, turn.y, turn.z).inverse(), by * time)
            })
            .collect();
        let outside = |p: DVec3| {
            let gap = |(back, at): &(nalgebra::Rotation3<f64>, DVec3)| {
                let q = (back * (p - at)).abs() - size / 2.0;
                q.sup(&DVec3::zeros()).norm() + q.max().min(0.0)
            };
            poses.iter().map(gap).fold(f64::INFINITY, f64::min)
        };
        for leaf in grid.leaves().unwrap() {
            for index in 0..512 {
                let at = [0, 1, 2].map(|axis| leaf.origin[axis] + (index >> (6 - 3 * axis) & 7) as i32);
                let value = f64::from(leaf.values[index]) / CELL;
                if value > 0.0 && value < 1.5 {
                    let truth = outside(DVec3::from(at.map(f64::from)) * CELL) / CELL;
                    let error = (value - truth).abs();
                    if error > worst.0 {
                        worst = (error, format!("{value:.3} for {truth:.3} at {at:?}, turned by {turn:?}"));
                    }
                }
            }
        }
    }
    assert!(worst.0 < 0.06, "{worst:?}");
}

#[test]
fn more_turns_than_a_step_can_have_are_refused() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let key = |time: f64| Key { time, at: DVec3::zeros(), turn: DVec3::x() * time * 1e4 };
    let keys = Keys::new(vec![key(0.0), key(1.0)]).unwrap();
    let body = Body::new(Box::new(Rigid::new(shapes::cuboid([0.1; 3]), keys)), 0.0).unwrap();
    let swept = sweep::chain(&ctx, &[body], 0.0, 1.0, &Settings::new(CELL));
    let error = swept.err().expect("an error").to_string();
    assert!(error.contains("turns by 572958 degrees in a step"), "{error}");
}
