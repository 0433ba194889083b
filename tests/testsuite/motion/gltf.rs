//! glTF characters: against formulas, against Blender, and files that are wrong in every way.

use crate::common::skip::skipped;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use crate::common::character;
use crate::common::hero;
use frazil::geometry::DVec3;
use frazil::motion::{Character, Key, Keys, Motion, Placed, Play, Space};
use frazil::sweep::Body;
use proptest::prelude::*;
use serde_json::json;

use crate::common::gltf_maker::Maker;
use crate::program::Folder;

fn open(path: &Path) -> Character {
    Character::open(path, Play { repeat: false, ..Play::default() }).unwrap()
}

fn pose(character: &dyn Motion, time: f64) -> Vec<DVec3> {
    let mut out = Vec::new();
    character.pose(time, &mut out).unwrap();
    out
}

#[track_caller]
fn close(a: DVec3, b: [f64; 3]) {
    assert!((a - DVec3::from(b)).norm() < 1e-6, "{a} is not {b:?}");
}

#[test]
fn step_linear_and_cubic_keys_follow_their_formulas() {
    let folder = Folder::empty();
    let times = [1.0, 2.0, 4.0];
    let flat = |x: [f32; 3]| x.iter().flat_map(|x| [*x, 0.0, 0.0]).collect::<Vec<f32>>();
    // In-tangent, value, out-tangent of each key: x = t^3 on all of them.
    let cubic: Vec<f32> =
        times.iter().flat_map(|t: &f32| flat([3.0 * t * t, t * t * t, 3.0 * t * t])).collect();
    for (how, values, expected) in [
        ("STEP", flat([5.0, 6.0, 7.0]), [(0.0, 5.0), (1.9, 5.0), (2.0, 6.0), (3.9, 6.0), (9.0, 7.0)]),
        ("LINEAR", flat([5.0, 6.0, 8.0]), [(0.0, 5.0), (1.25, 5.25), (2.0, 6.0), (3.0, 7.0), (9.0, 8.0)]),
        ("CUBICSPLINE", cubic, [(0.0, 1.0), (1.5, 3.375), (2.0, 8.0), (3.3, 35.937), (9.0, 64.0)]),
    ] {
        let mut maker = Maker::with_triangle();
        maker.clip("move");
        maker.channel(0, "translation", how, &times, &values);
        let character = open(&maker.write(&folder));
        for (time, x) in expected {
            // The clip's first key is at its start.
            close(pose(&character, time - 1.0)[0], [x, 0.0, 0.0]);
        }
    }
}

