//! `frazil vdb from-particles`.

use std::fs;
use std::path::Path;

use frazil::io::mesh;

use crate::common::liquids::filled;
use crate::program::{command, fails, works};

/// A drop of 2,109 particles, 0.1 m apart, as text.
fn write_drop(folder: &Path) {
    let places = filled(0.1, 0.1, 1.0, |place| place.norm() < 0.8);
    let lines: Vec<String> = places.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    fs::write(folder.join("drop.xyz"), lines.concat()).unwrap();
}

#[test]
fn a_drop_becomes_a_closed_mesh_and_a_level_set() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_drop(folder);
    works(folder, "vdb from-particles drop.xyz --mesh drop.ply -o drop.vdb --spacing 0.1 --threads 1");
    works(folder, "vdb from-particles drop.xyz --mesh again.ply -o again.vdb --spacing 0.1 --threads 2");
    for [a, b] in [["drop.ply", "again.ply"], ["drop.vdb", "again.vdb"]] {
        assert!(fs::read(folder.join(a)).unwrap() == fs::read(folder.join(b)).unwrap(), "{a}");
    }
    for level in ["baseline", "avx2"] {
        let mut plain =
            command(folder, "vdb from-particles drop.xyz --mesh level.ply -o level.vdb --spacing 0.1");
        assert!(plain.env("FRAZIL_CPU", level).status().unwrap().success());
        for [a, b] in [["drop.ply", "level.ply"], ["drop.vdb", "level.vdb"]] {
            assert!(fs::read(folder.join(a)).unwrap() == fs::read(folder.join(b)).unwrap(), "{a} {level}");
        }
    }
    let drop = mesh::read(&folder.join("drop.ply")).unwrap();
    assert!(drop.is_manifold());
    assert_eq!(drop.euler_characteristic(), 2);
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.8f64.powi(3);
    // Where it bends outward, the surface lies a little lower over the outermost particles.
    assert!((drop.volume() / ball - 1.0).abs() < 0.08, "{} is not {ball}", drop.volume());
    let measured = works(folder, "info drop.vdb --measure --json");
    let measured: serde_json::Value = serde_json::from_str(&measured).unwrap();
    let volume = measured[0]["holds"][0]["volume_m3"].as_f64().unwrap();
    assert!((volume / drop.volume() - 1.0).abs() < 0.01, "{volume} is not {}", drop.volume());
    // The spacing is found.
    let estimated = works(folder, "vdb from-particles drop.xyz --mesh drop.ply --report run.json");
    assert!(estimated.contains("estimated"), "{estimated}");
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
    assert!((report["spacing_m"].as_f64().unwrap() - 0.1).abs() < 0.005, "{report}");
}

#[test]
fn what_makes_no_surface_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_drop(folder);
    fs::write(folder.join("few.xyz"), "0 0 0\n1 0 0\n").unwrap();
    fs::write(folder.join("wild.xyz"), "0 0 0\nnan 0 0\n").unwrap();
    fails(folder, "vdb from-particles few.xyz --mesh out.ply", 2, &["few.xyz", "--spacing"]);
    fails(folder, "vdb from-particles wild.xyz --mesh out.ply", 2, &["wild.xyz"]);
    fails(folder, "vdb from-particles gone.xyz --mesh out.ply", 2, &["gone.xyz"]);
    fails(folder, "vdb from-particles drop.xyz --mesh out.ply --spacing 0.1 --cell 1", 2, &["cell"]);
    fails(folder, "vdb from-particles drop.xyz --mesh out.obj.txt", 2, &[".ply"]);
    fails(folder, "vdb from-particles drop.xyz", 2, &["--output"]);
    fails(folder, "vdb from-particles drop.%04d.xyz --mesh out.ply", 2, &["--frames"]);
    fails(folder, "vdb from-particles drop.%04d.xyz --frames 1-2 --mesh out.ply", 2, &["out.ply", "pattern"]);
    let small = "vdb from-particles drop.xyz --mesh out.ply --spacing 0.1 --cell 0.0125 --max-memory 1M";
    fails(folder, small, 2, &["surface", "limit"]);
    // The second frame is missing: nothing is made of the first.
    fs::copy(folder.join("drop.xyz"), folder.join("gap.0001.xyz")).unwrap();
    for work in ["vdb from-particles gap.%04d.xyz --mesh out.%04d.ply", "convert gap.%04d.xyz out.%04d.ply"] {
        fails(folder, &format!("{work} --frames 1-2"), 2, &["gap.0002.xyz"]);
    }
    assert!(!folder.join("out.ply").exists() && !folder.join("out.0001.ply").exists());
    // Ten times too small: each particle would be a drop of its own.
    let said = works(folder, "vdb from-particles drop.xyz --mesh out.ply --spacing 0.01");
    assert!(said.contains("a spacing of 0.01 m is given"), "{said}");
}
