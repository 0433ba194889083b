//! `frazil surface` where the liquid merges, splits, appears and is gone: the mesh is cut and rebuilt there, with all that it carries.

use crate::common::skip::skipped;
use std::fs;
use std::path::Path;

use frazil::geometry::check::topology::{Topology, components};
use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::{DVec3, DetailedMesh, TriMesh, Uvs, Vec3};
use frazil::io::mesh;
use serde_json::json;

use crate::common::character::{are_same, output};
use crate::common::clients;
use crate::common::followed::{array, frame, reported, values, write_mesh};
use crate::common::liquids::{ball, write_numbered};
use crate::common::shapes::welded;
use crate::common::usda::{self, numbers};
use crate::program::{Folder, kill_at, works};

/// Initial distance between particles (m).
const SPACING: f64 = 0.01;
/// A ball's mesh is made of the six sides of a cube, with so many squares along an edge.
const SIDE: usize = 10;
/// Triangles of one of these sides: a chart of the texture coordinates.
const CHART: usize = 2 * SIDE * SIDE;
/// Frames of the shot, and the one in which the balls are nearest to each other.
const FRAMES: i32 = 24;
const NEAREST: i32 = 11;
/// Up to this frame nothing merges.
const APART: i32 = 3;
/// What is farther than this from the plane in which the balls meet at the first frame (spacings) stays as it is.
const FAR: f64 = 6.0;

const SHOT: &str = "surface -p two.%04d.bgeo -m two.ply --spacing 0.01";
/// Its first half, in which the balls meet.
const MEETING: &str = "surface -p two.%04d.bgeo -m two.ply --spacing 0.01 --set shot.frames=1-14";

/// Where the middle of one of the balls is at a frame (m); they are on the sides -1 and 1 of the plane x = 0.
fn middle(side: f64, frame: i32) -> DVec3 {
    let nearer = f64::from(NEAREST - 1 - (frame - NEAREST).abs());
    DVec3::new(7.25 - 0.25 * nearer, 0.1, 0.2) * (SPACING * side)
}

/// A mesh with colours, another number of its own for each vertex and each triangle, and texture coordinates in charts: u is the
/// number of the chart, give or take less than a half.
fn detailed(mesh: TriMesh) -> DetailedMesh {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let counted = |count: usize| -> Vec<f64> { (0..count).map(|n| n as f64).collect() };
    let colour = |by: usize| -> Vec<f64> { (0..vertices).map(|n| (by * n % 251) as f64).collect() };
    let arrays = vec![
        array("red", On::Vertices, Number::U8, colour(1)),
        array("green", On::Vertices, Number::U8, colour(3)),
        array("blue", On::Vertices, Number::U8, colour(7)),
        array("mask", On::Vertices, Number::F64, counted(vertices)),
        array("part", On::Faces, Number::I32, counted(faces)),
    ];
    let position = |(corner, vertex): (usize, &u32)| {
        let position = mesh.positions[*vertex as usize];
        [(corner / (3 * CHART)) as f32 + position.y, position.z - position.x]
    };
    let positions = mesh.triangles.as_flattened().iter().enumerate().map(position).collect();
    let uvs = Uvs { coordinates: positions, corners: Some((0..3 * faces as u32).collect()), missing: 0 };
    DetailedMesh { mesh, uvs: Some(uvs), arrays }
}

/// The cache of two balls that meet and part, two.%04d.bgeo, with a mesh, two.ply.
fn write_shot(folder: &Path) -> DetailedMesh {
    let one = ball(5.0, SIDE, 0.1);
    for frame in 1..=FRAMES {
        let moved = |side: f64| one.positions.iter().map(move |place| place + middle(side, frame));
        let places: Vec<DVec3> = moved(-1.0).chain(moved(1.0)).collect();
        write_numbered(&folder.join(format!("two.{frame:04}.bgeo")), &places, 0);
    }
    let whole = welded(&one.mesh);
    let mut both = TriMesh::default();
    for side in [-1.0, 1.0] {
        let moved = |place: &Vec3| (place.cast::<f64>() + middle(side, 1)).cast::<f32>();
        let positions = whole.positions.iter().map(moved).collect();
        both.append(&TriMesh { positions, triangles: whole.triangles.clone() });
    }
    let detail = detailed(both);
    let path = folder.join("two.ply");
    write_mesh(&path, &detail);
    // As the program reads it.
    mesh::read_detailed(&path).unwrap()
}

