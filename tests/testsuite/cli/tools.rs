//! `new`, `check`, `mesh check` and `convert`, and settings from the command line.

use crate::common::skip::skipped;
use std::fs;
use std::path::Path;

use crate::common::character;
use crate::common::shapes;
use crate::program::{self, Folder, works};
use frazil::geometry::TriMesh;
use frazil::io::mesh;
use serde_json::Value;

#[track_caller]
fn fails(folder: &Path, arguments: &str, words: &[&str]) {
    program::fails(folder, arguments, 2, words);
}

/// A folder with a box of 0.4 m and a scene in which it crosses the snow.
fn folder() -> Folder {
    let folder = Folder::empty();
    mesh::write(&folder.join("box.obj"), &shapes::cuboid([0.4; 3])).unwrap();
    let scene = "[shot]\nframes = \"1-12\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.05\n\
                 [[object]]\nfile = \"box.obj\"\nkeys = [{ frame = 1, at = [0, 0.4, -0.5] }, { frame = 12, at = [0, 0.4, 0.6] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

#[test]
fn a_new_scene_lacks_nothing_but_its_character() {
    let folder = folder();
    fs::write(folder.join("new.toml"), works(&folder, "new snow")).unwrap();
    fails(&folder, "check new.toml", &["hero.glb", "no such file"]);
    let said = works(&folder, "check new.toml --set object.1.file=box.obj");
    assert!(
        said.contains("120, 5.00 s at 24 frames per second") && said.contains("800 x 800 columns"),
        "{said}"
    );
    // Every line behind a # is a default: with all of them in force nothing changes.
    let text = fs::read_to_string(folder.join("new.toml")).unwrap();
    // But for those of tables without which their stages are left out.
    let (before, grains) = text.split_once("# [grains]").unwrap();
    let (_, mist) = grains.split_once("# [mist]").unwrap();
    let all: Vec<String> = before
        .lines()
        .chain(mist.split_once("\n\n").unwrap().1.lines())
        .map(|line| match line.strip_prefix("# ") {
            Some(key) if key.contains(" = ") || key.starts_with('[') => key.to_string(),
            _ => line.to_string(),
        })
        .filter(|line| {
            !["top =", "node =", "clip =", "loop =", "compression =", "mesh =", "grains ="]
                .iter()
                .any(|key| line.starts_with(key))
        })
        .collect();
    fs::write(folder.join("all.toml"), all.join("\n")).unwrap();
    let resolved = |name: &str| {
        let scene =
            frazil::scene::Scene::read_with(&folder.join(name), &["object.1.file=box.obj".parse().unwrap()]);
        scene.unwrap().to_toml()
    };
    assert_eq!(resolved("new.toml"), resolved("all.toml"));
}

#[test]
fn check_prints_sizes_speed_memory_and_disk() {
    let folder = folder();
    let said = works(&folder, "check shot.toml -o out --json");
    let report: Value = serde_json::from_str(&said).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let object = &report["objects"][0];
    assert!((number(&object["size_m"][1]) - 0.4).abs() < 1e-6);
    assert!((number(&object["bounds_m"][1][2]) - 0.8).abs() < 1e-6);
    assert!((number(&object["fastest_m_per_s"]) - 1.1 / 11.0 * 24.0).abs() < 1e-6);
    assert_eq!(object["touches"], serde_json::json!([1, 12]));
    assert!(number(&report["memory_bytes"]) > 1e6 && number(&report["disk_bytes"]) > 1e5);
    assert_eq!(report["warnings"], serde_json::json!([]));
    assert!(!folder.join("out").exists(), "it computes and writes nothing");
}

#[test]
fn check_warns_of_what_looks_wrong() {
    let folder = folder();
    for (set, words) in [
        ("--set object.1.scale=430", "172.000 m large: scale = 4.3?"),
        ("--set object.1.scale=0.01", "0.004 m large: scale = 1?"),
        ("--set object.1.role=ignore", "nothing moves through the snow"),
        ("--set snow.depth=0.1 --set snow.ground=-1", "never touches the snow: it stays 1.100 m above it"),
        ("--set snow.area=[3,3,5,5]", "never touches the snow: it stays beside"),
        ("--max-memory 1M", "needs about"),
    ] {
        let said = works(&folder, &format!("check shot.toml {set}"));
        let warnings: Vec<&str> = said.lines().filter(|line| line.starts_with("warning")).collect();
        assert!(warnings.iter().any(|warning| warning.contains(words)), "{set}: {said}");
    }
}

#[test]
fn check_reads_every_frame_of_a_sequence() {
    let folder = Folder::empty();
    let scene = character::sequence_scene(&folder, 30, 12);
    assert!(works(&folder, "check sequence.toml").contains("288 triangles"));
    let path = folder.join("ball.0023.obj");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("f 1 2", "f 1 3", 1)).unwrap();
    fails(&folder, "check sequence.toml", &["ball.0023.obj", "must keep its faces"]);
    fs::write(&path, &text[..text.len() / 2]).unwrap();
    fails(&folder, "check sequence.toml", &["ball.0023.obj"]);
    fs::remove_file(&path).unwrap();
    fails(&folder, "check sequence.toml", &["ball.0023.obj", "missing"]);
    assert!(scene.exists());
}

