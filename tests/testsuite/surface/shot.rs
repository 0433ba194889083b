//! `frazil surface`: shots of a mesh that follows a cache.

use std::fs;
use std::path::Path;

use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::points::{Attribute, Column, Values};
use frazil::geometry::{DVec3, DetailedMesh, Points, TriMesh};
use frazil::io::{mesh, particles};

use crate::common::character::output;
use crate::common::followed::{array, counted, frame, seamed, values, write_mesh};
use crate::common::liquids::{Ball, ball, turned};
use crate::program::{Folder, command, fails, kill_at, works};

/// Where a position of the first frame is in another: it turns and travels.
fn motion(position: DVec3, frame: f64) -> DVec3 {
    turned(position, 0.1 * frame, DVec3::new(0.004, -0.003, 0.002) * frame)
}

fn write_frame(path: &Path, ball: &Ball, frame: f64, attributes: &[&str]) {
    let positions: Vec<DVec3> = ball.positions.iter().map(|position| motion(*position, frame)).collect();
    let mut points = Points::at(1.0, &positions).unwrap();
    let ahead = |position: &DVec3| {
        let step = 1e-3;
        let by = (motion(*position, frame + step) - motion(*position, frame - step)) * (24.0 / (2.0 * step));
        [by.x as f32, by.y as f32, by.z as f32]
    };
    for name in attributes {
        let values = match *name {
            "v" => Values::Vector(Column::Each(ball.positions.iter().map(ahead).collect())),
            _ => Values::Long(Column::Each((0..positions.len() as i64).collect())),
        };
        points.attributes.push(Attribute { name: name.to_string(), values });
    }
    particles::write(path, &points, false).unwrap();
}

/// A ball's mesh with a seam in its texture coordinates, colours and masks of its vertices and faces.
fn detailed(mesh: &TriMesh) -> DetailedMesh {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let arrays = vec![
        array("red", On::Vertices, Number::U8, counted(vertices)),
        array("mask", On::Vertices, Number::F64, counted(vertices)),
        array("part", On::Faces, Number::I32, counted(faces)),
        array("wet", On::Corners, Number::F32, counted(3 * faces)),
    ];
    DetailedMesh { mesh: mesh.clone(), uvs: Some(seamed(faces)), arrays }
}

/// The cache of a ball that turns, of so many frames, with its mesh.
fn write_shot(folder: &Path, frames: i32) -> Ball {
    let ball = ball(5.0, 10, 0.25);
    for frame in 1..=frames {
        write_frame(&folder.join(format!("ball.{frame:04}.bgeo")), &ball, f64::from(frame - 1), &["v", "id"]);
    }
    write_mesh(&folder.join("ball.ply"), &detailed(&ball.mesh));
    ball
}

const SHOT: &str = "surface -p ball.%04d.bgeo -m ball.ply --spacing 0.01 --set surface.rebuild=false";

#[test]
fn the_mesh_moves_with_its_velocities_and_keeps_what_it_carries() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 6);
    let said =
        works(folder, &format!("{SHOT} -o out --report run.json --set output.surface=[\"ply\",\"usd\"]"));
    assert!(!said.contains("estimated"), "{said}");
    let before = detailed(&ball.mesh);
    for number in 1..=6 {
        let now = frame(folder, "out", number);
        assert_eq!(now.mesh.triangles, before.mesh.triangles);
        assert_eq!(now.uvs, before.uvs);
        for own in &before.arrays {
            assert!(now.arrays.contains(own), "{} at frame {number}", own.name);
        }
        assert!(values(&now, "flagged").iter().all(|flag| *flag == 0.0));
        let ahead = frame(folder, "out", (number + 1).min(6));
        let speed = ["vx", "vy", "vz"].map(|name| values(&now, name));
        for (vertex, position) in now.mesh.positions.iter().enumerate() {
            let truth = motion(ball.mesh.positions[vertex].cast(), f64::from(number - 1));
            assert!(
                (position.cast::<f64>() - truth).norm() < 0.02 * ball.spacing,
                "frame {number}, vertex {vertex}"
            );
            let by = DVec3::new(speed[0][vertex], speed[1][vertex], speed[2][vertex]) / 24.0;
            if number < 6 {
                let off = (position.cast::<f64>() + by - ahead.mesh.positions[vertex].cast::<f64>()).norm();
                // What 32 bits of a position and a velocity hold.
                assert!(off < 2e-5 * ball.spacing, "{off} m at frame {number}, vertex {vertex}");
            } else {
                assert!(by.norm() > 0.0, "the last frame moves as it came");
            }
        }
    }
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
    assert_eq!((report["frames"].as_u64(), report["most_flagged"].as_u64()), (Some(6), Some(0)));
    works(folder, "preview out --frame 3 -o plain.png --size 64x48");
    works(folder, "preview out --frame 3 -o delta.png --size 64x48 --color delta");
    works(folder, "preview out/surface/surface.0003.usdc -o v.png --size 64x48 --color v");
    assert!(fs::read(folder.join("plain.png")).unwrap() != fs::read(folder.join("delta.png")).unwrap());
    fails(folder, "preview out --frame 3 -o no.png --color heat", 2, &["--color heat", "array"]);
    let checked = works(folder, "check out");
    assert!(checked.contains("6 frames") && checked.contains("all of them"), "{checked}");
}

