//! Frames without particles, and frames that are missing.

use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::io::{mesh, particles};

use crate::program::{Folder, fails, works};

/// Particles of a box, 0.1 m apart, at a frame; or none.
fn write(folder: &Path, number: i32, is_full: bool) {
    let from = DVec3::new(0.02, -0.01, 0.0) * f64::from(number);
    let position =
        |n: i32| DVec3::new(f64::from(n / 36), f64::from(n / 6 % 6), f64::from(n % 6)) * 0.1 + from;
    let positions: Vec<DVec3> = (0..if is_full { 216 } else { 0 }).map(position).collect();
    let mut points = Points::at(0.1, &positions).unwrap();
    points.set("id", Values::Long(Column::Each((0..positions.len() as i64).collect())));
    particles::write(&folder.join(format!("p.{number:04}.bgeo")), &points, false).unwrap();
}

/// Triangles of a mesh in a file; none: it is not there.
fn triangles(path: &Path) -> Option<usize> {
    path.is_file().then(|| mesh::read_any(path).unwrap().ends.len())
}

#[test]
fn frames_without_particles_get_empty_meshes_and_liquid_comes_back() {
    let folder = &Folder::empty();
    let is_full = |number: i32| ![1, 2, 6, 7].contains(&number);
    (1..=9).for_each(|number| write(folder, number, is_full(number)));
    let make = "vdb from-particles p.%04d.bgeo --frames 1-9 --spacing 0.1 --mesh a.%04d.ply -o a.%04d.vdb";
    let said = works(folder, make);
    assert!(said.contains("p.0006.bgeo: holds no particles"), "{said}");
    works(folder, "surface -p p.%04d.bgeo --spacing 0.1 -o out");
    works(folder, "convert out/surface/surface.%04d.usdc b.%04d.obj --frames 1-9");
    works(folder, "preview out/surface/surface.%04d.usdc -o c.%04d.png --frames 1-9 --size 32x32");
    for number in 1..=9 {
        let count = |name: String| triangles(&folder.join(name)).unwrap();
        let names = [
            format!("a.{number:04}.ply"),
            format!("out/surface/surface.{number:04}.usdc"),
            format!("b.{number:04}.obj"),
        ];
        names.into_iter().for_each(|name| assert_eq!(count(name.clone()) > 0, is_full(number), "{name}"));
        assert!(folder.join(format!("a.{number:04}.vdb")).is_file());
    }
    assert!(works(folder, "info a.0001.ply a.0001.vdb --measure").contains("triangles              0"));
    // From a state without a mesh a run goes on with the same bytes.
    works(folder, "surface -p p.%04d.bgeo --spacing 0.1 -o again --frames 1-6");
    works(folder, "surface -p p.%04d.bgeo --spacing 0.1 -o again");
    are_same(folder, "again", 1..=9);
}

/// The meshes of these frames are the same bytes in `out` and in another run.
fn are_same(folder: &Path, run: &str, frames: RangeInclusive<i32>) {
    for frame in frames {
        let read =
            |run: &str| fs::read(folder.join(format!("{run}/surface/surface.{frame:04}.usdc"))).unwrap();
        assert!(read("out") == read(run), "frame {frame} of {run}");
    }
}

#[test]
fn frames_before_a_missing_file_are_made_and_the_rest_when_it_comes() {
    let folder = &Folder::empty();
    (1..=8).filter(|number| *number != 6).for_each(|number| write(folder, number, true));
    let run = "surface -p p.%04d.bgeo --spacing 0.1 -o out --set shot.frames=1-8";
    fails(folder, run, 1, &["p.0006.bgeo"]);
    let made = |number: i32| triangles(&folder.join(format!("out/surface/surface.{number:04}.usdc")));
    assert!((1..=5).all(|number| made(number) > Some(0)) && (6..=8).all(|number| made(number).is_none()));
    write(folder, 6, true);
    works(folder, run);
    assert!((1..=8).all(|number| made(number) > Some(0)));
    works(folder, &run.replace("-o out", "-o whole"));
    are_same(folder, "whole", 1..=8);
}

#[test]
fn check_and_run_warn_of_ids_that_are_row_numbers() {
    let folder = &Folder::empty();
    for number in 1..=3 {
        // The rows of each frame are turned by one layer, so that rows name other particles though nothing moves.
        let position = |n: usize| DVec3::new((n / 36) as f64, (n / 6 % 6) as f64, (n % 6) as f64) * 0.1;
        let positions: Vec<DVec3> = (0..216).map(|n| position((n + 110 * number) % 216)).collect();
        let mut points = Points::at(0.1, &positions).unwrap();
        points.set("id", Values::Long(Column::Each((0..216).collect())));
        points.set("v", Values::Vector(Column::Each(vec![[0.0; 3]; 216])));
        particles::write(&folder.join(format!("p.{number:04}.bgeo")), &points, false).unwrap();
    }
    fs::write(
        folder.join("s.toml"),
        "[shot]\nframes = \"1-3\"\n[surface]\nparticles = \"p.%04d.bgeo\"\nspacing = 0.1\n",
    )
    .unwrap();
    for command in ["check s.toml", "surface s.toml -o out"] {
        let said = works(folder, command);
        assert!(said.contains("ids and velocities contradict each other"), "{command}: {said}");
    }
}