/// The texture coordinates of a triangle's corners.
fn coordinates(mesh: &DetailedMesh, triangle: usize) -> [[f32; 2]; 3] {
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    uvs.indices(&mesh.mesh.triangles, triangle).map(|index| uvs.coordinates[index as usize])
}

#[track_caller]
fn is_whole(mesh: &TriMesh, frame: i32) {
    let topology = Topology::of(mesh.positions.len(), &mesh.triangles);
    assert!(topology.is_watertight(), "frame {frame}: {topology:?}");
    let is_finite = |position: &Vec3| position.iter().all(|x| x.is_finite());
    assert!(mesh.positions.iter().all(is_finite), "frame {frame}");
}

/// Whether the mesh of two balls has a number for everything in a frame, and no triangle across a seam: each is of a chart, which is
/// that of the triangle that its number names.
#[track_caller]
fn carries_all(now: &DetailedMesh, first: &DetailedMesh, frame: i32) {
    let (vertices, faces) = (now.mesh.positions.len(), now.mesh.triangles.len());
    for name in ["red", "green", "blue", "mask", "vx", "vy", "vz", "delta", "flagged"] {
        let values = values(now, name);
        assert_eq!(values.len(), vertices, "{name} at frame {frame}");
        assert!(values.iter().all(|value| value.is_finite()), "{name} at frame {frame}");
    }
    let part = values(now, "part");
    assert_eq!(part.len(), faces, "frame {frame}");
    for (triangle, number) in part.iter().enumerate() {
        assert!((0.0..first.mesh.triangles.len() as f64).contains(number), "part {number} at frame {frame}");
        let chart = (*number as usize / CHART) as f32;
        let positions = coordinates(now, triangle);
        let is_there = |[u, v]: &[f32; 2]| (u - chart).abs() < 0.5 && v.is_finite();
        assert!(positions.iter().all(is_there), "{positions:?} of chart {chart} at frame {frame}");
    }
}

/// Whether what is far from the plane in which the balls meet is where its ball is in a frame, with the same numbers bit for bit.
#[track_caller]
fn far_is_as_it_was(now: &DetailedMesh, first: &DetailedMesh, frame: i32) {
    let is_far = |vertex: u32| f64::from(first.mesh.positions[vertex as usize].x.abs()) > FAR * SPACING;
    let mut names: Vec<Option<u32>> = vec![None; now.mesh.positions.len()];
    for (vertex, position) in (0..).zip(&first.mesh.positions).filter(|(vertex, _)| is_far(*vertex)) {
        let side = f64::from(position.x.signum());
        let there = position.cast::<f64>() + middle(side, frame) - middle(side, 1);
        let off = now.mesh.positions.iter().map(|position| (position.cast::<f64>() - there).norm() / SPACING);
        let (at, nearest) = off.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!(nearest < 0.1, "vertex {vertex} is gone at frame {frame}: {nearest} spacings");
        for name in ["red", "green", "blue", "mask"] {
            let [was, is] = [values(first, name)[vertex as usize], values(now, name)[at]];
            assert_eq!(was, is, "{name} of vertex {vertex} at frame {frame}");
        }
        names[at] = Some(vertex);
    }
    let mut stayed = 0;
    for (triangle, corners) in now.mesh.triangles.iter().enumerate() {
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| names[corner as usize]) else { continue };
        let number = values(now, "part")[triangle] as usize;
        let (own, positions) = (first.mesh.triangles[number], coordinates(first, number));
        for (vertex, is) in [a, b, c].into_iter().zip(coordinates(now, triangle)) {
            let corner = own.iter().position(|other| *other == vertex);
            let corner = corner.unwrap_or_else(|| panic!("triangle {number} at frame {frame}: {own:?}"));
            assert_eq!(positions[corner], is, "triangle {number} at frame {frame}");
        }
        stayed += 1;
    }
    let all = first.mesh.triangles.iter().filter(|corners| corners.iter().all(|corner| is_far(*corner)));
    assert_eq!(stayed, all.count(), "frame {frame}");
    assert!(stayed > 1000, "{stayed}");
}

