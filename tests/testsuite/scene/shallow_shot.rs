//! Shots of a liquid on a terrain: resumed, killed, on other threads, with obstacles and terrain that move.

use std::fs;
use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::Value;

use crate::common::character::output;
use crate::common::shapes::squares;
use crate::program::{Folder, command, fails, kill_at, works};

/// A sheet of 40 x 40 cells of 2 mm that falls along x, whose bumps are so high (m), raised by a height (m).
fn slope(bumps: f32, raised: f32) -> TriMesh {
    let count = 41u32;
    let position = |index: u32| {
        let [x, z] = [index % count, index / count].map(|at| 0.002 * (at as f32 - 20.0));
        let wave = |at: f32| 4.0 * at * at * 625.0 - (at * at * 625.0) * (at * at * 625.0);
        Vec3::new(x, raised - 0.2 * x + bumps * wave(x) * wave(z), z)
    };
    squares(count, position)
}

const LIQUID: &str = "[[pour]]\nat = [-0.02, 0.05, 0]\nradius = 0.008\nvolume_ml = 1.5\n\
    [[pour]]\nat = [0.01, 0.05, 0.01]\nradius = 0.004\nvolume_ml = 0.25\nframe = 4\n\
    [[source]]\nat = [-0.03, 0.05, 0.01]\nradius = 0.003\nrate_ml = 4\nfrequency = 3\nswing = 0.5\n\
    [[drain]]\nat = [-0.02, 0.05, 0]\nradius = 0.004\nrate_ml = 2\nfrom = 3\nuntil = 6\n\
    [[absorber]]\nat = [-0.02, 0.05, 0.004]\nradius = 0.004\nrate_ml = 3\ncapacity_ml = 0.1\n";

const OBSTACLES: &str = "[[object]]\nshape = \"capsule\"\nradius = 0.004\nlength = 0.02\n\
    keys = [{ frame = 1, at = [-0.03, 0.02, 0.02] }, { frame = 8, at = [0.0, 0.004, 0.0], turn_deg = [0, 0, 60] }]\n\
    [[object]]\nshape = \"box\"\nsize = [0.006, 0.02, 0.006]\nkeys = [{ frame = 1, at = [0.01, 0, -0.01] }]\n\
    [[object]]\nfile = \"stone.obj\"\nscale = 0.001\nkeys = [{ frame = 1, at = [-0.01, 0.004, 0.012] }]\n";

/// A scene of 8 frames on a slope, with more lines of [shallow], and tables.
fn write_shot(folder: &Path, lines: &str, tables: &str) {
    mesh::write(&folder.join("slope.ply"), &slope(0.002, 0.0)).unwrap();
    // A stone in millimetres.
    mesh::write(&folder.join("stone.obj"), &TriMesh::cuboid([-3.0, -6.0, -3.0], [3.0, 6.0, 3.0])).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-8\"\nfps = 60\n[shallow]\nterrain = \"slope.ply\"\ncell = 0.002\n{lines}{tables}\
         [output]\nliquid = [\"ply\", \"usd\"]\n"
    );
    fs::write(folder.join("spill.toml"), scene).unwrap();
}

