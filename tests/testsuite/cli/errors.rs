//! Whatever is wrong with its input, the program says so in one sentence, with the right exit code, and
//! leaves nothing half-written.

use crate::program::Folder;
use assert_cmd::Command;
use std::fs;
use std::path::Path;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
const SCENE: &str = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 1.5, 1.5]\n\
depth = 0.3\ncell = 0.05\n[[object]]\nfile = \"cube.obj\"\n";

/// A folder with a cube and a scene.
fn folder() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    fs::write(folder.join("shot.toml"), SCENE).unwrap();
    folder
}

/// Runs the program in a folder: exit code and stderr.
fn run(folder: &Path, arguments: &str) -> (i32, String) {
    let mut command = Command::cargo_bin("frazil").unwrap();
    let output = command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    (output.status.code().unwrap_or(-1), String::from_utf8(output.stderr).unwrap())
}

/// The program refuses, in one sentence that holds each of the words, and leaves no new file.
#[track_caller]
fn refuses(folder: &Path, arguments: &str, code: i32, words: &[&str]) {
    let before = listing(folder);
    let (found, stderr) = run(folder, arguments);
    assert_eq!(found, code, "{arguments}: {stderr}");
    assert!(stderr.starts_with("frazil: ") && stderr.lines().count() == 1, "no sentence: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{arguments}: no {word:?} in {stderr}");
    }
    assert_eq!(listing(folder), before, "{arguments} left something");
}

/// Every file below a folder.
fn listing(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { names.extend(listing(&path)) } else { names.push(path.display().to_string()) }
    }
    names.sort();
    names
}

#[test]
fn a_wrong_option_is_one_sentence() {
    let folder = folder();
    refuses(&folder, "snow shot.toml", 2, &["--output"]);
    refuses(&folder, "snow shot.toml -o out --frmaes 1-2", 2, &["--frmaes", "--frames"]);
    refuses(&folder, "snow shot.toml -o out --frames 2-1", 2, &["ends before it starts"]);
    refuses(&folder, "snow shot.toml -o out --frames 1-9", 2, &["1-9", "1-2"]);
    refuses(&folder, "snow shot.toml -o out --frames 1-2x0", 2, &["choice of frames"]);
    refuses(&folder, "snow shot.toml -o out --max-memory lots", 2, &["--max-memory"]);
    refuses(&folder, "brew", 2, &["brew"]);
    refuses(&folder, "vdb from-mesh cube.obj --cell=-1 -o out.vdb", 2, &["--cell"]);
    refuses(&folder, "vdb from-mesh cube.obj --cell 0.1 -o out.obj", 2, &["out.obj", ".vdb"]);
}

#[test]
fn missing_and_empty_files_are_named() {
    let folder = folder();
    refuses(&folder, "snow none.toml -o out", 2, &["none.toml", "cannot read"]);
    refuses(&folder, "vdb from-mesh none.obj --cell 0.1 -o out.vdb", 2, &["none.obj"]);
    refuses(&folder, "info none.vdb", 2, &["none.vdb"]);
    for name in ["empty.obj", "empty.ply", "empty.vdb"] {
        fs::write(folder.join(name), "").unwrap();
        refuses(&folder, &format!("info {name}"), 2, &[name, "empty"]);
        refuses(&folder, &format!("preview {name} -o out.png"), 2, &[name, "empty"]);
    }
}

#[test]
fn meshes_that_cannot_be_used_are_named_with_the_fault() {
    let folder = folder();
    let wrong = [
        ("nan.obj", CUBE.replacen("v 1 0 0", "v nan 0 0", 1), "line 2"),
        ("inf.obj", CUBE.replacen("v 1 1 1", "v 1 inf 1", 1), "line 7"),
        ("range.obj", CUBE.replacen("f 2 3 7 6", "f 2 3 7 60", 1), "face"),
        ("points.obj", CUBE.split("f ").next().unwrap().to_string(), "faces"),
    ];
    for (name, text, fault) in wrong {
        fs::write(folder.join(name), text).unwrap();
        refuses(&folder, &format!("vdb from-mesh {name} --cell 0.1 -o out.vdb"), 2, &[name, fault]);
        let scene = SCENE.replace("cube.obj", name);
        fs::write(folder.join("wrong.toml"), scene).unwrap();
        refuses(&folder, "snow wrong.toml -o out", 2, &[name, fault]);
    }
}

#[test]
fn scene_mistakes_are_named_with_line_and_key() {
    let folder = folder();
    let wrong = [
        ("frames", "framse", "shot.toml:2: unknown key `framse` in [shot]; did you mean `frames`?"),
        (
            "depth = 0.3",
            "depth = \"deep\"",
            "shot.toml:6: `depth` in [snow] must be a finite number, not a text",
        ),
        ("cell = 0.05", "cell = 0", "shot.toml:7: `cell` in [snow] must lie in"),
        ("[[object]]", "[[objects]]", "shot.toml:8: unknown key `objects`; did you mean `object`?"),
        ("\"1-2\"", "\"2-1\"", "ends before it starts"),
        ("[snow]", "[snow", "shot.toml:3: "),
        ("cube.obj\"", "cube.obj\"\nrole = \"colide\"", "did you mean \"collide\"?"),
        ("1.5]", "-1.5]", "`area` in [snow] must be [x0, z0, x1, z1]"),
        ("depth = 0.3", "", "`depth` in [snow] is missing"),
        (
            "[[object]]",
            "[snow.noise]\namplitude = 0.2\nsize = 0.2\n[[object]]",
            "shot.toml:9: `amplitude` in [snow.noise] is too steep",
        ),
        (
            "[[object]]",
            "[snow.noise]\nsize = 0.1\n[[object]]",
            "shot.toml:9: `size` in [snow.noise] is too steep",
        ),
        (
            "[[object]]",
            "[snow.noise]\nsize = 0.09\n[[object]]",
            "shot.toml:9: `size` in [snow.noise] must lie in",
        ),
        (
            "[[object]]",
            "[snow.noise]\noctaves = 9\n[[object]]",
            "shot.toml:9: `octaves` in [snow.noise] must lie in",
        ),
    ];
    for (from, to, sentence) in wrong {
        fs::write(folder.join("shot.toml"), SCENE.replacen(from, to, 1)).unwrap();
        refuses(&folder, "snow shot.toml -o out", 2, &[sentence]);
    }
}
