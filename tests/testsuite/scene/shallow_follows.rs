//! Shots of a liquid whose sources, drains and absorbers move with the terrain.

use std::fs;
use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::Value;

use super::shallow_shot::{are_same, ml, report, resume_in_every_way};
use crate::common::shapes::squares;
use crate::program::{Folder, fails, works};

/// A sheet of 40 x 40 cm in squares of 2 cm that has slid along x (m) and falls along its own x.
fn sheet(slid: f32, slope: f32) -> TriMesh {
    let count = 21u32;
    let position = |index: u32| {
        let [x, z] = [index % count, index / count].map(|at| 0.02 * (at as f32 - 10.0));
        Vec3::new(x + slid, -slope * x, z)
    };
    squares(count, position)
}

/// A scene of 8 frames over the middle 8 x 8 cm of a terrain, which stays within 2 cm of 0, with more lines of [shallow], and tables.
fn write_scene(folder: &Path, lines: &str, tables: &str) {
    let scene = format!(
        "[shot]\nframes = \"1-8\"\nfps = 60\n[shallow]\nterrain = \"ground.%04d.ply\"\ncell = 0.002\n\
         area = [-0.04, -0.04, 0.04, 0.04]\nbottom = -0.1\ntop = 0.1\nliquid = \"honey\"\n{lines}{tables}"
    );
    fs::write(folder.join("spill.toml"), scene).unwrap();
}

/// The terrain of each frame.
fn write_ground(folder: &Path, frames: i32, ground: impl Fn(i32) -> TriMesh) {
    for frame in 1..=frames {
        mesh::write(&folder.join(format!("ground.{frame:04}.ply")), &ground(frame)).unwrap();
    }
}

/// Positions of the surface at a frame, each with its depth (m) and layer.
fn surface(folder: &Path, out: &str, frame: i32) -> Vec<(Vec3, f64, f64)> {
    let surface = mesh::read_detailed(&folder.join(format!("{out}/liquid/liquid.{frame:04}.usdc"))).unwrap();
    let of = |name: &str| surface.of_vertices(name).unwrap();
    let numbers = of("depth").into_iter().zip(of("layer"));
    surface
        .mesh
        .positions
        .iter()
        .zip(numbers)
        .map(|(position, (depth, layer))| (*position, depth, layer))
        .collect()
}

/// Least and greatest x and z of what is wet (m).
#[track_caller]
fn wet(folder: &Path, out: &str, frame: i32) -> [f32; 4] {
    let surface = surface(folder, out, frame);
    let wet = || surface.iter().filter(|(_, depth, _)| *depth > 0.0).map(|(position, ..)| position);
    assert!(wet().next().is_some(), "{out} is dry");
    let most = |number: fn(&Vec3) -> f32| wet().map(number).fold(f32::NEG_INFINITY, f32::max);
    [
        -most(|position| -position.x),
        most(|position| position.x),
        -most(|position| -position.z),
        most(|position| position.z),
    ]
}

/// Mean depth within 4 mm of a position (m).
fn depth(folder: &Path, out: &str, frame: i32, [x, z]: [f32; 2]) -> f64 {
    let surface = surface(folder, out, frame);
    let is_near = |position: &Vec3| (position.x - x).hypot(position.z - z) < 0.004;
    let near: Vec<f64> = surface.iter().filter(|at| is_near(&at.0)).map(|at| at.1).collect();
    near.iter().sum::<f64>() / near.len().max(1) as f64
}

#[track_caller]
fn lies_within([x0, x1, z0, z1]: [f32; 4], x: [f32; 2], z: [f32; 2]) {
    // A column spreads to those beside it.
    let room = 0.0045;
    let fits = x0 > x[0] - room && x1 < x[1] + room && z0 > z[0] - room && z1 < z[1] + room;
    assert!(fits, "wet at x {x0} to {x1}, z {z0} to {z1}, which is not within {x:?} and {z:?}");
}

#[test]
fn a_source_follows_the_ground_that_slides_and_tilts() {
    let folder = &Folder::empty();
    // By frame 7 it has slid 3 cm, by frame 8 3.5 cm.
    write_ground(folder, 8, |frame| sheet(0.005 * (frame - 1) as f32, 0.008 * (frame - 1) as f32));
    let source = "[[source]]\nat = [-0.02, 0, 0.01]\nradius = 0.004\nrate_ml = 6\nfrom = 7\nfollows = true\n";
    write_scene(folder, "", source);
    works(folder, "shallow spill.toml -o rides");
    works(folder, "shallow spill.toml -o stays --set source.1.follows=false");
    for (frame, x) in [(7, 0.01), (8, 0.015)] {
        lies_within(wet(folder, "rides", frame), [0.006, x + 0.004], [0.006, 0.014]);
        lies_within(wet(folder, "stays", frame), [-0.024, -0.016], [0.006, 0.014]);
        let sourced = ["rides", "stays"].map(|out| ml(&report(folder, out, frame))[2]);
        assert!(
            sourced.iter().all(|ml| (ml / (0.1 * f64::from(frame - 6)) - 1.0).abs() < 0.01),
            "{sourced:?}"
        );
    }
    // With other keys it goes on from a frame where it is then.
    fails(folder, "shallow spill.toml -o stays", 2, &["source.1.follows was false", "--from"]);
    works(folder, "shallow spill.toml -o stays --from 8");
    let [_, x1, ..] = wet(folder, "stays", 8);
    assert!(x1 > 0.015 && wet(folder, "stays", 7)[1] < -0.01, "{x1}");
}

