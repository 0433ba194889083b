//! What of glTF is optional, and what comes by extensions.

use std::fs;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::motion::{Character, Motion, Play};
use serde_json::json;

use crate::common::gltf_maker::Maker;
use crate::common::gltf_variants::{Geometry, complete, geometry, variants};
use crate::program::Folder;

#[test]
fn optional_fields_may_be_left_out() {
    let folder = Folder::empty();
    for seed in 0..12 {
        let whole = complete(seed);
        let expected = geometry(&whole.write(&folder)).unwrap();
        assert!(expected.1[0] != expected.1[3], "it moves");
        let variants = variants(&whole);
        assert!(variants.len() > 150, "{}", variants.len());
        for (field, variant) in variants {
            assert_eq!(geometry(&variant.write(&folder)).as_ref(), Ok(&expected), "without {field}");
        }
    }
}

#[test]
fn extensions_that_are_needed_and_not_read_are_named() {
    let folder = Folder::empty();
    for name in ["KHR_draco_mesh_compression", "KHR_node_visibility", "ACME_custom", "odd"] {
        let mut maker = complete(1);
        maker.json["extensionsRequired"] = json!(["KHR_materials_unlit", name]);
        let said = geometry(&maker.write(&folder)).unwrap_err();
        assert!(said.contains(&format!("needs the glTF extension {name}")), "{said}");
    }
}

/// The triangle of [`Maker::triangle`] in instances.
fn instanced(attributes: impl FnOnce(&mut Maker) -> serde_json::Value) -> Maker {
    let mut maker = Maker::new();
    let mesh = maker.triangle();
    let attributes = attributes(&mut maker);
    maker.push(
        "nodes",
        json!({ "mesh": mesh, "translation": [10, 0, 0],
            "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } } }),
    );
    maker.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    maker
}

#[test]
fn instances_are_copies_at_their_places() {
    let folder = Folder::empty();
    let maker = instanced(|maker| {
        let places = maker.floats("VEC3", 3, &[0., 0., 0., 0., 5., 0., 0., 0., 7.]);
        let turn = (0.5f32).sqrt();
        let turns = maker.floats("VEC4", 3, &[0., 0., 0., 1., 0., 0., turn, turn, 0., 0., 0., 1.]);
        let scales = maker.floats("VEC3", 3, &[1., 1., 1., 2., 2., 2., -1., 1., 1.]);
        json!({ "TRANSLATION": places, "ROTATION": turns, "SCALE": scales })
    });
    let character = Character::open(&maker.write(&folder), Play::default()).unwrap();
    // The mirrored copy's face is turned, so that its outside stays outside.
    assert_eq!(character.triangles(), [[0, 1, 2], [3, 4, 5], [6, 8, 7]]);
    let mut pose = Vec::new();
    character.pose(0.0, &mut pose).unwrap();
    let expected = [[10., 0., 0.], [11., 0., 0.], [10., 1., 0.]]
        .into_iter()
        .chain([[10., 5., 0.], [10., 7., 0.], [8., 5., 0.]])
        .chain([[10., 0., 7.], [9., 0., 7.], [10., 1., 7.]]);
    for (position, expected) in pose.iter().zip(expected) {
        assert!((position - DVec3::from(expected)).norm() < 1e-6, "{position} is not {expected:?}");
    }
    let drawn = character.drawn();
    assert_eq!((drawn.vertices, drawn.triangles), (9, &[[0, 1, 2], [3, 4, 5], [6, 8, 7]][..]));
    let mut positions = Vec::new();
    character.drawn_pose(0.0, &mut positions).unwrap();
    assert_eq!(positions, pose);
}

#[test]
fn instances_that_cannot_be_are_a_sentence() {
    let folder = Folder::empty();
    let refused = |maker: Maker| geometry(&maker.write(&folder)).unwrap_err();
    let said = refused(instanced(|maker| {
        let places = maker.floats("VEC3", 2, &[0.0; 6]);
        let scales = maker.floats("VEC3", 3, &[1.0; 9]);
        json!({ "TRANSLATION": places, "SCALE": scales })
    }));
    assert!(said.contains("different counts"), "{said}");
    let said = refused(instanced(|_| json!({ "TRANSLATION": 77 })));
    assert!(said.contains("an accessor that does not exist"), "{said}");
    // Many copies of a large mesh, out of a small file.
    let mut maker = Maker::new();
    let corners = 3 * 20_000;
    let positions = maker.floats("VEC3", corners, &vec![1.0; 3 * corners]);
    maker.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
    let attributes = json!({ "TRANSLATION": positions });
    let extension = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    maker.push("nodes", json!({ "mesh": 0, "extensions": extension }));
    let said = refused(maker);
    assert!(said.contains("60000 instances of 20000 triangles"), "{said}");
}

#[test]
fn channels_without_a_node_are_passed_over_and_pointers_are_followed() {
    let folder = Folder::empty();
    let mut maker = Maker::with_triangle();
    maker.clip("go");
    maker.channel(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 4., 0., 0.]);
    maker.channel(0, "scale", "LINEAR", &[0.0, 2.0], &[1., 1., 1., 3., 1., 1.]);
    let target = &mut maker.json["animations"][0]["channels"][1]["target"];
    let pointing = |pointer: &str| json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": pointer } } });
    *target = pointing("/nodes/0/scale");
    let (_, poses) = geometry(&maker.write(&folder)).unwrap();
    // At 1 s: moved by 4 and scaled by 2.
    assert_eq!(poses[3][1], DVec3::new(6.0, 0.0, 0.0));
    maker.json["animations"][0]["channels"][1]["target"] = pointing("/materials/0/alphaCutoff");
    maker.json["extensionsRequired"] = json!(["KHR_animation_pointer"]);
    let (_, poses) = geometry(&maker.write(&folder)).unwrap();
    assert_eq!(poses[3][1], DVec3::new(5.0, 0.0, 0.0));
}

#[test]
fn clips_of_one_name_are_numbered_and_never_confused() {
    let folder = Folder::empty();
    let mut maker = Maker::with_triangle();
    for (name, x) in [("go", 1.0), ("go #1", 2.0), ("go", 3.0), ("stay", 4.0)] {
        maker.clip(name);
        maker.channel(0, "translation", "STEP", &[0.0, 1.0], &[x, 0., 0., x, 0., 0.]);
    }
    let path = maker.write(&folder);
    let names: Vec<String> =
        Character::describe(&path).unwrap().clips.into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["go #2", "go #1", "go #3", "stay"]);
    let open = |clip: &str| {
        let character = Character::open(&path, Play { clip: Some(clip.into()), ..Play::default() })?;
        let mut pose = Vec::new();
        character.pose(0.0, &mut pose)?;
        Ok::<f64, frazil::Error>(pose[0].x)
    };
    for (name, x) in names.iter().zip([1.0, 2.0, 3.0, 4.0]) {
        assert_eq!(open(name).unwrap(), x, "{name}");
    }
    let said = open("go").unwrap_err().to_string();
    assert!(said.contains("has 2 clips \"go\": choose one of \"go #2\""), "{said}");
}

