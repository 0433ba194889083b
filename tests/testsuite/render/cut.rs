//! Cuts through grids: colours change where the values do, level sets and meshes are lines where they meet the plane.

use std::fs;
use std::path::Path;

use frazil::io::mesh;
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::render::Field;
use frazil::vdb::file::WriteOptions;
use frazil::vdb::{FloatGrid, GridClass, file};
use frazil::{Context, Error, Pool};

use crate::common::shapes::sphere;
use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, works};

/// The ends of the ramp as pictures show them.
const LEAST: [u8; 3] = [34, 28, 105];
const GREATEST: [u8; 3] = [227, 217, 116];
/// Red in the middle of the ramp; it grows all the way.
const MIDDLE_RED: u8 = 57;

/// A folder with the level set of a ball around the origin of a radius of 0.5 m, in cells of 2 cm.
fn with_ball() -> Folder {
    let folder = Folder::empty();
    mesh::write(&folder.join("ball.obj"), &sphere(0.5, 48)).unwrap();
    works(&folder, "vdb from-mesh ball.obj --cell 0.02 -o ball.vdb -q");
    folder
}

fn picture(folder: &Path, arguments: &str) -> Picture {
    works(folder, &format!("preview {arguments} -o cut.png"));
    Picture::open(&folder.join("cut.png"))
}

/// Height of the plane (m).
const HEIGHT: f64 = 0.3;
/// It is seen from 2 m above, by 30 degrees of 90 rows.
const VIEW: &str = "--cut y=0.3 --eye 0,2.3,0 --target 0,0,0 --fov 30 --size 120x90";

/// Edge of a pixel in the plane (m).
fn pixel() -> f64 {
    2.0 * 2.0 * 15.0f64.to_radians().tan() / 90.0
}

/// Pixels of that view with their positions (x and z, m).
fn positions(picture: &Picture) -> impl Iterator<Item = ([f64; 2], [u8; 3])> + '_ {
    picture.pixels.iter().enumerate().map(|(n, rgb)| {
        let (column, row) = ((n % 120) as f64 + 0.5 - 60.0, (n / 120) as f64 + 0.5 - 45.0);
        ([column * pixel(), row * pixel()], *rgb)
    })
}

/// Whether a pixel is darker than any colour of the ramp.
fn is_ink(rgb: [u8; 3]) -> bool {
    rgb.iter().all(|value| *value < 20)
}

#[test]
fn the_distances_of_a_ball_change_sign_at_its_radius() {
    let folder = with_ball();
    let picture = picture(&folder, &format!("ball.vdb {VIEW}"));
    let mut on_line = 0u32;
    for ([x, z], rgb) in positions(&picture) {
        let across = (x * x + z * z).sqrt();
        // From the circle in which the plane meets the ball, in the plane (pixels), and from the ball itself (m).
        let off = (across - (0.25 - HEIGHT * HEIGHT).sqrt()) / pixel();
        let distance = (across * across + HEIGHT * HEIGHT).sqrt() - 0.5;
        if off.abs() > 2.0 {
            assert_eq!(rgb[0] > MIDDLE_RED, distance > 0.0, "{x} {z}: {rgb:?}");
        }
        // Beyond the band of three cells it has the values of its ends.
        let end = if distance > 0.0 { GREATEST } else { LEAST };
        if distance.abs() > 0.07 {
            assert!((0..3).all(|n| rgb[n].abs_diff(end[n]) <= 1), "{x} {z}: {rgb:?}");
        }
        // Only the line is as light as this.
        if rgb[2] > 180 {
            assert!(off.abs() < 1.4, "{x} {z}: {rgb:?}");
            on_line += 1;
        }
    }
    // One pixel wide at least.
    let circumference = std::f64::consts::TAU * (0.25 - HEIGHT * HEIGHT).sqrt() / pixel();
    assert!(f64::from(on_line) > 0.7 * circumference, "{on_line} of {circumference}");
}

#[test]
fn a_mesh_is_a_line_on_the_colours_of_a_grid() {
    let folder = &with_ball();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let before = picture(folder, &format!("ball.vdb {VIEW}"));
    let after = picture(folder, &format!("ball.vdb cube.obj {VIEW}"));
    let mut on_line = 0u32;
    for (([x, z], rgb), old) in positions(&after).zip(&before.pixels) {
        let off = (x.abs().max(z.abs()) - 0.2) / pixel();
        if is_ink(rgb) {
            assert!(off.abs() < 1.3, "{x} {z}");
            on_line += 1;
        } else if off.abs() > 2.0 {
            assert_eq!(rgb, *old, "{x} {z}");
        }
    }
    let expected = 0.8 * 4.0 * 0.4 / pixel();
    assert!(f64::from(on_line) > expected, "{on_line}");
    // A mesh alone is cut too, and what is before the plane does not hide it.
    let alone = picture(folder, &format!("cube.obj {VIEW}"));
    let count = alone.pixels.iter().filter(|rgb| is_ink(**rgb)).count();
    assert!(count as f64 > expected, "{count}");
}