#[test]
fn threads_kills_and_another_order_of_frames_give_the_same_bytes() {
    let folder = &Folder::empty();
    write_shot(folder, 8);
    let shot = format!("{SHOT} --set output.surface=[\"ply\",\"usd\",\"obj\"]");
    works(folder, &format!("{shot} -o whole --threads 2"));
    works(folder, &format!("{shot} -o one --threads 1"));
    let whole = output(&folder.join("whole"));
    let same = |out: &str| {
        let other = output(&folder.join(out));
        assert_eq!(whole.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>(), "{out}");
        whole.iter().for_each(|(name, bytes)| assert!(*bytes == other[name], "{name} of {out}"));
    };
    same("one");
    kill_at(folder, &format!("{shot} -o killed"), "killed/surface/surface.0003.usdc");
    works(folder, &format!("{shot} -o killed"));
    same("killed");
    works(folder, &format!("{shot} -o part --frames 5-6"));
    works(folder, &format!("{shot} -o part"));
    same("part");
    let mut plain = command(folder, &format!("{shot} -o baseline"));
    assert!(plain.env("FRAZIL_CPU", "baseline").status().unwrap().success());
    same("baseline");
    // Any frame can be resumed from, with other steps but not from another start.
    works(folder, &format!("{shot} -o whole --from 4 --set surface.change=0.25"));
    fails(folder, &format!("{shot} -o whole"), 2, &["surface.change was 0.25"]);
    fails(folder, &format!("{shot} -o whole --from 4 --set surface.cell=1"), 2, &["surface.cell"]);
}

#[test]
fn a_cache_that_grows_gives_the_last_frame_its_velocities() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 3);
    works(folder, &format!("{SHOT} -o out"));
    let before = frame(folder, "out", 3);
    write_frame(&folder.join("ball.0004.bgeo"), &ball, 3.0, &["v", "id"]);
    works(folder, &format!("{SHOT} -o out"));
    let after = frame(folder, "out", 3);
    assert!(before.mesh == after.mesh && values(&before, "vx") != values(&after, "vx"));
    works(folder, &format!("{SHOT} -o again"));
    assert!(output(&folder.join("out")) == output(&folder.join("again")));
}

#[test]
fn a_sequence_may_start_later_and_run_faster_or_slower() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 5);
    let at = |out: &str, number: i32, time: f64| {
        let mesh = frame(folder, out, number).mesh;
        let off = mesh.positions.iter().zip(&ball.mesh.positions).map(|(position, first)| {
            (position.cast::<f64>() - motion(first.cast(), time)).norm() / ball.spacing
        });
        off.fold(0.0, f64::max)
    };
    works(folder, &format!("{SHOT} -o fast --set shot.frames=1-3 --set surface.speed=2"));
    assert!(at("fast", 3, 4.0) < 0.02);
    // Frames between those of the cache are on the way that the velocities say.
    works(folder, &format!("{SHOT} -o slow --set shot.frames=1-9 --set surface.speed=0.5"));
    assert!(at("slow", 4, 1.5) < 0.02 && at("slow", 9, 4.0) < 0.02, "{}", at("slow", 4, 1.5));
    works(folder, &format!("{SHOT} -o late --set shot.frames=101-105 --set surface.offset=100"));
    assert!(at("late", 105, 4.0) < 0.02);
    fails(folder, &format!("{SHOT} -o no --set surface.offset=1"), 2, &["ball.0000.bgeo"]);
}

#[test]
fn without_a_mesh_the_liquid_has_its_own_surface() {
    let folder = &Folder::empty();
    write_shot(folder, 3);
    works(folder, "surface -p ball.%04d.bgeo --spacing 0.01 -o out");
    let (first, last) = (frame(folder, "out", 1).mesh, frame(folder, "out", 3).mesh);
    assert!(first.is_manifold() && first.triangles == last.triangles);
    works(folder, "vdb from-particles ball.0001.bgeo --spacing 0.01 --mesh own.ply");
    assert_eq!(mesh::read(&folder.join("own.ply")).unwrap(), first);
}