#[test]
fn balls_meet_and_part_and_the_rest_of_the_mesh_stays_as_it_is() {
    let folder = &Folder::empty();
    let first = write_shot(folder);
    let said = works(folder, &format!("{SHOT} -o out --set output.surface=[\"ply\"]"));
    assert!(!said.contains("repaired"), "{said}");
    let (mut parts, mut rebuilt, mut made) = (Vec::new(), 0, 0);
    // Frames in which more than the cells at fault, and those that they need, had to be rebuilt.
    let mut fallen_back = Vec::new();
    for number in 1..=FRAMES {
        let now = frame(folder, "out", number);
        is_whole(&now.mesh, number);
        carries_all(&now, &first, number);
        far_is_as_it_was(&now, &first, number);
        parts.push(components(&now.mesh.triangles).len());
        let told = |key: &str| reported(folder, "out", number, key);
        let counts = ["changed_cells", "rebuilt_cells", "made_triangles"].map(told);
        assert_eq!(told("vertices"), now.mesh.positions.len() as u64, "frame {number}");
        if told("rebuilt_rung") > 0 {
            fallen_back.push(number);
        }
        if number <= APART {
            assert_eq!(counts, [0; 3], "frame {number}");
            assert!(now.mesh.triangles == first.mesh.triangles && now.uvs == first.uvs, "frame {number}");
        }
        assert_eq!(counts[0] > 0, counts[1] > 0, "frame {number}: {counts:?}");
        assert_eq!(told("matching_iterations") > 0, counts[1] > 0, "frame {number}: {counts:?}");
        rebuilt += usize::from(counts[0] > 0);
        made += counts[2];
    }
    assert!(rebuilt > 1 && made > 0, "{rebuilt} frames, {made} triangles");
    assert!(fallen_back.is_empty(), "{fallen_back:?}");
    // Between the balls there may be a part of its own, a drop, while they meet.
    let at = |frame: i32| parts[frame as usize - 1];
    assert_eq!([at(1), at(APART), at(NEAREST), at(FRAMES)], [2, 2, 1, 2], "{parts:?}");
}

#[test]
fn velocities_lead_to_the_next_frame_and_stay_small_where_it_is_another_mesh() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(folder, &format!("{SHOT} -o out"));
    let ways = |now: &DetailedMesh| -> Vec<DVec3> {
        let [x, y, z] = ["vx", "vy", "vz"].map(|name| values(now, name));
        (0..x.len()).map(|vertex| DVec3::new(x[vertex], y[vertex], z[vertex]) / 24.0).collect()
    };
    let (mut same, mut others) = (0, 0);
    let mut now = frame(folder, "out", 1);
    for number in 1..=FRAMES {
        let ways = ways(&now);
        let most = ways.iter().map(|way| way.norm() / SPACING).fold(0.0, f64::max);
        assert!(ways.iter().all(|way| way.norm().is_finite()) && most < 3.0, "frame {number}: {most}");
        assert!(most > 0.1, "frame {number}: {most}");
        if number == FRAMES {
            break;
        }
        let next = frame(folder, "out", number + 1);
        if now.mesh.triangles == next.mesh.triangles {
            same += 1;
            for (vertex, (position, then)) in now.mesh.positions.iter().zip(&next.mesh.positions).enumerate()
            {
                let off = (position.cast::<f64>() + ways[vertex] - then.cast::<f64>()).norm() / SPACING;
                assert!(off < 1e-5, "{off} spacings at frame {number}, vertex {vertex}");
            }
        } else {
            others += 1;
        }
        now = next;
    }
    assert!(same > 0 && others > 1, "{same} {others}");
}