/// A fog of 8 voxels of 0.1 m along each axis, whose values are 0 to 7 times `step` along x.
fn steps(step: f32) -> FloatGrid {
    let mut fog = FloatGrid::new(0.1, 0.0).unwrap();
    // Voxel (x, y, z) lies at x << 6 | y << 3 | z.
    let values = Box::new(std::array::from_fn(|n| (n >> 6) as f32 * step));
    let block = Block { origin: [0; 3], values, mask: [u64::MAX; 8] };
    let ctx = Context::new(Pool::new(1).unwrap());
    fog.replace_blocks(&ctx, &[BlockEdit::Dense(block)]).unwrap();
    fog.set_class(GridClass::Fog).unwrap();
    fog.set_name("density").unwrap();
    fog
}

/// The pixels of a cut through such a fog, ascending along x from its first voxel to its last, and what the command says.
fn along(step: f32) -> (Vec<[u8; 3]>, String) {
    let folder = Folder::empty();
    file::write(&folder.join("fog.vdb"), &[&steps(step)], &WriteOptions::default()).unwrap();
    let said = works(&folder, "preview fog.vdb --cut z=0.35 --size 160x90 -v -o cut.png");
    let picture = Picture::open(&folder.join("cut.png"));
    // Its voxels, 0.8 m of them around x = 0.35 m, fill the height but for 4 % at each edge.
    let x = |column: usize| 0.35 + (column as f64 + 0.5 - 80.0) * 0.8 / 0.92 / 90.0;
    let inside = (0..160).filter(|c| (0.0..=0.7).contains(&x(*c)));
    (inside.map(|c| picture.pixel(c, 45)).collect(), said)
}

#[test]
fn the_values_of_a_fog_and_0_have_all_colours() {
    for (step, range) in [(1.0, "from 0, dark blue, to 7,"), (-1.0, "from -7, dark blue, to 0,")] {
        let (mut seen, said) = along(step);
        assert!(said.contains(range), "{said}");
        if step < 0.0 {
            seen.reverse();
        }
        assert!(seen.len() > 60);
        assert!(seen.is_sorted_by_key(|rgb| rgb[0]), "{seen:?}");
        let ends = [(seen[0], LEAST), (seen[seen.len() - 1], GREATEST)];
        // The ends lie up to a pixel inside.
        assert!(ends.iter().all(|(a, b)| (0..3).all(|n| a[n].abs_diff(b[n]) <= 6)), "{ends:?}");
    }
}

#[test]
fn leaves_are_listed_within_the_limit_of_memory() {
    let ctx = Context::new(Pool::new(1).unwrap());
    assert!(Field::grid(&ctx, steps(1.0)).is_ok());
    ctx.set_memory_limit(40);
    assert!(matches!(Field::grid(&ctx, steps(1.0)), Err(Error::Memory { .. })));
}

#[test]
fn the_same_cut_from_any_number_of_threads_and_in_a_flipbook() {
    let folder = &with_ball();
    let one = picture(folder, "ball.vdb ball.obj --cut x=0.1 --size 160x90 --threads 1");
    assert!(one == picture(folder, "ball.vdb ball.obj --cut x=0.1 --size 160x90 --threads 3"));
    for frame in ["0001", "0002"] {
        fs::copy(folder.join("ball.vdb"), folder.join(format!("ball.{frame}.vdb"))).unwrap();
    }
    works(folder, "preview ball.%04d.vdb ball.obj --frames 1-2 --cut x=0.1 --size 160x90 -o cut.%04d.png");
    assert!(one == Picture::open(&folder.join("cut.0002.png")));
}

#[test]
fn what_cannot_be_cut_is_refused() {
    let folder = &with_ball();
    fs::write(folder.join("drop.xyz"), "0 0 0\n1 1 1\n").unwrap();
    for (arguments, words) in [
        ("ball.vdb --cut y=2", &["--cut y=2 misses what is drawn", "-0.5"][..]),
        ("ball.vdb --cut w=1", &["x=0.1"]),
        ("ball.vdb --cut y", &["x=0.1"]),
        ("ball.vdb --cut y=nan", &["x=0.1"]),
        ("ball.obj --cut y=0 --color v", &["--color", "--cut"]),
        ("ball.vdb --cut y=0 --sun 10,20", &["--sun", "--cut"]),
        ("ball.vdb --cut y=0.3 --eye 1,0.3,0 --target 0,0,0", &["--eye lies in the plane of --cut y=0.3"]),
        ("drop.xyz --cut y=0", &["points are left out of a cut"]),
    ] {
        fails(folder, &format!("preview {arguments} -o out.png"), 2, words);
        assert!(!folder.join("out.png").exists(), "{arguments}");
    }
}
