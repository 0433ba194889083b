//! Shots that stop and resume: killed, continued, with other settings, damaged records, full disks.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::common::character::output;
use crate::common::usda;
use crate::program::{CUBE, Folder, command, fails, kill_at, works};

/// A folder with a cube that slides through snow for so many frames; `output` stands in the scene's table.
fn folder(frames: i32, cell: f64, output: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    write_scene(&folder, frames, cell, output);
    folder
}

fn write_scene(folder: &Path, frames: i32, cell: f64, output: &str) {
    let scene = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
         cell = {cell}\n[output]\n{output}\n[[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, \
         {{ frame = 12, at = [0, 0.1, 0.9], turn_deg = [0, 40, 0] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
}

/// Names of the files that are not the same in two outputs.
fn differences(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) -> Vec<String> {
    let names = a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name));
    names.cloned().collect()
}

/// Two files hold the same three grids: leaves, values, active voxels.
#[track_caller]
fn same_grids(a: &Path, b: &Path) {
    let [a, b] = [a, b].map(|path| frazil::vdb::file::read(path).unwrap());
    assert_eq!((a.len(), b.len()), (3, 3));
    for (a, b) in a.iter().zip(&b) {
        assert_eq!((a.name(), a.active_voxels()), (b.name(), b.active_voxels()));
        let (a, b) = (a.leaves().unwrap(), b.leaves().unwrap());
        assert_eq!(a.len(), b.len());
        let same = |(a, b): (&frazil::vdb::Leaf<'_>, &frazil::vdb::Leaf<'_>)| {
            a.origin == b.origin && a.mask == b.mask && a.values == b.values
        };
        assert!(a.iter().zip(&b).all(same));
    }
}

#[test]
fn a_killed_run_resumes_to_the_same_bytes_whatever_is_written() {
    for written in
        ["", "base_mode = \"delta\"", "half = true", "base = []", "objects = [\"usd\"]\nremoved = []"]
    {
        let folder = folder(12, 0.02, written);
        works(&folder, "snow shot.toml -o once -q");
        for frame in [1, 4, 9] {
            kill_at(&folder, "snow shot.toml -o killed", &format!("killed/state/base.{frame:04}.json"));
            // As when it is killed before it has removed an old state.
            let state = |frame: i32| folder.join(format!("killed/state/base.{frame:04}.vdb"));
            if frame > 2 && state(frame).exists() {
                fs::copy(state(frame), state(frame - 2)).unwrap();
            }
        }
        works(&folder, "snow shot.toml -o killed -q --threads 1");
        let [once, killed] = ["once", "killed"].map(|name| output(&folder.join(name)));
        assert_eq!(differences(&once, &killed), Vec::<String>::new(), "{written}");
        assert!(once.len() > 12);
    }
}

#[test]
fn a_second_run_makes_nothing_again() {
    let folder = folder(4, 0.04, "");
    works(&folder, "snow shot.toml -o out -q");
    let stamp = |name: &str| fs::metadata(folder.join(name)).unwrap().modified().unwrap();
    let before = stamp("out/base/base.0002.vdb");
    let said = works(&folder, "snow shot.toml -o out");
    // Of the base, its mesh and the object.
    assert!(said.contains("12 frames exist, 0 are to be made"), "{said}");
    assert_eq!(before, stamp("out/base/base.0002.vdb"));
    // A frame that is gone is made again, and only that one.
    fs::remove_file(folder.join("out/removed/removed.0003.vdb")).unwrap();
    let said = works(&folder, "snow shot.toml -o out");
    assert!(said.contains("11 frames exist, 1 are to be made"), "{said}");
    assert_eq!(before, stamp("out/base/base.0002.vdb"));
}

#[test]
fn a_shot_may_grow() {
    let folder = folder(8, 0.04, "");
    works(&folder, "snow shot.toml -o whole -q");
    write_scene(&folder, 5, 0.04, "");
    works(&folder, "snow shot.toml -o grown -q");
    write_scene(&folder, 8, 0.04, "");
    works(&folder, "snow shot.toml -o grown -q");
    let [whole, grown] = ["whole", "grown"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&whole, &grown), Vec::<String>::new());
}

#[test]
fn frames_in_pieces_are_those_of_a_whole_run() {
    let folder = folder(12, 0.04, "");
    works(&folder, "snow shot.toml -o whole -q");
    for frames in ["5-7", "10,12", "1-4", "1-12"] {
        works(&folder, &format!("snow shot.toml -o pieces -q --frames {frames}"));
    }
    let [whole, pieces] = ["whole", "pieces"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&whole, &pieces), Vec::<String>::new());
    fails(&folder, "snow shot.toml -o d --set output.base_mode=delta --frames 5-7", 2, &["frame 1", "delta"]);
}

