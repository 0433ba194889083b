//! `frazil surface` with meshes that were edited by hand in the middle of the shot.

use std::fs;
use std::path::Path;

use frazil::geometry::mesh::attributes::{MeshArray, Number, On};
use frazil::geometry::{DVec3, DetailedMesh, TriMesh, Vec3};
use frazil::io::mesh;

use crate::common::character::{are_same, output};
use crate::common::followed::{array, counted, frame, report, seamed, values, write_mesh};
use crate::common::liquids::{ball, write_cache, write_numbered};
use crate::program::{Folder, fails, kill_at, works};

/// Distance between particles (m), and frames of the shot.
const SPACING: f64 = 0.01;
const FRAMES: i32 = 6;
/// Height of a bump (spacings).
const BUMP: f64 = 0.8;

const SHOT: &str = "surface -p ball.%04d.bgeo -m ball.ply --spacing 0.01 --set surface.rebuild=false";
const REBUILT: &str = "surface -p ball.%04d.bgeo -m ball.ply --spacing 0.01";
const SCULPTS: &str = "--set surface.resculpt=sculpts/ball.%04d.ply";

/// The middle of the ball at a frame (m), as its cache has it.
fn middle(frame: i32) -> DVec3 {
    DVec3::new(0.002, -0.001, 0.0) * f64::from(frame - 1)
}

/// The cache of a ball that travels, with a mesh that carries colours, masks and texture coordinates with seams.
fn write_shot(folder: &Path) {
    let ball = ball(5.0, 10, 0.25);
    write_cache(folder, "ball", &ball, FRAMES);
    let (vertices, faces) = (ball.mesh.positions.len(), ball.mesh.triangles.len());
    let arrays = vec![
        array("red", On::Vertices, Number::U8, counted(vertices)),
        array("mask", On::Vertices, Number::F64, counted(vertices)),
        array("part", On::Faces, Number::I32, counted(faces)),
    ];
    write_mesh(&folder.join("ball.ply"), &DetailedMesh { mesh: ball.mesh, uvs: Some(seamed(faces)), arrays });
    fs::create_dir(folder.join("sculpts")).unwrap();
}

/// A mesh of the ball at a frame, of other triangles, with a bump of a height (spacings) along z.
fn edited(frame: i32, height: f64) -> TriMesh {
    let mut mesh = ball(5.0, 8, 0.0).mesh;
    for position in &mut mesh.positions {
        let unit = position.cast::<f64>().normalize();
        let share = ((unit.z - 0.7) / 0.3).clamp(0.0, 1.0);
        *position = (unit * ((5.0 + height * share) * SPACING) + middle(frame)).cast();
    }
    mesh
}

fn write_sculpt(folder: &Path, frame: i32, mesh: TriMesh, arrays: Vec<MeshArray>) {
    let path = folder.join(format!("sculpts/ball.{frame:04}.ply"));
    write_mesh(&path, &DetailedMesh { mesh, uvs: None, arrays });
}

/// How far a mesh reaches from the middle of the ball along z (spacings).
fn reach(mesh: &TriMesh, frame: i32) -> f64 {
    let along = mesh.positions.iter().map(|position| (position.cast::<f64>() - middle(frame)).z / SPACING);
    along.fold(0.0, f64::max)
}

/// Whether the report of each frame says that an edited mesh took the place of the tracked one.
fn resculpted(folder: &Path, out: &str) -> Vec<bool> {
    let of_frame = |frame: i32| {
        let report = report(folder, out, frame);
        report["resculpted"].as_bool().unwrap_or_else(|| panic!("frame {frame}: {}", report["resculpted"]))
    };
    (1..=FRAMES).map(of_frame).collect()
}

/// Records say from which frame on a shot was made again.
fn is_no_record(name: &str) -> bool {
    !name.ends_with(".json")
}