#[test]
fn a_source_stays_on_its_shelf() {
    let folder = &Folder::empty();
    // A shelf over the ground slides away and rises.
    let ground = |frame: i32| {
        let way = (frame - 1) as f32;
        let [x, y] = [0.004 * way, 0.03 + 0.002 * way];
        let shelf = TriMesh::cuboid([x - 0.03, y - 0.01, -0.02], [x - 0.01, y, 0.02]);
        let mut mesh = sheet(0.0, 0.0);
        let before = mesh.positions.len() as u32;
        mesh.positions.extend(shelf.positions);
        mesh.triangles.extend(shelf.triangles.iter().map(|corners| corners.map(|corner| corner + before)));
        mesh
    };
    write_ground(folder, 8, ground);
    write_scene(
        folder,
        "",
        "[[source]]\nat = [-0.02, 0.035, 0]\nradius = 0.004\nrate_ml = 6\nfrom = 8\nfollows = true\n",
    );
    works(folder, "shallow spill.toml -o rides");
    lies_within(wet(folder, "rides", 8), [0.004, 0.012], [-0.004, 0.004]);
    let top = f64::from(0.03f32 + 0.014);
    for (position, depth, layer) in surface(folder, "rides", 8).into_iter().filter(|at| at.1 > 0.0) {
        assert!(
            layer == 1.0 && (f64::from(position.y) - depth - top).abs() < 1e-4,
            "{position:?}, layer {layer}"
        );
    }
}

#[test]
fn drains_and_absorbers_follow_too_and_gauze_stays_wet() {
    let folder = &Folder::empty();
    write_ground(folder, 8, |frame| sheet(0.005 * (frame - 1) as f32, 0.0));
    let points = "[[drain]]\nat = [-0.02, 0, 0.01]\nradius = 0.006\nrate_ml = 12\nfrom = 7\nfollows = true\n\
        [[absorber]]\nat = [-0.02, 0, -0.02]\nradius = 0.006\nrate_ml = 1\ncapacity_ml = 0.05\nfollows = true\n";
    write_scene(folder, "border = \"closed\"\nfill = 0.001\n", points);
    works(folder, "shallow spill.toml -o rides");
    works(folder, "shallow spill.toml -o stays --set drain.1.follows=false --set absorber.1.follows=false");
    let depths = |out: &str, z: f32| [-0.02, 0.01].map(|x| depth(folder, out, 7, [x, z]));
    let ([old, new], [still_old, still_new]) = (depths("rides", 0.01), depths("stays", 0.01));
    assert!(new < 0.0005 && old > 0.0009, "{new} m where the drain is, {old} m where it was");
    assert!(still_old < 0.0005 && still_new > 0.0009, "{still_old} m, {still_new} m");
    // The gauze is full after three frames, and its moving on does not dry it.
    let absorbed = [2, 4, 6, 8].map(|frame| ml(&report(folder, "rides", frame))[4]);
    assert!((absorbed[0] - 1.0 / 60.0).abs() < 1e-4, "{absorbed:?}");
    assert!((absorbed[1] - 0.05).abs() < 1e-4 && absorbed[1] == absorbed[3], "{absorbed:?}");
    let [under, ahead] = [-0.02, 0.0].map(|x| depth(folder, "rides", 4, [x, -0.02]));
    let [still_under, still_ahead] = [-0.02, 0.0].map(|x| depth(folder, "stays", 4, [x, -0.02]));
    assert!(under > still_under && ahead < still_ahead, "{under} {ahead}, {still_under} {still_ahead}");
}

/// Names of the points that rest, as the report of a frame has them.
fn resting(folder: &Path, out: &str, frame: i32) -> Value {
    report(folder, out, frame)["resting"].clone()
}

/// Slides out of the area from frame 4 to 6, and comes back.
fn out_and_back(frame: i32) -> TriMesh {
    let way = [0.0, 0.004, 0.008, 0.03, 0.04, 0.03, 0.008, 0.004];
    sheet(way[(frame - 1) as usize % 8], 0.02)
}

