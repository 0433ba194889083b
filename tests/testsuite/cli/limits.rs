//! Full disks, forbidden folders, too little memory, damaged files, signals: one sentence, the right exit
//! code, whole frames only.

use crate::common::skip::skipped;
use crate::program::{CUBE, Folder, complains, frazil};
use assert_cmd::Command;
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

fn scene(frames: u32, cell: f64, file: &str) -> String {
    format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
         cell = {cell}\n[[object]]\nfile = \"{file}\"\n"
    )
}

fn folder() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    fs::write(folder.join("shot.toml"), scene(2, 0.05, "cube.obj")).unwrap();
    folder
}

/// Files that were begun and not finished.
fn begun(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            names.extend(begun(&path));
        } else if path.to_string_lossy().contains(".part") || path.to_string_lossy().contains("probe") {
            names.push(path.display().to_string());
        }
    }
    names
}

#[test]
fn a_missing_frame_of_a_sequence_is_named_before_the_first_frame() {
    let folder = folder();
    for frame in [1, 2, 4] {
        fs::write(folder.join(format!("cube.{frame:04}.obj")), CUBE).unwrap();
    }
    fs::write(folder.join("shot.toml"), scene(4, 0.05, "cube.%04d.obj")).unwrap();
    complains(&frazil(&folder, "snow shot.toml -o out"), 2, &["cube.0003.obj", "missing"]);
    assert!(!folder.join("out").exists());
}

#[test]
fn a_cell_too_small_for_the_memory_is_refused_before_it_is_taken() {
    let folder = folder();
    fs::write(folder.join("shot.toml"), scene(2, 0.00002, "cube.obj")).unwrap();
    let start = Instant::now();
    complains(&frazil(&folder, "snow shot.toml -o out"), 2, &["cell", "MB"]);
    complains(&frazil(&folder, "vdb from-mesh cube.obj --cell 0.00001 -o out.vdb"), 2, &["--cell", "MB"]);
    assert!(start.elapsed() < Duration::from_secs(5));
    let output = frazil(&folder, "vdb from-mesh cube.obj --cell 0.01 -o out.vdb --max-memory 100K");
    complains(&output, 2, &["--cell"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_the_first_frame() {
    let folder = folder();
    fs::write(folder.join("file"), "").unwrap();
    for out in ["file", "file/out", "/proc/out"] {
        complains(&frazil(&folder, &format!("snow shot.toml -o {out}")), 2, &[out]);
    }
    for out in ["file/out.vdb", "/proc/out.vdb", "none/out.vdb"] {
        complains(&frazil(&folder, &format!("vdb from-mesh cube.obj --cell 0.05 -o {out}")), 2, &[out]);
    }
}

#[test]
fn damaged_and_foreign_vdb_files_are_named() {
    let folder = folder();
    let made = frazil(&folder, "vdb from-mesh cube.obj --cell 0.05 -o cube.vdb");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let whole = fs::read(folder.join("cube.vdb")).unwrap();
    for part in 1..20 {
        fs::write(folder.join("cut.vdb"), &whole[..whole.len() * part / 20]).unwrap();
        complains(&frazil(&folder, "vdb to-mesh cut.vdb -o cut.ply"), 2, &["cut.vdb"]);
    }
    fs::write(folder.join("text.vdb"), CUBE).unwrap();
    complains(&frazil(&folder, "vdb to-mesh text.vdb -o cut.ply"), 2, &["text.vdb", "not a .vdb file"]);
    assert!(!folder.join("cut.ply").exists());
    assert_eq!(begun(&folder), Vec::<String>::new());
}

#[test]
fn a_grid_of_another_type_is_named_with_its_type() {
    let folder = folder();
    let make = "import pyopenvdb as v; g = v.BoolGrid(); g.name = 'mask'; g.fill((0, 0, 0), (9, 9, 9), True); \
                v.write('mask.vdb', g)";
    let python =
        std::process::Command::new("/usr/bin/python3").current_dir(folder.path()).args(["-c", make]).output();
    if !python.is_ok_and(|output| output.status.success()) {
        skipped("no pyopenvdb");
        return;
    }
    complains(&frazil(&folder, "vdb to-mesh mask.vdb -o out.ply"), 2, &["mask.vdb", "\"mask\"", "bool"]);
    assert!(frazil(&folder, "info mask.vdb").status.success());
}

/// Runs the program in a shell whose files may have at most so many blocks of 512 bytes.
fn with_file_limit(folder: &Path, blocks: u32, arguments: &str) -> Output {
    let program = Command::cargo_bin("frazil").unwrap().get_program().to_os_string();
    let script = format!("ulimit -f {blocks}; exec \"$0\" {arguments}");
    let mut shell = std::process::Command::new("sh");
    shell.current_dir(folder).arg("-c").arg(script).arg(program).output().unwrap()
}

#[test]
fn a_full_disk_ends_the_run_with_nothing_half_written() {
    let folder = folder();
    fs::write(folder.join("shot.toml"), scene(3, 0.01, "cube.obj")).unwrap();
    let output = with_file_limit(&folder, 16, "snow shot.toml -o out -q");
    complains(&output, 1, &["cannot write"]);
    let made = frazil(&folder, "vdb from-mesh cube.obj --cell 0.005 -o whole.vdb");
    assert!(made.status.success());
    let output = with_file_limit(&folder, 16, "vdb from-mesh cube.obj --cell 0.005 -o out.vdb");
    complains(&output, 1, &["out.vdb", "cannot write"]);
    assert!(!folder.join("out.vdb").exists());
    assert_eq!(begun(&folder), Vec::<String>::new());
}

#[test]
fn a_signal_leaves_whole_frames_and_its_exit_code() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = folder();
        fs::write(folder.join("shot.toml"), scene(100_000, 0.02, "cube.obj")).unwrap();
        let program = Command::cargo_bin("frazil").unwrap().get_program().to_os_string();
        let mut command = std::process::Command::new(program);
        command.current_dir(folder.path()).args(["snow", "shot.toml", "-o", "out"]).stderr(Stdio::piped());
        let child = command.spawn().unwrap();
        let second = folder.join("out/base/base.0002.vdb");
        let start = Instant::now();
        while !second.exists() && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let kill = std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        let asked = Instant::now();
        complains(&child.wait_with_output().unwrap(), code, &["frazil: "]);
        assert!(asked.elapsed() < Duration::from_secs(5), "it ran on for {:?}", asked.elapsed());
        assert_eq!(begun(&folder), Vec::<String>::new());
        assert!(frazil(&folder, "info out/base/base.0002.vdb").status.success());
    }
}

#[test]
fn a_closed_pipe_is_not_an_error() {
    let folder = folder();
    let program = Command::cargo_bin("frazil").unwrap().get_program().to_os_string();
    let mut shell = std::process::Command::new("sh");
    let script =
        "(\"$0\" info cube.obj cube.obj; echo $? > code; \"$0\" --help; echo $? >> code) | true; sleep 0.5";
    let output = shell.current_dir(folder.path()).arg("-c").arg(script).arg(program).output().unwrap();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read_to_string(folder.join("code")).unwrap(), "0\n0\n");
}