#[test]
fn a_mesh_that_was_sculpted_takes_the_position_of_the_tracked_one() {
    let folder = &Folder::empty();
    write_shot(folder);
    let sculpt = edited(3, BUMP);
    let (vertices, faces) = (sculpt.positions.len(), sculpt.triangles.len());
    let arrays = vec![
        array("heat", On::Vertices, Number::F32, vec![1.0; vertices]),
        array("mask", On::Vertices, Number::I16, counted(vertices)),
        array("red", On::Vertices, Number::F32, vec![0.5; vertices]),
    ];
    write_sculpt(folder, 3, sculpt.clone(), arrays);
    works(folder, &format!("{SHOT} -o plain"));
    let said = works(folder, &format!("{SHOT} {SCULPTS} -o out"));
    let path = "ball.0003.ply: ";
    for words in [
        &format!("{path}lacks what the first frame's mesh carries: part, texture coordinates"),
        &format!("{path}carries what the first frame's mesh does not, which is left out: heat"),
    ] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    // Nothing before it knows of it: not even velocities.
    for number in 1..=2 {
        let name = format!("surface/surface.{number:04}.usdc");
        let [plain, out] = ["plain", "out"].map(|run| fs::read(folder.join(run).join(&name)).unwrap());
        assert!(plain == out, "frame {number}");
    }
    let plain = reach(&frame(folder, "plain", FRAMES).mesh, FRAMES);
    let height = reach(&sculpt, 3);
    assert!(height > plain + 0.5, "{plain} {height}");
    for number in 3..=FRAMES {
        let now = frame(folder, "out", number);
        assert!(now.mesh.triangles == sculpt.triangles, "frame {number}");
        assert!(number > 3 || now.mesh.positions == sculpt.positions);
        let is = reach(&now.mesh, number);
        assert!((is - height).abs() < 0.2, "{is} at frame {number}, {height} before");
        assert!(values(&now, "mask") == counted(vertices), "frame {number}");
        assert!(values(&now, "red").iter().all(|red| *red == 128.0), "frame {number}");
        let part = values(&now, "part");
        assert!(part.len() == faces && part.iter().all(|part| *part == 0.0), "frame {number}");
        assert!(now.arrays.iter().all(|array| array.name != "heat"), "frame {number}");
        let uvs = now.uvs.as_ref().expect("texture coordinates");
        assert!(uvs.coordinates.iter().all(|position| *position == [0.0; 2]), "frame {number}");
        // Velocities lead to the next frame.
        if number < FRAMES {
            let next = frame(folder, "out", number + 1).mesh;
            let speed = ["vx", "vy", "vz"].map(|name| values(&now, name));
            for (vertex, position) in now.mesh.positions.iter().enumerate() {
                let by = DVec3::new(speed[0][vertex], speed[1][vertex], speed[2][vertex]) / 24.0;
                let off =
                    (position.cast::<f64>() + by - next.positions[vertex].cast::<f64>()).norm() / SPACING;
                assert!(off < 1e-4, "{off} spacings at frame {number}, vertex {vertex}");
            }
        }
    }
}

/// Centimetres, Z up, as the files of `up` have them.
fn theirs(position: DVec3) -> DVec3 {
    DVec3::new(position.x, -position.z, position.y) * 100.0
}

/// A mesh in that space.
fn write_theirs(path: &Path, mesh: &TriMesh) {
    let position = |position: &Vec3| -> Vec3 { theirs(position.cast()).cast() };
    let positions = mesh.positions.iter().map(position).collect();
    mesh::write(path, &TriMesh { positions, triangles: mesh.triangles.clone() }).unwrap();
}