#[test]
fn rotations_take_the_shorter_way_and_nodes_carry_their_children() {
    let folder = Folder::empty();
    let mut maker = Maker::new();
    let mesh = maker.triangle();
    maker.push("nodes", json!({ "children": [1], "translation": [0, 0, 2], "scale": [2, 2, 2] }));
    maker.push("nodes", json!({ "mesh": mesh, "translation": [1, 0, 0] }));
    maker.clip("turn");
    // From 0 to 90 degrees about y, the second key with its sign turned round.
    let half = (PI / 4.0).sin() as f32;
    maker.channel(0, "rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., -half, 0., -half]);
    let character = open(&maker.write(&folder));
    close(pose(&character, 0.0)[0], [2.0, 0.0, 2.0]);
    let (sine, cosine) = (PI / 8.0).sin_cos();
    close(pose(&character, 0.25)[0], [2.0 * cosine, 0.0, 2.0 - 2.0 * sine]);
    close(pose(&character, 1.0)[0], [0.0, 0.0, 0.0]);
    close(pose(&character, 1.0)[2], [0.0, 2.0, 0.0]);
}

#[test]
fn morph_targets_add_their_parts() {
    let folder = Folder::empty();
    let mut maker = Maker::new();
    let positions = maker.floats("VEC3", 3, &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let up = maker.floats("VEC3", 3, &[0., 0., 4., 0., 0., 0., 0., 0., 0.]);
    let side = maker.floats("VEC3", 3, &[0., 1., 0., 0., 0., 0., 0., 0., 0.]);
    maker.push(
        "meshes",
        json!({ "weights": [0.5, 0], "primitives": [{
            "attributes": { "POSITION": positions }, "targets": [{ "POSITION": up }, { "POSITION": side }],
        }] }),
    );
    maker.push("nodes", json!({ "mesh": 0 }));
    maker.clip("morph");
    maker.channel(0, "weights", "LINEAR", &[0.0, 1.0], &[0.5, 0.0, 1.0, 3.0]);
    let path = maker.write(&folder);
    close(pose(&open(&path), 0.5)[0], [0.0, 1.5, 3.0]);
    let rest = Character::open(&path, Play { clip: Some(String::new()), ..Play::default() }).unwrap();
    close(pose(&rest, 7.0)[0], [0.0, 0.0, 2.0]);
}

/// Two triangles side by side whose common corners are written twice; skinned to two joints.
fn strip(weights_differ: bool) -> Maker {
    let mut maker = Maker::new();
    let places = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    let positions = maker.floats("VEC3", 6, &places);
    let joints = maker.accessor(5121, "VEC4", 6, &[0, 1, 0, 0].repeat(6));
    let mut weights = [0.5, 0.5, 0.0, 0.0].repeat(6);
    if weights_differ {
        weights[3 * 4..3 * 4 + 2].copy_from_slice(&[0.25, 0.75]);
    }
    // Weights that do not add up to 1 are shares all the same.
    weights[..2].copy_from_slice(&[2.0, 2.0]);
    let weights = maker.floats("VEC4", 6, &weights);
    maker.push(
        "meshes",
        json!({ "primitives": [{ "attributes": { "POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights } }] }),
    );
    maker.push("nodes", json!({ "children": [1, 2, 3], "translation": [0, 0, 9] }));
    // A skinned mesh does not follow its own node.
    maker.push("nodes", json!({ "name": "skinned", "mesh": 0, "skin": 0, "translation": [7, 7, 7] }));
    maker.push("nodes", json!({ "name": "still" }));
    maker.push("nodes", json!({ "name": "moving" }));
    maker.push("skins", json!({ "joints": [2, 3] }));
    maker.clip("slide");
    maker.channel(3, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 4., 0., 0.]);
    maker
}

#[test]
fn skins_share_their_joints_and_equal_vertices_are_welded() {
    let folder = Folder::empty();
    let whole = open(&strip(false).write(&folder));
    assert_eq!(whole.vertex_count(), 4);
    close(pose(&whole, 1.0)[0], [2.0, 0.0, 9.0]);
    assert_eq!(Body::new(Box::new(whole), 0.0).unwrap().closed_loops(), 1);
    // One corner that hangs on its joints in another way stays a vertex of its own, though the positions are equal.
    let torn = open(&strip(true).write(&folder));
    assert_eq!(torn.vertex_count(), 5);
    close(pose(&torn, 1.0)[3], [1.0 + 3.0, 0.0, 9.0]);
}

#[test]
fn clips_start_where_they_are_asked_to_and_repeat() {
    let folder = Folder::empty();
    let mut maker = Maker::with_triangle();
    maker.clip("sway");
    maker.channel(0, "translation", "LINEAR", &[3., 4., 5.], &[0., 0., 0., 1., 0., 0., 0., 0., 0.]);
    let path = maker.write(&folder);
    let play = Play { start: 10.0, ..Play::default() };
    let character = Character::open(&path, play.clone()).unwrap();
    assert_eq!((character.duration(), character.jump(0.0, 10.0)), (2.0, None));
    for (time, x) in [(10.0, 0.0), (10.5, 0.5), (11.0, 1.0), (12.0, 0.0), (12.25, 0.25), (9.5, 0.5)] {
        close(pose(&character, time)[0], [x, 0.0, 0.0]);
    }
    let breaks = character.breaks(10.5, 13.5);
    assert!(breaks.iter().zip([11.0, 12.0, 13.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{breaks:?}");
    let once = Character::open(&path, Play { repeat: false, ..play }).unwrap();
    close(pose(&once, 12.25)[0], [0.0, 0.0, 0.0]);
    close(pose(&once, 9.5)[0], [0.0, 0.0, 0.0]);
}

#[test]
fn a_round_that_does_not_close_says_so_and_jumps_at_once() {
    let folder = Folder::empty();
    let mut maker = Maker::with_triangle();
    maker.clip("walk");
    maker.channel(0, "translation", "LINEAR", &[0., 1.], &[0., 0., 0., 3., 0., 0.]);
    let character = Character::open(&maker.write(&folder), Play::default()).unwrap();
    assert!((character.jump(0.0, 10.0).unwrap() - 3.0).abs() < 1e-6);
    let breaks = character.breaks(0.5, 1.5);
    assert_eq!(breaks.len(), 2, "{breaks:?}");
    assert!(pose(&character, breaks[0])[0].x > 2.99 && pose(&character, breaks[1] + 1e-9)[0].x < 0.01);
}

#[test]
fn mirrored_nodes_keep_their_outside_outside() {
    let folder = Folder::empty();
    let mut maker = Maker::new();
    let mesh = maker.triangle();
    maker.push("nodes", json!({ "mesh": mesh, "scale": [-1, 1, 1] }));
    assert_eq!(open(&maker.write(&folder)).triangles(), [[0, 2, 1]]);
}

#[test]
fn nodes_and_clips_that_do_not_exist_are_answered_with_those_that_do() {
    let folder = Folder::empty();
    let mut maker = strip(false);
    maker.clip("run");
    let path = maker.write(&folder);
    let refused = |node: Option<&str>, clip: Option<&str>| {
        let play = Play { node: node.map(str::to_string), clip: clip.map(str::to_string), ..Play::default() };
        Character::open(&path, play).err().map(|error| error.to_string()).unwrap_or_default()
    };
    for (node, clip, words) in [
        (None, None, ["2 clips", "\"run\""]),
        (None, Some("walk"), ["no clip \"walk\"", "\"slide\", \"run\""]),
        (Some("hero*"), Some("slide"), ["no node \"hero*\"", "\"skinned\""]),
    ] {
        let said = refused(node, clip);
        assert!(words.iter().all(|word| said.contains(word)) && said.contains("made.glb"), "{said}");
    }
    assert_eq!(refused(Some("skin*"), Some("slide")), "");
    assert_eq!(refused(Some("node 0"), Some("")), "");
}

#[test]
fn damaged_files_are_refused_with_their_name() {
    let folder = Folder::empty();
    let whole = strip(false).glb();
    let path = folder.join("cut.glb");
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        let error = Character::open(&path, Play::default()).err().unwrap().to_string();
        assert!(error.contains("cut.glb"), "{error}");
    }
    let mut json = strip(false).json;
    json["buffers"] = json!([{ "byteLength": 400, "uri": "arms.bin" }]);
    for list in ["skins", "animations"] {
        assert!(!json[list].as_array().unwrap().is_empty());
    }
    let gltf = folder.join("hero.gltf");
    fs::write(&gltf, json.to_string()).unwrap();
    let error = Character::open(&gltf, Play::default()).err().unwrap().to_string();
    assert!(error.contains("hero.gltf") && error.contains("arms.bin"), "{error}");
    fs::write(folder.join("arms.bin"), [0; 100]).unwrap();
    let error = Character::open(&gltf, Play::default()).err().unwrap().to_string();
    assert!(error.contains("100 bytes, not 400"), "{error}");
    for (list, key, value) in [
        ("accessors", "count", json!(7_000_000)),
        ("accessors", "byteOffset", json!(4_000_000_000u64)),
        ("bufferViews", "byteLength", json!(1_000_000)),
        ("nodes", "children", json!([0])),
    ] {
        let mut maker = strip(false);
        maker.json[list][0][key] = value;
        fs::write(&path, maker.glb()).unwrap();
        assert!(Character::open(&path, Play::default()).is_err(), "{list} {key}");
    }
    let mut draco = strip(false);
    draco.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    draco.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    fs::write(&path, draco.glb()).unwrap();
    let error = Character::open(&path, Play::default()).err().unwrap().to_string();
    assert!(error.contains("KHR_draco_mesh_compression"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_never_stop_the_program(at in prop::collection::vec((0usize..6000, any::<u8>()), 1..6)) {
        thread_local!(static FILE: (Folder, Vec<u8>) = (Folder::empty(), strip(true).glb()));
        FILE.with(|(folder, whole)| {
            let mut bytes = whole.clone();
            for (position, value) in at {
                let position = position % bytes.len();
                bytes[position] = value;
            }
            let path = folder.join("flipped.glb");
            fs::write(&path, &bytes).unwrap();
            if let Ok(character) = Character::open(&path, Play::default()) {
                pose(&character, 0.3);
            }
        });
    }
}

#[test]
fn the_foot_that_stands_does_not_slip_when_keys_carry_the_figure_at_its_speed() {
    let folder = Folder::empty();
    let path = folder.join("hero.glb");
    fs::write(&path, hero::glb()).unwrap();
    let play = Play { clip: Some("walk".into()), ..Play::default() };
    let inner = Character::open(&path, play).unwrap();
    assert_eq!(inner.jump(0.0, 10.0), None);
    let key = |time: f64| Key { time, at: DVec3::z() * f64::from(hero::SPEED) * time, turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(0.0), key(4.0)]).unwrap();
    let walker = Placed::new(Box::new(inner), Space::OWN, keys);
    let at = |step: i32| pose(&walker, f64::from(step) / 48.0);
    // The left sole stands in the first half of each round.
    let (start, middle, end) = (at(48), at(59), at(71));
    let sole: Vec<usize> = (0..start.len()).filter(|&v| start[v].y < 0.02 && start[v].x > 0.0).collect();
    assert!(sole.len() > 20);
    for &vertex in &sole {
        let slip = [&middle, &end].map(|pose| (pose[vertex] - start[vertex]).norm());
        assert!(slip.iter().all(|slip| *slip < 2e-3), "{slip:?}");
    }
    assert!(sole.iter().all(|&vertex| at(84)[vertex].y > 0.15), "then it is lifted");
}

#[test]
fn khronos_simple_skin_bends_as_its_keys_say() {
    let Some(path) = character::data("character/SimpleSkin.gltf") else {
        return skipped("no outside data");
    };
    let character = open(&path);
    assert_eq!((character.triangles().len(), character.vertex_count()), (8, 10));
    let rest = pose(&character, 0.0);
    close(rest[9], [0.5, 2.0, 0.0]);
    // At 1.5 s the upper joint, at (0, 1), has turned by 90 degrees about z: the top edge lies to its left.
    let turned = pose(&character, 1.5);
    close(turned[8], [-1.0, 0.5, 0.0]);
    close(turned[9], [-1.0, 1.5, 0.0]);
    close(turned[0], [-0.5, 0.0, 0.0]);
}

#[test]
fn skinning_is_blenders() {
    let Some(path) = character::data("character/CesiumMan.glb") else {
        return skipped("no outside data");
    };
    let (farthest, height) = character::farthest_from_blender(&path);
    assert!(farthest < 1e-5 * height, "{farthest} m of {height} m");
}
