//! `frazil vdb from-particles`.

use std::fs;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::geometry::points::{Attribute, Column, Points, Values};
use frazil::io::{mesh, particles};

use crate::common::liquids::filled;
use crate::program::{Folder, command, fails, works};

/// A drop of 2,109 particles, 0.1 m apart, as text.
fn write_drop(folder: &Path) {
    let positions = filled(0.1, 0.1, 1.0, |position| position.norm() < 0.8);
    let lines: Vec<String> = positions.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    fs::write(folder.join("drop.xyz"), lines.concat()).unwrap();
}

#[test]
fn a_drop_becomes_a_closed_mesh_and_a_level_set() {
    let folder = &Folder::empty();
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
fn specks_go_a_box_cuts_and_attributes_come_along() {
    let folder = &Folder::empty();
    let mut positions = filled(0.1, 0.1, 1.0, |position| position.norm() < 0.8);
    let whole = positions.len();
    positions.extend((0..5).map(|n| DVec3::new(3.0, 0.1 * f64::from(n), 0.0)));
    let mut points = Points::at(1.0, &positions).unwrap();
    let speed = positions.iter().map(|p| [p.x as f32, 2.0, -1.0]).collect();
    points.attributes.push(Attribute { name: "v".into(), values: Values::Vector(Column::Each(speed)) });
    points.attributes.push(Attribute { name: "heat".into(), values: Values::Float(Column::Uniform(0.25)) });
    points.attributes.push(Attribute { name: "kind".into(), values: Values::Int(Column::Uniform(3)) });
    particles::write(&folder.join("drop.bgeo"), &points, false).unwrap();
    let make = "vdb from-particles drop.bgeo --spacing 0.1 --mesh out.ply --report run.json";
    let number = |name: &str| {
        let text = fs::read(folder.join("run.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&text).unwrap()[name].as_u64().unwrap() as usize
    };
    let parts = |mesh: &frazil::geometry::TriMesh| mesh.euler_characteristic() / 2;
    works(folder, make);
    assert_eq!(parts(&mesh::read(&folder.join("out.ply")).unwrap()), 2);
    works(folder, &format!("{make} --min-drop 6 --attributes v,heat"));
    assert_eq!((number("particles"), number("specks_left_out")), (whole, 5));
    let out = mesh::read_detailed(&folder.join("out.ply")).unwrap();
    assert_eq!(parts(&out.mesh), 1);
    let array = |name: &str| &out.arrays.iter().find(|array| array.name == name).unwrap().values;
    assert_eq!(out.arrays.len(), 4);
    for (vertex, position) in out.mesh.positions.iter().enumerate() {
        assert!((array("vx")[vertex] - f64::from(position.x)).abs() < 0.15, "{}", array("vx")[vertex]);
        assert!((array("vy")[vertex] - 2.0).abs() < 1e-5 && (array("heat")[vertex] - 0.25).abs() < 1e-6);
    }
    works(folder, &format!("{make} --box-min=-1,-1,-1 --box-max=1,1,0 --attributes all"));
    assert!(number("particles") < whole * 11 / 20 && number("particles") > whole * 9 / 20);
    assert!(mesh::read(&folder.join("out.ply")).unwrap().is_manifold());
    fails(folder, &format!("{make} --attributes kind"), 2, &["drop.bgeo", "\"kind\"", "heat"]);
    fails(folder, &format!("{make} --min-drop 9000"), 2, &["drop.bgeo", "9000"]);
    fails(folder, &format!("{make} --box-min=7,7,7 --box-max=8,8,8"), 2, &["drop.bgeo", "box"]);
    fails(folder, &format!("{make} --box-min=7,7,7"), 2, &["box-max"]);
    fails(folder, &format!("{} --attributes v", make.replace("out.ply", "out.obj")), 2, &["out.obj", ".ply"]);
}

#[test]
fn what_makes_no_surface_is_refused() {
    let folder = &Folder::empty();
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
    // The second frame is missing: the first is made.
    fs::copy(folder.join("drop.xyz"), folder.join("gap.0001.xyz")).unwrap();
    for work in ["vdb from-particles gap.%04d.xyz --mesh out.%04d.ply", "convert gap.%04d.xyz out.%04d.ply"] {
        fails(
            folder,
            &format!("{work} --frames 1-2"),
            1,
            &["gap.0002.xyz", "1 of 2 frames were not made: 2"],
        );
        fs::remove_file(folder.join("out.0001.ply")).unwrap();
        // None is: nothing was begun.
        fails(folder, &format!("{work} --frames 2-3"), 2, &["gap.0002.xyz"]);
    }
    assert!(!folder.join("out.ply").exists() && !folder.join("out.0001.ply").exists());
    // Ten times too small: each particle would be a drop of its own.
    let said = works(folder, "vdb from-particles drop.xyz --mesh out.ply --spacing 0.01");
    assert!(said.contains("a spacing of 0.01 m is given"), "{said}");
}
