//! Points as a user handles them: info, convert, preview.

use std::fs;
use std::path::Path;

use frazil::base::DVec3;
use frazil::base::points::{Column, Points, Values};
use frazil::vdb::file::WriteOptions;
use frazil::vdb::points;
use frazil::{Context, Pool};

use crate::program::{CUBE, fails, works};

/// A few grains, with a file of them.
fn grains(folder: &Path, name: &str) -> Points {
    let places: Vec<DVec3> = (0..60).map(|n| DVec3::new(f64::from(n) * 0.013, 0.5, -1.0)).collect();
    let mut grains = Points::at(0.01, &places).unwrap();
    let speed = |n: i32| [n as f32 * 0.5, -1.25, 0.0];
    grains.set("v", Values::Vector(Column::Each((0..60).map(speed).collect())));
    grains.set("id", Values::Long(Column::Each((0..60).collect())));
    grains.set("pscale", Values::Float(Column::Uniform(0.004)));
    grains.set("source_frame", Values::Int(Column::Each((0..60).collect())));
    grains.set("active", Values::Bool(Column::Each((0..60).map(|n| n % 3 == 0).collect())));
    grains.set("rest", Values::Vector(Column::Each((0..60).map(|n| [n as f32, 0.25, 1.0]).collect())));
    let ctx = Context::new(Pool::new(1).unwrap());
    if let Some(order) = points::order(&ctx, &grains.cells).unwrap() {
        grains.reorder(&order);
    }
    points::write(&ctx, &folder.join(name), "grains", &grains, &WriteOptions::default()).unwrap();
    grains
}

#[test]
fn info_lists_attributes_with_their_ranges() {
    let folder = tempfile::tempdir().unwrap();
    grains(folder.path(), "grains.vdb");
    works(folder.path(), "convert grains.vdb grains.ply");
    for name in ["grains.vdb", "grains.ply"] {
        let said: serde_json::Value =
            serde_json::from_str(&works(folder.path(), &format!("info {name} --json"))).unwrap();
        let points = &said[0]["holds"][0];
        assert_eq!((&points["points"], &points["voxel_m"]), (&60.into(), &0.01.into()), "{said}");
        assert_eq!(points["attribute id"]["max"], 59);
        assert_eq!(points["attribute pscale"]["uniform"], true);
        assert_eq!(points["attribute v"]["min"], serde_json::json!([0.0, -1.25, 0.0]));
        assert_eq!(points["attribute active"]["type"], "bool");
        assert!((points["bounds_m"][1][0].as_f64().unwrap() - 59.0 * 0.013).abs() < 1e-6);
    }
}

#[test]
fn convert_carries_every_attribute_through_ply() {
    let folder = tempfile::tempdir().unwrap();
    let given = grains(folder.path(), "a.vdb");
    works(folder.path(), "convert a.vdb b.ply");
    works(folder.path(), "convert b.ply c.vdb");
    works(folder.path(), "convert b.ply d.ply");
    let back = points::read_own(&folder.path().join("c.vdb"), Some("grains")).unwrap();
    assert_eq!(back.attributes, given.attributes);
    assert_eq!(back.voxel_size, 0.01);
    for n in 0..60 {
        assert!((back.position(n) - given.position(n)).norm() < 1e-7);
    }
    assert_eq!(
        fs::read(folder.path().join("b.ply")).unwrap(),
        fs::read(folder.path().join("d.ply")).unwrap()
    );
    // Any program's vertices are points too.
    let plain = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\n0 0 0\n1 2 3\n";
    fs::write(folder.path().join("plain.ply"), plain).unwrap();
    fails(folder.path(), "convert plain.ply e.vdb", 2, &["plain.ply", "--voxel"]);
    works(folder.path(), "convert plain.ply e.vdb --voxel 0.1");
    assert_eq!(points::read_own(&folder.path().join("e.vdb"), None).unwrap().count(), 2);
}

#[test]
fn convert_writes_points_of_usd() {
    let folder = tempfile::tempdir().unwrap();
    for frame in [4, 5] {
        grains(folder.path(), &format!("g.{frame:04}.vdb"));
    }
    works(folder.path(), "convert g.%04d.vdb out.%04d.usda --frames 4-5 --fps 25");
    let text = fs::read_to_string(folder.path().join("out.0005.usda")).unwrap();
    for line in [
        "def Points \"g\"",
        "timeCodesPerSecond = 25",
        "int64[] ids.timeSamples = { 5: [0, 1, 2,",
        "float[] widths.timeSamples = { 5: [0.008] }",
        "vector3f[] velocities.timeSamples = { 5: [(0, -1.25, 0), (0.5, -1.25, 0),",
        "int[] primvars:source_frame.timeSamples = { 5: [0, 1,",
        "bool[] primvars:active.timeSamples = { 5: [1, 0, 0, 1,",
        "float3[] primvars:rest.timeSamples = { 5: [(0, 0.25, 1),",
    ] {
        assert!(text.contains(line), "no {line:?} in {text}");
    }
}

#[test]
fn points_and_meshes_are_not_mixed_up() {
    let folder = tempfile::tempdir().unwrap();
    grains(folder.path(), "grains.vdb");
    fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    works(folder.path(), "convert cube.obj cube.ply");
    works(folder.path(), "convert cube.ply cube2.obj");
    fails(folder.path(), "convert grains.vdb grains.obj", 2, &["grains.obj", ".usda"]);
    fails(folder.path(), "convert cube.obj cube.vdb", 2, &["cube.obj", "points"]);
    fails(folder.path(), "convert grains.vdb g.ply --scale 2", 2, &["--scale"]);
    fails(folder.path(), "convert cube.obj c.ply --voxel 1", 2, &["--voxel"]);
    fails(folder.path(), "convert g.%04d.vdb g.ply", 2, &["--frames"]);
    fails(folder.path(), "convert none.vdb g.ply", 2, &["none.vdb"]);
    fails(folder.path(), "preview cube.obj -o p.png --color v", 2, &["--color"]);
    fails(
        folder.path(),
        "preview grains.vdb -o p.png --color heat",
        2,
        &["grains.vdb", "heat", "source_frame"],
    );
}

#[test]
fn preview_draws_points_beside_meshes_and_colours_them() {
    let folder = tempfile::tempdir().unwrap();
    grains(folder.path(), "grains.vdb");
    fs::write(folder.path().join("cube.obj"), CUBE).unwrap();
    let picture = |arguments: &str| {
        works(folder.path(), &format!("preview {arguments} -o p.png --size 160x90"));
        fs::read(folder.path().join("p.png")).unwrap()
    };
    let plain = picture("grains.vdb --threads 1");
    assert!(picture("grains.vdb --threads 2") == plain);
    let coloured = picture("grains.vdb --color source_frame");
    assert!(coloured != plain && picture("grains.vdb --color active") != coloured);
    assert!(picture("grains.vdb --color v") != plain);
    let both = picture("cube.obj grains.vdb --eye 1,1,2 --target 0,0,0");
    assert!(picture("cube.obj --eye 1,1,2 --target 0,0,0") != both);
}
