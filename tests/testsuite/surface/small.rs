//! `frazil surface` at drops of few particles (`surface.min_drop`), and at bubbles that the mesh lacks (`surface.match`).

use std::path::Path;

use frazil::geometry::check::topology::components;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::mesh;
use frazil::surface::{Implicit, Isosurface};

use crate::common::followed::{self, reported};
use crate::common::liquids::{context, write_numbered};
use crate::program::{Folder, works};

/// Distance between particles (m).
const SPACING: f64 = 0.01;
/// Frames of the shot in which a drop flies off a ball, and the one from which on it is far from it.
const FRAMES: i32 = 22;
const AWAY: i32 = 20;

/// Positions of a lattice (spacings), so many along each axis.
fn lattice(low: DVec3, counts: [u32; 3]) -> impl Iterator<Item = DVec3> {
    let on = move |axis: usize| (0..counts[axis]).map(f64::from);
    on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| low + DVec3::new(x, y, z))))
}

/// Writes particles at positions (spacings), numbered from 0 on.
fn write_particles(path: &Path, positions: &[DVec3]) {
    let positions: Vec<DVec3> = positions.iter().map(|position| position * SPACING).collect();
    write_numbered(path, &positions, 0);
}

/// A frame's mesh as it was written.
fn frame(folder: &Path, out: &str, frame: i32) -> TriMesh {
    followed::frame(folder, out, frame).mesh
}

/// Where the first particle of the drop is (spacings).
fn drop_at(frame: i32) -> DVec3 {
    DVec3::new(3.6 + 0.25 * f64::from(frame - 1), 0.4, 0.4)
}

/// The cache of a ball, from which a drop of 4 particles flies off.
fn write_drop(folder: &Path) {
    for frame in 1..=FRAMES {
        let ball = lattice(DVec3::repeat(-4.0), [9; 3]).filter(|position| position.norm() <= 4.5);
        let positions: Vec<DVec3> = ball.chain(lattice(drop_at(frame), [2, 2, 1])).collect();
        write_particles(&folder.join(format!("drop.{frame:04}.bgeo")), &positions);
    }
}

#[test]
fn a_drop_of_fewer_particles_than_min_drop_is_taken_away() {
    let folder = &Folder::empty();
    write_drop(folder);
    let shot = "surface -p drop.%04d.bgeo --spacing 0.01";
    works(folder, &format!("{shot} -o all --set surface.min_drop=1"));
    works(folder, &format!("{shot} -o eight --set surface.min_drop=8"));
    works(folder, &format!("{shot} -o four --set surface.min_drop=4"));
    works(folder, &format!("{shot} -o usual"));
    let specks = |out: &str| (1..=FRAMES).map(|number| reported(folder, out, number, "specks")).sum::<u64>();
    for (out, wanted) in [("all", 0), ("four", 0), ("eight", 1), ("usual", 1)] {
        assert_eq!(specks(out), wanted, "{out}");
        for number in AWAY..=FRAMES {
            let middle = drop_at(number) + DVec3::new(0.5, 0.5, 0.0);
            let is_near = |position: &&Vec3| (position.cast::<f64>() / SPACING - middle).norm() < 2.2;
            let now = frame(folder, out, number);
            let count = now.positions.iter().filter(is_near).count();
            let is_right = if wanted == 0 { count > 20 } else { count == 0 };
            assert!(is_right, "{count} vertices at the drop in frame {number} of {out}");
            assert_eq!(components(&now.triangles).len(), if wanted == 0 { 2 } else { 1 }, "{out}, {number}");
        }
    }
}

/// The outer part of the particles' own surface; positions in spacings, the mesh in metres.
fn outer_surface(places: &[DVec3]) -> TriMesh {
    let places: Vec<DVec3> = places.iter().map(|place| place * SPACING).collect();
    let phi = Implicit::new(&context(2), &places, SPACING, 0.5 * SPACING).unwrap();
    let whole = Isosurface::new(&phi).mesh(&phi);
    let of_part = |part: Vec<u32>| {
        let triangles = part.iter().map(|triangle| whole.triangles[*triangle as usize]).collect();
        TriMesh { positions: whole.positions.clone(), triangles }.without_unused()
    };
    let parts = components(&whole.triangles);
    assert_eq!(parts.len(), 2, "a surface outside, and one inside");
    parts.into_iter().map(of_part).max_by(|a, b| a.volume().total_cmp(&b.volume())).unwrap()
}

#[test]
fn a_bubble_that_the_mesh_lacks_is_meshed_where_all_of_it_is_matched() {
    let folder = &Folder::empty();
    let all = lattice(DVec3::repeat(-9.0), [19; 3]);
    let positions: Vec<DVec3> = all.filter(|position| (5.0..=8.5).contains(&position.norm())).collect();
    let outer = outer_surface(&positions);
    mesh::write(&folder.join("outer.ply"), &outer).unwrap();
    let frames = 3;
    for frame in 1..=frames {
        write_particles(&folder.join(format!("hollow.{frame:04}.bgeo")), &positions);
    }
    let shot = "surface -p hollow.%04d.bgeo -m outer.ply --spacing 0.01";
    works(folder, &format!("{shot} -o usual"));
    works(folder, &format!("{shot} -o flagged --set surface.match=flagged"));
    let said = works(folder, &format!("{shot} -o every --set surface.match=every"));
    assert!(!said.contains("surface.match"), "{said}");
    for out in ["usual", "flagged"] {
        assert!(frame(folder, out, frames).triangles == outer.triangles, "{out}");
        assert_eq!(reported(folder, out, frames, "bubbles"), 1, "{out}");
    }
    let meshed = frame(folder, "every", frames);
    assert!(meshed.is_manifold() && components(&meshed.triangles).len() == 2);
    // Its surface lies 4.5 spacings from the middle: 380 cubes.
    let bubble = (outer.volume() - meshed.volume()) / SPACING.powi(3);
    assert!((340.0..420.0).contains(&bubble), "{bubble} cubes of a spacing");
    assert_eq!(reported(folder, "every", frames, "bubbles"), 0);
    let warning = "frazil: warn: surface.match = \"every\" does nothing where surface.rebuild is false";
    let said = works(
        folder,
        &format!(
            "{shot} -o fixed --set surface.match=every --set surface.rebuild=false --set shot.frames=1-1"
        ),
    );
    assert!(said.contains(warning), "{said}");
}
