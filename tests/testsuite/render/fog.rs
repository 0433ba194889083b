//! Fog in pictures: it lets through what the law of Beer and Lambert says, lies where its grid says, and is the same from
//! both sides and from any number of threads.

use crate::common::skip::skipped;
use std::path::Path;

use crate::program::Folder;
use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, TriMesh};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::render::{Camera, Cloud, Fog, Light, Model, Models, Picture, Size};
use frazil::vdb::{FloatGrid, GridClass, MetaValue, file};
use frazil::{Context, Pool};

const CELL: f64 = 0.125;

fn ctx(threads: usize) -> Context {
    Context::new(Pool::new(threads).unwrap())
}

/// A grid of densities by voxel, on the blocks from one position (in blocks) to another, both included.
fn grid(low: [i32; 3], high: [i32; 3], density: impl Fn([i32; 3]) -> f32) -> FloatGrid {
    let mut grid = FloatGrid::new(CELL, 0.0).unwrap();
    let mut edits = Vec::new();
    for x in low[0]..=high[0] {
        for (y, z) in (low[1]..=high[1]).flat_map(|y| (low[2]..=high[2]).map(move |z| (y, z))) {
            let origin = [x, y, z].map(|at| 8 * at);
            let value = |n: usize| {
                let local = [n >> 6, n >> 3 & 7, n & 7];
                density([0, 1, 2].map(|axis| origin[axis] + local[axis] as i32))
            };
            let values = Box::new(std::array::from_fn(value));
            edits.push(BlockEdit::Dense(Block { origin, values, mask: [u64::MAX; 8] }));
        }
    }
    grid.replace_blocks(&ctx(1), &edits).unwrap();
    grid.set_class(GridClass::Fog).unwrap();
    grid
}

/// A ball of fog around the origin that becomes thinner outward.
fn ball() -> FloatGrid {
    grid([-2; 3], [1; 3], |at| {
        let square: i32 = at.iter().map(|at| at * at).sum();
        (1.0 - (square as f32).sqrt() / 9.0).max(0.0)
    })
}

fn fog(grid: &FloatGrid, extinction: f64) -> Fog {
    Fog::grid(&ctx(1), grid, extinction).unwrap()
}

/// The linear light of a pixel's red, green and blue: what a picture shows of it, reversed.
fn light_of(picture: &Picture, x: u32, y: u32) -> [f64; 3] {
    let at = 3 * (y * picture.size.width + x) as usize;
    [0, 1, 2].map(|channel| {
        let coded = f64::from(picture.rgb[at + channel]) / 255.0;
        let shown = if coded <= 0.04045 { coded / 12.92 } else { ((coded + 0.055) / 1.055).powf(2.4) };
        let over = (shown - 0.6) / 0.4;
        (if over <= 0.0 { shown } else { 0.6 + 0.4 * over / (1.0 - over) }) / 0.92
    })
}

#[test]
fn a_wall_behind_a_slab_of_fog_is_as_much_weaker_as_the_law_of_beer_and_lambert_says() {
    let size = Size { width: 40, height: 24 };
    let camera = Camera { eye: DVec3::new(0.0, 0.0, 12.0), target: DVec3::zeros(), fov_deg: 12.0 };
    // From the wall the sun is seen past the fog.
    let sun = Light::from_degrees(60.0, 10.0);
    // 2 m thick.
    let slab = grid([-2, -2, 2], [1, 1, 3], |_| 1.0);
    let draw = |albedo: f32, fogs: Vec<Fog>| {
        let wall = TriMesh::cuboid([-9.0, -9.0, -3.0], [9.0, 9.0, -2.0]);
        let models = Models::new(vec![Model::mesh(&wall, [albedo; 3])]).with_fogs(fogs);
        models.draw(&ctx(2), &camera, &sun, size).unwrap()
    };
    // What a white wall sends more than a black one.
    let contrast = |extinction: Option<f64>| {
        let fogs = || extinction.map(|extinction| fog(&slab, extinction)).into_iter().collect::<Vec<_>>();
        let (white, black) = (draw(0.7, fogs()), draw(0.0, fogs()));
        let (white, black) = (light_of(&white, 20, 12), light_of(&black, 20, 12));
        [0, 1, 2].map(|channel| white[channel] - black[channel])
    };
    let clear = contrast(None);
    for extinction in [0.1f64, 0.3, 0.6, 1.0] {
        let expected = (-2.0 * extinction).exp();
        let veiled = contrast(Some(extinction));
        for channel in 0..3 {
            let through = veiled[channel] / clear[channel];
            // A picture has steps of about 0.01 of the wall's light, where the fog before it is bright.
            assert!((through - expected).abs() < 0.015, "{extinction}: {through}, not {expected}");
        }
    }
    // The file's own scale goes before.
    let mut scaled = slab.deep_copy().unwrap();
    scaled.set_metadata("frazil:density_scale", MetaValue::Float(0.3)).unwrap();
    assert!(draw(0.7, vec![fog(&scaled, 9.0)]) == draw(0.7, vec![fog(&slab, f64::from(0.3f32))]));
    scaled.set_metadata("frazil:density_scale", MetaValue::Text("much".into())).unwrap();
    let error = Fog::grid(&ctx(1), &scaled, 1.0).err().unwrap().to_string();
    assert!(error.contains("frazil:density_scale"), "{error}");
}

