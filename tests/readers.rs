//! Programs and libraries that nobody here wrote read what the command writes: they see the same grids. This program does
//! not link frazil, which only makes the files, as a command.

#[path = "common/program.rs"]
#[allow(dead_code)]
mod program;
#[path = "common/skip.rs"]
mod skip;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::process::Command;

use program::{CUBE, Folder};
use serde_json::Value;
use skip::skipped;
use vdb_rs::{Map, MetadataValue, VdbReader};

const SCENE: &str = "[shot]\nframes = \"1-3\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
cell = 0.02\n[[object]]\nfile = \"cube.obj\"\nkeys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 3, at = [0, 0.1, 0.9] }]\n";

fn frazil(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(assert_cmd::cargo::cargo_bin("frazil"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Where the library were linked, OpenVDB would be too.
#[test]
fn this_program_does_not_link_ours() {
    let loaded = std::fs::read_to_string("/proc/self/maps").unwrap();
    assert!(loaded.contains("libc.so") && !loaded.contains("libopenvdb"), "{loaded}");
}

/// A folder with three frames of prints, and what the command says of the last.
fn frames() -> (Folder, Vec<Value>) {
    let folder = Folder::empty();
    std::fs::write(folder.join("cube.obj"), CUBE).unwrap();
    std::fs::write(folder.join("shot.toml"), SCENE).unwrap();
    frazil(&folder, &["snow", "shot.toml", "-o", "out", "-q"]);
    let info = frazil(&folder, &["info", "out/base/base.0003.vdb", "out/removed/removed.0003.vdb", "--json"]);
    let info: Value = serde_json::from_str(&info).unwrap();
    let grids = info.as_array().unwrap().iter().flat_map(|file| file["holds"].as_array().unwrap().clone());
    let grids = grids.collect();
    (folder, grids)
}

fn file_of(grid: &Value) -> &'static str {
    if grid["name"] == "removed" { "out/removed/removed.0003.vdb" } else { "out/base/base.0003.vdb" }
}

#[test]
fn vdb_rs_sees_the_same_grids() {
    let (folder, grids) = frames();
    assert_eq!(grids.len(), 4);
    for info in grids {
        let name = info["name"].as_str().unwrap();
        let file = BufReader::new(File::open(folder.join(file_of(&info))).unwrap());
        let grid = VdbReader::new(file).unwrap().read_grid::<f32>(name).unwrap();
        let active: f64 = grid.iter().map(|(_, _, level)| f64::from(level.scale()).powi(3)).sum();
        assert_eq!(Some(active), info["active_voxels"].as_f64(), "{name}");
        // A grid without a class does not say so.
        let class = match grid.descriptor.meta_data.0.get("class") {
            Some(MetadataValue::String(class)) => class.as_str(),
            _ => "unknown",
        };
        assert_eq!(Some(class), info["class"].as_str(), "{name}");
        let Map::UniformScaleMap { voxel_size, .. } = grid.transform else { panic!("{:?}", grid.transform) };
        assert_eq!(voxel_size.to_array(), [0.02; 3]);
        if name == "surface" {
            let band = grid.iter().all(|(_, value, _)| value.abs() < 0.06);
            assert!(band, "a value outside the narrow band");
            assert!(
                grid.iter().any(|(_, value, _)| value < 0.0) && grid.iter().any(|(_, value, _)| value > 0.0)
            );
        }
    }
}

/// Debian's module is for /usr/bin/python3; skipped, with a message, where it is not installed.
#[test]
fn pyopenvdb_sees_the_same_grids() {
    let script = "import sys, pyopenvdb as v\n\
        for path in sys.argv[1:]:\n    \
            for g in v.readAllGridMetadata(path):\n        \
                g = v.read(path, g.name)\n        \
                print(g.name, g.activeVoxelCount(), g.gridClass, g.transform.voxelSize()[0], sep='|')\n";
    let has_module = Command::new("/usr/bin/python3").args(["-c", "import pyopenvdb"]).output();
    if !has_module.is_ok_and(|output| output.status.success()) {
        skipped("python3-openvdb is not installed");
        return;
    }
    let (folder, grids) = frames();
    let output = Command::new("/usr/bin/python3")
        .current_dir(folder.path())
        .args(["-c", script, "out/base/base.0003.vdb", "out/removed/removed.0003.vdb"])
        .output()
        .unwrap();
    let text = |info: &Value| {
        let class = info["class"].as_str().unwrap();
        format!("{}|{}|{class}|0.02", info["name"].as_str().unwrap(), info["active_voxels"])
    };
    let mut expected: Vec<String> = grids.iter().map(text).collect();
    let printed = String::from_utf8(output.stdout).unwrap();
    let mut seen: Vec<String> = printed.lines().map(str::to_string).collect();
    expected.sort();
    seen.sort();
    assert_eq!(seen, expected, "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn vdb_print_is_content() {
    let (folder, _) = frames();
    match Command::new("vdb_print").current_dir(folder.path()).args(["-l", "out/base/base.0003.vdb"]).output()
    {
        Err(_) => skipped("libopenvdb-tools is not installed"),
        Ok(output) => {
            assert!(output.status.success());
            assert!(String::from_utf8_lossy(&output.stdout).contains("surface"));
        }
    }
}

/// Kernels are compiled for several sets of instructions: all of them give the same bytes.
#[test]
fn every_set_of_instructions_gives_the_same_bytes() {
    let folder = Folder::empty();
    std::fs::write(folder.join("cube.obj"), CUBE).unwrap();
    std::fs::write(folder.join("shot.toml"), SCENE).unwrap();
    let run = |level: &str| {
        let output = Command::new(assert_cmd::cargo::cargo_bin("frazil"))
            .current_dir(folder.path())
            .env("FRAZIL_CPU", level)
            .args(["snow", "shot.toml", "-q", "-o", level])
            .output()
            .unwrap();
        assert!(output.status.success());
        let read = |name: &str| std::fs::read(folder.join(level).join(name)).unwrap();
        ["base/base.0003.vdb", "removed/removed.0002.vdb"].map(read)
    };
    let baseline = run("baseline");
    assert!(run("avx2") == baseline, "avx2 differs");
    assert!(run("avx512") == baseline, "avx512 differs");
}
