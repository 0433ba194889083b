//! `mesh compare`: how far meshes lie apart and how much sequences flicker; and the bodies of `mesh check`.

use std::fs;
use std::path::Path;

use crate::common::shapes::{cuboid, sphere, torus};
use crate::program::{CUBE, Folder, complains, fails, frazil, works};
use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::{Value, json};

fn folder_with(meshes: &[(&str, &TriMesh)]) -> Folder {
    let folder = Folder::empty();
    meshes.iter().for_each(|(name, mesh)| write(&folder, name, mesh));
    folder
}

fn write(folder: &Path, name: &str, mesh: &TriMesh) {
    mesh::write(&folder.join(name), mesh).unwrap();
}

fn moved(mesh: &TriMesh, by: [f32; 3]) -> TriMesh {
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|position| *position += Vec3::from(by));
    mesh
}

#[track_caller]
fn compare(folder: &Path, arguments: &str) -> Value {
    serde_json::from_str(&works(folder, &format!("mesh compare {arguments} --json"))).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Mean, p95 and max (m).
fn distances(value: &Value) -> [f64; 3] {
    ["mean_m", "p95_m", "max_m"].map(|key| number(&value[key]))
}

fn is_near(a: f64, b: f64, most: f64) -> bool {
    (a - b).abs() <= most
}

#[test]
fn a_cube_lies_on_itself() {
    let folder = folder_with(&[]);
    for name in ["a.obj", "b.obj"] {
        fs::write(folder.join(name), CUBE).unwrap();
    }
    let found = compare(&folder, "a.obj b.obj");
    for key in ["a_to_b", "b_to_a", "vertex_to_vertex"] {
        assert_eq!(distances(&found[key]), [0.0; 3], "{found}");
    }
    assert_eq!((&found["same_faces"], &found["hausdorff_m"]), (&json!(true), &json!(0.0)));
    assert!(is_near(number(&found["areas_m2"][0]), 0.96, 1e-6), "{found}");
    assert!(is_near(number(&found["volumes_m3"][1]), 0.064, 1e-6), "{found}");
    assert_eq!(found["volume_difference_percent"], json!(0.0));
    let said = works(&folder, "mesh compare a.obj b.obj");
    for words in [
        "a.obj: area 0.960000 m2, volume 0.064000 m3\n",
        "b.obj: area 0.960000 m2 (+0.0000 %), volume 0.064000 m3 (+0.0000 %)\n",
        "  from b.obj to a.obj: mean 0.000000 m, 95 % within 0.000000 m, all within 0.000000 m (at ",
        "  Hausdorff distance 0.000000 m\n",
        "  the same faces; from vertex to vertex mean 0.000000 m",
    ] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
}

#[test]
fn a_cube_that_moved_is_as_far_as_it_moved() {
    let cube = cuboid([0.4; 3]);
    let folder = folder_with(&[("a.ply", &cube), ("b.ply", &moved(&cube, [0.1, 0.0, 0.0]))]);
    let found = compare(&folder, "a.ply b.ply");
    assert!(distances(&found["vertex_to_vertex"]).iter().all(|d| is_near(*d, 0.1, 1e-7)), "{found}");
    for key in ["a_to_b", "b_to_a"] {
        let [mean, p95, max] = distances(&found[key]);
        assert!(0.0 < mean && mean < p95 && p95 <= max && is_near(max, 0.1, 1e-7), "{found}");
    }
    // On one of the two faces across the way.
    assert!(is_near(number(&found["a_to_b"]["max_at_m"][0]).abs(), 0.2, 1e-6), "{found}");
    assert!(is_near(number(&found["hausdorff_m"]), 0.1, 1e-7), "{found}");
    // A quarter of the volume more is in percent of the first.
    let wide = cuboid([0.5, 0.4, 0.4]);
    write(&folder, "wide.ply", &wide);
    let found = compare(&folder, "a.ply wide.ply");
    assert!(is_near(number(&found["volume_difference_percent"]), 25.0, 1e-4), "{found}");
    assert!(is_near(number(&found["area_difference_percent"]), 100.0 / 6.0, 1e-4), "{found}");
}

#[test]
fn a_sphere_is_a_tenth_from_one_of_a_radius_a_tenth_larger() {
    let folder = folder_with(&[("a.ply", &sphere(1.0, 12)), ("b.stl", &sphere(1.1, 17))]);
    let found = compare(&folder, "a.ply b.stl");
    for key in ["a_to_b", "b_to_a"] {
        let [mean, p95, max] = distances(&found[key]);
        assert!(is_near(mean, 0.1, 0.006) && mean < p95 && p95 < max && max < 0.115, "{found}");
    }
    assert_eq!((&found["same_faces"], &found["vertex_to_vertex"]), (&json!(false), &Value::Null));
    assert!(
        works(&folder, "mesh compare a.ply b.stl").contains("  different faces, or in a different order\n")
    );
}

#[test]
fn a_part_that_one_mesh_lacks_is_seen_from_the_other_only() {
    let cube = cuboid([0.4; 3]);
    let mut more = cube.clone();
    more.append(&moved(&cube, [5.0, 0.0, 0.0]));
    let folder = folder_with(&[("more.ply", &more), ("cube.ply", &cube)]);
    let found = compare(&folder, "more.ply cube.ply");
    assert!(is_near(distances(&found["a_to_b"])[2], 5.0, 1e-5), "{found}");
    assert_eq!(distances(&found["b_to_a"]), [0.0; 3], "{found}");
    assert!(is_near(number(&found["hausdorff_m"]), 5.0, 1e-5), "{found}");
    assert!(is_near(number(&found["a_to_b"]["max_at_m"][0]), 5.2, 1e-5), "{found}");
    let swapped = compare(&folder, "cube.ply more.ply");
    assert_eq!(swapped["b_to_a"], found["a_to_b"]);
}

/// A cube of 1 m at positions along x (m), a frame for each.
fn write_ride(folder: &Path, name: &str, positions: &[f32]) {
    for (position, frame) in positions.iter().zip(1..) {
        write(folder, &format!("{name}.{frame:04}.ply"), &moved(&cuboid([1.0; 3]), [*position, 0.0, 0.0]));
    }
}

#[test]
fn sequences_are_compared_frame_by_frame() {
    let folder = folder_with(&[("still.ply", &cuboid([1.0; 3]))]);
    write_ride(&folder, "a", &[0.0, 0.25, 0.5]);
    write_ride(&folder, "b", &[0.0, 0.5, 0.5]);
    let found = compare(&folder, "a.%04d.ply b.####.ply --frames 1-3");
    let frames = found["frames"].as_array().unwrap();
    let told: Vec<_> = frames.iter().map(|of| (number(&of["frame"]), number(&of["hausdorff_m"]))).collect();
    assert_eq!(told, [(1.0, 0.0), (2.0, 0.25), (3.0, 0.0)]);
    let all = &found["all_frames"];
    assert!(is_near(number(&all["vertex_to_vertex"]["mean_m"]), 0.25 / 3.0, 1e-12), "{all}");
    let most = &all["vertex_to_vertex"];
    assert_eq!((&most["max_m"], &most["max_frame"]), (&json!(0.25), &json!(2)), "{all}");
    assert_eq!((&all["hausdorff_m"], &all["a_to_b"]["most_p95_m"]), (&json!(0.25), &json!(0.25)), "{all}");
    let said = works(&folder, "mesh compare a.%04d.ply b.%04d.ply --frames 1-3");
    assert!(said.contains("frame 2: from A to B mean ") && said.contains("\nall frames:\n"), "{said}");
    assert!(said.contains("  Hausdorff distance at most 0.250000 m\n"), "{said}");
    // One mesh for all frames.
    let still = compare(&folder, "a.%04d.ply still.ply --frames 1-3x2");
    assert_eq!(still["frames"].as_array().unwrap().len(), 2);
    assert_eq!(still["frames"][1]["vertex_to_vertex"]["max_m"], json!(0.5));
    assert_eq!((&still["b"], &still["flicker"]), (&json!("still.ply"), &json!([])));
}

#[test]
fn what_moves_evenly_does_not_flicker_and_a_jump_does() {
    let folder = folder_with(&[]);
    write_ride(&folder, "even", &[0.0, 0.25, 0.5, 0.75, 1.0]);
    write_ride(&folder, "jump", &[0.0, 0.25, 0.5, 1.25, 1.5]);
    let found = compare(&folder, "even.%04d.ply jump.%04d.ply --frames 1-5 --flicker");
    let [even, jump] = [&found["flicker"][0], &found["flicker"][1]];
    assert_eq!((&even["file"], &jump["file"]), (&json!("even.%04d.ply"), &json!("jump.%04d.ply")));
    assert_eq!(even["frames"].as_array().unwrap().len(), 3);
    assert_eq!((&even["all_frames"]["max_m"], &even["changes"]), (&json!(0.0), &json!([])));
    let around: Vec<_> =
        jump["frames"].as_array().unwrap().iter().map(|of| (number(&of["frame"]), distances(of))).collect();
    assert_eq!(around, [(2.0, [0.0; 3]), (3.0, [0.5; 3]), (4.0, [0.5; 3])]);
    assert_eq!((&jump["all_frames"]["max_m"], &jump["all_frames"]["max_frame"]), (&json!(0.5), &json!(3)));
    // A sequence alone.
    let said = works(&folder, "mesh compare jump.%04d.ply --frames 1-5 --flicker");
    assert!(said.starts_with("jump.%04d.ply, flicker around frame 2: mean 0.000000 m"), "{said}");
    assert!(
        said.contains("jump.%04d.ply, flicker over all frames: ") && !said.contains("all frames:\n"),
        "{said}"
    );
    assert!(!said.contains("cannot be subtracted"), "{said}");
}

#[test]
fn where_faces_change_the_surfaces_are_compared_instead() {
    let folder = folder_with(&[]);
    write_ride(&folder, "a", &[0.0, 0.25, 0.5]);
    for frame in 4..7 {
        write(&folder, &format!("a.{frame:04}.ply"), &moved(&sphere(0.5, 4), [0.5, 0.0, 0.0]));
    }
    let found = compare(&folder, "a.%04d.ply --frames 1-6 --flicker");
    let flicker = &found["flicker"][0];
    let frames: Vec<&Value> = flicker["frames"].as_array().unwrap().iter().map(|of| &of["frame"]).collect();
    assert_eq!(frames, [&json!(2), &json!(5)]);
    let changes = flicker["changes"].as_array().unwrap();
    assert_eq!((changes.len(), &changes[0]["frames"]), (1, &json!([3, 4])), "{flicker}");
    // The cube's corners are far from the sphere.
    let corner = 0.75f64.sqrt() - 0.5;
    assert!(is_near(distances(&changes[0]["forward"])[2], corner, 0.02), "{flicker}");
    assert!(distances(&changes[0]["back"])[2] < 0.25 && found["b"].is_null(), "{flicker}");
    let said = works(&folder, "mesh compare a.%04d.ply --frames 1-6 --flicker");
    assert!(said.contains("a.%04d.ply, frames 3 and 4 have different faces: forward mean "), "{said}");
    let sentence = |line: &&str| line.starts_with("a.%04d.ply: where faces change between two frames");
    assert_eq!(said.lines().filter(sentence).count(), 1, "{said}");
}

#[test]
fn what_cannot_be_compared_is_a_sentence() {
    let folder = folder_with(&[("a.ply", &cuboid([1.0; 3]))]);
    write_ride(&folder, "a", &[0.0, 0.25, 0.5]);
    fs::write(folder.join("cut.obj"), "v 0 0 0\nv 1 0 0\nf 1 2 7\n").unwrap();
    let cases: [(&str, &[&str]); 10] = [
        ("a.ply none.ply", &["none.ply", "no such file"]),
        ("cut.obj a.ply", &["cut.obj", "vertex 7"]),
        ("a.ply a.vdb", &["a.vdb"]),
        ("a.ply", &["required arguments"]),
        ("a.%04d.ply a.ply", &["a.%04d.ply", "--frames A-B"]),
        ("a.ply a.ply --frames 1-2", &["--frames", "sequences"]),
        ("a.%04d.ply a.ply --frames 1-4", &["a.0004.ply"]),
        ("a.ply --flicker", &["--flicker", "sequences"]),
        ("a.%04d.ply --flicker --frames 1-2", &["--flicker", "three frames"]),
        ("a.%04d.ply --flicker --frames 1,2,4", &["--flicker", "evenly"]),
    ];
    for (arguments, words) in cases {
        fails(&folder, &format!("mesh compare {arguments}"), 2, words);
    }
    // What is damaged behind the first frame ends a run that has begun.
    fs::write(folder.join("a.0003.ply"), "ply\n").unwrap();
    fails(&folder, "mesh compare a.%04d.ply a.ply --frames 1-3", 1, &["a.0003.ply"]);
}

#[test]
fn frames_before_one_without_faces_are_told() {
    let folder = folder_with(&[("still.ply", &cuboid([1.0; 3]))]);
    let folder = folder.path();
    write_ride(folder, "a", &[0.0, 0.25, 0.5, 0.75, 1.0]);
    // A liquid that is gone leaves such a mesh.
    write(folder, "a.0005.ply", &TriMesh::default());
    let ends = |arguments: &str| {
        let output = frazil(folder, &format!("mesh compare a.%04d.ply {arguments} --frames 1-5"));
        complains(&output, 1, &["a.0005.ply", "no faces"]);
        String::from_utf8(output.stdout).unwrap()
    };
    let found: Value = serde_json::from_str(&ends("still.ply --json --flicker")).unwrap();
    let frames = found["frames"].as_array().unwrap();
    let told: Vec<_> = frames.iter().map(|of| (number(&of["frame"]), number(&of["hausdorff_m"]))).collect();
    assert_eq!(told, [(1.0, 0.0), (2.0, 0.25), (3.0, 0.5), (4.0, 0.75)]);
    let flicker = &found["flicker"][0];
    assert_eq!(flicker["frames"].as_array().unwrap().len(), 2);
    // Of all frames nothing is known, as in words.
    assert!(found["all_frames"].is_null() && flicker["all_frames"].is_null(), "{found}");
    let said = ends("still.ply");
    assert!(said.contains("frame 4: from A to B ") && !said.contains("all frames:"), "{said}");
    let alone: Value = serde_json::from_str(&ends("--flicker --json")).unwrap();
    assert_eq!((&alone["frames"], alone["flicker"][0]["frames"].as_array().unwrap().len()), (&json!([]), 2));
    // Without its first frame nothing is begun.
    write(folder, "a.0001.ply", &TriMesh::default());
    let output = frazil(folder, "mesh compare a.%04d.ply still.ply --frames 1-5 --json");
    complains(&output, 2, &["a.0001.ply", "no faces"]);
    assert!(output.stdout.is_empty());
}

#[test]
fn any_number_of_threads_says_the_same() {
    let folder = folder_with(&[("a.ply", &sphere(1.0, 20)), ("b.ply", &torus(1.0, 0.3, 60, 30))]);
    let with = |threads: usize| {
        let output = frazil(&folder, &format!("mesh compare a.ply b.ply --json --threads {threads}")).stdout;
        String::from_utf8(output).unwrap()
    };
    let one = with(1);
    assert!(one.contains("hausdorff_m") && one == with(3), "{one}");
}

#[test]
fn mesh_check_tells_each_body() {
    let cube = cuboid([0.4; 3]);
    let mut mesh = torus(2.0, 0.5, 24, 12);
    mesh.append(&cube);
    mesh.append(&moved(&cube, [9.0, 0.0, 0.0]).reversed());
    // The last lacks a triangle, and touches the second in a corner.
    let mut open = moved(&cube, [0.4, 0.4, 0.4]);
    open.triangles.truncate(11);
    mesh.append(&open);
    let folder = folder_with(&[("bodies.ply", &mesh), ("cube.ply", &cube)]);
    let report: Value =
        serde_json::from_str(&works(&folder, "mesh check bodies.ply cube.ply --json")).unwrap();
    let bodies = report[0]["bodies"].as_array().unwrap();
    let of = |key: &str| -> Vec<&Value> { bodies.iter().map(|body| &body[key]).collect() };
    assert_eq!(of("triangles"), [&json!(576), &json!(12), &json!(12), &json!(11)]);
    assert_eq!(of("genus"), [&json!(1), &json!(0), &json!(0), &Value::Null]);
    assert_eq!(of("holes"), [&json!(0), &json!(0), &json!(0), &json!(1)]);
    assert_eq!(of("solid"), [&json!(true), &json!(true), &json!(true), &json!(false)]);
    assert!(is_near(number(of("volume_m3")[1]), 0.064, 1e-6) && number(of("volume_m3")[2]) < -0.063);
    assert!(is_near(number(&bodies[2]["bounds_m"][0][0]), 8.8, 1e-5), "{}", bodies[2]);
    let alone = &report[1]["bodies"];
    assert_eq!((alone.as_array().unwrap().len(), &alone[0]["area_m2"]), (1, &report[1]["area_m2"]));
    let said = works(&folder, "mesh check bodies.ply");
    let lines: Vec<&str> = said.lines().filter(|line| line.starts_with("  body: ")).collect();
    assert_eq!(lines.len(), 4, "{said}");
    assert!(
        lines[0].starts_with("  body: 576 triangles, genus 1, area ") && lines[3].contains("open"),
        "{said}"
    );
    assert!(!works(&folder, "mesh check cube.ply").contains("body: "));
    // Many are counted.
    let mut many = TriMesh::default();
    (0..11).for_each(|n| many.append(&moved(&cube, [n as f32, 0.0, 0.0])));
    write(&folder, "many.ply", &many);
    assert!(works(&folder, "mesh check many.ply").contains("  and 3 more bodies\n"));
}

#[test]
fn the_page_of_the_command_line_compares() {
    const CLI: &str = include_str!("../../../docs/cli.md");
    let folder = folder_with(&[("before.ply", &cuboid([1.0; 3])), ("after.ply", &sphere(0.6, 6))]);
    write_ride(&folder, "a", &[0.0, 0.25, 0.5]);
    write_ride(&folder, "b", &[0.0, 0.5, 0.5]);
    let page = CLI.split("## Compared meshes\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let block = page.split("```sh\n").nth(1).unwrap().split("```").next().unwrap();
    let lines: Vec<&str> = block.lines().filter_map(|line| line.strip_prefix("frazil ")).collect();
    assert_eq!(lines.len(), 5, "{lines:?}");
    for line in lines {
        works(&folder, line.split(" #").next().unwrap());
    }
    // Every key of a comparison is on the page.
    let mut keys = Vec::new();
    let found = compare(&folder, "a.%04d.ply b.%04d.ply --frames 1-3 --flicker");
    keys_of(&found, &mut keys);
    assert!(keys.len() > 20, "{keys:?}");
    let missing: Vec<&String> = keys.iter().filter(|key| !page.contains(&format!("`{key}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

fn keys_of(value: &Value, keys: &mut Vec<String>) {
    for (key, inner) in value.as_object().into_iter().flatten() {
        keys.push(key.clone());
        keys_of(inner, keys);
    }
    value.as_array().into_iter().flatten().for_each(|inner| keys_of(inner, keys));
}
