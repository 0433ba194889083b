//! Valid glTF files that say the same with fewer words: a file with every optional field, all of them with values that change
//! nothing, and its variants, each without one of these.

use frazil::geometry::DVec3;
use frazil::motion::{Character, Motion, Play};
use serde_json::{Map, Value, json};
use std::path::Path;

use super::gltf_maker::Maker;

/// Times (s) at which poses are compared.
const TIMES: [f64; 4] = [0.0, 0.3, 0.7, 1.0];
/// Required extensions that touch no geometry, or that the file uses.
const REQUIRED: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_lights_punctual",
    "KHR_xmp_json_ld",
];

/// Triangles, and the positions of their corners at each of [`TIMES`].
pub type Geometry = (Vec<[u32; 3]>, Vec<Vec<DVec3>>);

/// What a file makes of its geometry; the refusal if it is refused.
pub fn geometry(path: &Path) -> Result<Geometry, String> {
    let play = Play { repeat: false, ..Play::default() };
    let character = Character::open(path, play).map_err(|error| error.to_string())?;
    let pose = |time: &f64| {
        let mut out = Vec::new();
        character.pose(*time, &mut out).map_err(|error| error.to_string())?;
        Ok(out)
    };
    let poses = TIMES.iter().map(pose).collect::<Result<_, String>>()?;
    Ok((character.triangles().to_vec(), poses))
}

