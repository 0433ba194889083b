//! The stage `grains` in shots: it reads the base's frames, resumes, and is made again when they change.

use std::fs;
use std::path::Path;

use crate::common::character::output;
use crate::program::{CUBE, Folder, fails, kill_at, works};

/// The keys of `[output]` that leave out files for other programs, but for those that `output` has itself.
fn without_usd(output: &str) -> String {
    let is_missing =
        |(key, _): &(&str, &str)| !output.lines().any(|line| line.starts_with(&format!("{key} =")));
    let keys = [("grains", "[\"vdb\"]"), ("mesh", "[]"), ("objects", "[]")].into_iter().filter(is_missing);
    keys.map(|(key, value)| format!("{key} = {value}\n")).collect::<String>() + output
}

/// A folder with a cube that slides through snow; `grains` and `output` stand in the scene's tables. Nothing is written for other programs
/// that `output` does not ask for.
pub fn folder(grains: &str, output: &str) -> Folder {
    let (folder, output) = (Folder::empty(), without_usd(output));
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-10\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.0]\ndepth = 0.2\ncell = 0.02\n\
         [grains]\n{grains}\n[output]\n{output}\n[[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, \
         {{ frame = 10, at = [0, 0.1, 0.4], turn_deg = [0, 40, 0] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

/// The files of grains.
pub fn grains(folder: &Path, out: &str) -> Vec<(String, Vec<u8>)> {
    let files = output(&folder.join(out)).into_iter();
    files.filter(|(name, _)| name.starts_with("grains/")).collect()
}

#[test]
fn a_killed_run_resumes_to_the_same_grains() {
    let all = "base_mode = \"delta\"\ngrains = [\"vdb\", \"ply\", \"usd\"]";
    for (written, files) in [("", 10), (all, 31), ("grains_mode = \"delta\"", 10)] {
        let at = &folder("compression = 0.4", written);
        works(at, "snow shot.toml -o once -q");
        for frame in [3, 6] {
            kill_at(at, "snow shot.toml -o killed", &format!("killed/state/grains.{frame:04}.json"));
        }
        works(at, "snow shot.toml -o killed -q --threads 1");
        let [once, killed] = ["once", "killed"].map(|out| grains(at, out));
        assert!(once == killed, "{written}");
        assert_eq!(once.len(), files);
        let info = works(at, "info once/grains/grains.0010.vdb");
        assert!(info.contains("source_frame") && info.contains("pscale"), "{info}");
        assert!(works(at, "snow shot.toml -o once").contains("exist, 0 are to be made"));
    }
}

#[test]
fn grains_are_a_pass_of_their_own_over_the_base() {
    let at = &folder("", "");
    works(at, "snow shot.toml -o cache -q --stage base");
    assert!(grains(at, "cache").is_empty());
    works(at, "snow shot.toml -o cache -q --stage grains");
    let first = grains(at, "cache");
    assert_eq!(first.len(), 10);
    // Another setting of theirs leaves the base as it is.
    fails(at, "snow shot.toml -o cache -q --set grains.friction=0.1", 2, &["grains.friction"]);
    let base = fs::metadata(at.join("cache/base/base.0005.vdb")).unwrap().modified().unwrap();
    works(at, "snow shot.toml -o cache -q --stage grains --from 1 --set grains.friction=0.1");
    assert!(grains(at, "cache") != first);
    assert_eq!(fs::metadata(at.join("cache/base/base.0005.vdb")).unwrap().modified().unwrap(), base);
    // Another base takes them with it.
    works(at, "snow shot.toml -o cache -q --stage base --from 4 --set snow.noise.seed=3");
    assert_eq!(grains(at, "cache").len(), 3);
    works(at, "snow shot.toml -o cache -q --set grains.friction=0.1 --set snow.noise.seed=3");
    assert_eq!(grains(at, "cache").len(), 10);
}

#[test]
fn a_scene_without_the_table_has_no_grains() {
    let at = &folder("", "");
    let scene = fs::read_to_string(at.join("shot.toml")).unwrap().replace("[grains]", "");
    fs::write(at.join("plain.toml"), scene).unwrap();
    works(at, "snow plain.toml -o plain -q --frames 1-2");
    assert!(!at.join("plain/grains").exists());
    fails(at, "snow plain.toml -o plain -q --stage grains", 2, &["grains"]);
    assert!(!fs::read_to_string(at.join("plain/scene.toml")).unwrap().contains("[grains]"));
}

#[test]
fn what_grains_cannot_be_made_from_is_said_first() {
    let at = |grains: &str, output: &str, words: &[&str]| {
        let folder = folder(grains, output);
        fails(&folder, "snow shot.toml -o out -q", 2, words);
        assert!(!folder.join("out/base").exists());
    };
    at("", "half = true", &["half", "grains"]);
    at("", "base = []", &["base", "grains"]);
    at("radius = 0.05", "", &["radius"]);
    at("radius = 0.0", "", &["radius"]);
    at("compression = -0.1", "", &["compression"]);
    at("repose_angle_deg = 80.0", "", &["repose_angle_deg"]);
    at("air = nan", "", &["air"]);
    at("restitution = 1.5", "", &["restitution"]);
    at("stands = -0.1", "", &["stands"]);
    at("preset = \"icy\"", "", &["preset", "powder"]);
    at("lifetime = 0.0", "", &["lifetime"]);
    at("active_distance = 0.0", "", &["active_distance"]);
    at("air_by_density = 0.5", "", &["air_by_density"]);
    at("keep_box = [0, 0, 0, 1, 0, 1]", "", &["keep_box"]);
    at("initial = \"gone.ply\"", "", &["gone.ply"]);
    // A frame of the base that is not there.
    let folder = folder("", "");
    works(&folder, "snow shot.toml -o cache -q --stage base --frames 1-10x3");
    fails(&folder, "snow shot.toml -o cache -q --stage grains", 2, &["base"]);
}

#[test]
fn more_grains_than_max_are_refused_before_their_first_frame() {
    let at = &folder("max = 50\ncompression = 0.0", "");
    // With the base made by the same run, and by an earlier one.
    for _ in 0..2 {
        fails(at, "snow shot.toml -o out -q", 2, &["shot.toml", "grains.max = 50", "grains.radius"]);
        assert!(at.join("out/base/base.0010.vdb").exists() && grains(at, "out").is_empty());
    }
    fails(at, "snow shot.toml -o out -q --stage grains", 2, &["grains.max = 50"]);
    let said = works(at, "check shot.toml -o out");
    assert!(said.contains("warning   ") && said.contains("more than grains.max = 50"), "{said}");
    // The frames up to the last one that is asked for count. No frame was made, so that other settings are welcome.
    let some = "snow shot.toml -o out -q --stage grains --frames 1-2 --set grains.max=2000";
    works(at, some);
    fails(at, &some.replace("1-2", "3-10"), 2, &["grains.max = 2000"]);
}

#[test]
fn where_a_box_takes_grains_away_too_many_end_the_run_with_the_frame() {
    let folder = folder("max = 50\ncompression = 0.0\nkeep_box = [-9, -9, -9, 9, 9, 9]", "");
    fails(&folder, "snow shot.toml -o out -q", 1, &["max = 50", "frame"]);
    let said = works(&folder, "check shot.toml -o out");
    assert!(said.contains("at most about"), "{said}");
}

#[test]
fn a_check_says_how_many_grains_there_will_be() {
    let at = &folder("compression = 0.4", "");
    let report = |arguments: &str| -> serde_json::Value {
        serde_json::from_str(&works(at, &format!("check shot.toml --json {arguments}"))).unwrap()
    };
    let frames =
        |report: &serde_json::Value| ["to_frame", "base_to_frame"].map(|key| report["grains"][key].as_i64());
    let before = report("-o cache");
    assert_eq!(frames(&before), [Some(10), None]);
    assert!(works(at, "check shot.toml").contains("by the poses of objects"));
    works(at, "snow shot.toml -o cache -q --stage base --frames 1-4");
    let partly = report("-o cache");
    assert_eq!(frames(&partly), [Some(10), Some(4)]);
    assert!(works(at, "check shot.toml -o cache").contains("by the poses of objects after frame 4"));
    works(at, "snow shot.toml -o cache -q --stage base");
    let after = report("-o cache");
    assert_eq!(frames(&after), [Some(10); 2]);
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    // A cube that slides and turns: the poses say nearly what the base says, whose edges are ragged.
    let count = number(&after["grains"]["grains"]);
    for estimate in [&before, &partly] {
        assert!((number(&estimate["grains"]["grains"]) / count - 1.0).abs() < 0.1, "{estimate} {after}");
    }
    // Memory and space count them.
    let without = report("-o cache --set grains.compression=1.0");
    for key in ["memory_bytes", "disk_bytes"] {
        assert!(number(&after[key]) > number(&without[key]), "{key}");
    }
    // The run refuses what is more than the limit before it writes a grain.
    let limit = (number(&without["memory_bytes"]) + number(&after["memory_bytes"])) / 2.0;
    let run = format!("snow shot.toml -o cache --stage grains --max-memory {}", limit.round());
    fails(at, &run, 2, &["stage grains", "needs about"]);
    assert!(grains(at, "cache").is_empty());
    let said = works(at, "snow shot.toml -o cache --stage grains -v");
    assert!(said.contains(&format!("grains: about {count} grains at once, ")), "{said}");
    let made: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("cache/report/grains.0010.json")).unwrap()).unwrap();
    assert!((number(&made["grains"]) + number(&made["owed"]) - count).abs() < 2.0, "{made} {count}");
    let disk = |set: &str| number(&report(&format!("-o cache --set output.{set}"))["disk_bytes"]);
    assert!(
        disk("grains_mode=delta") < disk("grains=[\"vdb\"]")
            && disk("grains=[\"vdb\"]") < disk("grains=[\"vdb\",\"usd\"]")
    );
    // Fewer where they live for three frames, and where an object presses all of its snow together.
    let few = report("-o cache --set grains.lifetime=0.125");
    assert!(number(&few["grains"]["grains"]) < 0.5 * count, "{few}");
    let none = report("-o cache --set object.1.compression=1.0");
    assert_eq!(none["grains"]["grains"], 0);
    // A report that was changed is no ground to count on.
    let path = at.join("cache/report/base.0003.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"removed_m3\": 0", "\"removed_m3\": 1", 1)).unwrap();
    fails(at, "check shot.toml -o cache", 2, &["base.0003.json"]);
}

#[test]
fn a_preset_fills_in_what_is_left_out() {
    let at = &folder("preset = \"wet\"\ncompression = 0.4", "");
    works(at, "snow shot.toml -o out -q --frames 1-3");
    let scene = fs::read_to_string(at.join("out/scene.toml")).unwrap();
    for line in
        ["preset = \"wet\"", "compression = 0.4", "repose_angle_deg = 34.0", "stands = 0.25", "air = 0.8"]
    {
        assert!(scene.contains(line), "{line} in {scene}");
    }
    // The resolved scene is the same scene.
    works(at, "snow out/scene.toml -o again -q --frames 1-3");
    assert!(grains(at, "out") == grains(at, "again"));
}

#[test]
fn objects_take_snow_or_push_grains_or_both() {
    let born = |role: &str| {
        let at = &folder("compression = 0.0", "");
        let scene = fs::read_to_string(at.join("shot.toml")).unwrap() + &format!("role = \"{role}\"\n");
        fs::write(at.join("shot.toml"), scene).unwrap();
        works(at, "snow shot.toml -o out -q");
        let report = fs::read_to_string(at.join("out/report/grains.0010.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        (report["grains"].as_u64().unwrap(), grains(at, "out").pop().unwrap().1)
    };
    let (both, base, grains) = (born("collide"), born("base"), born("grains"));
    // The cube stands in the grains of what it took.
    assert!(both.0 == base.0 && both.0 > 100 && both.1 != base.1);
    assert_eq!(grains.0, 0);
}

#[test]
fn grains_of_a_file_are_there_from_the_start() {
    let at = &folder("initial = \"drift.ply\"", "");
    let points = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                  property float vx\nproperty float vy\nproperty float vz\nend_header\n0 0.5 0 0 1 0\n0.3 0.9 0.5 0 0 0\n";
    fs::write(at.join("drift.ply"), points).unwrap();
    works(at, "snow shot.toml -o out -q");
    let info = works(at, "info out/grains/grains.0001.vdb");
    assert!(info.contains("points                 2"), "{info}");
    let files = grains(at, "out");
    // Another file makes others.
    fs::write(at.join("drift.ply"), points.replace("0.3 0.9", "0.3 0.8")).unwrap();
    fails(at, "snow shot.toml -o out -q", 2, &["grains.initial"]);
    works(at, "snow shot.toml -o out -q --stage grains --from 1");
    assert!(grains(at, "out") != files);
    fs::write(at.join("drift.ply"), &points[..points.len() - 9]).unwrap();
    fails(at, "snow shot.toml -o none -q", 2, &["drift.ply"]);
    assert!(!at.join("none/base").exists());
}