#[test]
fn a_ball_of_fog_is_the_same_from_the_left_and_the_right() {
    let size = Size { width: 96, height: 64 };
    let camera = Camera { eye: DVec3::new(0.0, 2.0, 6.0), target: DVec3::zeros(), fov_deg: 30.0 };
    let fogs = vec![fog(&ball(), 3.0)];
    let picture = Models::new(vec![])
        .with_fogs(fogs)
        .draw(&ctx(2), &camera, &Light::from_degrees(0.0, 50.0), size)
        .unwrap();
    let pixel = |x: u32, y: u32| {
        let at = 3 * (y * size.width + x) as usize;
        [0, 1, 2].map(|channel| i32::from(picture.rgb[at + channel]))
    };
    assert_ne!(pixel(48, 32), pixel(2, 32), "nothing is drawn");
    for (x, y) in (0..48).flat_map(|x| (0..64).map(move |y| (x, y))) {
        let (left, right) = (pixel(x, y), pixel(95 - x, y));
        assert!(
            (0..3).all(|channel| (left[channel] - right[channel]).abs() <= 1),
            "{x} {y}: {left:?} {right:?}"
        );
    }
}

/// Ground, a few grains on it and a fog over it.
fn everything(threads: usize, fogs: Vec<Fog>) -> Picture {
    let ground = TriMesh::cuboid([-4.0, -3.0, -4.0], [4.0, -2.0, 4.0]);
    let mut points = Points::at(0.5, &[DVec3::new(0.0, -1.8, 1.5), DVec3::new(0.3, 0.0, 0.0)]).unwrap();
    points.set("pscale", Values::Float(Column::Uniform(0.2)));
    let camera = Camera { eye: DVec3::new(0.0, 4.0, 8.0), target: DVec3::new(0.0, -1.0, 0.0), fov_deg: 40.0 };
    Models::new(vec![Model::mesh(&ground, [0.9; 3])])
        .with_clouds(vec![Cloud::new(&points, None).unwrap()])
        .with_fogs(fogs)
        .draw(&ctx(threads), &camera, &Light::from_degrees(0.0, 89.0), Size { width: 96, height: 64 })
        .unwrap()
}

#[test]
fn everything_is_in_one_picture_the_same_from_any_number_of_threads() {
    let picture = everything(1, vec![fog(&ball(), 2.0)]);
    assert!(everything(3, vec![fog(&ball(), 2.0)]) == picture);
    assert!(everything(1, vec![]) != picture);
}

#[test]
fn fog_takes_some_of_the_sun_from_the_ground_below_it() {
    // The ground below the middle of the fog, seen below the fog's lower edge, and ground far from it.
    let at = |picture: &Picture, position: DVec3| {
        let camera =
            Camera { eye: DVec3::new(0.0, 4.0, 8.0), target: DVec3::new(0.0, -1.0, 0.0), fov_deg: 40.0 };
        let [right, up, ahead] = camera.axes();
        let (off, half) = (position - camera.eye, 20.0f64.to_radians().tan());
        let x = 48.0 + 32.0 * off.dot(&right) / off.dot(&ahead) / half;
        let y = 32.0 - 32.0 * off.dot(&up) / off.dot(&ahead) / half;
        light_of(picture, x as u32, y as u32)[0]
    };
    let (clear, thin, thick) = (
        everything(1, vec![]),
        everything(1, vec![fog(&ball(), 0.5)]),
        everything(1, vec![fog(&ball(), 50.0)]),
    );
    let (below, beside) = (DVec3::new(0.0, -2.0, 0.7), DVec3::new(3.2, -2.0, 2.5));
    let left = |picture: &Picture| at(picture, below) / at(&clear, below);
    assert!(left(&thin) < 0.95 && left(&thick) < 0.75 * left(&thin), "{} {}", left(&thin), left(&thick));
    assert!((at(&thick, beside) / at(&clear, beside) - 1.0).abs() < 0.02);
}

/// Runs Python with OpenVDB's module; false where there is none.
fn python(folder: &Path, script: &str) -> bool {
    let python =
        std::process::Command::new("/usr/bin/python3").current_dir(folder).args(["-c", script]).output();
    python.is_ok_and(|output| output.status.success())
}

#[test]
fn a_fog_is_where_the_transform_of_its_grid_puts_it() {
    let folder = Folder::empty();
    // Voxels of 0.5 m: moved by half of one; turned by 90 degrees about y, and flatter.
    let script = "import pyopenvdb as v\n\
        def write(name, rows):\n\
        \x20 g = v.FloatGrid(); g.name = 'density'; g.gridClass = v.GridClass.FOG_VOLUME\n\
        \x20 g.transform = v.createLinearTransform(rows); g.fill((8, 16, -8), (15, 23, -1), 1.0); v.write(name, g)\n\
        write('moved.vdb', [[.5,0,0,0],[0,.5,0,0],[0,0,.5,0],[.25,.25,.25,1]])\n\
        write('turned.vdb', [[0,0,-.5,0],[0,.25,0,0],[.5,0,0,0],[0,0,0,1]])";
    if !python(&folder, script) {
        skipped("no pyopenvdb");
        return;
    }
    let expected = [
        ("moved.vdb", [4.0, 8.0, -4.0], [8.0, 12.0, 0.0]),
        ("turned.vdb", [-4.25, 3.875, -7.75], [-0.25, 5.875, -3.75]),
    ];
    for (name, low, high) in expected {
        let grid = file::read_named(&folder.join(name), None).unwrap();
        let (seen_low, seen_high) = fog(&grid, 1.0).bounds().unwrap();
        assert!((seen_low - DVec3::from(low)).norm() < 1e-9, "{name}: {seen_low}");
        assert!((seen_high - DVec3::from(high)).norm() < 1e-9, "{name}: {seen_high}");
    }
}