/// A skinned mesh of two joints beside a morphed one, under a root; shape, component types and nesting by the seed.
pub fn complete(seed: u32) -> Maker {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12345);
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut maker = Maker::new();
    let triangles = 2 + (random() * 4.0) as usize;
    let corners = 3 * triangles;
    let places: Vec<f32> = (0..3 * corners).map(|_| 4.0 * random() - 2.0).collect();
    let positions = maker.floats("VEC3", corners, &places);
    let normals = maker.floats("VEC3", corners, &[0.0, 1.0, 0.0].repeat(corners));
    let tangents = maker.floats("VEC4", corners, &[1.0, 0.0, 0.0, 1.0].repeat(corners));
    let uvs = maker.floats("VEC2", corners, &[0.5, 0.25].repeat(corners));
    let colours = maker.floats("VEC4", corners, &[1.0; 4].repeat(corners));
    let custom = maker.floats("SCALAR", corners, &vec![7.0; corners]);
    // Indices that name the corners in their order, so that a file without them says the same.
    let (kind, indices): (u32, Vec<u8>) = match seed % 3 {
        0 => (5121, (0..corners).map(|index| index as u8).collect()),
        1 => (5123, (0..corners as u16).flat_map(u16::to_le_bytes).collect()),
        _ => (5125, (0..corners as u32).flat_map(u32::to_le_bytes).collect()),
    };
    let indices = maker.accessor(kind, "SCALAR", corners, &indices);
    let joints = match seed % 2 {
        0 => maker.accessor(5121, "VEC4", corners, &[0, 1, 0, 0].repeat(corners)),
        _ => maker.accessor(5123, "VEC4", corners, &[0, 0, 1, 0, 0, 0, 0, 0].repeat(corners)),
    };
    let weights = match seed % 4 {
        0 => maker.accessor(5121, "VEC4", corners, &[204, 51, 0, 0].repeat(corners)),
        1 => maker.accessor(5123, "VEC4", corners, &[255, 127, 0, 128, 0, 0, 0, 0].repeat(corners)),
        _ => maker.floats("VEC4", corners, &[0.75, 0.25, 0.0, 0.0].repeat(corners)),
    };
    if seed.is_multiple_of(4) || seed % 4 == 1 {
        maker.json["accessors"][weights]["normalized"] = json!(true);
    }
    let identity: Vec<f32> = (0..16).map(|at| if at % 5 == 0 { 1.0 } else { 0.0 }).collect();
    let inverse_bind = maker.floats("MAT4", 2, &identity.repeat(2));
    let primitive = json!({
        "attributes": { "POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs,
            "COLOR_0": colours, "_ID": custom, "JOINTS_0": joints, "WEIGHTS_0": weights },
        "indices": indices, "mode": 4, "material": 0, "extras": { "note": [1] },
        "extensions": { "KHR_materials_variants": { "mappings": [{ "material": 0, "variants": [0] }] } },
    });
    maker.push("meshes", json!({ "name": "body", "primitives": [primitive], "extras": {} }));
    // Two targets that move nothing: one of zeros that are stored, one that is all sparse.
    let zeros = maker.floats("VEC3", corners, &vec![0.0; 3 * corners]);
    let at = maker.accessor(5121, "SCALAR", 1, &[1]);
    let offset = maker.floats("VEC3", 1, &[0.0, 3.0, 0.0]);
    let view = |maker: &Maker, accessor: usize| maker.json["accessors"][accessor]["bufferView"].clone();
    let sparse = json!({
        "componentType": 5126, "type": "VEC3", "count": corners, "min": [0, 0, 0], "max": [0, 3, 0],
        "sparse": { "count": 1, "indices": { "bufferView": view(&maker, at), "byteOffset": 0, "componentType": 5121 },
            "values": { "bufferView": view(&maker, offset), "byteOffset": 0 } },
    });
    maker.push("accessors", sparse);
    let sparse = maker.json["accessors"].as_array().unwrap().len() - 1;
    maker.push(
        "meshes",
        json!({ "name": "face", "weights": [0.0, 0.0], "primitives": [{
            "attributes": { "POSITION": positions }, "indices": indices, "mode": 4,
            "targets": [{ "POSITION": zeros, "NORMAL": zeros, "TANGENT": zeros }, { "POSITION": sparse }] }] }),
    );
    let still = json!({ "translation": [0, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1] });
    let with_still = |value: Value| {
        let mut value = value;
        value.as_object_mut().unwrap().extend(still.as_object().unwrap().clone());
        value
    };
    let matrix: Vec<f64> = identity.iter().map(|value| f64::from(*value)).collect();
    maker.push(
        "nodes",
        with_still(json!({ "name": "root", "children": [1, 2, 4, 5], "camera": 0, "extras": 3 })),
    );
    maker.push("nodes", json!({ "name": "skinned", "mesh": 0, "skin": 0 }));
    maker.push("nodes", with_still(json!({ "name": "hip", "children": [3] })));
    maker.push("nodes", with_still(json!({ "name": "knee" })));
    maker.push("nodes", json!({ "name": "face", "mesh": 1, "weights": [0.0, 0.0], "matrix": matrix }));
    maker.push("nodes", json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    maker.push(
        "skins",
        json!({ "name": "skin", "joints": [2, 3], "skeleton": 2, "inverseBindMatrices": inverse_bind }),
    );
    maker.clip("walk");
    let ends: Vec<f32> = (0..6).map(|_| random()).collect();
    maker.channel(2, "translation", "LINEAR", &[0.0, 1.0], &ends);
    let half = (0.5 * random()).sin();
    let turn = [0., 0., 0., 1., 0., half, 0., (1.0 - half * half).sqrt()];
    maker.channel(3, "rotation", "LINEAR", &[0.0, 1.0], &turn);
    // A channel that changes nothing, with a node and without.
    maker.channel(3, "scale", "LINEAR", &[0.0, 1.0], &[1.0; 6]);
    for (list, value) in [
        ("cameras", json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } })),
        ("images", json!({ "uri": "skin.webp", "mimeType": "image/webp", "name": "skin" })),
        ("samplers", json!({ "magFilter": 9729, "wrapS": 33071 })),
        ("textures", json!({ "sampler": 0, "extensions": { "EXT_texture_webp": { "source": 0 } } })),
        (
            "materials",
            json!({ "name": "skin", "doubleSided": true, "alphaMode": "BLEND",
                "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1], "baseColorTexture": { "index": 0,
                    "texCoord": 0, "extensions": { "KHR_texture_transform": { "offset": [0, 1] } } } },
                "extensions": { "KHR_materials_unlit": {} } }),
        ),
    ] {
        maker.json[list] = json!([value]);
    }
    let used = [&REQUIRED[..], &["KHR_animation_pointer", "EXT_meshopt_compression"]].concat();
    let root = json!({
        "extras": { "made": "by code" }, "extensionsRequired": REQUIRED,
        "extensionsUsed": used,
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point" }] } },
        "asset": { "version": "2.0", "minVersion": "2.0", "generator": "tests", "copyright": "none" },
    });
    maker.json.as_object_mut().unwrap().extend(root.as_object().unwrap().clone());
    for view in maker.json["bufferViews"].as_array_mut().unwrap() {
        let fields = view.as_object_mut().unwrap();
        fields.insert("name".into(), json!("view"));
        fields.insert("target".into(), json!(34962));
    }
    for accessor in maker.json["accessors"].as_array_mut().unwrap() {
        let fields = accessor.as_object_mut().unwrap();
        fields.insert("name".into(), json!("accessor"));
        fields.entry("normalized").or_insert(json!(false));
        if fields.contains_key("bufferView") {
            fields.insert("byteOffset".into(), json!(0));
        }
    }
    maker
}

