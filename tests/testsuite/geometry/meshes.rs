//! Meshes whose numbers are known, rays against brute force, mesh sequences, and meshes from the wild.

use crate::common::skip::skipped;
use std::f64::consts::PI;
use std::path::PathBuf;

use crate::common::shapes;
use crate::program::Folder;
use frazil::geometry::spatial::bvh::Bvh;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::files::sequence::Pattern;
use frazil::io::mesh;
use frazil::motion::{Key, Keys, MeshSequence, Motion, Placed, Rigid, Space, Up};
use proptest::prelude::*;

/// A torus about Y: closed, genus 1.
fn torus(radius: f64, tube: f64, n: u32) -> TriMesh {
    let angle = |i: u32| 2.0 * PI * f64::from(i) / f64::from(n);
    let mut mesh = TriMesh::default();
    for i in 0..n {
        for j in 0..n {
            let r = radius + tube * angle(j).cos();
            let p = DVec3::new(r * angle(i).cos(), tube * angle(j).sin(), r * angle(i).sin());
            mesh.positions.push(p.cast());
            let at = |i: u32, j: u32| (i % n) * n + j % n;
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[test]
fn volumes_areas_and_handles_are_the_textbook_ones() {
    let cube = shapes::cuboid([0.1, 0.2, 0.3]);
    assert!(cube.is_manifold() && cube.euler_characteristic() == 2);
    assert!((cube.volume() - 0.006).abs() < 1e-9 && (cube.area() - 0.22).abs() < 1e-7);
    let ring = torus(1.0, 0.25, 96);
    assert!(ring.is_manifold() && ring.euler_characteristic() == 0);
    assert!((ring.volume() / (2.0 * PI * PI * 0.0625) - 1.0).abs() < 3e-3, "{}", ring.volume());
    assert!((ring.area() / (4.0 * PI * PI * 0.25) - 1.0).abs() < 3e-3, "{}", ring.area());
    // Far away the volume must not drown in the coordinates' size: exact offsets, exact corners.
    let mut far = shapes::cuboid([1.0, 1.0, 1.0]);
    far.positions.iter_mut().for_each(|p| p.x += 65_536.0);
    assert!((far.volume() - 1.0).abs() < 1e-9);
    let mut inside_out = cube.clone();
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!((inside_out.volume() + cube.volume()).abs() < 1e-15);
}

#[test]
fn open_folded_and_turned_meshes_are_told_apart() {
    let cube = shapes::cuboid([1.0; 3]);
    let mut open = cube.clone();
    open.triangles.pop();
    assert!(!open.is_closed() && !open.is_manifold() && open.validate().is_ok());
    let mut turned = cube.clone();
    turned.triangles[3].swap(0, 1);
    assert!(!turned.is_closed());
    let mut fin = cube.clone();
    let [a, b, _] = fin.triangles[0];
    fin.positions.push(Vec3::new(3.0, 0.0, 0.0));
    fin.triangles.push([a, b, 8]);
    assert!(!fin.is_closed() && !fin.is_manifold() && fin.validate().is_ok());
    // Two separate cubes: 2 each.
    let mut pair = cube.clone();
    pair.append(&cube);
    assert!(pair.is_manifold() && pair.euler_characteristic() == 4);
    assert!(TriMesh::default().validate().is_err() && TriMesh::default().volume() == 0.0);
}

/// The nearest hit over all triangles, by plane and edges.
fn brute(mesh: &TriMesh, origin: DVec3, direction: DVec3) -> Option<f64> {
    let hit = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(&(c - a));
        let s = (a - origin).dot(&normal) / direction.dot(&normal);
        let p = origin + direction * s;
        let side = |u: DVec3, v: DVec3| (v - u).cross(&(p - u)).dot(&normal) >= 0.0;
        (s > 0.0 && side(a, b) && side(b, c) && side(c, a)).then_some(s)
    };
    (0..mesh.triangles.len()).filter_map(hit).min_by(f64::total_cmp)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn rays_meet_what_brute_force_meets(
        o in prop::array::uniform3(-1.5f64..1.5), d in prop::array::uniform3(-1.0f64..1.0),
    ) {
        let body = shapes::blob(1.0, 8);
        let tree = Bvh::new(&body);
        let (origin, direction) = (DVec3::from(o), DVec3::from(d));
        prop_assume!(direction.norm() > 1e-3);
        let hit = tree.ray(origin, direction, f64::INFINITY);
        let want = brute(&body, origin, direction);
        prop_assert_eq!(hit.is_some(), want.is_some());
        prop_assert_eq!(tree.any_hit(origin, direction, f64::INFINITY), want.is_some());
        if let (Some(hit), Some(want)) = (hit, want) {
            prop_assert!((hit.distance - want).abs() < 1e-9 * want.max(1.0));
            let [a, b, c] = body.corners(hit.triangle);
            let p = a + (b - a) * hit.u + (c - a) * hit.v;
            prop_assert!((p - origin - direction * hit.distance).norm() < 1e-9);
            prop_assert!(!tree.any_hit(origin, direction, want * 0.999_999));
        }
    }
}

#[test]
fn rigid_keys_move_on_arcs_and_compose() {
    let key = |time: f64, x: f64, turn: f64| Key { time, at: DVec3::x() * x, turn: DVec3::z() * turn };
    let keys = || Keys::new(vec![key(1.0, 0.0, 0.0), key(2.0, 4.0, PI)]).unwrap();
    let one = TriMesh { positions: vec![Vec3::x(), Vec3::y(), Vec3::z()], triangles: vec![[0, 1, 2]] };
    let rigid = Rigid::new(one.clone(), keys());
    let mut out = Vec::new();
    rigid.pose(1.5, &mut out).unwrap();
    // Half way: turned by 90 degrees, so the vertex keeps its distance to the origin that moved.
    assert!((out[0] - DVec3::new(2.0, 1.0, 0.0)).norm() < 1e-12);
    for (time, x) in [(0.0, 1.0), (1.0, 1.0), (2.0, 3.0), (9.0, 3.0)] {
        rigid.pose(time, &mut out).unwrap();
        assert!((out[0] - DVec3::new(x, 0.0, 0.0)).norm() < 1e-12, "{time}");
    }
    assert_eq!(rigid.breaks(0.0, 2.0), [1.0]);
    let placed = Placed::new(
        Box::new(rigid),
        Space::OWN,
        Keys::new(vec![key(1.5, 10.0, PI / 2.0), key(3.0, 0.0, 0.0)]).unwrap(),
    );
    placed.pose(1.5, &mut out).unwrap();
    assert!((out[0] - DVec3::new(9.0, 2.0, 0.0)).norm() < 1e-12);
    assert_eq!(placed.breaks(0.0, 3.0), [1.0, 1.5, 2.0]);
}

/// Frames 1 to 3 of a box that moves 0, 1, 4 m up.
fn sequence() -> (Folder, Pattern) {
    let folder = Folder::empty();
    let pattern = Pattern::parse(&folder.join("b.%04d.ply")).unwrap();
    for (frame, y) in [(1, 0.0), (2, 1.0), (3, 4.0)] {
        let mut cube = shapes::cuboid([1.0; 3]);
        cube.positions.iter_mut().for_each(|p| p.y += y);
        mesh::write(&pattern.path(frame), &cube).unwrap();
    }
    (folder, pattern)
}

#[test]
fn sequences_are_linear_between_frames_and_rest_outside() {
    let (_folder, pattern) = sequence();
    let moving = MeshSequence::open(pattern, 1, 3, 24.0, 10.0).unwrap();
    let mut out = Vec::new();
    for (frame, y) in [
        (0.0, 0.0),
        (11.0, 0.0),
        (11.5, 0.5),
        (12.0, 1.0),
        (12.25, 1.75),
        (13.0, 4.0),
        (99.0, 4.0),
        (11.5, 0.5),
    ] {
        moving.pose(frame / 24.0, &mut out).unwrap();
        assert!((out[0].y + 0.5 - y).abs() < 1e-6, "frame {frame}: {}", out[0].y);
    }
    let breaks = moving.breaks(11.0 / 24.0, 13.0 / 24.0);
    assert!(breaks.len() == 1 && (breaks[0] - 0.5).abs() < 1e-12, "{breaks:?}");
}

#[test]
fn a_missing_frame_and_a_changed_mesh_are_named() {
    let (_folder, pattern) = sequence();
    let message = |result: frazil::Result<()>| result.unwrap_err().to_string();
    let open = |last| MeshSequence::open(pattern.clone(), 1, last, 24.0, 0.0);
    assert!(message(open(5).map(drop)).contains("b.0004.ply"));
    mesh::write(&pattern.path(2), &shapes::sphere(1.0, 2)).unwrap();
    let what = message(open(3).unwrap().pose(1.5 / 24.0, &mut Vec::new()));
    assert!(what.contains("b.0001.ply") && what.contains("b.0002.ply"), "{what}");
    // As many vertices and triangles, joined otherwise.
    let mut other = shapes::cuboid([1.0; 3]);
    other.triangles.swap(0, 1);
    mesh::write(&pattern.path(2), &other).unwrap();
    assert!(open(3).unwrap().pose(1.5 / 24.0, &mut Vec::new()).is_err());
}

/// A mesh from outside the project, or none with a printed word.
fn wild(name: &str) -> Option<TriMesh> {
    let folder =
        std::env::var_os("FRAZIL_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = folder.join("mesh").join(name);
    if !path.exists() {
        skipped(&format!("no {}", path.display()));
        return None;
    }
    Some(mesh::read(&path).unwrap())
}

#[test]
fn meshes_from_the_wild_load_whole() {
    // Name, triangles, closed.
    let known = [
        ("armadillo.obj", 86_482, true),
        ("spot.obj", 5_856, true),
        ("cow.obj", 5_804, true),
        ("stanford-bunny.obj", 69_451, false),
        ("beetle-alt.obj", 38_656, false),
        ("teapot.obj", 6_320, false),
    ];
    for (name, triangles, closed) in known {
        let Some(mesh) = wild(name) else { continue };
        assert_eq!(mesh.triangles.len(), triangles, "{name}");
        assert_eq!(mesh.is_closed(), closed, "{name}");
        assert!(mesh.area() > 0.0, "{name}");
    }
    // Triangle strips.
    if let Some(igea) = wild("igea.ply") {
        assert_eq!(igea.positions.len(), 134_345);
        assert!(igea.triangles.len() > 200_000, "{}", igea.triangles.len());
        assert!(igea.volume() > 0.0);
    }
}

#[test]
fn a_file_in_centimetres_with_z_up_is_turned_before_its_keys() {
    let triangle = TriMesh {
        positions: vec![Vec3::new(100.0, 200.0, 300.0), Vec3::zeros(), Vec3::x()],
        triangles: vec![[0, 1, 2]],
    };
    let key = Key { time: 0.0, at: DVec3::y(), turn: DVec3::zeros() };
    let space = Space { scale: 0.01, up: Up::Z, ..Space::OWN };
    let own = Box::new(Rigid::new(triangle, Keys::default()));
    let mut pose = Vec::new();
    Placed::new(own, space, Keys::new(vec![key]).unwrap()).pose(0.0, &mut pose).unwrap();
    assert!((pose[0] - DVec3::new(1.0, 4.0, -2.0)).norm() < 1e-6, "{}", pose[0]);
}