#[test]
fn threads_kills_and_frames_made_again_give_the_same_bytes() {
    let folder = &Folder::empty();
    write_shot(folder);
    let shot = format!("{MEETING} --set output.surface=[\"ply\",\"usd\",\"obj\"]");
    works(folder, &format!("{shot} -o whole --threads 2"));
    let triangles = |number: i32| frame(folder, "whole", number).mesh.triangles;
    assert!(
        triangles(1) != triangles(5) && triangles(5) != triangles(8),
        "changes before frame 6, and after"
    );
    let whole = output(&folder.join("whole"));
    let path = |out: &str| folder.join(out);
    works(folder, &format!("{shot} -o one --threads 1"));
    are_same(&whole, &path("one"), |_| true);
    kill_at(folder, &format!("{shot} -o killed"), "killed/surface/surface.0006.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(&whole, &path("killed"), |_| true);
    // Resumed from a mesh that was rebuilt. Records say from which frame on it was made again.
    for from in [6, 12] {
        works(folder, &format!("{shot} -o one --from {from}"));
        are_same(&whole, &path("one"), |name| !name.ends_with(".json"));
    }
}

#[test]
fn a_mesh_that_is_not_rebuilt_keeps_its_triangles_and_is_flagged() {
    let folder = &Folder::empty();
    let first = write_shot(folder);
    works(folder, &format!("{MEETING} -o out --set surface.rebuild=false --set output.surface=[\"ply\"]"));
    let mut flagged = 0;
    for number in 1..=14 {
        let now = frame(folder, "out", number);
        assert!(now.mesh.triangles == first.mesh.triangles, "frame {number}");
        assert!(now.mesh.positions.len() == first.mesh.positions.len() && now.uvs == first.uvs);
        for own in &first.arrays {
            assert!(now.arrays.contains(own), "{} at frame {number}", own.name);
        }
        for key in ["changed_cells", "rebuilt_cells", "made_triangles", "matching_iterations"] {
            assert_eq!(reported(folder, "out", number, key), 0, "{key} at frame {number}");
        }
        flagged += values(&now, "flagged").iter().filter(|flag| **flag == 1.0).count();
    }
    assert!(flagged > 0);
}

#[test]
fn an_open_mesh_is_closed_first_and_that_is_said() {
    let folder = &Folder::empty();
    let mut open = write_shot(folder).mesh;
    // Two holes, of two triangles and of one.
    for triangle in [1230, 201, 200] {
        open.triangles.remove(triangle);
    }
    mesh::write(&folder.join("open.ply"), &open).unwrap();
    let shot = "surface -p two.%04d.bgeo -m open.ply --spacing 0.01 --set shot.frames=1-2";
    let said = works(folder, &format!("{shot} -o closed"));
    let faces = open.triangles.len();
    let before = said.split_once(&format!(" of {faces} triangles are as they were"));
    let (before, _) = before.unwrap_or_else(|| panic!("{said}"));
    assert!(before.contains("open.ply") && before.contains("was repaired"), "{said}");
    let kept: usize = before.rsplit(' ').next().unwrap().parse().unwrap();
    assert!((faces - 50..=faces).contains(&kept), "{said}");
    for number in 1..=2 {
        is_whole(&frame(folder, "closed", number).mesh, number);
    }
    let said = works(folder, &format!("{shot} -o open --set surface.rebuild=false"));
    assert!(!said.contains("repaired"), "{said}");
    for words in ["open.ply", "open edges", "it follows as it is"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    assert!(frame(folder, "open", 2).mesh.triangles == open.triangles);
}

/// Name, type and interpolation of the primvars besides texture coordinates, and the arrays of a .ply that hold them.
const PRIMVARS: [(&str, &str, &str, &[&str]); 6] = [
    ("displayColor", "color3f[]", "vertex", &["red", "green", "blue"]),
    ("mask", "double[]", "vertex", &["mask"]),
    ("part", "int[]", "uniform", &["part"]),
    ("delta", "float[]", "vertex", &["delta"]),
    ("flagged", "int[]", "vertex", &["flagged"]),
    ("rebuilt", "int[]", "uniform", &["rebuilt"]),
];

#[test]
fn usd_has_other_faces_from_frame_to_frame_and_primvars_that_fit_them() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(folder, &format!("{SHOT} -o out --set shot.frames=1-7 --set output.surface=[\"ply\",\"usd\"]"));
    let file = |name: &str| folder.join("out").join(name);
    let python = clients::usd_python();
    let mut all = Vec::new();
    for number in 1..=7 {
        let text = usda::text(&file(&format!("surface/surface.{number:04}.usdc")));
        let (points, counts) = (numbers(&text, "points").len() / 3, numbers(&text, "faceVertexCounts"));
        let indices = numbers(&text, "faceVertexIndices");
        let made = frame(folder, "out", number);
        assert_eq!((points, counts.len()), (made.mesh.positions.len(), made.mesh.triangles.len()));
        assert!(counts.iter().all(|count| *count == 3.0) && indices.len() == 3 * counts.len());
        assert!(indices.iter().all(|index| (0.0..points as f32).contains(index)), "frame {number}");
        assert_eq!(numbers(&text, "velocities").len(), 3 * points, "frame {number}");
        let (positions, corners) =
            (numbers(&text, "primvars:st").len() / 2, numbers(&text, "primvars:st:indices"));
        assert_eq!(corners.len(), indices.len(), "frame {number}");
        assert!(corners.iter().all(|corner| (0.0..positions as f32).contains(corner)), "frame {number}");
        let mut wanted = serde_json::Map::new();
        for (name, class, interpolation, arrays) in PRIMVARS {
            let count = if interpolation == "vertex" { points } else { counts.len() };
            let there = numbers(&text, &format!("primvars:{name}"));
            assert_eq!(there.len(), arrays.len() * count, "{name} at frame {number}");
            let value = |array: &[f64], at: usize| match name {
                "displayColor" => f64::from(array[at] as f32 / 255.0),
                _ => array[at],
            };
            let arrays: Vec<&[f64]> = arrays.iter().map(|name| values(&made, name)).collect();
            let of_one = |at: usize| -> Vec<f64> { arrays.iter().map(|array| value(array, at)).collect() };
            let values: Vec<Vec<f64>> = (0..count).map(of_one).collect();
            let one = json!({ "type": class, "interpolation": interpolation, "values": values });
            wanted.insert(name.into(), one);
        }
        all.push(indices);
        let Some(python) = &python else { continue };
        // Through the clips of the shot.
        fs::write(file("wanted.json"), serde_json::Value::Object(wanted).to_string()).unwrap();
        let (shot, wanted) = (file("shot.usda"), file("wanted.json"));
        let said =
            clients::usd_reads_arrays(python, &shot, "/shot/surface/surface", number, &wanted).unwrap();
        assert_eq!(said, "6 arrays");
    }
    assert!(all[0] == all[1] && all.windows(2).filter(|pair| pair[0] != pair[1]).count() > 1);
    if python.is_none() {
        skipped("no usd-core");
    }
}

#[test]
fn a_liquid_that_is_gone_takes_its_mesh_along_and_one_that_appears_is_meshed() {
    let folder = &Folder::empty();
    let one = ball(5.0, SIDE, 0.1);
    mesh::write(&folder.join("one.ply"), &welded(&one.mesh)).unwrap();
    let (last_of_one, frames) = (3, 18);
    let far = |frame: i32| DVec3::new(1.0, -0.1 * SPACING * f64::from(frame), 0.0);
    for frame in 1..=frames {
        // All particles end, and others with other ids begin a metre away.
        let (by, first_id) = if frame <= last_of_one { (DVec3::zeros(), 0) } else { (far(frame), 10_000) };
        let positions: Vec<DVec3> = one.positions.iter().map(|position| position + by).collect();
        write_numbered(&folder.join(format!("one.{frame:04}.bgeo")), &positions, first_id);
    }
    works(folder, "surface -p one.%04d.bgeo -m one.ply --spacing 0.01 -o out");
    for number in 1..=frames {
        is_whole(&frame(folder, "out", number).mesh, number);
    }
    let count = one.positions.len() as u64;
    let change = ["died", "born"].map(|key| reported(folder, "out", last_of_one + 1, key));
    assert_eq!(change, [count, count]);
    // What is expected: the new liquid has a mesh from its first frame on, a part of its own. The old mesh is nowhere near any liquid: all
    // of it is lost, and goes within some frames, from outside inward, since matching reaches only so far from what does not fit. In the
    // end there is only the new liquid's mesh, which has no detail.
    let near = |position: &Vec3, number: i32| (position.cast::<f64>() - far(number)).norm() < 7.0 * SPACING;
    let begun = frame(folder, "out", last_of_one + 1).mesh;
    assert!(begun.positions.iter().any(|position| near(position, last_of_one + 1)));
    let last = frame(folder, "out", frames).mesh;
    assert!(last.positions.iter().all(|position| near(position, frames)));
    assert_eq!(components(&last.triangles).len(), 1);
    let volume = last.volume() / (count as f64 * SPACING.powi(3));
    assert!((0.7..1.2).contains(&volume), "{volume} of the particles' own");
}