/// The file without each of its optional fields in turn, with the field's path.
pub fn variants(whole: &Maker) -> Vec<(String, Maker)> {
    let mut paths = Vec::new();
    collect(&whole.json, "", &mut paths);
    let is_optional = |path: &&String| is_optional(whole, path);
    let without = |path: &String| {
        let (parent, key) = path.rsplit_once('/').unwrap();
        let mut variant = Maker { json: whole.json.clone(), bytes: whole.bytes.clone() };
        object(&mut variant.json, parent).remove(key);
        (path.clone(), variant)
    };
    paths.iter().filter(is_optional).map(without).collect()
}

fn object<'a>(root: &'a mut Value, path: &str) -> &'a mut Map<String, Value> {
    root.pointer_mut(path).unwrap().as_object_mut().unwrap()
}

/// Paths of all fields of objects, at any depth.
fn collect(value: &Value, path: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let path = format!("{path}/{key}");
                collect(value, &path, out);
                out.push(path);
            }
        }
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(at, value)| collect(value, &format!("{path}/{at}"), out));
        }
        _ => {}
    }
}

/// Whether a file is valid without a field, and means the same.
fn is_optional(whole: &Maker, path: &str) -> bool {
    let parts: Vec<&str> = path.split('/').skip(1).collect();
    let key = parts[parts.len() - 1];
    // Whatever extensions and materials hold is not geometry.
    if parts
        .iter()
        .any(|part| ["extensions", "extras", "materials", "images", "textures", "samplers"].contains(part))
        && parts[0] != "animations"
    {
        return true;
    }
    match parts[..] {
        [list] => !["nodes", "meshes", "skins", "animations", "accessors", "bufferViews", "asset", "scenes"]
            .contains(&list),
        ["asset", key] => key != "version",
        ["scenes", ..] => key == "name",
        ["nodes", ..] => !["children", "mesh", "skin"].contains(&key),
        ["skins", ..] => key != "joints",
        ["meshes", _, "primitives"] | ["meshes", _, "primitives", _, "attributes"] => false,
        ["meshes", _, "primitives", _, "targets", target, "POSITION"] => target == "0",
        ["meshes", _, "primitives", _, "targets"] => false,
        ["meshes", ..] => !["POSITION", "JOINTS_0", "WEIGHTS_0"].contains(&key),
        ["accessors", _, "sparse", ..] => key == "byteOffset",
        ["accessors", at, "bufferView"] => is_zero(whole, at.parse().unwrap()),
        ["accessors", ..] if key == "normalized" => whole.json.pointer(path) == Some(&json!(false)),
        ["accessors", ..] => ["byteOffset", "min", "max", "name"].contains(&key),
        ["bufferViews", ..] => match key {
            "byteOffset" => whole.json.pointer(path) == Some(&json!(0)),
            _ => ["name", "target"].contains(&key),
        },
        ["animations", _, "samplers", _, key] => key == "interpolation",
        // The last channel changes nothing.
        ["animations", _, "channels", "2", "target", key] => key == "node",
        ["animations", _, key] => key == "name",
        ["animations", ..] => false,
        ["cameras", ..] => true,
        _ => false,
    }
}

/// Whether an accessor holds zeros only, which need no data.
fn is_zero(whole: &Maker, accessor: usize) -> bool {
    let accessor = &whole.json["accessors"][accessor];
    let view = &whole.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [begin, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
    whole.bytes[begin..begin + length].iter().all(|byte| *byte == 0)
}