#[test]
fn other_settings_are_refused_by_name_and_from_keeps_what_is_before() {
    let folder = folder(6, 0.04, "");
    works(&folder, "snow shot.toml -o out -q");
    let before = output(&folder.join("out"));
    let words = ["snow.noise.seed was 0", "object.1.scale was 1.0", "--from N", "another -o"];
    let set = "--set snow.noise.seed=2 --set object.1.scale=1.1";
    fails(&folder, &format!("snow shot.toml -o out {set}"), 2, &words);
    assert_eq!(differences(&before, &output(&folder.join("out"))), Vec::<String>::new());
    works(&folder, &format!("snow shot.toml -o out -q {set} --from 4"));
    let after = output(&folder.join("out"));
    for frame in 1..=6 {
        let name = format!("base/base.{frame:04}.vdb");
        assert_eq!(before[&name] == after[&name], frame < 4, "{name}");
    }
    // What was kept stays kept, and what was made continues with the settings that made it.
    works(&folder, &format!("snow shot.toml -o out -q {set}"));
    fails(&folder, "snow shot.toml -o out", 2, &["snow.noise.seed was 2"]);
    assert_eq!(differences(&after, &output(&folder.join("out"))), Vec::<String>::new());
    // A kept frame that is gone cannot be made again: its settings are not those of now.
    let kept = folder.join("out/base/base.0003.vdb");
    let bytes = fs::read(&kept).unwrap();
    fs::remove_file(&kept).unwrap();
    works(&folder, &format!("snow shot.toml -o out -q {set} --frames 4-6"));
    fails(&folder, &format!("snow shot.toml -o out {set}"), 2, &["frame 3", "other settings", "gone"]);
    fs::write(&kept, bytes).unwrap();
    works(&folder, &format!("snow shot.toml -o out -q {set}"));
    let deeper = format!("snow shot.toml -o out {set} --set snow.depth=0.2 --from 3");
    fails(&folder, &deeper, 2, &["--from 3", "another layer", "snow.depth was 0.3"]);
    assert_eq!(differences(&after, &output(&folder.join("out"))), Vec::<String>::new());
    fails(&folder, "snow shot.toml -o new --from 4", 2, &["frame 3", "does not exist"]);
    assert!(!folder.join("new").exists());
    fails(&folder, "snow shot.toml -o new --from 9", 2, &["--from 9", "1-6"]);
}

#[test]
fn from_the_first_frame_starts_anew() {
    let folder = folder(3, 0.04, "");
    works(&folder, "snow shot.toml -o out -q");
    works(&folder, "snow shot.toml -o out -q --set snow.depth=0.25 --from 1");
    works(&folder, "snow shot.toml -o fresh -q --set snow.depth=0.25");
    let [out, fresh] = ["out", "fresh"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&out, &fresh), Vec::<String>::new());
}

#[test]
fn a_mesh_that_changed_is_noticed_wherever_it_lies() {
    let folder = folder(3, 0.04, "");
    works(&folder, "snow shot.toml -o out -q");
    // The same content in another position is the same input.
    fs::create_dir(folder.join("moved")).unwrap();
    fs::rename(folder.join("cube.obj"), folder.join("moved/box.obj")).unwrap();
    works(&folder, "snow shot.toml -o out -q --set object.1.file=moved/box.obj");
    fs::write(folder.join("cube.obj"), CUBE.replace(".4", ".5")).unwrap();
    fails(&folder, "snow shot.toml -o out", 2, &["object.1.file had different contents"]);
}