/// A closed tetrahedron, skinned to joint 1 or hung on node 1, under a root with a scale.
fn tetrahedron(skinned: bool, scale: [f64; 3]) -> Maker {
    let mut maker = Maker::new();
    let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    let faces = [0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3].map(|corner: usize| corners[corner]);
    let positions = maker.floats("VEC3", 12, faces.as_flattened());
    let mut attributes = json!({ "POSITION": positions });
    if skinned {
        attributes["JOINTS_0"] = json!(maker.accessor(5121, "VEC4", 12, &[0; 48]));
        attributes["WEIGHTS_0"] = json!(maker.floats("VEC4", 12, &[1.0, 0.0, 0.0, 0.0].repeat(12)));
        maker.push("skins", json!({ "joints": [1] }));
    }
    maker.push("meshes", json!({ "primitives": [{ "attributes": attributes }] }));
    maker.push("nodes", json!({ "children": [1, 2], "scale": scale }));
    maker.push("nodes", json!({ "name": "joint" }));
    maker.push("nodes", if skinned { json!({ "mesh": 0, "skin": 0 }) } else { json!({ "mesh": 0 }) });
    maker.clip("turn");
    maker.channel(1, "rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 1., 0., 0.]);
    maker
}

#[test]
fn an_ancestor_that_mirrors_turns_faces_skinned_or_not() {
    let folder = Folder::empty();
    for skinned in [false, true] {
        for scale in [[1., 1., 1.], [-1., 1., 1.], [-2., -1., 1.], [-1., -1., -1.]] {
            let path = tetrahedron(skinned, scale).write(&folder);
            let (triangles, poses) = geometry(&path).unwrap();
            let expected = scale.iter().product::<f64>().abs() / 6.0;
            let volumes: Vec<f64> = poses.iter().map(|pose| volume(&triangles, pose)).collect();
            assert!(
                volumes.iter().all(|volume| (volume - expected).abs() < 1e-6),
                "skinned {skinned} {scale:?}: {volumes:?}"
            );
            let rest = Character::at_rest(&path).unwrap();
            assert!((rest.volume() - expected).abs() < 1e-6);
        }
    }
}

fn volume(triangles: &[[u32; 3]], pose: &[DVec3]) -> f64 {
    let six = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|vertex| pose[vertex as usize]);
        a.dot(&b.cross(&c))
    };
    triangles.iter().map(six).sum::<f64>() / 6.0
}