#[test]
fn a_sculpt_of_another_format_or_in_another_space_is_the_same_mesh() {
    let folder = &Folder::empty();
    write_shot(folder);
    let sculpt = edited(3, BUMP);
    write_sculpt(folder, 3, sculpt.clone(), Vec::new());
    mesh::write(&folder.join("sculpts/ball.0003.obj"), &sculpt).unwrap();
    write_theirs(&folder.join("sculpts/up.0003.ply"), &sculpt);
    let ball = ball(5.0, 10, 0.25);
    write_theirs(&folder.join("up.ply"), &ball.mesh);
    for frame in 1..=FRAMES {
        let positions: Vec<DVec3> =
            ball.positions.iter().map(|position| theirs(position + middle(frame))).collect();
        write_numbered(&folder.join(format!("up.{frame:04}.bgeo")), &positions, 0);
    }
    works(folder, &format!("{SHOT} -o plain"));
    assert_eq!(resculpted(folder, "plain"), [false; FRAMES as usize]);
    works(folder, &format!("{SHOT} {SCULPTS} -o ply"));
    works(folder, &format!("{SHOT} --set surface.resculpt=sculpts/ball.%04d.obj -o obj"));
    let up = SHOT.replace("ball", "up");
    let space = "--set surface.scale=0.01 --set surface.up=z";
    works(folder, &format!("{up} {space} --set surface.resculpt=sculpts/up.%04d.ply -o up"));
    for out in ["ply", "obj", "up"] {
        assert_eq!(resculpted(folder, out), [false, false, true, false, false, false], "{out}");
    }
    for number in 1..=FRAMES {
        let [wanted, obj, up] = ["ply", "obj", "up"].map(|out| frame(folder, out, number).mesh);
        assert!((wanted.triangles == sculpt.triangles) == (number >= 3), "frame {number}");
        assert!(obj == wanted, "frame {number}");
        assert!(up.triangles == wanted.triangles, "frame {number}");
        for (vertex, (is, position)) in up.positions.iter().zip(&wanted.positions).enumerate() {
            // What rounding to 32 bits leaves.
            let off = (is.cast::<f64>() - position.cast::<f64>()).norm() / SPACING;
            assert!(off < 1e-3, "{off} spacings at frame {number}, vertex {vertex}");
        }
    }
}

#[test]
fn threads_kills_and_frames_made_again_give_the_same_bytes() {
    for shot in [SHOT, REBUILT] {
        let folder = &Folder::empty();
        write_shot(folder);
        write_sculpt(folder, 3, edited(3, BUMP), Vec::new());
        write_sculpt(folder, 5, edited(5, 0.5 * BUMP), Vec::new());
        let shot = format!("{shot} {SCULPTS} --set output.surface=[\"ply\",\"usd\",\"obj\"]");
        works(folder, &format!("{shot} -o whole --threads 2"));
        let whole = output(&folder.join("whole"));
        works(folder, &format!("{shot} -o one --threads 1"));
        are_same(&whole, &folder.join("one"), |_| true);
        kill_at(folder, &format!("{shot} -o killed"), "killed/surface/surface.0002.usdc");
        works(folder, &format!("{shot} -o killed"));
        are_same(&whole, &folder.join("killed"), |_| true);
        for from in [6, 4, 3] {
            works(folder, &format!("{shot} -o one --from {from}"));
            are_same(&whole, &folder.join("one"), is_no_record);
        }
        let reaches = [2, 4, 6].map(|number| reach(&frame(folder, "whole", number).mesh, number));
        assert!(reaches[1] > reaches[2] + 0.2 && reaches[2] > reaches[0] + 0.2, "{reaches:?}");
    }
}

#[test]
fn a_sculpt_that_changes_comes_or_goes_is_noticed() {
    let folder = &Folder::empty();
    write_shot(folder);
    let shot = format!("{SHOT} {SCULPTS}");
    let again = |from: i32| {
        let words = [&format!("inputs of frame {from} have changed"), &format!("--from {from} ")];
        fails(folder, &format!("{shot} -o out"), 2, &words.map(String::as_str));
        works(folder, &format!("{shot} -o out --from {from}"));
        let fresh = format!("fresh{}", fs::read_dir(folder).unwrap().count());
        works(folder, &format!("{shot} -o {fresh}"));
        are_same(&output(&folder.join(&fresh)), &folder.join("out"), is_no_record);
    };
    // A shot that is done has none yet.
    works(folder, &format!("{SHOT} -o out"));
    write_sculpt(folder, 3, edited(3, BUMP), Vec::new());
    fails(folder, &format!("{shot} -o out"), 2, &["surface.resculpt was not set", "--from N"]);
    works(folder, &format!("{shot} -o out --from 3"));
    works(folder, &format!("{shot} -o fresh"));
    are_same(&output(&folder.join("fresh")), &folder.join("out"), is_no_record);
    // Another one.
    write_sculpt(folder, 3, edited(3, 0.5 * BUMP), Vec::new());
    again(3);
    // One more, and one less.
    write_sculpt(folder, 5, edited(5, BUMP), Vec::new());
    again(5);
    fs::remove_file(folder.join("sculpts/ball.0005.ply")).unwrap();
    again(5);
}