#[test]
fn what_a_mesh_cannot_follow_is_refused_with_the_file() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 3);
    let refused = |arguments: &str, words: &[&str]| {
        fails(folder, &format!("{arguments} -o no"), 2, words);
        assert!(!folder.join("no").exists(), "{arguments}");
    };
    refused("surface -p none.%04d.bgeo -m ball.ply", &["none.%04d.bgeo", "no frame"]);
    refused("surface -p ball.%04d.bgeo -m ball.stl", &["ball.stl", "cannot read"]);
    refused("surface -p ball.%04d.bgeo -m ball.txt", &["mesh", ".ply"]);
    fs::write(folder.join("own.0001.bgeo.sc"), "scf1").unwrap();
    refused("surface -p own.%04d.bgeo.sc -m ball.ply", &["own.%04d.bgeo.sc", "Houdini"]);
    refused(&format!("{SHOT} --set surface.cel=1"), &["did you mean `cell`"]);
    refused("surface -p ball.0001.bgeo -m ball.ply --set shot.frames=1-2", &["never moves"]);
    // The mesh lies elsewhere.
    let mut far = ball.mesh.clone();
    far.positions.iter_mut().for_each(|position| position.x += 5.0);
    mesh::write(&folder.join("far.ply"), &far).unwrap();
    let said = ["far.ply", "0 %", "same space"];
    fails(folder, "surface -p ball.%04d.bgeo -m far.ply --spacing 0.01 -o far", 2, &said);
    // Nothing says where particles go.
    for frame in 1..=3 {
        write_frame(&folder.join(format!("plain.{frame:04}.bgeo")), &ball, f64::from(frame - 1), &[]);
    }
    refused(
        "surface -p plain.%04d.bgeo -m ball.ply --spacing 0.01",
        &["plain.0001.bgeo", "ids", "velocities"],
    );
    // A frame is cut, or gone.
    let bytes = fs::read(folder.join("ball.0002.bgeo")).unwrap();
    fs::write(folder.join("ball.0002.bgeo"), &bytes[..bytes.len() / 2]).unwrap();
    fails(folder, &format!("{SHOT} -o cut"), 1, &["ball.0002.bgeo"]);
    fs::remove_file(folder.join("ball.0002.bgeo")).unwrap();
    fails(folder, &format!("{SHOT} -o gap"), 1, &["ball.0002.bgeo"]);
    assert!(folder.join("gap/surface/surface.0001.usdc").exists());
    // Scenes of one system are not for the command of another.
    fs::write(
        folder.join("shot.toml"),
        "[shot]\nframes = \"1-2\"\n[surface]\nparticles = \"ball.%04d.bgeo\"\n[snow]\n",
    )
    .unwrap();
    refused("surface shot.toml", &["shot.toml:5", "one system"]);
    let snow =
        "[shot]\nframes = \"1-2\"\n[snow]\nground = 0\narea = [0, 0, 1, 1]\ndepth = 0.2\ncell = 0.05\n";
    fs::write(folder.join("snow.toml"), snow).unwrap();
    refused("surface snow.toml", &["snow.toml", "`surface` is missing"]);
}

#[test]
fn velocities_alone_are_enough_and_ids_alone_too() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 1);
    for (name, attributes) in [("fast", &["v"]), ("named", &["id"])] {
        for frame in 1..=4 {
            let file = folder.join(format!("{name}.{frame:04}.bgeo"));
            write_frame(&file, &ball, f64::from(frame - 1), attributes);
        }
        works(
            folder,
            &format!(
                "surface -p {name}.%04d.bgeo -m ball.ply --spacing 0.01 --set surface.rebuild=false -o {name}"
            ),
        );
        let mesh = frame(folder, name, 4).mesh;
        let far = |(position, first): (&frazil::geometry::Vec3, &frazil::geometry::Vec3)| {
            (position.cast::<f64>() - motion(first.cast(), 3.0)).norm() / ball.spacing
        };
        let most = mesh.positions.iter().zip(&ball.mesh.positions).map(far).fold(0.0, f64::max);
        assert!(most < 0.2, "{name}: {most}");
    }
}

