//! What a shot is made from: sequences with their next frame, static objects, objects far away, names of objects.

use std::fs;
use std::path::Path;

use crate::common::character::output;
use crate::common::usda;
use crate::program::{CUBE, Folder, complains, fails, frazil, works};

/// A folder with a cube; the scene has an area of 2 x 2 m, and `objects` at its end.
fn folder(frames: i32, cell: f64, objects: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    write_scene(&folder, frames, cell, objects);
    folder
}

fn write_scene(folder: &Path, frames: i32, cell: f64, objects: &str) {
    let scene = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = {cell}\n{objects}"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
}

/// The cube, so far along x.
fn cube_at(x: f64) -> String {
    let moved = |line: &str| match line.strip_prefix("v ").and_then(|rest| rest.split_once(' ')) {
        Some((first, rest)) => format!("v {} {rest}\n", first.parse::<f64>().unwrap() + x),
        None => format!("{line}\n"),
    };
    CUBE.lines().map(moved).collect()
}

/// The first velocity along x in a USD file.
fn velocity(path: &Path) -> f64 {
    usda::numbers(&usda::text(path), "velocities")[0].into()
}

const SEQUENCE: &str = "[output]\nobjects = [\"usd\"]\n[[object]]\nfile = \"body.%04d.obj\"\n";