#[test]
fn settings_of_the_command_line_are_named_when_they_are_wrong() {
    let folder = folder();
    for (set, words) in [
        ("snow.nois.seed=2", ["--set snow.nois.seed=2", "did you mean `noise`"]),
        ("snow.cell=-1", ["--set snow.cell=-1", "must lie in"]),
        ("object.2.scale=1", ["`object`", "1 to 1"]),
        ("shot.frames.first=1", ["`frames` is not a table", "--set"]),
        ("snow.depth=", ["--set snow.depth=", "not a text"]),
        ("snow.depth", ["\"snow.depth\"", "snow.noise.seed=2"]),
        ("object.1.keys=[{frame=3},{frame=2}]", ["--set object.1.keys", "greater"]),
        ("object.1.clip=walk", ["`clip`", ".glb"]),
    ] {
        fails(&folder, &format!("check shot.toml --set {set}"), &words);
    }
    // A file of the command line is looked for where the command is typed.
    fs::create_dir(folder.join("sub")).unwrap();
    fs::rename(folder.join("shot.toml"), folder.join("sub/shot.toml")).unwrap();
    fails(&folder, "check sub/shot.toml", &["sub/box.obj"]);
    works(&folder, "check sub/shot.toml --set object.1.file=box.obj");
}

fn faults(folder: &Path, mesh: &TriMesh) -> Value {
    mesh::write(&folder.join("mesh.ply"), mesh).unwrap();
    let report: Value = serde_json::from_str(&works(folder, "mesh check mesh.ply --json")).unwrap();
    report[0].clone()
}

#[test]
fn mesh_check_tells_solids_from_other_meshes() {
    let folder = folder();
    let said = works(&folder, "mesh check box.obj");
    assert!(said.contains("box.obj: a solid") && said.contains("volume 0.064000 m3"), "{said}");
    let mut open = shapes::cuboid([1.0; 3]);
    open.triangles.truncate(10);
    let report = faults(&folder, &open);
    assert_eq!(
        (&report["solid"], &report["holes"], &report["open_edges"]),
        (&false.into(), &1.into(), &4.into())
    );
    let mut cross = shapes::cuboid([1.0, 1.0, 1.0]);
    cross.append(&shapes::cuboid([0.5, 0.5, 3.0]));
    let report = faults(&folder, &cross);
    assert_eq!((&report["solid"], &report["parts"]), (&true.into(), &2.into()));
    assert!(report["crossings"].as_u64().unwrap() >= 8, "{report}");
    assert_eq!((&report["embedded"], &report["by_index"]["watertight"]), (&false.into(), &true.into()));
    fails(&folder, "mesh check none.stl", &["none.stl"]);
    assert!(works(&folder, "mesh check box.obj").contains("8 vertices, 12 triangles, 1 part, genus 0\n"));
    // What is known of a file is said before another is at fault.
    let output = program::frazil(&folder, "mesh check box.obj none.stl");
    program::complains(&output, 2, &["none.stl"]);
    assert!(String::from_utf8(output.stdout).unwrap().starts_with("box.obj: a solid\n"));
}

#[test]
fn mesh_check_finds_parts_that_are_inside_out() {
    let folder = folder();
    let [mut two, second] = [0.0, 2.0].map(|x| TriMesh::cuboid([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]));
    // Mirrored, and so inside out.
    two.append(&second.reversed());
    let report = faults(&folder, &two);
    assert_eq!((&report["solid"], &report["inverted_parts"]), (&false.into(), &1.into()));
    let said = works(&folder, "mesh check mesh.ply");
    assert!(said.contains("mesh.ply: not a solid as it is\n"), "{said}");
    assert!(said.contains("1 part is inside out: it is turned outward where the mesh is used\n"), "{said}");
    // Area and volume are those of the triangles that count.
    let mut doubled = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    doubled.triangles.extend_from_within(..6);
    let report = faults(&folder, &doubled);
    assert_eq!((&report["area_m2"], &report["volume_m3"]), (&6.0.into(), &1.0.into()));
    assert_eq!((&report["doubled_triangles"], &report["solid"]), (&6.into(), &true.into()));
}