#[test]
fn velocities_are_brought_into_the_shot_s_space_under_any_name() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 1);
    // Centimetres, Z up, all at 1 m/s upward; a number of another name comes first.
    for frame in 1..=2 {
        let places: Vec<DVec3> = ball
            .positions
            .iter()
            .map(|p| p + DVec3::new(0.0, f64::from(frame - 1) / 24.0, 0.0))
            .map(|p| DVec3::new(p.x, -p.z, p.y) * 100.0)
            .collect();
        let mut points = Points::at(1.0, &places).unwrap();
        let vel = Values::Float(Column::Uniform(3.0));
        points.attributes.push(Attribute { name: "vel".into(), values: vel });
        let speed = Values::Vector(Column::Uniform([0.0, 0.0, 100.0]));
        points.attributes.push(Attribute { name: "Velocity".into(), values: speed });
        particles::write(&folder.join(format!("up.{frame:04}.bgeo")), &points, false).unwrap();
    }
    let places = |p: &frazil::geometry::Vec3| frazil::geometry::Vec3::new(p.x, -p.z, p.y) * 100.0;
    let positions = ball.mesh.positions.iter().map(places).collect();
    let mesh = TriMesh { positions, triangles: ball.mesh.triangles.clone() };
    mesh::write(&folder.join("up.ply"), &mesh).unwrap();
    let space = "--set surface.scale=0.01 --set surface.up=z";
    works(folder, &format!("surface -p up.%04d.bgeo -m up.ply --spacing 0.01 -o out {space}"));
    let now = frame(folder, "out", 1);
    for vertex in 0..now.mesh.positions.len() {
        let speed = ["vx", "vy", "vz"].map(|name| values(&now, name)[vertex]);
        assert!((speed[1] - 1.0).abs() < 0.01 && speed[0].abs() + speed[2].abs() < 0.01, "{speed:?}");
    }
}

#[test]
fn what_lies_beyond_the_shot_does_not_keep_its_last_frame() {
    let folder = &Folder::empty();
    write_shot(folder, 4);
    fs::copy(folder.join("ball.0004.bgeo"), folder.join("ball.0007.bgeo")).unwrap();
    // A gap on the way to the frame behind the last one.
    works(folder, &format!("{SHOT} -o gap --set shot.frames=1-2 --set surface.speed=3"));
    assert!(folder.join("gap/surface/surface.0002.usdc").exists());
    // A file that is being written.
    let bytes = fs::read(folder.join("ball.0004.bgeo")).unwrap();
    fs::write(folder.join("ball.0004.bgeo"), &bytes[..bytes.len() / 2]).unwrap();
    let said = works(folder, &format!("{SHOT} -o half --set shot.frames=1-3"));
    assert!(said.contains("ball.0004.bgeo") && said.contains("the velocities of the frame before"), "{said}");
    // One frame of positions alone is a shot too.
    works(folder, "convert ball.0001.bgeo still.xyz");
    works(folder, "surface -p still.xyz -m ball.ply --spacing 0.01 -o still");
    assert!(values(&frame(folder, "still", 1), "vx").iter().all(|speed| *speed == 0.0));
}

#[test]
fn detail_may_be_painted_in_bytes_and_only_counts_where_it_fades() {
    let folder = &Folder::empty();
    let ball = write_shot(folder, 2);
    let paint = |number, value: f64| {
        let values = ball.mesh.positions.iter().map(|p| if p.x > 0.0 { value } else { 0.0 }).collect();
        let arrays = vec![array("detail", On::Vertices, number, values)];
        write_mesh(&folder.join("ball.ply"), &DetailedMesh { mesh: ball.mesh.clone(), uvs: None, arrays });
    };
    paint(Number::U8, 255.0);
    works(folder, &format!("{SHOT} -o fades --set surface.half_life=0.01"));
    let now = frame(folder, "fades", 2);
    let first = frame(folder, "fades", 1);
    let share = |vertex: usize| values(&now, "delta")[vertex] / values(&first, "delta")[vertex];
    let on =
        |right: bool| (0..ball.mesh.positions.len()).find(|n| (ball.mesh.positions[*n].x > 0.0) == right);
    assert!(share(on(true).unwrap()) == 1.0 && share(on(false).unwrap()) < 0.1);
    paint(Number::F32, 7.0);
    works(folder, &format!("{SHOT} -o stays"));
    fails(folder, &format!("{SHOT} -o no --set surface.half_life=1"), 2, &["ball.ply", "detail of vertex"]);
}

#[test]
fn check_reads_every_file_and_says_what_there_is() {
    let folder = &Folder::empty();
    write_shot(folder, 3);
    let scene = "[shot]\nframes = \"1-3\"\n[surface]\nparticles = \"ball.%04d.bgeo\"\nmesh = \"ball.ply\"\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    let said = works(folder, "check shot.toml");
    for words in ["3 files of 552 particles", "ids and velocities", "1200 triangles", "estimated"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    works(folder, "surface shot.toml -o out");
    works(folder, "surface out/scene.toml -o again");
    assert!(output(&folder.join("out")) == output(&folder.join("again")));
}
