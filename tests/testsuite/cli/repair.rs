//! `mesh repair`: solids of meshes with faults, what they keep, and what is said.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::hero;
use crate::program::{CUBE, Folder, fails, works};
use frazil::geometry::mesh::attributes::{DetailedMesh, MeshArray, Number, On};
use frazil::geometry::{TriMesh, Uvs, Vec3};
use frazil::io::mesh;
use serde_json::{Value, json};

/// A cube of 1 m whose faces are n x n squares.
fn cube(low: [f32; 3], n: usize) -> TriMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut numbers: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    for (axis, side) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0), (axis, n)]) {
        let mut vertex = |i: usize, j: usize| {
            let mut at = [side; 3];
            (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (i, j);
            *numbers.entry(at).or_insert_with(|| {
                positions.push(Vec3::from([0, 1, 2].map(|k| low[k] + at[k] as f32 / n as f32)));
                positions.len() as u32 - 1
            })
        };
        for (i, j) in (0..n * n).map(|square| (square / n, square % n)) {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
            triangles.extend(if side == 0 { [[a, d, c], [a, c, b]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    TriMesh { positions, triangles }
}

/// Two cubes that overlap, each of 12 n^2 triangles, and the volume that they fill (m3).
fn two_cubes(n: usize) -> (TriMesh, f64) {
    let mut two = cube([0.0; 3], n);
    two.append(&cube([0.537, 0.463, 0.411], n));
    (two, 2.0 - (1.0 - 0.537) * (1.0 - 0.463) * (1.0 - 0.411))
}

fn write(folder: &Path, name: &str, mesh: &TriMesh) {
    mesh::write(&folder.join(name), mesh).unwrap();
}

/// What `mesh check` says of a file.
#[track_caller]
fn checked(folder: &Path, name: &str) -> Value {
    let report: Value = serde_json::from_str(&works(folder, &format!("mesh check {name} --json"))).unwrap();
    report[0].clone()
}

/// A repair's report.
#[track_caller]
fn repaired(folder: &Path, arguments: &str) -> Value {
    serde_json::from_str(&works(folder, &format!("mesh repair {arguments} --json"))).unwrap()
}

#[track_caller]
fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {report}"))
}

#[test]
fn two_cubes_that_overlap_become_one_solid() {
    let folder = &Folder::empty();
    let (two, volume) = two_cubes(10);
    write(folder, "two.ply", &two);
    let said = works(folder, "mesh repair two.ply -o one.ply");
    assert!(said.starts_with("two.ply: a solid now, in one.ply\n"), "{said}");
    assert!(said.contains("  cells of 0.0384 m, a 40th of the longest side\n"), "{said}");
    assert!(
        said.contains(" of 2400 triangles kept, ") && said.contains("volume 2.000000 m3 before"),
        "{said}"
    );
    let found = checked(folder, "one.ply");
    assert_eq!((&found["solid"], &found["by_index"]["watertight"]), (&json!(true), &json!(true)), "{found}");
    assert_eq!((&found["parts"], &found["genus"]), (&json!(1), &json!(0)), "{found}");
    assert!((number(&found, "volume_m3") - volume).abs() < 0.01, "{found}");
    // The same in numbers.
    let report = repaired(folder, "two.ply -o again.ply");
    let [kept, made, all] =
        ["kept_triangles", "made_triangles", "triangles"].map(|key| number(&report, key) as u64);
    assert!(kept > 1300 && kept < 2400 && kept + made == all, "{report}");
    assert_eq!(found["triangles"], json!(all));
    assert!(number(&report, "flagged_cells") > 50.0, "{report}");
    assert!(number(&report, "rebuilt_cells") >= number(&report, "flagged_cells"), "{report}");
    assert_eq!((number(&report, "cell_m"), &report["solid_already"]), (0.0384, &json!(false)));
    // Other threads, the same bytes; other cells, others.
    for threads in [1, 2] {
        works(folder, &format!("mesh repair two.ply -o {threads}.ply --threads {threads}"));
    }
    let bytes = |name: &str| fs::read(folder.join(name)).unwrap();
    assert!(bytes("1.ply") == bytes("2.ply") && bytes("1.ply") == bytes("one.ply"));
    let said = works(folder, "mesh repair two.ply -o coarse.ply --cell 0.07");
    assert!(said.contains("  cells of 0.07 m\n") && bytes("coarse.ply") != bytes("one.ply"), "{said}");
}

#[test]
fn an_open_cube_is_closed_and_a_whole_one_written_as_it_is() {
    let folder = &Folder::empty();
    let mut open = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    open.triangles.truncate(10);
    write(folder, "open.obj", &open);
    let said = works(folder, "mesh repair open.obj -o closed.obj");
    for words in ["  1 hole closed\n", "10 of 10 triangles kept, 2 made\n", ", 1.000000 m3 now\n"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    let closed = mesh::read(&folder.join("closed.obj")).unwrap();
    assert!(closed.is_manifold() && closed.volume() == 1.0);
    assert!(closed.triangles.starts_with(&open.triangles) && closed.positions == open.positions);
    works(folder, "mesh repair open.obj -o closed.usda");
    let text = fs::read_to_string(folder.join("closed.usda")).unwrap();
    assert!(text.contains("def Mesh \"open\"") && !text.contains("velocities"), "{text}");
    let said = works(folder, "mesh repair open.obj -o large.stl --scale 2 --up z");
    assert!(said.contains(", 8.000000 m3 now\n"), "{said}");
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let said = works(folder, "mesh repair cube.obj -o same.ply");
    assert_eq!(said, "cube.obj is a solid already: written as it is\n");
    let [cube, same] = ["cube.obj", "same.ply"].map(|name| mesh::read(&folder.join(name)).unwrap());
    assert!(cube == same);
    assert_eq!(repaired(folder, "cube.obj -o same.ply")["solid_already"], json!(true));
}

#[test]
fn soups_and_characters_become_solids() {
    let folder = &Folder::empty();
    let (two, volume) = two_cubes(6);
    let positions: Vec<Vec3> =
        two.triangles.as_flattened().iter().map(|&vertex| two.positions[vertex as usize]).collect();
    let mut soup = TriMesh {
        positions,
        triangles: (0..two.triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
    };
    let mut turned = 0;
    for triangle in soup.triangles[..432].iter_mut().step_by(7) {
        triangle.swap(1, 2);
        turned += 1;
    }
    for name in ["soup.stl", "soup.ply"] {
        write(folder, name, &soup);
        let report = repaired(folder, &format!("{name} -o solid.ply"));
        let found = checked(folder, "solid.ply");
        assert_eq!((&found["solid"], &found["parts"]), (&json!(true), &json!(1)), "{found}");
        assert!((number(&found, "volume_m3") - volume).abs() < 0.01, "{found}");
        assert_eq!(report["turned_triangles"], json!(turned), "{report}");
        // The reader of .stl joins corners itself.
        assert_eq!(number(&report, "joined_vertices") > 0.0, name == "soup.ply", "{report}");
    }
    fs::write(folder.join("hero.glb"), hero::glb()).unwrap();
    let report = repaired(folder, "hero.glb -o hero.ply");
    let found = checked(folder, "hero.ply");
    assert_eq!(found["by_index"]["watertight"], json!(true), "{found}");
    assert!(number(&report, "volume_m3") > 0.01, "{report}");
}

/// Numbers of a corner: texture coordinates, "dry" of corners, "mask" and "red" of vertices, bit by bit.
type Corner = [u64; 5];

/// A triangle by where its corners lie, beginning with the least, with the numbers of these and of the face.
type Placed = ([[u32; 3]; 3], ([Corner; 3], u64));

fn by_positions(detail: &DetailedMesh) -> Vec<Placed> {
    let DetailedMesh { mesh, uvs, arrays } = detail;
    let uvs = uvs.as_ref().unwrap();
    let values = |name: &str| &arrays.iter().find(|array| array.name == name).unwrap().values;
    let [dry, mask, red, part] = ["dry", "mask", "red", "part"].map(values);
    let triangle = |n: usize| {
        let positions = uvs.indices(&mesh.triangles, n).map(|index| uvs.coordinates[index as usize]);
        let mut corners = [0, 1, 2].map(|corner| {
            let vertex = mesh.triangles[n][corner] as usize;
            let [u, v] = positions[corner].map(|x| u64::from(x.to_bits()));
            let numbers = [dry[3 * n + corner], mask[vertex], red[vertex]].map(f64::to_bits);
            let position: [f32; 3] = mesh.positions[vertex].into();
            (position.map(f32::to_bits), [u, v, numbers[0], numbers[1], numbers[2]])
        });
        let least = (0..3).min_by_key(|corner| corners[*corner].0).unwrap();
        corners.rotate_left(least);
        (corners.map(|corner| corner.0), (corners.map(|corner| corner.1), part[n].to_bits()))
    };
    (0..mesh.triangles.len()).map(triangle).collect()
}

#[test]
fn what_is_not_rebuilt_keeps_its_arrays_bit_for_bit() {
    let folder = &Folder::empty();
    let (mesh, _) = two_cubes(10);
    let array = |name: &str, on: On, number: Number, values: Vec<f64>| MeshArray {
        name: name.into(),
        on,
        number,
        values,
    };
    let corners = 3 * mesh.triangles.len() as u32;
    let arrays = [
        array("mask", On::Vertices, Number::F64, mesh.positions.iter().map(|p| f64::from(p.x)).collect()),
        array("red", On::Vertices, Number::U8, (0..mesh.positions.len()).map(|n| (n % 256) as f64).collect()),
        array("part", On::Faces, Number::U16, (0..mesh.triangles.len()).map(|n| n as f64).collect()),
        array("dry", On::Corners, Number::F32, (0..corners).map(|n| 0.125 * f64::from(n)).collect()),
    ];
    // Each corner has its own: seams everywhere.
    let positions = (0..corners).map(|n| [0.25 * n as f32, 1.0 + n as f32]).collect();
    let uvs = Uvs { coordinates: positions, corners: Some((0..corners).collect()), missing: 0 };
    let arrays: Vec<&MeshArray> = arrays.iter().collect();
    let carried = mesh::Carried { uvs: Some(&uvs), arrays: &arrays, ..Default::default() };
    mesh::write_carried(&folder.join("two.ply"), &mesh, &carried).unwrap();
    works(folder, "mesh repair two.ply -o one.ply");
    let [before, after] = ["two.ply", "one.ply"].map(|name| mesh::read_detailed(&folder.join(name)).unwrap());
    let known: BTreeMap<_, _> = by_positions(&before).into_iter().collect();
    let found = by_positions(&after);
    let same = found.iter().filter(|(positions, _)| known.contains_key(positions)).count();
    assert!(same > 1300 && same < found.len(), "{same} of {}", found.len());
    let differ =
        found.iter().filter(|(positions, numbers)| known.get(positions).is_some_and(|was| was != numbers));
    assert_eq!(differ.count(), 0);
    // What was made has what lies nearest.
    let mask = &after.arrays.iter().find(|array| array.name == "mask").unwrap().values;
    let farthest =
        mask.iter().zip(&after.mesh.positions).map(|(x, position)| (x - f64::from(position.x)).abs());
    assert!(farthest.fold(0.0, f64::max) < 0.1);
    // What a format cannot hold is said.
    let said = works(folder, "mesh repair two.ply -o one.obj");
    assert!(said.contains("two.ply: arrays are not carried over: mask, "), "{said}");
    let said = works(folder, "mesh repair two.ply -o one.stl");
    assert!(said.contains("two.ply: UVs and colours are not carried over"), "{said}");
}

#[test]
fn sequences_are_repaired_frame_by_frame() {
    let folder = &Folder::empty();
    for (frame, size) in [(1, 1.0), (2, 2.0), (3, 0.5)] {
        let mut open = TriMesh::cuboid([0.0; 3], [size, 1.0, 1.0]);
        open.triangles.truncate(10);
        write(folder, &format!("open.{frame:04}.ply"), &open);
    }
    let report = repaired(folder, "open.%04d.ply -o solid.%04d.ply --frames 1-3x2");
    assert_eq!((report.as_array().map(Vec::len), &report[1]["frame"]), (Some(2), &json!(3)), "{report}");
    assert_eq!(report[1]["file"], json!("open.0003.ply"));
    assert!((number(&report[1], "volume_m3") - 0.5).abs() < 1e-9, "{report}");
    // The first mesh says how large cells are.
    assert_eq!(report[0]["cell_m"], report[1]["cell_m"]);
    assert!(!folder.join("solid.0002.ply").exists());
    // What is at fault behind the first frame ends a run that has begun.
    let lone = TriMesh { positions: vec![Vec3::zeros(), Vec3::x(), Vec3::y()], triangles: vec![[0, 1, 2]] };
    write(folder, "open.0002.ply", &lone);
    let line = "mesh repair open.%04d.ply -o late.%04d.ply --frames 1-3";
    fails(folder, line, 1, &["open.0002.ply: nothing in the mesh encloses a volume"]);
    assert!(folder.join("late.0001.ply").exists() && !folder.join("late.0003.ply").exists());
}

#[test]
fn what_cannot_be_repaired_is_a_sentence() {
    let folder = &Folder::empty();
    for name in ["cube.obj", "body.1.obj", "body.2.obj"] {
        fs::write(folder.join(name), CUBE).unwrap();
    }
    let (lone, point) = ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    fs::write(folder.join("lone.obj"), lone).unwrap();
    fs::write(folder.join("point.obj"), point).unwrap();
    let cases: [(&str, &[&str]); 13] = [
        ("lone.obj -o out.ply", &["lone.obj: nothing in the mesh encloses a volume"]),
        ("point.obj -o out.ply", &["point.obj: nothing in the mesh encloses a volume"]),
        ("cube.obj -o cube.obj", &["cube.obj", "input"]),
        ("body.%d.obj -o body.#.obj --frames 1-2", &["body.1.obj", "input"]),
        ("none.obj -o out.ply", &["none.obj"]),
        ("cube.obj -o out.vdb", &["out.vdb", ".usda"]),
        ("cube.obj -o none/out.ply", &["none/out.ply"]),
        ("cube.obj -o out.ply --cell 0", &["--cell"]),
        ("cube.obj -o out.ply --cell 0.00001 --max-memory 1G", &["cells of 0.00001 m", "needs about"]),
        ("cube.obj -o out.ply --frames 1-2", &["--frames", "single mesh"]),
        ("body.%d.obj -o out.ply", &["body.%d.obj", "--frames A-B"]),
        ("body.%d.obj -o out.ply --frames 1-2", &["out.ply", "pattern"]),
        ("body.%d.obj -o out.%d.ply --frames 1-3", &["body.3.obj"]),
    ];
    for (arguments, words) in cases {
        fails(folder, &format!("mesh repair {arguments}"), 2, words);
    }
    assert_eq!(fs::read_to_string(folder.join("cube.obj")).unwrap(), CUBE);
    let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["body.1.obj", "body.2.obj", "cube.obj", "lone.obj", "point.obj"]);
}

#[test]
fn every_key_of_a_report_is_on_the_page() {
    const CLI: &str = include_str!("../../../docs/cli.md");
    let folder = Folder::empty();
    fs::write(folder.join("body.1.obj"), CUBE).unwrap();
    let page = CLI.split("## Repaired meshes\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let report = repaired(&folder, "body.%d.obj -o out.%d.ply --frames 1");
    let keys: Vec<&String> = report[0].as_object().unwrap().keys().collect();
    assert!(keys.len() > 18, "{keys:?}");
    let missing: Vec<_> = keys.into_iter().filter(|key| !page.contains(&format!("`{key}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}
