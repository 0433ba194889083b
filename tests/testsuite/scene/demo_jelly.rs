//! The demonstration's jelly moves as a liquid may, and its commands in the Makefile run.

use std::fs;

use frazil::geometry::{DVec3, TriMesh};
use frazil::io::mesh;
use nalgebra::Matrix3;

use crate::common::jelly::{FRAMES, Jelly, moved};
use crate::program::{Folder, works};

const MAKEFILE: &str = include_str!("../../../Makefile");
/// As the demonstration has it.
const SPACING: f64 = 0.0125;

/// The mesh where the formula puts it at a frame.
fn at(mesh: &TriMesh, frame: i32) -> TriMesh {
    let positions = mesh.positions.iter().map(|position| moved(position.cast(), frame).cast()).collect();
    TriMesh { positions, ..mesh.clone() }
}

#[test]
fn the_motion_keeps_volumes_stays_above_the_ground_and_is_not_hasty() {
    let jelly = Jelly::new(2.0 * SPACING, 60);
    for frame in 1..=FRAMES {
        for position in &jelly.positions {
            let now = moved(*position, frame);
            assert!(now.y > 0.0, "{position:?} is below the ground at frame {frame}");
            let way = (now - moved(*position, (frame - 1).max(1))).norm();
            assert!(way < 9.0 * SPACING, "{position:?} moves by {way} m to frame {frame}");
            let by = |axis: usize| {
                let mut step = DVec3::zeros();
                step[axis] = 1e-6;
                (moved(position + step, frame) - moved(position - step, frame)) / 2e-6
            };
            let rate = Matrix3::from_columns(&[0, 1, 2].map(by));
            assert!((rate.determinant() - 1.0).abs() < 1e-6, "{position:?}, frame {frame}");
        }
        let volume = at(&jelly.mesh, frame).volume() / jelly.mesh.volume();
        assert!((volume - 1.0).abs() < 0.005, "frame {frame}: {volume} of the volume");
    }
}

#[test]
fn it_is_small_and_its_mesh_is_sound_and_detailed() {
    let jelly = Jelly::new(SPACING, 190);
    assert!((10_000..20_000).contains(&jelly.positions.len()), "{} particles", jelly.positions.len());
    assert!((100_000..200_000).contains(&jelly.mesh.triangles.len()));
    assert!((24..=48).contains(&FRAMES));
    assert!(jelly.mesh.is_manifold());
    assert_eq!(jelly.mesh.euler_characteristic(), 2);
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.2f64.powi(3);
    assert!((1.0..1.03).contains(&(jelly.mesh.volume() / ball)), "{}", jelly.mesh.volume());
    // Letters stand out towards +z, and nowhere else.
    let paint = jelly.paint();
    let letters = jelly.mesh.positions.iter().zip(&paint.values).filter(|(_, paint)| **paint > 0.99);
    let (count, behind) = letters
        .fold((0, 0), |(count, behind), (position, _)| (count + 1, behind + usize::from(position.z < 0.0)));
    assert!(count > 400 && behind == 0, "{count} vertices of letters, {behind} of them behind");
}

/// The Makefile's commands of the demonstration that handle the liquid, with smaller pictures and other particles.
fn commands(spacing: f64) -> Vec<String> {
    let lines = MAKEFILE.lines().filter_map(|line| line.strip_prefix("\ttarget/release/frazil "));
    let small = |line: &str| {
        let line = line.replace("$(DEMO)/", "");
        let mut words: Vec<String> = line.split_whitespace().map(String::from).collect();
        for (option, value) in [("--size", "80x60".to_string()), ("--spacing", spacing.to_string())] {
            if let Some(position) = words.iter().position(|word| word == option) {
                words[position + 1] = value;
            }
        }
        words.join(" ")
    };
    lines.filter(|line| line.contains("$(DEMO)/liquid")).map(small).collect()
}

#[test]
fn the_demonstration_tracks_a_coarse_jelly() {
    let folder = &Folder::empty();
    let jelly = Jelly::new(2.0 * SPACING, 60);
    jelly.write(folder).unwrap();
    let commands = commands(jelly.spacing);
    assert_eq!(commands.len(), 7, "{commands:?}");
    commands.iter().for_each(|command| {
        works(folder, command);
    });
    for picture in ["liquid.png", "liquid_plain.png", "liquid_particles.png", "liquid.gif"] {
        assert!(fs::metadata(folder.join(picture)).unwrap().len() > 1_000, "{picture}");
    }
    let first = jelly.paint();
    for frame in 1..=FRAMES {
        let path = folder.join(format!("liquid/surface/surface.{frame:04}.usdc"));
        let tracked = mesh::read_detailed(&path).unwrap();
        assert_eq!(tracked.mesh.triangles, jelly.mesh.triangles);
        // Written with 32 bits.
        let paint = tracked.of_vertices("paint").unwrap();
        assert!(paint.iter().zip(&first.values).all(|(now, first)| *now as f32 == *first as f32));
        let flagged = tracked.of_vertices("flagged").unwrap().iter().filter(|flag| **flag != 0.0).count();
        assert_eq!(flagged, 0, "frame {frame}: vertices are flagged, and nothing merges or splits");
        let exact = at(&jelly.mesh, frame).positions;
        let pairs = tracked.mesh.positions.iter().zip(&exact);
        let off: f64 = pairs.map(|(now, exact)| f64::from((now - exact).norm())).sum();
        let mean = off / (exact.len() as f64 * jelly.spacing);
        // Letters keep their height, while the image is squashed with them.
        assert!(mean < 0.25, "frame {frame}: {mean} r off in the mean");
    }
}
