//! `frazil vdb from-particles`: spheres, smoothing, and solids cut out of the liquid.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use frazil::geometry::TriMesh;
use frazil::geometry::points::{Attribute, Column, Points, Values};
use frazil::io::{mesh, particles};
use frazil::vdb::file::{self, WriteOptions};
use frazil::vdb::{FloatGrid, GridClass, level_set};

use crate::common::liquids::{context, filled};
use crate::program::{Folder, GRAINS, fails, works};

/// Spacing and cell (m) of the drop.
const SPACING: f64 = 0.1;
const CELL: f64 = 0.05;

/// A drop of 2,109 particles, which carry their positions as velocities.
fn write_drop(folder: &Path, name: &str) {
    let positions = filled(SPACING, 0.1, 1.0, |position| position.norm() < 0.8);
    let mut points = Points::at(1.0, &positions).unwrap();
    let speed = positions.iter().map(|position| position.cast::<f32>().into()).collect();
    points.attributes.push(Attribute { name: "v".into(), values: Values::Vector(Column::Each(speed)) });
    particles::write(&folder.join(name), &points, false).unwrap();
}

/// A level set of the half of a large box that lies above 0 on an axis.
fn write_half(folder: &Path, name: &str, axis: usize, options: &str) {
    let mut low = [-2.0; 3];
    low[axis] = 0.0;
    mesh::write(&folder.join("box.obj"), &TriMesh::cuboid(low, [2.0; 3])).unwrap();
    works(folder, &format!("vdb from-mesh box.obj {options} -o {name}"));
}

fn read(folder: &Path, name: &str) -> TriMesh {
    mesh::read(&folder.join(name)).unwrap()
}

/// Volume (m3) of a level set in a file.
fn volume(folder: &Path, name: &str) -> f64 {
    let measured = works(folder, &format!("info {name} --measure --json"));
    let measured: serde_json::Value = serde_json::from_str(&measured).unwrap();
    measured[0]["holds"][0]["volume_m3"].as_f64().unwrap()
}

#[track_caller]
fn near(value: f64, expected: f64, part: f64) {
    assert!((value / expected - 1.0).abs() < part, "{value} is not {expected}");
}

/// How far normals of a drop's surface turn from its middle's direction (rad): the root of the mean square.
fn roughness(mesh: &TriMesh) -> f64 {
    let normals = mesh.normals();
    let turned = |(normal, position): (&frazil::geometry::Vec3, &frazil::geometry::Vec3)| {
        f64::from((normal - position.normalize()).norm_squared())
    };
    let sum: f64 = normals.iter().zip(&mesh.positions).map(turned).sum();
    (sum / normals.len() as f64).sqrt()
}

#[test]
fn a_sphere_around_a_particle_has_the_volume_of_a_sphere() {
    let folder = &Folder::empty();
    fs::write(folder.join("one.xyz"), "0.013 0.02 -0.01\n").unwrap();
    fs::write(folder.join("two.xyz"), "0 0 0\n0.2 0 0\n").unwrap();
    let make = "--method spheres --spacing 0.2 --cell 0.0125 --mesh out.ply -o out.vdb";
    let ball = 4.0 / 3.0 * PI * 0.2f64.powi(3);
    // What two spheres share: a lens.
    let lens = PI * (4.0 * 0.2 + 0.2) * (2.0 * 0.2 - 0.2f64).powi(2) / 12.0;
    for (arguments, expected) in [
        ("one.xyz", ball),
        ("one.xyz --radius 0.15", ball * 0.75f64.powi(3)),
        ("one.xyz --smooth 10", ball),
        ("two.xyz", 2.0 * ball - lens),
    ] {
        works(folder, &format!("vdb from-particles {arguments} {make}"));
        let mesh = read(folder, "out.ply");
        assert!(mesh.is_closed());
        near(mesh.volume(), expected, 0.02);
        near(volume(folder, "out.vdb"), expected, 0.02);
    }
}

