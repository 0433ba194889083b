//! What turns keeps its narrow band: neighbour voxels of opposite sign have values that fit together.

#[path = "common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use frazil::base::{DVec3, TriMesh};
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