#[test]
fn mesh_check_says_what_joining_vertices_by_position_hides() {
    let folder = folder();
    let whole = shapes::cuboid([1.0; 3]);
    let positions: Vec<_> =
        whole.triangles.as_flattened().iter().map(|&vertex| whole.positions[vertex as usize]).collect();
    let triangles = (0..12).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)).collect();
    let report = faults(&folder, &TriMesh { positions, triangles });
    let by_index = &report["by_index"];
    assert_eq!((&report["solid"], &report["open_edges"]), (&true.into(), &0.into()));
    assert_eq!((&by_index["watertight"], &by_index["open_edges"]), (&false.into(), &36.into()));
    let said = works(&folder, "mesh check mesh.ply");
    assert!(said.contains("mesh.ply: a solid, once vertices at one position are joined"), "{said}");
    assert!(said.contains("36 edges with one triangle, by the vertices' indices"), "{said}");
    // Two boxes with a corner in common.
    let [mut two, second] = [[-1.0, 0.0], [0.0, 1.0]].map(|[low, high]| TriMesh::cuboid([low; 3], [high; 3]));
    two.append(&second);
    let report = faults(&folder, &two);
    assert_eq!((&report["non_manifold_vertices"], &report["embedded"]), (&1.into(), &true.into()));
    assert_eq!((&report["genus"], &report["by_index"]["watertight"]), (&0.into(), &true.into()));
    let said = works(&folder, "mesh check mesh.ply");
    assert!(said.contains("1 non-manifold vertex: its triangles form no single fan\n"), "{said}");
}

#[test]
fn mesh_check_of_real_meshes_finds_their_known_faults() {
    let Some(bunny) = character::data("mesh/stanford-bunny.obj") else {
        return skipped("no outside data");
    };
    let folder = folder();
    let report: Value =
        serde_json::from_str(&works(&folder, &format!("mesh check {} --json", bunny.display()))).unwrap();
    assert_eq!((&report[0]["triangles"], &report[0]["holes"]), (&69_451.into(), &5.into()));
}

#[test]
fn meshes_pass_through_every_format() {
    let folder = folder();
    for (from, to) in [("box.obj", "a.stl"), ("a.stl", "b.ply"), ("b.ply", "c.obj")] {
        works(&folder, &format!("convert {from} {to}"));
    }
    let (before, after) = (mesh::read(&folder.join("box.obj")), mesh::read(&folder.join("c.obj")));
    let (before, after) = (before.unwrap(), after.unwrap());
    assert!((before.volume() - after.volume()).abs() < 1e-9 && after.is_manifold());
    assert_eq!(before.triangles.len(), after.triangles.len());
    works(&folder, "convert box.obj big.ply --scale 0.01 --to-scale 1000 --to-up z");
    let big = mesh::read(&folder.join("big.ply")).unwrap();
    assert!((big.volume() - 64.0).abs() < 1e-4);
    works(&folder, "convert big.ply back.ply --up z --scale 0.1");
    let back = mesh::read(&folder.join("back.ply")).unwrap();
    let same = back.positions.iter().zip(&before.positions).all(|(p, q)| (p - q).norm() < 1e-6);
    assert!(same && back.volume() > 0.0);
    fails(&folder, "convert box.obj out.fbx", &["out.fbx", ".usda"]);
    fails(&folder, "convert box.obj out.%04d.obj --frames 1-2", &["--frames"]);
}

#[test]
fn sequences_and_characters_become_files_a_frame() {
    let folder = Folder::empty();
    character::sequence_scene(&folder, 3, 12);
    works(&folder, "convert ball.%04d.obj out.%04d.usda --frames 1-2");
    let text = fs::read_to_string(folder.join("out.0002.usda")).unwrap();
    assert!(text.contains("def Mesh \"ball\"") && text.contains("velocities.timeSamples = { 2: ["), "{text}");
    fails(&folder, "convert ball.%04d.obj out.ply --frames 1-2", &["pattern"]);
    fails(&folder, "convert ball.%04d.obj out.%04d.ply", &["--frames"]);
    let Some(man) = character::data("character/CesiumMan.glb") else {
        return skipped("no outside data");
    };
    works(&folder, &format!("convert {} man.%04d.ply --frames 1001-1003", man.display()));
    let man = mesh::read(&folder.join("man.1003.ply")).unwrap();
    assert_eq!(man.triangles.len(), 4672);
    assert!(man.volume() > 0.0);
}