#[test]
fn smoothing_keeps_the_volume_takes_lumps_away_and_the_level_set_follows() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    for (method, parts) in [("solenthaler", [0.95, 0.93]), ("spheres", [0.9, 0.65])] {
        let make = format!("vdb from-particles drop.bgeo --method {method} --spacing 0.1 --cell 0.05");
        works(folder, &format!("{make} --mesh rough.ply"));
        let rough = read(folder, "rough.ply");
        for (passes, part) in [5, 25].into_iter().zip(parts) {
            works(folder, &format!("{make} --smooth {passes} --mesh soft.ply -o soft.vdb"));
            let soft = read(folder, "soft.ply");
            assert_eq!(soft.triangles, rough.triangles);
            near(soft.volume(), rough.volume(), 1e-3);
            let (before, after) = (roughness(&rough), roughness(&soft));
            assert!(after < part * before, "{method}, {passes} passes: {after} of {before}");
            // The level set is that of this mesh.
            works(folder, "vdb from-mesh soft.ply --cell 0.05 -o again.vdb");
            let [one, two] = ["soft.vdb", "again.vdb"].map(|name| fs::read(folder.join(name)).unwrap());
            assert!(one == two, "{method}, {passes} passes");
        }
    }
}

#[test]
fn a_box_takes_half_of_a_drop_whatever_its_cells() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    let make = "vdb from-particles drop.bgeo --spacing 0.1";
    works(folder, &format!("{make} --mesh whole.ply"));
    let whole = read(folder, "whole.ply").volume();
    let cells = ["--cell 0.05", "--cell 0.03", "--cell 0.08", "--cell 0.05 --half-width 6"];
    for (method, cells) in [("solenthaler", cells), ("spheres", cells)] {
        let make = format!("{make} --method {method} --mesh cut.ply");
        let whole = match method {
            "spheres" => {
                works(folder, &make);
                read(folder, "cut.ply").volume()
            }
            _ => whole,
        };
        for cells in cells {
            write_half(folder, "half.vdb", 0, cells);
            works(folder, &format!("{make} --subtract half.vdb -o cut.vdb --attributes v"));
            let cut = mesh::read_detailed(&folder.join("cut.ply")).unwrap();
            assert!(cut.mesh.is_closed(), "{method} {cells}");
            near(cut.mesh.volume(), 0.5 * whole, 0.03);
            near(volume(folder, "cut.vdb"), 0.5 * whole, 0.03);
            // Nothing lies in the box, and the liquid reaches it.
            let farthest = cut.mesh.positions.iter().map(|position| position.x).fold(f32::MIN, f32::max);
            assert!(farthest.abs() < 0.01 * CELL as f32, "{farthest}");
            let speed = cut.arrays.iter().find(|array| array.name == "vx").unwrap();
            assert_eq!(speed.values.len(), cut.mesh.positions.len());
            for (value, position) in speed.values.iter().zip(&cut.mesh.positions) {
                assert!((value - f64::from(position.x)).abs() < 0.25, "{value} at {position}");
            }
        }
    }
}

#[test]
fn each_frame_has_its_colliders_and_threads_change_nothing() {
    let folder = &Folder::empty();
    for frame in [1, 2] {
        write_drop(folder, &format!("drop.000{frame}.bgeo"));
        write_half(folder, &format!("moving.000{frame}.vdb"), frame - 1, "--cell 0.04");
    }
    write_half(folder, "floor.vdb", 2, "--cell 0.05");
    let make = "vdb from-particles drop.%04d.bgeo --frames 1-2 --spacing 0.1 --method spheres --smooth 3 \
                --subtract moving.%04d.vdb --subtract floor.vdb";
    works(folder, &format!("{make} --mesh a.%04d.ply -o a.%04d.vdb --threads 1"));
    works(folder, &format!("{make} --mesh b.%04d.ply -o b.%04d.vdb --threads 2"));
    let sides = [1, 2].map(|frame| {
        for kind in ["ply", "vdb"] {
            let [one, two] = ["a", "b"].map(|run| fs::read(folder.join(format!("{run}.000{frame}.{kind}"))));
            assert!(one.unwrap() == two.unwrap(), "frame {frame}, .{kind}");
        }
        let mesh = read(folder, &format!("a.000{frame}.ply"));
        assert!(mesh.is_closed());
        let (_, high) = mesh.bounds().unwrap();
        (mesh.volume(), [0, 1, 2].map(|axis| high[axis] < 0.01))
    });
    assert_eq!(sides.map(|(_, is_cut)| is_cut), [[true, false, true], [false, true, true]]);
    near(sides[0].0, sides[1].0, 0.03);
}