#[test]
fn joints_of_zeros_need_no_data() {
    let folder = Folder::empty();
    let whole = tetrahedron(true, [1.0; 3]);
    let expected = geometry(&whole.write(&folder)).unwrap();
    let mut without = tetrahedron(true, [1.0; 3]);
    let joints = without.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"].as_u64().unwrap();
    without.json["accessors"][joints as usize].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(geometry(&without.write(&folder)).unwrap(), expected);
}

/// The file with all of its buffer views of floats and of indices compressed by meshoptimizer; their plain data is gone.
fn compressed(mut maker: Maker) -> Maker {
    let plain = std::mem::take(&mut maker.bytes);
    let views = maker.json["bufferViews"].as_array().unwrap().clone();
    for (at, view) in views.iter().enumerate() {
        let [begin, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        let data = &plain[begin..begin + length];
        let accessor =
            maker.json["accessors"].as_array().unwrap().iter().find(|a| a["bufferView"] == at).unwrap();
        let count = accessor["count"].as_u64().unwrap() as usize;
        let stride = length / count;
        let mut packed = vec![0u8; 4096 + 4 * length];
        let rows_of_12: Vec<[u8; 12]> = data.chunks_exact(12).map(|row| row.try_into().unwrap()).collect();
        let (mode, size) =
            match (accessor["type"].as_str().unwrap(), accessor["componentType"].as_u64().unwrap()) {
                ("VEC3", 5126) => (
                    "ATTRIBUTES",
                    meshopt_rs::vertex::buffer::encode_vertex_buffer(
                        &mut packed,
                        &rows_of_12,
                        Default::default(),
                    )
                    .unwrap(),
                ),
                ("SCALAR", 5125) => {
                    let word = |b: &[u8]| u32::from_le_bytes(b.try_into().unwrap());
                    let indices: Vec<u32> = data.chunks_exact(4).map(word).collect();
                    let size = meshopt_rs::index::buffer::encode_index_buffer(
                        &mut packed,
                        &indices,
                        Default::default(),
                    );
                    ("TRIANGLES", size.unwrap())
                }
                _ => {
                    packed[..length].copy_from_slice(data);
                    ("", length)
                }
            };
        let begin = maker.bytes.len();
        maker.bytes.extend(&packed[..size]);
        maker.bytes.resize(maker.bytes.len().next_multiple_of(4), 0);
        let view = &mut maker.json["bufferViews"][at];
        if mode.is_empty() {
            view["byteOffset"] = json!(begin);
        } else {
            view["buffer"] = json!(1);
            view["byteOffset"] = json!(0);
            view["extensions"] = json!({ "EXT_meshopt_compression": { "buffer": 0, "byteOffset": begin,
                "byteLength": size, "byteStride": stride, "count": count, "mode": mode } });
        }
    }
    maker.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    maker.json["buffers"] = json!([
        { "byteLength": maker.bytes.len() },
        { "byteLength": plain.len(), "extensions": { "EXT_meshopt_compression": { "fallback": true } } },
    ]);
    maker
}

/// Like [`geometry`], with the order of corners in triangles free: the encoder turns them.
fn turned(path: &Path) -> Geometry {
    let (mut triangles, poses) = geometry(path).unwrap();
    for triangle in &mut triangles {
        let least = (0..3).min_by_key(|at| triangle[*at]).unwrap();
        triangle.rotate_left(least);
    }
    (triangles, poses)
}

#[test]
fn compressed_views_are_read_and_damaged_ones_refused() {
    let folder = Folder::empty();
    // Seed 2 has 32-bit indices.
    let expected = turned(&complete(2).write(&folder));
    let maker = compressed(complete(2));
    assert_eq!(turned(&maker.write(&folder)), expected);
    let path = folder.join("damaged.glb");
    let whole = maker.glb();
    let (mut read, mut refused) = (0, 0);
    for at in (0..maker.bytes.len()).step_by(3) {
        let mut bytes = whole.clone();
        let at = whole.len() - maker.bytes.len() + at;
        bytes[at] ^= 0x5a;
        fs::write(&path, &bytes).unwrap();
        match geometry(&path) {
            Ok(_) => read += 1,
            Err(said) => {
                refused += 1;
                assert!(said.contains("damaged.glb"), "{said}");
            }
        }
    }
    assert!(read > 0 && refused > 0, "{read} {refused}");
    let mut large = compressed(complete(2));
    let views = large.json["bufferViews"].as_array_mut().unwrap();
    let view = views.iter_mut().find(|view| view.get("extensions").is_some()).unwrap();
    view["extensions"]["EXT_meshopt_compression"]["count"] = json!(1_000_000_000u64);
    let said = geometry(&large.write(&folder)).unwrap_err();
    assert!(said.contains("shorter than its count"), "{said}");
}
