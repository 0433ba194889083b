//! What works, what a stopped run leaves, and what a full disk does.

use std::fs;
use std::path::Path;

use crate::program::{CUBE, Folder, frazil, works};

/// A folder with a cube that slides through snow for so many frames.
fn folder(frames: u32, cell: f64, mesh: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), mesh).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
         cell = {cell}\n[[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, \
         {{ frame = {frames}, at = [0, 0.1, 0.9], turn_deg = [0, 40, 0] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

fn removed(folder: &Path, frame: u32) -> f64 {
    let text = fs::read_to_string(folder.join(format!("out/report/base.{frame:04}.json"))).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    report["removed_m3"].as_f64().unwrap()
}

#[test]
fn a_scene_makes_frames_and_its_resolved_file_makes_them_again() {
    let folder = folder(3, 0.05, CUBE);
    let said = works(&folder, "snow shot.toml -o out --stage base");
    assert!(said.contains("frame 3 stage base 100% eta 00:00:00"), "{said}");
    assert!(removed(&folder, 1) > 0.4 * 0.4 * 0.2 * 0.8);
    works(&folder, "snow out/scene.toml -o again -q --threads 1");
    for name in ["base/base.0003.vdb", "removed/removed.0002.vdb", "scene.toml"] {
        let [a, b] = ["out", "again"].map(|tree| fs::read(folder.join(tree).join(name)).unwrap());
        assert!(a == b, "{name} differs");
    }
    let json = works(&folder, "info out/base/base.0003.vdb --json --measure");
    let info: serde_json::Value = serde_json::from_str(&json).unwrap();
    let names: Vec<_> =
        info[0]["holds"].as_array().unwrap().iter().map(|grid| grid["name"].clone()).collect();
    assert_eq!(names, ["compression", "surface", "touched"]);
    works(&folder, "preview out/base/base.0003.vdb cube.obj -o p.png --size 64x36");
    assert!(folder.join("p.png").metadata().unwrap().len() > 500);
}

#[test]
fn a_damaged_frame_of_an_object_costs_no_frame_before_it() {
    let folder = folder(4, 0.05, CUBE);
    (1..=4).for_each(|frame| fs::write(folder.join(format!("cube.{frame:04}.obj")), CUBE).unwrap());
    fs::write(folder.join("cube.0003.obj"), CUBE.replacen("v ", "v nan ", 1)).unwrap();
    // With and without an estimate of the time left, which reads all frames of the object before the first frame is made.
    for (out, options) in [("shown", ""), ("quiet", "-q")] {
        let scene = "snow shot.toml --set object.1.file=cube.%04d.obj --set object.1.keys=[]";
        let output = frazil(&folder, &format!("{scene} -o {out} {options}"));
        assert_eq!(output.status.code(), Some(1), "{out}");
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.contains("cube.0003.obj: "), "{stderr}");
        let made = [1, 2, 3].map(|frame| folder.join(format!("{out}/base/base.{frame:04}.vdb")).exists());
        assert_eq!(made, [true, true, false], "{out}");
    }
}

#[test]
fn progress_is_a_line_of_json_for_each_frame() {
    let folder = folder(3, 0.05, CUBE);
    let said = works(&folder, "snow shot.toml -o out --progress json");
    let lines: Vec<serde_json::Value> =
        said.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    // Of the base, its mesh and the objects.
    assert_eq!(lines.len(), 9, "{said}");
    let of_base: Vec<i64> = lines
        .iter()
        .filter(|line| line["stage"] == "base")
        .map(|line| line["frame"].as_i64().unwrap())
        .collect();
    assert_eq!(of_base, [1, 2, 3]);
    for line in &lines {
        let [fraction, left] = ["fraction", "seconds_left"].map(|key| line[key].as_f64().unwrap());
        assert!((0.0..=1.0).contains(&fraction) && left >= 0.0, "{line}");
    }
    let last = lines.last().unwrap();
    assert_eq!((last["fraction"].as_f64(), last["seconds_left"].as_f64()), (Some(1.0), Some(0.0)));
    assert_eq!(works(&folder, "snow shot.toml -o quiet -q --progress json"), "");
}

#[test]
fn another_scene_does_not_mix_into_a_folder() {
    let folder = folder(2, 0.05, CUBE);
    works(&folder, "snow shot.toml -o out -q");
    works(&folder, "snow shot.toml -o out -q");
    let scene = fs::read_to_string(folder.join("shot.toml")).unwrap();
    fs::write(folder.join("shot.toml"), scene.replace("depth = 0.3", "depth = 0.2")).unwrap();
    let output = frazil(&folder, "snow shot.toml -o out");
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("(snow.depth was 0.3)") && stderr.contains("another -o"), "{stderr}");
}

#[test]
fn chosen_frames_are_written_as_in_a_whole_run() {
    let folder = folder(5, 0.05, CUBE);
    works(&folder, "snow shot.toml -o whole -q");
    works(&folder, "snow shot.toml -o out -q --frames 2-4x2");
    let there = |tree: &str, frame: u32| folder.join(format!("{tree}/base/base.{frame:04}.vdb"));
    assert_eq!((1..=5).filter(|&frame| there("out", frame).exists()).collect::<Vec<_>>(), [2, 4]);
    assert!(fs::read(there("out", 4)).unwrap() == fs::read(there("whole", 4)).unwrap());
}

#[test]
fn verbose_says_what_is_read_and_how_long_stages_take() {
    let folder = folder(2, 0.05, &CUBE.replacen("f 3 4 8 7\n", "", 1));
    let said = works(&folder, "snow shot.toml -o out -v --max-memory 1G");
    for words in ["10 triangles, 1 open loops closed", "active voxels", "frame 2: ", "sweep", " ms"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    let quiet = works(&folder, "snow shot.toml -o again --quiet");
    assert_eq!(quiet, "");
}

#[test]
fn open_non_manifold_and_distant_meshes_work() {
    let open = CUBE.replacen("f 3 4 8 7\n", "", 1);
    let folder_open = folder(2, 0.05, &open);
    works(folder_open.path(), "snow shot.toml -o out -q");
    assert!(removed(folder_open.path(), 1) > 0.02);
    let fin = format!("{CUBE}v 0 .6 0\nf 3 4 9\n");
    let folder_fin = folder(2, 0.05, &fin);
    works(folder_fin.path(), "snow shot.toml -o out -q");
    assert!(removed(folder_fin.path(), 1) > 0.02);
    let folder_far = folder(2, 0.05, CUBE);
    let scene = fs::read_to_string(folder_far.join("shot.toml")).unwrap();
    fs::write(folder_far.join("shot.toml"), scene.replace("at = [0,", "at = [50,")).unwrap();
    works(folder_far.path(), "snow shot.toml -o out -q");
    assert_eq!(removed(folder_far.path(), 2), 0.0);
}

/// Seconds and runs of each phase in a report.
fn phases(path: &Path) -> std::collections::BTreeMap<String, (f64, Option<u64>)> {
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let list = report["phases"].as_array().unwrap();
    let entry = |phase: &serde_json::Value| {
        (
            phase["name"].as_str().unwrap().into(),
            (phase["seconds"].as_f64().unwrap(), phase["count"].as_u64()),
        )
    };
    let phases: std::collections::BTreeMap<_, _> = list.iter().map(entry).collect();
    assert_eq!(phases.len(), list.len(), "a phase has one entry: {list:?}");
    phases
}

#[test]
fn the_report_of_a_run_sums_the_phases_of_its_frames() {
    let folder = folder(3, 0.05, CUBE);
    works(&folder, "snow shot.toml -o out --report run.json");
    let run = phases(&folder.join("run.json"));
    let frames: Vec<_> =
        (1..=3).map(|frame| phases(&folder.join(format!("out/report/base.{frame:04}.json")))).collect();
    for name in ["sweep", "distance", "noise", "subtract", "columns", "commit"] {
        let (seconds, count) = run[name];
        let sum: f64 = frames.iter().map(|frame| frame[name].0).sum();
        // The snow before the first frame has distances too.
        let own = u64::from(name == "distance");
        assert_eq!(count, Some(3 + own), "{name}: {run:?}");
        assert!(seconds > sum - 1e-6, "{name}: {seconds} s, in frames {sum} s");
        assert!(own > 0 || seconds < sum + 1e-6, "{name}: {seconds} s, in frames {sum} s");
    }
    assert!(frames.iter().all(|frame| !frame.contains_key("measure")), "a step's phases only");
    assert_eq!(run["measure"].1, Some(1));
}