#[test]
fn a_frame_of_a_sequence_that_changed_is_named() {
    let folder = folder(6, 0.04, "");
    let mesh = |frame: i32, top: &str| {
        let text = CUBE.replace(".4", top);
        fs::write(folder.join(format!("body.{frame:04}.obj")), text).unwrap();
    };
    (1..=6).for_each(|frame| mesh(frame, ".4"));
    let set = "--set object.1.file=body.%04d.obj";
    works(&folder, &format!("snow shot.toml -o out -q {set}"));
    let before = output(&folder.join("out"));
    mesh(4, ".5");
    fails(&folder, &format!("snow shot.toml -o out {set}"), 2, &["body.0004.obj", "frame 4", "--from 4"]);
    works(&folder, &format!("snow shot.toml -o out -q {set} --from 4"));
    works(&folder, &format!("snow shot.toml -o fresh -q {set}"));
    let [after, fresh] = ["out", "fresh"].map(|name| output(&folder.join(name)));
    let bytes = |tree: &BTreeMap<String, Vec<u8>>| tree["removed/removed.0003.vdb"].clone();
    assert!(bytes(&before) == bytes(&after));
    assert!(before["base/base.0006.vdb"] != after["base/base.0006.vdb"] && fresh.len() == after.len());
    same_grids(&folder.join("out/base/base.0006.vdb"), &folder.join("fresh/base/base.0006.vdb"));
    fs::remove_file(folder.join("body.0005.obj")).unwrap();
    fails(&folder, &format!("snow shot.toml -o out {set}"), 2, &["body.0005.obj", "missing"]);
}

#[test]
fn damaged_records_and_files_are_named() {
    let folder = folder(4, 0.04, "");
    works(&folder, "snow shot.toml -o out -q");
    let path = |name: &str| folder.join("out").join(name);
    let manifest = fs::read_to_string(path("state/base.0003.json")).unwrap();
    for (changed, word) in [
        (manifest.replace("\"bytes\"", "\"byte\""), "damaged"),
        (manifest[..manifest.len() / 2].to_string(), "damaged"),
        (manifest.replace("\"format\": 1", "\"format\": 2"), "newer frazil"),
        (String::new(), "damaged"),
    ] {
        fs::write(path("state/base.0003.json"), changed).unwrap();
        fails(&folder, "snow shot.toml -o out", 2, &["state/base.0003.json", word]);
    }
    fs::remove_file(path("state/base.0003.json")).unwrap();
    let said = works(&folder, "snow shot.toml -o out");
    assert!(said.contains("11 frames exist, 1 are to be made"), "{said}");
    // The length is right, the content is not: no run resumes from it.
    let mut bytes = fs::read(path("base/base.0003.vdb")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path("base/base.0003.vdb"), bytes).unwrap();
    fs::remove_file(path("state/base.0004.json")).unwrap();
    fails(&folder, "snow shot.toml -o out", 2, &["base.0003.vdb", "remove it"]);
    fs::remove_file(path("base/base.0003.vdb")).unwrap();
    works(&folder, "snow shot.toml -o out -q");
    works(&folder, "snow shot.toml -o fresh -q");
    let [out, fresh] = ["out", "fresh"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&out, &fresh), Vec::<String>::new());
    fs::write(path("state/base.json"), "{}").unwrap();
    fails(&folder, "snow shot.toml -o out", 2, &["state/base.json", "damaged"]);
}

#[test]
fn two_runs_do_not_write_into_one_folder() {
    let folder = folder(2000, 0.02, "");
    let mut child = command(&folder, "snow shot.toml -o out -q").spawn().unwrap();
    while !folder.join("out/state/base.0001.json").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    fails(&folder, "snow shot.toml -o out", 75, &["another run", "out"]);
    fails(&folder, "snow shot.toml -o out --wait 0.3", 75, &["another run", "out"]);
    // One that waits gets its turn; a dead run holds nothing.
    let mut waiting = command(&folder, "snow shot.toml -o out -q --frames 1-2 --wait 600").spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert!(waiting.try_wait().unwrap().is_none());
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(waiting.wait().unwrap().success());
    fails(&folder, "snow shot.toml -o out --wait=-1", 2, &["--wait", "3.2e7"]);
}

#[test]
fn no_space_ends_the_run_and_space_lets_it_resume() {
    let folder = folder(12, 0.02, "base_mode = \"delta\"");
    // Files may grow to what the first frames need: a later one, larger, finds no space.
    works(&folder, "snow shot.toml -o once -q");
    let size =
        |frame: i32| fs::metadata(folder.join(format!("once/base/base.{frame:04}.vdb"))).unwrap().len();
    works(&folder, "snow shot.toml -o full -q --frames 1-2");
    let blocks = (3..=12).map(size).max().unwrap() / 512 - 2;
    let script = format!("ulimit -f {blocks}; exec \"$0\" snow shot.toml -o full -q");
    let mut shell = Command::new("sh");
    let shell = shell.current_dir(folder.path()).arg("-c").arg(script).arg(env!("CARGO_BIN_EXE_frazil"));
    let stopped = shell.output().unwrap();
    let said = String::from_utf8_lossy(&stopped.stderr);
    assert_eq!(stopped.status.code(), Some(1), "{said}");
    assert!(said.contains("cannot write"), "{said}");
    works(&folder, "snow shot.toml -o full -q");
    let [once, full] = ["once", "full"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&once, &full), Vec::<String>::new());
}

