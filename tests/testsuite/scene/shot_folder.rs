//! What a run may trust and touch in its output folder: damaged files are named, foreign ones stay as they are.

use std::fs;
use std::path::Path;

use crate::common::character::{moments, output};
use crate::program::{self, CUBE, Folder, complains, fails, frazil, works};

/// A folder with a cube that slides through snow for so many frames; `output` stands in the scene's table.
fn folder(frames: i32, output: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    write_scene(&folder, frames, output);
    folder
}

fn write_scene(folder: &Path, frames: i32, output: &str) {
    let scene = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
         cell = 0.04\n[output]\n{output}\n[[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, \
         {{ frame = 12, at = [0, 0.1, 0.9], turn_deg = [0, 40, 0] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
}

fn flip(path: &Path, part: f64) {
    let mut bytes = fs::read(path).unwrap();
    let bit = (part * (8 * bytes.len()) as f64) as usize;
    bytes[bit / 8] ^= 1 << (bit % 8);
    fs::write(path, bytes).unwrap();
}

/// Every file of a folder, from it.
fn files(folder: &Path) -> Vec<String> {
    let mut out = Vec::new();
    for kind in ["", "base", "removed", "objects", "state", "report"] {
        let Ok(entries) = fs::read_dir(folder.join(kind)) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_file() && fs::metadata(&path).unwrap().len() > 0 {
                out.push(path.strip_prefix(folder).unwrap().to_string_lossy().into_owned());
            }
        }
    }
    out.sort();
    out
}

#[test]
fn a_state_is_hashed_before_a_run_resumes_from_it() {
    for written in ["half = true", "base = []"] {
        let folder = folder(4, written);
        works(&folder, "snow shot.toml -o out -q");
        let state = folder.join("out/state/base.0004.vdb");
        let whole = fs::read(&state).unwrap();
        write_scene(&folder, 5, written);
        for part in moments(12) {
            fs::write(&state, &whole).unwrap();
            flip(&state, part);
            fails(&folder, "snow shot.toml -o out", 2, &["state/base.0004.vdb", "not the file", "remove it"]);
        }
        fs::remove_file(&state).unwrap();
        works(&folder, "snow shot.toml -o out -q");
        works(&folder, "snow shot.toml -o fresh -q");
        let [out, mut fresh] = ["out", "fresh"].map(|name| output(&folder.join(name)));
        // The state that was removed is not made again: frame 4 is done.
        assert!(fresh.remove("state/base.0004.vdb").is_some());
        assert!(out == fresh, "{written}");
    }
}

#[test]
fn check_reads_all_that_a_folder_holds_and_names_what_is_damaged() {
    for written in ["objects = [\"usd\", \"ply\"]", "half = true", "base_mode = \"delta\""] {
        let folder = folder(3, written);
        works(&folder, "snow shot.toml -o out -q");
        let said = works(&folder, "check out");
        assert!(said.contains("3 frames") && said.contains("as they were written"), "{said}");
        let out = folder.join("out");
        let names = files(&out);
        assert!(names.len() >= 14, "{names:?}");
        for (name, part) in names.iter().zip(moments(names.len())) {
            let path = out.join(name);
            let whole = fs::read(&path).unwrap();
            flip(&path, part);
            let checked = frazil(&folder, "check out");
            complains(&checked, 1, &[name]);
            let said = String::from_utf8(checked.stdout).unwrap();
            assert!(said.contains(&format!("damaged   {name}")), "{name}: {said}");
            fs::write(&path, &whole[..whole.len() - 1]).unwrap();
            complains(&frazil(&folder, "check out"), 1, &[name]);
            fs::write(&path, whole).unwrap();
        }
        works(&folder, "check out");
    }
    let empty = Folder::empty();
    fails(empty.path(), "check .", 2, &["holds no frames"]);
}

#[test]
fn from_refuses_what_it_cannot_resume_from_before_it_removes_anything() {
    for written in ["half = true", "base = []"] {
        let folder = folder(10, written);
        works(&folder, "snow shot.toml -o out -q");
        let before = output(&folder.join("out"));
        let set = "--set snow.noise.seed=2";
        fails(
            &folder,
            &format!("snow shot.toml -o out {set} --from 6"),
            2,
            &["--from 6", "exact layer after frame 5", ": --from 10, --from 1 or another -o"],
        );
        assert!(before == output(&folder.join("out")), "{written}");
        works(&folder, &format!("snow shot.toml -o out -q {set} --from 10"));
        // The layer before frame 10 is needed again, and gone: earlier frames are not made again with other settings.
        for name in ["state/base.0010.json", "state/base.0009.vdb", "state/base.0010.vdb"] {
            fs::remove_file(folder.join("out").join(name)).unwrap();
        }
        fails(&folder, &format!("snow shot.toml -o out {set}"), 2, &["after frame 9", "gone"]);
    }
}

#[test]
fn from_is_refused_whole_when_the_asked_frames_cannot_be_made() {
    let folder = folder(10, "");
    works(&folder, "snow shot.toml -o out -q");
    let before = output(&folder.join("out"));
    let refused = |arguments: &str, words: &[&str]| {
        fails(&folder, &format!("snow shot.toml -o out {arguments}"), 2, words);
    };
    refused("--from 6 --frames 2-3", &["--from 6", "2-3"]);
    assert!(before == output(&folder.join("out")));
    works(&folder, "snow shot.toml -o gaps -q --frames 1,2,5-8");
    let before = output(&folder.join("gaps"));
    fails(&folder, "snow shot.toml -o gaps --from 6", 2, &["frame 3 does not exist", "--frames from 6"]);
    assert!(before == output(&folder.join("gaps")));
    // A damaged frame before it: nothing is removed.
    flip(&folder.join("out/base/base.0005.vdb"), 0.5);
    let before = output(&folder.join("out"));
    refused("--from 6 --set snow.noise.seed=2", &["base.0005.vdb"]);
    assert!(before == output(&folder.join("out")));
}

#[test]
fn a_user_s_own_files_are_never_written_over() {
    let folder = folder(2, "");
    let scene = fs::read(folder.join("shot.toml")).unwrap();
    fs::rename(folder.join("shot.toml"), folder.join("scene.toml")).unwrap();
    fails(&folder, "snow scene.toml -o .", 2, &["scene.toml", "another -o"]);
    assert_eq!(fs::read(folder.join("scene.toml")).unwrap(), scene);
    assert!(!folder.join("state").exists());
    for foreign in [
        "scene.toml",
        "shot.usda",
        "shot.samples.usdc",
        "base/base.0001.vdb",
        "removed/removed.0002.vdb",
        "report/base.0002.json",
    ] {
        let path = folder.join("out").join(foreign);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "mine").unwrap();
        fails(&folder, "snow scene.toml -o out", 2, &[foreign]);
        assert_eq!(fs::read(&path).unwrap(), b"mine");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
    works(&folder, "snow scene.toml -o out -q");
    // What the folder's own scene became in a user's hands is the user's.
    let own = folder.join("out/scene.toml");
    let edited = fs::read_to_string(&own).unwrap() + "# A word of mine.\n";
    fs::write(&own, &edited).unwrap();
    fails(&folder, "snow scene.toml -o out", 2, &["out/scene.toml"]);
    fails(&folder, "snow out/scene.toml -o out", 2, &["out/scene.toml"]);
    assert_eq!(fs::read_to_string(&own).unwrap(), edited);
}

#[test]
fn a_scene_s_inputs_are_never_its_output() {
    let folder = folder(2, "");
    works(&folder, "snow shot.toml -o out -q");
    let before = output(&folder.join("out"));
    let layer = "[shot]\nframes = \"1-2\"\n[snow]\ntop = \"out/base/base.0002.vdb\"\ncell = 0.04\n";
    fs::write(folder.join("layer.toml"), layer).unwrap();
    fails(&folder, "snow layer.toml -o out --from 1", 2, &["base.0002.vdb", "input"]);
    assert!(before == output(&folder.join("out")));
    works(&folder, "snow layer.toml -o other -q");
}

#[test]
fn unfinished_files_of_others_stay() {
    let folder = folder(2, "");
    works(&folder, "snow shot.toml -o out -q");
    let path = |name: &str| folder.join("out").join(name);
    fs::write(path("film.mkv.part"), "of a browser").unwrap();
    fs::write(path("base/film.12-3.part"), "of a browser").unwrap();
    fs::write(path("base/base.0007.vdb.99999-3.part"), "of a killed run").unwrap();
    works(&folder, "snow shot.toml -o out -q");
    assert!(path("film.mkv.part").exists() && path("base/film.12-3.part").exists());
    assert!(!path("base/base.0007.vdb.99999-3.part").exists());
}

#[test]
fn a_record_names_no_files_outside_its_frame() {
    let folder = folder(3, "");
    works(&folder, "snow shot.toml -o out -q");
    fs::write(folder.join("precious"), "mine").unwrap();
    for (name, foreign) in
        [("base/base.0003.vdb", "../precious"), ("removed/removed.0003.vdb", "/etc/hostname")]
    {
        let record = folder.join("out/state/base.0003.json");
        let before = fs::read_to_string(&record).unwrap();
        let crafted: serde_json::Value = serde_json::from_str(&before.replace(name, foreign)).unwrap();
        frazil::io::records::checksummed::write(&record, &crafted["content"]).unwrap();
        fails(&folder, "snow shot.toml -o out --from 2", 2, &["base.0003.json", foreign]);
        assert!(folder.join("precious").exists() && folder.join("out/base/base.0002.vdb").exists());
        fs::write(&record, before).unwrap();
    }
    works(&folder, "snow shot.toml -o out -q --from 2");
}

#[test]
fn a_folder_that_cannot_be_locked_is_reported() {
    let folder = folder(1, "");
    let shim = "#include <errno.h>\nint flock(int file, int operation) { errno = ENOLCK; return -1; }\n";
    fs::write(folder.join("shim.c"), shim).unwrap();
    let built = std::process::Command::new("cc")
        .current_dir(folder.path())
        .args(["-shared", "-fPIC", "-o", "shim.so", "shim.c"])
        .status()
        .unwrap();
    assert!(built.success());
    let mut run = program::command(&folder, "snow shot.toml -o out");
    let run = run.env("LD_PRELOAD", folder.join("shim.so")).output().unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.contains("run.lock: cannot lock: no locks available"), "{said}");
}