#[test]
fn the_last_frame_of_a_sequence_moves_as_the_next_file_says_once_it_is_there() {
    let folder = folder(4, 0.05, SEQUENCE);
    let write =
        |frame: i32, x: f64| fs::write(folder.join(format!("body.{frame:04}.obj")), cube_at(x)).unwrap();
    (1..=4).for_each(|frame| write(frame, 0.01 * f64::from(frame * frame)));
    works(&folder, "snow shot.toml -o out -q");
    let last = folder.join("out/objects/objects.0004.usdc");
    // No next file: as over the frame before, 0.16 - 0.09 m in 1/24 s.
    assert!((velocity(&last) - 0.07 * 24.0).abs() < 1e-4, "{}", velocity(&last));
    let said = works(&folder, "snow shot.toml -o out");
    assert!(said.contains("0 are to be made"), "{said}");
    (5..=6).for_each(|frame| write(frame, 0.01 * f64::from(frame * frame)));
    write_scene(&folder, 5, 0.05, SEQUENCE);
    works(&folder, "snow shot.toml -o out -q");
    assert!((velocity(&last) - 0.09 * 24.0).abs() < 1e-4, "{}", velocity(&last));
    // Frame 5 is the last of the shot, but not of the files.
    let last = folder.join("out/objects/objects.0005.usdc");
    assert!((velocity(&last) - 0.11 * 24.0).abs() < 1e-4, "{}", velocity(&last));
    works(&folder, "snow shot.toml -o fresh -q");
    assert!(output(&folder.join("out")) == output(&folder.join("fresh")));
    // Another next file: only the velocities of the last frame change.
    let base = fs::read(folder.join("out/base/base.0005.vdb")).unwrap();
    write(6, 0.5);
    works(&folder, "snow shot.toml -o out -q");
    assert!((velocity(&last) - 0.25 * 24.0).abs() < 1e-4, "{}", velocity(&last));
    assert!(base == fs::read(folder.join("out/base/base.0005.vdb")).unwrap());
    // One that does not fit does not stop the run.
    fs::write(folder.join("body.0006.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let said = works(&folder, "snow shot.toml -o out");
    assert!(said.contains("body.0006.obj") && (velocity(&last) - 0.09 * 24.0).abs() < 1e-4, "{said}");
}

#[test]
fn a_file_that_changes_while_it_is_in_use_is_named() {
    use frazil::motion::{MeshSequence, Motion};
    let folder = folder(1, 0.05, "");
    let path = |frame: i32| folder.join(format!("body.{frame}.obj"));
    (1..=4).for_each(|frame| fs::write(path(frame), cube_at(f64::from(frame))).unwrap());
    let pattern = frazil::io::files::sequence::Pattern::parse(&folder.join("body.%d.obj")).unwrap();
    let sequence = MeshSequence::open(pattern, 1, 4, 1.0, 0.0).unwrap();
    let mut pose = Vec::new();
    (1..=4).for_each(|frame| sequence.pose(f64::from(frame), &mut pose).unwrap());
    fs::write(path(1), cube_at(9.0)).unwrap();
    let error = sequence.pose(1.0, &mut pose).unwrap_err().to_string();
    assert!(error.contains("body.1.obj") && error.contains("changed while"), "{error}");
}

#[test]
fn a_static_object_is_part_of_the_layer_that_from_keeps() {
    let objects = "[[object]]\nfile = \"rock.obj\"\nrole = \"static\"\n[[object]]\nfile = \"cube.obj\"\n\
                   keys = [{ frame = 1, at = [0.6, 0.1, 0] }, { frame = 6, at = [0.6, 0.1, 0.5] }]\n";
    let folder = folder(4, 0.05, objects);
    fs::write(folder.join("rock.obj"), cube_at(-0.5)).unwrap();
    works(&folder, "snow shot.toml -o out -q");
    let before = output(&folder.join("out"));
    for (set, word) in [
        ("object.1.scale=0.5", "static object 1: scale was 1.0"),
        ("object.1.file=cube.obj", "static object 1: file had different contents"),
        ("object.1.role=ignore", "static object 1: file had different contents"),
        ("object.2.role=static", "static object 2: file was not set"),
    ] {
        let run = format!("snow shot.toml -o out --from 3 --set {set}");
        fails(&folder, &run, 2, &["--from 3", "another layer", word]);
    }
    assert!(before == output(&folder.join("out")));
    works(&folder, "snow shot.toml -o out -q --from 3 --set object.2.scale=0.9");
    fails(&folder, "snow shot.toml -o out", 2, &["object.2.scale was 0.9"]);
}

#[test]
fn every_object_has_a_prim_of_its_own() {
    let object = |file: &str| format!("[[object]]\nfile = \"{file}\"\n");
    let files = ["boot_2.obj", "boot.obj", "boot.obj", "cube.obj"];
    let objects: String = files.into_iter().map(object).collect();
    let folder = folder(1, 0.1, &format!("[output]\nobjects = [\"usd\"]\n{objects}"));
    ["boot.obj", "boot_2.obj"].iter().for_each(|name| fs::write(folder.join(name), CUBE).unwrap());
    works(&folder, "snow shot.toml -o out -q");
    let clip = usda::text(&folder.join("out/objects/objects.0001.usdc"));
    let names: Vec<&str> =
        clip.split("def Mesh \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(names.len(), 4, "{clip}");
    assert!((1..4).all(|at| !names[..at].contains(&names[at])), "{names:?}");
}

#[test]
fn a_frame_that_removes_nothing_has_a_volume_of_nought() {
    let objects = "[[object]]\nfile = \"cube.obj\"\nkeys = [{ frame = 1, at = [0, 3, 0] }]\n";
    let folder = folder(1, 0.1, objects);
    works(&folder, "snow shot.toml -o out -q");
    let report = fs::read_to_string(folder.join("out/report/base.0001.json")).unwrap();
    assert!(report.contains("\"removed_m3\": 0.0"), "{report}");
    let grids = frazil::vdb::file::read(&folder.join("out/removed/removed.0001.vdb")).unwrap();
    let metadata = grids[0].metadata().unwrap();
    let volume = metadata.iter().find(|(key, _)| key == "volume_m3").map(|(_, value)| value.clone());
    let Some(frazil::vdb::MetaValue::Double(volume)) = volume else { panic!("no volume") };
    assert_eq!(volume.to_bits(), 0.0f64.to_bits());
}

/// The values of a base at the frames of two outputs are the same bits.
fn same_base(folder: &Path, a: &str, b: &str, frame: i32) -> bool {
    let read = |name: &str| {
        let grids =
            frazil::vdb::file::read(&folder.join(format!("{name}/base/base.{frame:04}.vdb"))).unwrap();
        let leaves = grids[0].leaves().unwrap();
        let bits = |leaf: &frazil::vdb::Leaf<'_>| (leaf.origin, leaf.values.map(f32::to_bits));
        leaves.iter().map(bits).collect::<Vec<_>>()
    };
    read(a) == read(b)
}

#[test]
fn what_is_out_of_reach_leaves_no_trace_and_what_passes_through_leaves_its_own() {
    // Cells of 5 mm reach 655 m.
    let object = |keys: &str| format!("[[object]]\nfile = \"cube.obj\"\nnoise = false\nkeys = [{keys}]\n");
    let near = object("{ frame = 1, at = [0, 0.1, 0] }, { frame = 3, at = [0, 0.1, 0.2] }");
    let far = object("{ frame = 1, at = [0, 0.1, 900] }, { frame = 3, at = [0, 0.1, 1000] }");
    let above = object(
        "{ frame = 1, at = [0, 800, 0], turn_deg = [0, 0, 0] }, { frame = 3, at = [0, 790, 0], turn_deg = [0, 900, 0] }",
    );
    let folder = folder(3, 0.02, &(near.clone() + &far + &above));
    let set = "--set snow.cell=0.005 --set snow.area=[-0.3,-0.3,0.3,0.3] --set snow.depth=0.15";
    works(&folder, &format!("check shot.toml {set}"));
    works(&folder, &format!("snow shot.toml -o far -q {set}"));
    write_scene(&folder, 3, 0.02, &near);
    works(&folder, &format!("snow shot.toml -o near -q {set}"));
    assert!((1..=3).all(|frame| same_base(&folder, "far", "near", frame)));
    // From -1 km to +1 km in one frame: as from -100 m to +100 m.
    for (name, way) in [("long", 1000.0), ("short", 100.0)] {
        let keys = format!("{{ frame = 1, at = [0, 0.1, -{way}] }}, {{ frame = 2, at = [0, 0.1, {way}] }}");
        write_scene(&folder, 2, 0.02, &object(&keys));
        let said = works(&folder, &format!("check shot.toml {set}"));
        assert!(!said.contains("cannot be made"), "{said}");
        works(&folder, &format!("snow shot.toml -o {name} -q {set}"));
    }
    let volume = |name: &str| -> f64 {
        let report = fs::read_to_string(folder.join(format!("{name}/report/base.0002.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        report["removed_m3"].as_f64().unwrap()
    };
    // 0.4 m wide, 0.6 m long, 0.05 m deep.
    let expected = 0.4 * 0.6 * 0.05;
    assert!((volume("short") - expected).abs() < 2e-3 * expected, "{}", volume("short"));
    assert!((volume("long") - volume("short")).abs() < 1e-4 * expected, "{}", volume("long"));
}

#[test]
fn what_reaches_from_the_snow_to_beyond_the_reach_is_named_by_check_and_by_the_run() {
    // A pole of 2 km that comes down on the snow at frame 3.
    let objects = "[[object]]\nfile = \"cube.obj\"\n[[object]]\nfile = \"pole.obj\"\nkeys = [{ frame = 2, at = [0, 5, 0] }, \
                   { frame = 3, at = [0, 0.1, 0] }]\n";
    let folder = folder(4, 0.005, objects);
    let pole = CUBE.replace(" .2\n", " 2000\n").replace(" -.2\n", " -2000\n");
    fs::write(folder.join("pole.obj"), pole).unwrap();
    let set = "--set snow.area=[-0.3,-0.3,0.3,0.3] --set snow.depth=0.15";
    let said = works(&folder, &format!("check shot.toml {set}"));
    let named = |said: &str| {
        said.contains("frame 3") && said.contains("object 2 (pole.obj)") && said.contains("655 m")
    };
    assert!(named(&said), "{said}");
    let run = frazil(&folder, &format!("snow shot.toml -o out {set}"));
    complains(&run, 1, &["frame 3", "object 2 (pole.obj)"]);
    assert!(folder.join("out/base/base.0002.vdb").exists());
    // A static one.
    let objects = "[[object]]\nfile = \"pole.obj\"\nrole = \"static\"\n";
    write_scene(&folder, 1, 0.005, objects);
    let said = works(&folder, &format!("check shot.toml {set}"));
    assert!(said.contains("object 1 (pole.obj), static"), "{said}");
    fails(&folder, &format!("snow shot.toml -o other {set}"), 2, &["object 1 (pole.obj), static"]);
}