#[test]
fn what_cannot_be_cut_out_is_refused_before_any_work() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    for frame in [1, 2] {
        write_drop(folder, &format!("drop.000{frame}.bgeo"));
    }
    write_half(folder, "half.vdb", 0, "--cell 0.1");
    fs::copy(folder.join("half.vdb"), folder.join("gap.0001.vdb")).unwrap();
    fs::copy(folder.join("half.vdb"), folder.join("fog.0001.vdb")).unwrap();
    let write = |name: &str, background: f32, class: GridClass| {
        let mut grid = FloatGrid::new(0.1, background).unwrap();
        grid.set_class(class).unwrap();
        grid.set_name("thing").unwrap();
        file::write(&folder.join(name), &[&grid], &WriteOptions::default()).unwrap();
    };
    write("fog.vdb", 0.0, GridClass::Fog);
    write("fog.0002.vdb", 0.0, GridClass::Fog);
    write("outside.vdb", -0.3, GridClass::LevelSet);
    fs::write(folder.join("text.vdb"), "no grid at all").unwrap();
    fs::write(folder.join("grains.ply"), GRAINS).unwrap();
    works(folder, "convert grains.ply points.vdb --voxel 0.1");
    let make = "vdb from-particles drop.bgeo --spacing 0.1 --mesh out.ply -o out.vdb";
    for (name, words) in [
        ("gone.vdb", "cannot read"),
        ("text.vdb", "text.vdb"),
        ("points.vdb", "points.vdb"),
        ("fog.vdb", "not a level set"),
        ("outside.vdb", "inside out"),
    ] {
        fails(folder, &format!("{make} --subtract half.vdb --subtract {name}"), 2, &[name, words]);
    }
    let frames = "vdb from-particles drop.%04d.bgeo --frames 1-2 --spacing 0.1 --mesh out.%04d.ply";
    fails(folder, &format!("{frames} --subtract gap.%04d.vdb"), 1, &["gap.0002.vdb", "1 of 2 frames"]);
    fails(folder, &format!("{frames} --subtract fog.%04d.vdb"), 1, &["fog.0002.vdb", "not a level set"]);
    fs::remove_file(folder.join("out.0001.ply")).unwrap();
    for (options, words) in [
        ("--radius 0.1", "--method spheres"),
        ("--method spheres --radius 6", "1.5 to 100"),
        ("--method spheres --radius 0.025 --cell 0.025", "--radius 0.025 m is 1.000 cells"),
        ("--method spheres --cell 0.08", "1.5 to 100"),
        ("--method spheres --cell 0.01 --max-memory 1M", "limit"),
    ] {
        fails(folder, &format!("{make} {options}"), 2, &[words]);
    }
    // A file for each frame tells no frame.
    fails(folder, &format!("{make} --subtract gap.%04d.vdb"), 2, &["gap.%04d.vdb", "needs --frames"]);
    let made = |name: &str| folder.join(name).exists();
    assert!(!made("out.ply") && !made("out.vdb") && !made("out.0001.ply"));
    // A solid is not written over.
    fails(folder, &make.replace("out.vdb", "half.vdb --subtract half.vdb"), 2, &["half.vdb", "input"]);
}

#[test]
fn where_solids_take_all_nothing_is_left_and_said() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    mesh::write(&folder.join("all.obj"), &TriMesh::cuboid([-2.0; 3], [2.0; 3])).unwrap();
    works(folder, "vdb from-mesh all.obj --cell 0.1 -o all.vdb");
    let said = works(folder, "vdb from-particles drop.bgeo --spacing 0.1 --subtract all.vdb -o none.vdb");
    assert!(said.contains("drop.bgeo: nothing is left"), "{said}");
    let grid = file::read_named(&folder.join("none.vdb"), None).unwrap();
    assert!(grid.value([0; 3]) > 0.0);
    let mesh = level_set::to_mesh(&context(1), &grid, 0.0, 0.0).unwrap();
    assert_eq!(mesh.triangles.len(), 0);
    // Files of nothing are files all the same.
    for name in ["none.ply", "none.obj"] {
        let make = "vdb from-particles drop.bgeo --spacing 0.1 --subtract all.vdb";
        works(folder, &format!("{make} --mesh {name}"));
    }
    let ply = fs::read_to_string(folder.join("none.ply")).unwrap();
    assert!(ply.contains("element vertex 0") && !ply.contains("vx"), "{ply}");
    assert!(fs::read_to_string(folder.join("none.obj")).unwrap().starts_with('#'));
}

