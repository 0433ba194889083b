//! Points as a user handles them: info, convert, preview.

use std::fs;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::vdb::file::WriteOptions;
use frazil::vdb::points;
use frazil::{Context, Pool};

use crate::program::{CUBE, Folder, fails, works};

/// A few grains, with a file of them.
fn grains(folder: &Path, name: &str) -> Points {
    let positions: Vec<DVec3> = (0..60).map(|n| DVec3::new(f64::from(n) * 0.013, 0.5, -1.0)).collect();
    let mut grains = Points::at(0.01, &positions).unwrap();
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
    let folder = Folder::empty();
    grains(&folder, "grains.vdb");
    works(&folder, "convert grains.vdb grains.ply");
    for name in ["grains.vdb", "grains.ply"] {
        let said: serde_json::Value =
            serde_json::from_str(&works(&folder, &format!("info {name} --json"))).unwrap();
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
    let folder = Folder::empty();
    let given = grains(&folder, "a.vdb");
    works(&folder, "convert a.vdb b.ply");
    works(&folder, "convert b.ply c.vdb");
    works(&folder, "convert b.ply d.ply");
    let back = points::read_own(&folder.join("c.vdb"), Some("grains")).unwrap();
    assert_eq!(back.attributes, given.attributes);
    assert_eq!(back.voxel_size, 0.01);
    for n in 0..60 {
        assert!((back.position(n) - given.position(n)).norm() < 1e-7);
    }
    assert_eq!(fs::read(folder.join("b.ply")).unwrap(), fs::read(folder.join("d.ply")).unwrap());
    works(&folder, "convert a.vdb wide.vdb --voxel 0.02");
    let wide = points::read_own(&folder.join("wide.vdb"), Some("grains")).unwrap();
    assert_eq!(wide.voxel_size, 0.02);
    works(&folder, "convert wide.vdb again.vdb --voxel 0.01");
    let again = points::read_own(&folder.join("again.vdb"), Some("grains")).unwrap();
    // The grains lie on a line, so cells of every size have them in the same order.
    for other in [&wide, &again] {
        assert_eq!(other.attributes, given.attributes);
        assert!((0..60).all(|n| (other.position(n) - given.position(n)).norm() < 1e-6));
    }
    // Any program's vertices are points too.
    let plain = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                 end_header\n0 0 0\n1 2 3\n";
    fs::write(folder.join("plain.ply"), plain).unwrap();
    fails(&folder, "convert plain.ply e.vdb", 2, &["plain.ply", "--voxel"]);
    works(&folder, "convert plain.ply e.vdb --voxel 0.1");
    assert_eq!(points::read_own(&folder.join("e.vdb"), None).unwrap().count(), 2);
}

#[test]
fn particle_caches_are_listed_and_go_from_one_format_to_another() {
    let folder = &Folder::empty();
    for frame in [1, 2] {
        grains(folder, &format!("g.{frame:04}.vdb"));
    }
    let info = |name: &str| -> serde_json::Value {
        let said: serde_json::Value =
            serde_json::from_str(&works(folder, &format!("info {name} --json"))).unwrap();
        said[0]["holds"][0].clone()
    };
    works(folder, "convert g.%04d.vdb a.%04d.bgeo --frames 1-2");
    let of_bgeo = info("a.0002.bgeo");
    assert_eq!((&of_bgeo["type"], &of_bgeo["points"]), (&"points".into(), &60.into()));
    assert_eq!(of_bgeo["attribute active"]["type"], "bool");
    assert_eq!(of_bgeo["attribute id"]["type"], "int64");
    assert!(of_bgeo["voxel_m"].is_null());
    fails(folder, "convert a.0001.bgeo b.vdb", 2, &["a.0001.bgeo", "--voxel"]);
    works(folder, "convert a.0001.bgeo b.vdb --voxel 0.01");
    assert_eq!(info("b.vdb")["attribute v"], info("g.0001.vdb")["attribute v"]);
    let said = works(folder, "convert a.0001.bgeo c.xyz");
    assert!(said.contains("c.xyz") && said.contains("without v, id"), "{said}");
    assert_eq!(info("c.xyz")["bounds_m"], info("a.0001.bgeo")["bounds_m"]);
    works(folder, "convert c.xyz c.usda");
    // No voxels are made up where a file has none.
    works(folder, "convert a.0001.bgeo d.ply");
    assert!(info("d.ply")["voxel_m"].is_null());
    fails(folder, "convert d.ply e.vdb", 2, &["d.ply", "--voxel"]);
    works(folder, "preview a.0001.bgeo -o p.png --size 64x48 --color v");
}

#[test]
fn points_of_another_unit_and_axis_are_turned_with_their_vectors() {
    let folder = &Folder::empty();
    let text = "# vtk DataFile Version 3.0\ncentimetres, z up\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n100 200 300\n0 0 50\n\
                POINT_DATA 2\nVECTORS velocity float\n10 20 30\n0 0 -981\nVECTORS colour float\n1 2 3\n1 2 4\n\
                SCALARS pscale float\nLOOKUP_TABLE default\n2\n3\n";
    fs::write(folder.join("a.vtk"), text).unwrap();
    works(folder, "convert a.vtk a.ply --scale 0.01 --up z");
    let cloud = frazil::io::particles::read(&folder.join("a.ply")).unwrap();
    let near = |a: DVec3, b: [f64; 3]| assert!((a - DVec3::from(b)).norm() < 1e-6, "{a:?} {b:?}");
    near(cloud.positions[0], [1.0, 3.0, -2.0]);
    let vector = |name: &str, point: usize| match cloud.attribute(name) {
        Some(Values::Vector(column)) => DVec3::from(column.get(point).map(f64::from)),
        other => panic!("{name}: {other:?}"),
    };
    near(vector("velocity", 0), [0.1, 0.3, -0.2]);
    near(vector("velocity", 1), [0.0, -9.81, 0.0]);
    near(vector("colour", 1), [1.0, 2.0, 4.0]);
    assert_eq!(cloud.attribute("pscale").unwrap().number(1), f64::from(0.03f32));
    // Points of a .vdb too, with their voxels.
    let given = grains(folder, "g.vdb");
    works(folder, "convert g.vdb h.vdb --scale 2 --up z");
    let back = points::read_own(&folder.join("h.vdb"), None).unwrap();
    assert_eq!(back.voxel_size, 0.02);
    let found = |id: f64| (0..60).find(|&point| back.attribute("id").unwrap().number(point) == id).unwrap();
    let (position, now) = (given.position(0), back.position(found(given.attribute("id").unwrap().number(0))));
    near(now, [2.0 * position.x, 2.0 * position.z, -2.0 * position.y]);
}

#[test]
fn convert_writes_points_of_usd() {
    let folder = Folder::empty();
    for frame in [4, 5] {
        grains(&folder, &format!("g.{frame:04}.vdb"));
    }
    works(&folder, "convert g.%04d.vdb out.%04d.usda --frames 4-5 --fps 25");
    let text = fs::read_to_string(folder.join("out.0005.usda")).unwrap();
    for line in [
        "def Points \"g\"",
        "timeCodesPerSecond = 25",
        "int64[] ids.timeSamples = { 5: [0, 1, 2,",
        "float[] widths.timeSamples = { 5: [0.008, 0.008,",
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
    let folder = Folder::empty();
    grains(&folder, "grains.vdb");
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    works(&folder, "convert cube.obj cube.ply");
    works(&folder, "convert cube.ply cube2.obj");
    fails(&folder, "convert grains.vdb grains.obj", 2, &["grains.obj", ".usda"]);
    fails(&folder, "convert cube.obj cube.vdb", 2, &["cube.obj", "points"]);
    fails(&folder, "convert grains.vdb g.ply --to-scale 2", 2, &["--to-scale"]);
    fails(&folder, "convert grains.vdb g.vtk", 2, &["g.vtk", ".bgeo"]);
    fails(&folder, "convert grains.bgeo.sc g.vdb", 2, &["grains.bgeo.sc"]);
    fails(&folder, "info none.bgeo", 2, &["none.bgeo"]);
    fails(&folder, "convert cube.obj c.ply --voxel 1", 2, &["--voxel"]);
    fails(&folder, "convert g.%04d.vdb g.ply", 2, &["--frames"]);
    fails(&folder, "convert none.vdb g.ply", 2, &["none.vdb"]);
    fails(&folder, "preview cube.obj -o p.png --color v", 2, &["--color"]);
    fails(&folder, "preview grains.vdb -o p.png --color heat", 2, &["grains.vdb", "heat", "source_frame"]);
}

#[test]
fn preview_draws_points_beside_meshes_and_colours_them() {
    let folder = Folder::empty();
    grains(&folder, "grains.vdb");
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let picture = |arguments: &str| {
        works(&folder, &format!("preview {arguments} -o p.png --size 160x90"));
        fs::read(folder.join("p.png")).unwrap()
    };
    let plain = picture("grains.vdb --threads 1");
    assert!(picture("grains.vdb --threads 2") == plain);
    let coloured = picture("grains.vdb --color source_frame");
    assert!(coloured != plain && picture("grains.vdb --color active") != coloured);
    assert!(picture("grains.vdb --color v") != plain);
    let both = picture("cube.obj grains.vdb --eye 1,1,2 --target 0,0,0");
    assert!(picture("cube.obj --eye 1,1,2 --target 0,0,0") != both);
}
