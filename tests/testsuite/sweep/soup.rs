//! Triangle soup whose corners are off by rounding, as bodies: at rest, turned, far away by keys, as a sequence that shakes, and as a
//! ground under snow.

use std::sync::Arc;

use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::mesh_repair::repair;
use frazil::motion::{Key, Keys, Morph, Motion, Placed, Rigid, Space, Up};
use frazil::snow::base_layer::initial::{self, Cover, Ground};
use frazil::sweep::{self, Body, Settings};

use crate::common::bodies::Dice;
use crate::common::liquids::context;
use crate::common::soups::{Solid, solids, volume_inside as volume};

#[track_caller]
fn near(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 0.01, "{what}: {found}, not {expected}");
}

fn pose_at(at: DVec3, turn: DVec3) -> Keys {
    Keys::new(vec![Key { time: 0.0, at, turn }]).unwrap()
}

fn shared(solid: &Solid) -> TriMesh {
    let positions = solid.positions.iter().map(|position| position.cast()).collect();
    TriMesh { positions, triangles: solid.triangles.clone() }
}

#[test]
fn soup_has_the_volume_of_its_solid() {
    let (ctx, mut dice) = (context(2), Dice(21));
    for (size, far) in [(1.0, 0.0), (4.0, 1e4), (40.0, 1e5)] {
        for solid in solids(&mut dice) {
            let soup = solid.soup(size, dice.direction() * far, 4, &mut dice);
            let what = format!("{} of {size} m at {far} m", solid.name);
            let expected = solid.volume * size.powi(3);
            let settings = Settings::new(size / 40.0);
            near(volume(&sweep::voxelise(&ctx, soup.clone(), &settings).unwrap()), expected, &what);
            let repaired = repair(&ctx, &soup, size / 40.0).unwrap();
            near(repaired.mesh.volume(), expected, &what);
            assert_eq!(repaired.report.losses.warning(size / 40.0), None, "{what}");
        }
    }
}

#[test]
fn corners_are_those_of_the_file_however_a_body_is_scaled_turned_and_moved() {
    let mut dice = Dice(22);
    let turn = DVec3::new(0.3, -1.1, 0.7);
    for solid in solids(&mut dice) {
        let soup = solid.soup(1.0, DVec3::new(0.5, 0.0, 0.0), 4, &mut dice);
        let still = Body::new(Box::new(Rigid::new(soup.clone(), Keys::default())), 0.0).unwrap();
        let far = pose_at(DVec3::new(1e5, 0.0, -3e4), turn);
        let inner = Box::new(Rigid::new(soup.clone(), Keys::default()));
        let placed = Placed::new(inner, Space { scale: 0.01, up: Up::Z, ..Space::OWN }, far.clone());
        let moved = Body::new(Box::new(placed), 0.0).unwrap();
        assert_eq!((still.closed_loops(), moved.closed_loops()), (0, 0), "{}", solid.name);
        assert_eq!(still.corners(), moved.corners());
        // An open mesh does not close because it is carried to where numbers are coarse.
        let mut open = shared(&solid);
        open.triangles.remove(0);
        let open = Body::new(Box::new(Rigid::new(open, far)), 0.0).unwrap();
        assert_eq!((open.closed_loops(), open.weld_warning()), (1, None), "{}", solid.name);
    }
}

#[test]
fn soup_that_shakes_by_rounding_as_it_moves_stays_whole() {
    let (ctx, mut dice) = (context(2), Dice(23));
    let solid = solids(&mut dice).swap_remove(0);
    let at = DVec3::new(3.0, 1.0, 2.0);
    let [first, last] = [at, at + DVec3::new(0.5, 0.0, 0.0)].map(|at| solid.soup(1.0, at, 4, &mut dice));
    let morph = || Box::new(Morph::new(first.clone(), last.positions.clone()).unwrap());
    let body = Body::new(morph(), 0.0).unwrap();
    assert!(first.triangles == morph().triangles());
    let swept = sweep::chain(&ctx, &[body], 0.0, 1.0, &Settings::new(0.02)).unwrap();
    near(volume(&swept), 1.5, "a cube that moves by half of its size");
    // Parts that come apart are no longer one corner.
    let mut parted = last.positions.clone();
    parted[..3].iter_mut().for_each(|position| *position += Vec3::new(0.0, 0.4, 0.0));
    let body = Body::new(Box::new(Morph::new(first, parted).unwrap()), 0.0).unwrap();
    assert!(sweep::chain(&ctx, &[body], 0.0, 1.0, &Settings::new(0.05)).is_ok());
}

#[test]
fn a_shape_is_shared_only_where_its_corners_are_the_same() {
    let mut dice = Dice(24);
    let solid = solids(&mut dice).swap_remove(3);
    let rigid = |mesh: &TriMesh| Box::new(Rigid::new(mesh.clone(), Keys::default())) as Box<dyn Motion>;
    let soup = solid.soup(1.0, DVec3::zeros(), 4, &mut dice);
    let first = Body::new(rigid(&soup), 0.0).unwrap();
    let again = Body::shaped(rigid(&soup), 0.0, Some(first.shape().clone())).unwrap();
    assert!(Arc::ptr_eq(first.shape(), again.shape()));
    // One triangle comes off: all corners are at positions of their own still, but no longer one.
    let mut parted = soup.clone();
    parted.positions[..3].iter_mut().for_each(|position| position.x += 2.0);
    let known = Body::shaped(rigid(&parted), 0.0, Some(first.shape().clone())).unwrap();
    let new = Body::new(rigid(&parted), 0.0).unwrap();
    assert_eq!((known.closed_loops(), known.corners()), (new.closed_loops(), new.corners()));
    assert!(known.closed_loops() > 0);
}

#[test]
fn snow_lies_on_soup_as_on_its_solid() {
    let (ctx, mut dice) = (context(2), Dice(25));
    for solid in solids(&mut dice) {
        let soup = solid.soup(1.0, DVec3::zeros(), 4, &mut dice);
        let on_ground = |mesh: TriMesh| {
            let layer = initial::layer(&ctx, &Ground::Mesh(mesh), &[], &Cover::Depth(0.3), 0.04, 3.0);
            volume(&layer.unwrap())
        };
        near(on_ground(soup.clone()), on_ground(shared(&solid)), solid.name);
        let plane = Ground::Plane { height: -0.8, area: [-0.8, -0.8, 0.8, 0.8] };
        let over = |mesh: TriMesh| {
            let layer = initial::layer(&ctx, &plane, &[mesh], &Cover::Depth(1.7), 0.04, 3.0);
            volume(&layer.unwrap())
        };
        near(over(soup), over(shared(&solid)), solid.name);
    }
}