#[test]
fn an_open_sculpt_is_closed_where_the_mesh_is_rebuilt() {
    let folder = &Folder::empty();
    write_shot(folder);
    let mut open = edited(3, BUMP);
    open.triangles.truncate(open.triangles.len() - 2);
    write_sculpt(folder, 3, open.clone(), Vec::new());
    let said = works(folder, &format!("{REBUILT} {SCULPTS} -o closed --set shot.frames=1-4"));
    let line = said.lines().find(|line| line.contains("sculpts/ball.0003.ply") && line.contains("repaired"));
    assert!(line.is_some_and(|line| line.contains("as they were")), "{said}");
    for number in 3..=4 {
        let mesh = frame(folder, "closed", number).mesh;
        assert!(mesh.is_manifold(), "frame {number}");
        assert!(reach(&mesh, number) > 5.0 + 0.5 * BUMP, "frame {number}");
    }
    let said = works(folder, &format!("{SHOT} {SCULPTS} -o open --set shot.frames=1-4"));
    assert!(said.contains("ball.0003.ply: has") && said.contains("it follows as it is"), "{said}");
    assert!(frame(folder, "open", 4).mesh.triangles == open.triangles);
}

#[test]
fn what_is_painted_to_last_on_a_sculpt_does_not_fade() {
    let folder = &Folder::empty();
    write_shot(folder);
    let shot = format!("{SHOT} {SCULPTS} --set surface.half_life=0.05");
    let sculpt = edited(3, BUMP);
    let vertices = sculpt.positions.len();
    let painted = |number, share: f64| vec![array("detail", On::Vertices, number, vec![share; vertices])];
    let last = |out: &str| reach(&frame(folder, out, FRAMES).mesh, FRAMES);
    write_sculpt(folder, 3, sculpt.clone(), Vec::new());
    works(folder, &format!("{shot} -o fades"));
    write_sculpt(folder, 3, sculpt.clone(), painted(Number::U8, 255.0));
    works(folder, &format!("{shot} -o stays"));
    let (fades, stays) = (last("fades"), last("stays"));
    assert!((stays - reach(&sculpt, 3)).abs() < 0.2 && fades < stays - 0.5 * BUMP, "{fades} {stays}");
    write_sculpt(folder, 3, sculpt, painted(Number::F32, 7.0));
    fails(folder, &format!("{shot} -o no"), 2, &["ball.0003.ply", "detail of vertex 1 is 7"]);
}

#[test]
fn what_is_no_sculpt_is_refused_with_the_key_or_the_file() {
    let folder = &Folder::empty();
    write_shot(folder);
    let shot = |pattern: &str, out: &str| format!("{SHOT} --set surface.resculpt={pattern} -o {out}");
    let refused = |pattern: &str, words: &[&str]| {
        fails(folder, &shot(pattern, "no"), 2, words);
        assert!(!folder.join("no").exists(), "{pattern}");
    };
    // No position for the frame's number.
    for one in ["ball.ply", "sculpts/none.ply"] {
        refused(one, &[one, "surface.resculpt", "place for the frame's number"]);
    }
    let words = ["sculpts/none.%04d.ply", "no edited mesh", "surface.resculpt", "after its first, 1"];
    refused("sculpts/none.%04d.ply", &words);
    let sculpt = edited(1, BUMP);
    mesh::write(&folder.join("sculpts/first.0001.ply"), &sculpt).unwrap();
    mesh::write(&folder.join("sculpts/first.0003.ply"), &sculpt).unwrap();
    refused("sculpts/first.%04d.ply", &["first.0001.ply", "surface.mesh", "surface.resculpt"]);
    // Only beyond the shot.
    mesh::write(&folder.join("sculpts/late.0007.ply"), &sculpt).unwrap();
    refused("sculpts/late.%04d.ply", &["late.%04d.ply", "no edited mesh"]);
    fs::write(folder.join("sculpts/cut.0003.ply"), "ply\n").unwrap();
    refused("sculpts/cut.%04d.ply", &["cut.0003.ply"]);
    // It lies elsewhere, which is seen when its frame comes.
    let mut far = edited(3, BUMP);
    far.positions.iter_mut().for_each(|position| position.x += 5.0);
    mesh::write(&folder.join("sculpts/far.0003.ply"), &far).unwrap();
    fails(folder, &shot("sculpts/far.%04d.ply", "far"), 1, &["far.0003.ply", "same space"]);
}