#[test]
fn what_leaves_the_area_rests_until_it_comes_back() {
    let folder = &Folder::empty();
    write_ground(folder, 8, out_and_back);
    let points = "[[source]]\nat = [0.03, 0, 0.01]\nradius = 0.003\nrate_ml = 6\nfollows = true\n\
        [[source]]\nat = [0, 0, -0.01]\nradius = 0.003\nrate_ml = 6\nfollows = true\n\
        [[drain]]\nat = [0.03, 0, 0]\nradius = 0.003\nrate_ml = 6\nuntil = 3\nfollows = true\n";
    write_scene(folder, "border = \"closed\"\n", points);
    let said = works(folder, "shallow spill.toml -o whole");
    let warned: Vec<&str> = said.lines().filter(|line| line.contains("rests until")).collect();
    assert!(matches!(warned[..], [line] if line.contains("source.1: at frame 4")), "{said}");
    let sourced = |frame| ml(&report(folder, "whole", frame))[2];
    for frame in 1..=8 {
        let rests = (4..=6).contains(&frame);
        let wanted = if rests { serde_json::json!(["source.1"]) } else { serde_json::json!([]) };
        assert_eq!(resting(folder, "whole", frame), wanted, "frame {frame}");
        if frame > 1 {
            let more = sourced(frame) - sourced(frame - 1);
            let wanted = if rests { 0.1 } else { 0.2 };
            assert!((more / wanted - 1.0).abs() < 0.01, "{more} ml come on the way to frame {frame}");
        }
    }
    // A run that stops while it rests goes on to the same bytes, and need not tell it again.
    works(folder, "shallow spill.toml -o part --frames 1-5");
    let said = works(folder, "shallow spill.toml -o part");
    assert!(!said.contains("rests until"), "{said}");
    are_same(folder, "whole", "part");
    let said = works(folder, "check spill.toml");
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("and rests")).collect();
    assert!(
        matches!(lines[..], [line] if line.contains("source.1") && line.contains("at 3 frames, the first of them 4")),
        "{said}"
    );
    assert!(!said.contains("beside it"), "{said}");
    // High above a slope the nearest position is another one than that below.
    let said = works(folder, "check spill.toml --set source.2.at=[0,0.3,0]");
    assert!(
        said.contains("source.2: the point of the terrain that is nearest to it")
            && said.contains("beside it"),
        "{said}"
    );
    // Where it would be outside from the beginning it is refused, before anything is written.
    let outside = "--set source.1.at=[0.06,0,0]";
    fails(folder, &format!("shallow spill.toml -o no {outside}"), 2, &["spill.toml", "source.1", "outside"]);
    assert!(!folder.join("no").exists());
}

#[test]
fn what_never_comes_has_no_sign() {
    let folder = Folder::empty();
    write_ground(&folder, 8, |_| sheet(0.0, 0.0));
    write_scene(&folder, "", "");
    let said = works(&folder, "check spill.toml");
    assert!(said.contains(" 0.0000 ml come later") && !said.contains("-0.0000"), "{said}");
}

#[test]
fn what_an_obstacle_covers_rests_and_the_shot_resumes() {
    let folder = &Folder::empty();
    write_ground(folder, 8, |_| sheet(0.0, 0.0));
    let tables = "[[source]]\nat = [0, 0, 0]\nradius = 0.002\nrate_ml = 6\n\
        [[source]]\nat = [0, 0, 0]\nradius = 0.002\nrate_ml = 6\nfollows = true\n\
        [[object]]\nshape = \"box\"\nsize = [0.02, 0.06, 0.02]\n\
        keys = [{ frame = 1, at = [-0.03, 0, 0] }, { frame = 4, at = [0, 0, 0] }, { frame = 8, at = [0.03, 0, 0] }]\n";
    write_scene(folder, "", tables);
    works(folder, "shallow spill.toml -o whole");
    let said = works(folder, "check spill.toml");
    let counted = said.lines().filter(|line| line.contains("at 2 frames, the first of them 4")).count();
    assert_eq!(counted, 2, "{said}");
    let both = serde_json::json!(["source.1", "source.2"]);
    let none = serde_json::json!([]);
    let rest = [2, 4, 5, 8].map(|frame| resting(folder, "whole", frame));
    assert_eq!(rest, [&none, &both, &both, &none].map(Value::clone));
    works(folder, "shallow spill.toml -o part --frames 1-4");
    works(folder, "shallow spill.toml -o part");
    are_same(folder, "whole", "part");
    // So it does with others that are covered there.
    works(folder, "shallow spill.toml -o part --from 5 --set source.1.rate_ml=9");
    let sourced = [5, 8].map(|frame| ml(&report(folder, "part", frame))[2]);
    assert!((sourced[1] - sourced[0] - 3.0 * 0.25).abs() < 0.01, "{sourced:?}");
}

#[test]
fn they_resume_to_the_same_bytes_on_any_threads() {
    let folder = &Folder::empty();
    write_ground(folder, 40, out_and_back);
    let points = "[[pour]]\nat = [0, 0.05, 0]\nradius = 0.02\nvolume_ml = 2\n\
        [[source]]\nat = [0.03, 0, 0.01]\nradius = 0.003\nrate_ml = 6\nfrequency = 3\nswing = 0.5\nfollows = true\n\
        [[source]]\nat = [0.01, 0, -0.02]\nradius = 0.003\nrate_ml = 2\n\
        [[drain]]\nat = [0, 0, 0.01]\nradius = 0.003\nrate_ml = 1\nfrom = 3\nfollows = true\n\
        [[absorber]]\nat = [0.01, 0, 0]\nradius = 0.003\nrate_ml = 2\ncapacity_ml = 0.5\nfollows = true\n";
    write_scene(folder, "", points);
    resume_in_every_way(folder);
}