#[test]
fn whole_frames_are_rebuilt_from_changes() {
    let folder = folder(6, 0.04, "base_mode = \"delta\"");
    works(&folder, "snow shot.toml -o delta -q");
    works(&folder, "snow shot.toml -o full -q --set output.base_mode=full");
    works(&folder, "vdb rebuild delta --frame 1-6 -o rebuilt.%04d.vdb");
    works(&folder, "vdb rebuild delta --frame 5 -o five.vdb");
    for frame in 1..=6 {
        let rebuilt = folder.join(format!("rebuilt.{frame:04}.vdb"));
        same_grids(&rebuilt, &folder.join(format!("full/base/base.{frame:04}.vdb")));
    }
    let [five, rebuilt] = ["five.vdb", "rebuilt.0005.vdb"].map(|name| fs::read(folder.join(name)).unwrap());
    assert!(five == rebuilt);
    fails(&folder, "vdb rebuild delta --frame 9 -o nine.vdb", 2, &["frame 9", "does not exist"]);
    fails(&folder, "vdb rebuild delta --frame 1-2 -o two.vdb", 2, &["pattern"]);
    fails(&folder, "vdb rebuild nowhere --frame 1 -o one.vdb", 2, &["nowhere"]);
}

#[test]
fn a_preview_has_coarser_cells_and_a_folder_of_its_own() {
    let folder = folder(2, 0.02, "");
    works(&folder, "snow shot.toml -o out -q");
    fails(&folder, "snow shot.toml -o out --preview 3", 2, &["snow.cell was 0.02"]);
    works(&folder, "snow shot.toml -o look -q --preview 3");
    let look = fs::read_to_string(folder.join("look/scene.toml")).unwrap();
    assert!(look.contains("cell = 0.06"), "{look}");
    works(&folder, "vdb from-mesh cube.obj --cell 0.02 -o layer.vdb");
    let layer = "[shot]\nframes = \"1-2\"\n[snow]\ntop = \"layer.vdb\"\ncell = 0.02\n";
    fs::write(folder.join("layer.toml"), layer).unwrap();
    fails(&folder, "snow layer.toml -o x --preview 2", 2, &["layer.vdb", "preview"]);
}

#[test]
fn the_resolved_scene_of_overrides_makes_the_same_again() {
    let folder = folder(3, 0.04, "");
    works(&folder, "snow shot.toml -o out -q --set snow.noise.amplitude=0.03 --set shot.fps=30");
    works(&folder, "snow out/scene.toml -o again -q");
    let [out, again] = ["out", "again"].map(|name| output(&folder.join(name)));
    assert_eq!(differences(&out, &again), Vec::<String>::new());
}

#[test]
fn shot_usda_names_every_file_by_a_relative_path() {
    let folder = folder(3, 0.04, "objects = [\"usd\"]");
    works(&folder, "snow shot.toml -o out -q");
    let [shot, samples] =
        ["shot.usda", "shot.samples.usdc"].map(|name| usda::text(&folder.join("out").join(name)));
    let stage = shot + &samples;
    let assets: Vec<&str> = stage.split('@').skip(1).step_by(2).collect();
    assert!(assets.len() > 9, "{stage}");
    for asset in assets {
        assert!(asset.starts_with("./") && folder.join("out").join(asset).is_file(), "{asset}");
    }
    let clip = usda::text(&folder.join("out/objects/objects.0002.usdc"));
    // 0.9 m along z in 11 frames of 1/24 s; corners turn besides, so look at their mean.
    let numbers = usda::numbers(&clip, "velocities");
    assert_eq!(numbers.len(), 24);
    let mean = numbers.chunks(3).map(|velocity| f64::from(velocity[2])).sum::<f64>() / 8.0;
    assert!((mean - 0.9 / 11.0 * 24.0).abs() < 1e-3, "{mean}");
}