pub fn report(folder: &Path, out: &str, frame: i32) -> Value {
    let path = folder.join(format!("{out}/report/liquid.{frame:04}.json"));
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Millilitres at a frame by name: inside, poured, sourced, drained, absorbed, lost.
pub fn ml(report: &Value) -> [f64; 6] {
    ["inside", "poured", "sourced", "drained", "absorbed", "lost"]
        .map(|name| report[format!("{name}_ml")].as_f64().unwrap())
}

#[track_caller]
pub fn are_same(folder: &Path, a: &str, b: &str) {
    let [a_files, b_files] = [a, b].map(|out| output(&folder.join(out)));
    assert_eq!(a_files.keys().collect::<Vec<_>>(), b_files.keys().collect::<Vec<_>>(), "{a} and {b}");
    a_files.iter().for_each(|(name, bytes)| assert!(*bytes == b_files[name], "{name} of {a} and {b}"));
}

#[test]
fn all_liquid_is_accounted_for_and_points_act_at_their_frames() {
    let folder = &Folder::empty();
    write_shot(folder, "", LIQUID);
    works(folder, "shallow spill.toml -o out");
    let first = ml(&report(folder, "out", 1));
    assert!((first[0] - 1.5).abs() < 1e-6 && first[2..] == [0.0; 4], "{first:?}");
    for frame in 1..=8 {
        let report = report(folder, "out", frame);
        let [inside, poured, sourced, drained, absorbed, lost] = ml(&report);
        let error = poured + sourced - drained - absorbed - lost - inside;
        assert!(error.abs() < 1e-9 && report["missing_units"] == 0, "{report}");
        assert!((poured - if frame < 4 { 1.5 } else { 1.75 }).abs() < 1e-6, "{report}");
        assert!(absorbed <= 0.1 + 1e-9, "{report}");
    }
    let drained = [2, 6, 8].map(|frame| ml(&report(folder, "out", frame))[3]);
    // At most four frames at 2 ml/s; what is less than a unit a column may follow.
    assert!(drained[0] == 0.0 && (0.02..0.1334).contains(&drained[1]), "{drained:?}");
    assert!((drained[1] - drained[2]).abs() < 1e-6, "{drained:?}");
    let absorbed = ml(&report(folder, "out", 8))[4];
    assert!((0.05..=0.1 + 1e-9).contains(&absorbed), "{absorbed} ml are in the gauze");
    // The surface carries what it is asked for.
    let surface = mesh::read_detailed(&folder.join("out/liquid/liquid.0008.usdc")).unwrap();
    let names: Vec<&str> = surface.arrays.iter().map(|array| &*array.name).collect();
    assert_eq!(names, ["vx", "vy", "vz", "depth", "alpha", "layer"]);
    let of = |name: &str| surface.of_vertices(name).unwrap();
    let deepest = of("depth").into_iter().fold(0.0, f64::max);
    assert!((deepest / report(folder, "out", 8)["deepest_m"].as_f64().unwrap() - 1.0).abs() < 1e-6);
    for (depth, alpha) in of("depth").into_iter().zip(of("alpha")) {
        assert!((alpha - (depth / 0.001).min(1.0)).abs() < 1e-5, "{depth} m: {alpha}");
    }
    assert!(of("v").into_iter().fold(0.0, f64::max) > 0.01, "nothing flows");
    let text = fs::read_to_string(folder.join("out/shot.usda")).unwrap();
    assert!(text.contains("displayOpacity") && text.contains("/materials/blood"), "{text}");
}

#[test]
fn threads_kills_and_another_order_of_frames_give_the_same_bytes() {
    let folder = &Folder::empty();
    for (name, tables) in [("still", LIQUID.to_string()), ("moving", format!("{LIQUID}{OBSTACLES}"))] {
        let folder = folder.join(name);
        fs::create_dir(&folder).unwrap();
        write_shot(&folder, "", &tables);
        resume_in_every_way(&folder);
    }
}

/// Makes a shot in several ways, all to the same bytes.
#[track_caller]
pub fn resume_in_every_way(folder: &Path) {
    // Enough frames that none is the last when it is killed.
    let shot = "shallow spill.toml --set shot.frames=1-40";
    works(folder, &format!("{shot} -o whole --threads 2"));
    works(folder, &format!("{shot} -o one --threads 1"));
    are_same(folder, "whole", "one");
    kill_at(folder, &format!("{shot} -o killed"), "killed/liquid/liquid.0003.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(folder, "whole", "killed");
    works(folder, &format!("{shot} -o part --frames 5-6"));
    works(folder, &format!("{shot} -o part"));
    are_same(folder, "whole", "part");
    let mut plain = command(folder, &format!("{shot} -o baseline"));
    assert!(plain.env("FRAZIL_CPU", "baseline").status().unwrap().success());
    are_same(folder, "whole", "baseline");
    let said = works(folder, &format!("{shot} -o whole"));
    assert!(said.contains("40 frames exist, 0 are to be made"), "{said}");
    let checked = works(folder, "check whole");
    assert!(checked.contains("40 frames") && checked.contains("all of them"), "{checked}");
}

#[test]
fn a_run_goes_on_with_other_settings_but_not_on_another_terrain() {
    let folder = &Folder::empty();
    write_shot(folder, "", &format!("{LIQUID}{OBSTACLES}"));
    let shot = "shallow spill.toml -o out";
    works(folder, shot);
    let before = ml(&report(folder, "out", 5));
    fails(
        folder,
        &format!("{shot} --set shallow.viscosity=1e-4"),
        2,
        &["shallow.viscosity was 4e-6", "--from"],
    );
    fails(folder, &format!("{shot} --set source.1.rate_ml=9"), 2, &["source.1.rate_ml was 4"]);
    for set in [
        "shallow.cell=0.001",
        "shallow.border=closed",
        "shallow.top=1",
        "shallow.fill=0.01",
        "object.3.scale=0.002",
    ] {
        let key = set.split('=').next().unwrap();
        fails(folder, &format!("{shot} --from 6 --set {set}"), 2, &[key]);
    }
    // Obstacles, points and liquids may be others.
    let more = format!("{LIQUID}[[source]]\nat = [0, 0.05, -0.02]\nradius = 0\nrate_ml = 60\n{OBSTACLES}");
    write_shot(folder, "liquid = \"honey\"\n", &more);
    works(folder, &format!("{shot} --from 6 --set object.1.keys=[{{frame=1,at=[0.02,0.01,0.02]}}]"));
    assert_eq!(ml(&report(folder, "out", 5)), before);
    let sourced = ml(&report(folder, "out", 6))[2] - before[2];
    assert!(sourced > 1.0, "{sourced} ml come in a frame, 1 of them of the new source");
    // What lies beyond the shot does not matter; a longer shot only adds frames.
    write_shot(folder, "", LIQUID);
    works(folder, "shallow spill.toml -o long");
    let said = works(folder, "shallow spill.toml -o long --set shot.frames=1-10");
    assert!(said.contains("8 frames exist, 2 are to be made"), "{said}");
    // A state that was damaged is named, and one that is gone is made again.
    let state = folder.join("long/state/liquid.0010.liquid");
    let mut bytes = fs::read(&state).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&state, &bytes).unwrap();
    fails(folder, "shallow spill.toml -o long --set shot.frames=1-11", 2, &["liquid.0010.liquid"]);
    fs::remove_file(&state).unwrap();
    works(folder, "shallow spill.toml -o long --set shot.frames=1-11");
    write_shot(folder, "", LIQUID);
    works(folder, "shallow spill.toml -o at_once --set shot.frames=1-11");
    let frame = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0011.usdc")).unwrap();
    assert!(frame("long") == frame("at_once"), "the last frame differs");
}

#[test]
fn a_terrain_that_moves_loses_nothing() {
    let folder = &Folder::empty();
    write_shot(folder, "border = \"closed\"\n", LIQUID);
    for frame in 1..=24 {
        let raised = 0.001 * (frame % 4) as f32;
        mesh::write(&folder.join(format!("organ.{frame:04}.ply")), &slope(0.0002 * frame as f32, raised))
            .unwrap();
    }
    let shot = "shallow spill.toml --set shallow.terrain=organ.%04d.ply --set shot.frames=1-24";
    works(folder, &format!("{shot} -o whole"));
    for frame in 1..=24 {
        let report = report(folder, "whole", frame);
        let [inside, poured, sourced, drained, absorbed, lost] = ml(&report);
        let error = poured + sourced - drained - absorbed - lost - inside;
        assert!(error.abs() < 1e-9 && report["missing_units"] == 0 && lost == 0.0, "{report}");
    }
    kill_at(folder, &format!("{shot} -o killed"), "killed/liquid/liquid.0004.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(folder, "whole", "killed");
    works(folder, "preview whole --frames 1-24x23 -o p.%04d.png --size 32x24");
    // A mesh that was changed concerns the frames from its own on.
    mesh::write(&folder.join("organ.0006.ply"), &slope(0.004, 0.0)).unwrap();
    fails(folder, &format!("{shot} -o whole"), 2, &["frame 6"]);
    works(folder, &format!("{shot} -o whole --from 6"));
    mesh::write(&folder.join("organ.0007.ply"), &TriMesh::cuboid([-0.01; 3], [0.01; 3])).unwrap();
    fails(folder, &format!("{shot} -o other"), 1, &["organ.0007.ply", "another mesh", "8 vertices"]);
    mesh::write(&folder.join("organ.0007.ply"), &slope(0.0, 5.0)).unwrap();
    fails(folder, &format!("{shot} -o other"), 1, &["organ.0007.ply", "shallow.top"]);
    fails(
        folder,
        "check spill.toml --set shallow.terrain=organ.%04d.ply",
        2,
        &["organ.0007.ply", "shallow.top"],
    );
    fs::remove_file(folder.join("organ.0005.ply")).unwrap();
    fails(folder, &format!("{shot} -o gone"), 2, &["organ.0005.ply"]);
}

#[test]
fn an_obstacle_pushes_liquid_away_and_none_is_lost() {
    let folder = &Folder::empty();
    // A tray with a pool into which a ball is lowered.
    mesh::write(&folder.join("slope.ply"), &TriMesh::cuboid([-0.04, -0.01, -0.04], [0.04, 0.0, 0.04]))
        .unwrap();
    let scene = "[shot]\nframes = \"1-8\"\nfps = 60\n[shallow]\nterrain = \"slope.ply\"\ncell = 0.002\nborder = \"closed\"\n\
                 fill = 0.004\nliquid = \"water\"\n[[object]]\nshape = \"sphere\"\nradius = 0.012\n\
                 keys = [{ frame = 1, at = [0, 0.03, 0] }, { frame = 6, at = [0, 0.006, 0] }]\n";
    fs::write(folder.join("pool.toml"), scene).unwrap();
    works(folder, "shallow pool.toml -o out");
    let inside = [1, 8].map(|frame| ml(&report(folder, "out", frame))[0]);
    assert!((inside[0] - 25.6).abs() < 1e-5 && inside[0] == inside[1], "{inside:?}");
    let deepest = |frame| report(folder, "out", frame)["deepest_m"].as_f64().unwrap();
    assert!(deepest(1) < 0.0041 && deepest(7) > 0.0043, "{} m, then {} m", deepest(1), deepest(7));
}