#[test]
fn of_a_huge_solid_only_what_lies_in_the_liquid_counts() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    // On the liquid's cells its surface would take terabytes.
    let huge = TriMesh::cuboid([0.0, -2000.0, -2000.0], [4000.0, 2000.0, 2000.0]);
    mesh::write(&folder.join("huge.obj"), &huge).unwrap();
    works(folder, "vdb from-mesh huge.obj --cell 50 -o huge.vdb");
    let make = "vdb from-particles drop.bgeo --spacing 0.1";
    works(folder, &format!("{make} --mesh whole.ply"));
    works(folder, &format!("{make} --subtract huge.vdb --mesh cut.ply"));
    let [whole, cut] = ["whole.ply", "cut.ply"].map(|name| read(folder, name));
    assert!(cut.is_closed());
    near(cut.volume(), 0.5 * whole.volume(), 0.03);
    assert!(cut.bounds().unwrap().1.x < 0.01 * CELL as f32);
    // Its vertices lie beyond what can be counted in cells.
    mesh::write(&folder.join("far.obj"), &TriMesh::cuboid([0.0; 3], [9000.0; 3])).unwrap();
    works(folder, "vdb from-mesh far.obj --cell 100 -o far.vdb");
    fails(folder, &format!("{make} --subtract far.vdb --mesh far.ply"), 2, &["far.vdb", "reach"]);
}

#[test]
fn all_level_sets_of_a_file_are_cut_out() {
    let folder = &Folder::empty();
    write_drop(folder, "drop.bgeo");
    let halves = [("one", 0), ("other", 1)].map(|(name, axis)| {
        write_half(folder, "half.vdb", axis, "--cell 0.04");
        let mut grid = file::read_named(&folder.join("half.vdb"), None).unwrap();
        grid.set_name(name).unwrap();
        grid
    });
    let [one, other] = &halves;
    file::write(&folder.join("both.vdb"), &[one, other], &WriteOptions::default()).unwrap();
    let make = "vdb from-particles drop.bgeo --spacing 0.1";
    works(folder, &format!("{make} --mesh whole.ply"));
    works(folder, &format!("{make} --subtract both.vdb --mesh cut.ply"));
    near(read(folder, "cut.ply").volume(), 0.25 * read(folder, "whole.ply").volume(), 0.05);
}

#[test]
fn options_that_would_do_nothing_are_refused() {
    let folder = &Folder::empty();
    let positions = filled(SPACING, 0.1, 1.0, |position| position.norm() < 0.4);
    let mut points = Points::at(1.0, &positions).unwrap();
    let speed = Values::Vector(Column::Each(vec![[1.0, 2.0, 3.0]; positions.len()]));
    points.attributes.push(Attribute { name: "v".into(), values: speed });
    for name in ["vx", "y"] {
        let values = Values::Float(Column::Each(vec![4.0; positions.len()]));
        points.attributes.push(Attribute { name: name.into(), values });
    }
    particles::write(&folder.join("drop.bgeo"), &points, false).unwrap();
    let make = "vdb from-particles drop.bgeo --spacing 0.1 --mesh out.ply";
    for option in ["--half", "--compression zip", "--name water"] {
        fails(folder, &format!("{make} {option}"), 2, &["--output"]);
    }
    for (names, twice) in [("v,vx", "\"vx\""), ("y", "\"y\""), ("all", "two arrays")] {
        fails(folder, &format!("{make} --attributes {names}"), 2, &["drop.bgeo", twice]);
    }
    assert!(!folder.join("out.ply").exists());
    works(folder, &format!("{make} --attributes vx"));
}

#[test]
fn cells_follow_small_spheres() {
    let folder = &Folder::empty();
    fs::write(folder.join("one.xyz"), "0 0 0\n").unwrap();
    works(folder, "vdb from-particles one.xyz --method spheres --spacing 0.2 --radius 0.12 --mesh out.ply");
    near(read(folder, "out.ply").volume(), 4.0 / 3.0 * PI * 0.12f64.powi(3), 0.2);
}
