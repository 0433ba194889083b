//! glTF files made by code.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

/// A glTF file in the making: its JSON and its one buffer.
pub struct Maker {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Maker {
    /// A file whose scene has node 0.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
            "nodes": [], "meshes": [], "skins": [], "animations": [], "accessors": [], "bufferViews": [],
        });
        Self { json, bytes: Vec::new() }
    }

    /// Adds an accessor with a buffer view of its own; `kind` is its component type.
    pub fn accessor(&mut self, kind: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let list = |name: &str, json: &Value| json[name].as_array().unwrap().len();
        let view = list("bufferViews", &self.json);
        let number = list("accessors", &self.json);
        let view_json = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        let mut accessor =
            json!({ "bufferView": view, "componentType": kind, "type": shape, "count": count });
        // The specification asks for the bounds of positions.
        accessor["min"] = json!([0, 0, 0]);
        accessor["max"] = json!([1, 1, 1]);
        self.push("bufferViews", view_json);
        self.push("accessors", accessor);
        self.bytes.extend_from_slice(bytes);
        number
    }

    /// As [`Maker::accessor`], of floats.
    pub fn floats(&mut self, shape: &str, count: usize, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(5126, shape, count, &bytes)
    }

    /// Adds an element to a list of the root.
    pub fn push(&mut self, list: &str, value: Value) {
        self.json[list].as_array_mut().unwrap().push(value);
    }

    /// A channel of the last clip.
    pub fn channel(&mut self, node: usize, path: &str, how: &str, times: &[f32], values: &[f32]) {
        let (shape, width) = match path {
            "weights" => ("SCALAR", 1),
            "rotation" => ("VEC4", 4),
            _ => ("VEC3", 3),
        };
        let input = self.floats("SCALAR", times.len(), times);
        let output = self.floats(shape, values.len() / width, values);
        let animation = self.json["animations"].as_array_mut().unwrap().last_mut().unwrap();
        let sampler = animation["samplers"].as_array().unwrap().len();
        let samplers = animation["samplers"].as_array_mut().unwrap();
        samplers.push(json!({ "input": input, "output": output, "interpolation": how }));
        let channels = animation["channels"].as_array_mut().unwrap();
        channels.push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
    }

    /// Begins a clip.
    pub fn clip(&mut self, name: &str) {
        self.push("animations", json!({ "name": name, "samplers": [], "channels": [] }));
    }

    /// A mesh of one triangle (0 0 0), (1 0 0), (0 1 0).
    pub fn triangle(&mut self) -> usize {
        let positions = self.floats("VEC3", 3, &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
        self.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
        self.json["meshes"].as_array().unwrap().len() - 1
    }

    /// The file as a .glb.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        // Empty lists are not allowed.
        for list in ["skins", "animations", "accessors", "bufferViews", "meshes"] {
            if json[list].as_array().is_some_and(Vec::is_empty) {
                json.as_object_mut().unwrap().remove(list);
            }
        }
        let padded = |mut bytes: Vec<u8>, with: u8| {
            bytes.resize(bytes.len().next_multiple_of(4), with);
            bytes
        };
        let (json, bytes) = (padded(json.to_string().into_bytes(), b' '), padded(self.bytes.clone(), 0));
        let mut out = b"glTF".to_vec();
        let total = 12 + 8 + json.len() + 8 + bytes.len();
        for word in [2, total as u32, json.len() as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(json);
        out.extend((bytes.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bytes);
        out
    }

    /// Writes it as `made.glb`.
    pub fn write(&self, folder: impl AsRef<Path>) -> PathBuf {
        let path = folder.as_ref().join("made.glb");
        fs::write(&path, self.glb()).unwrap();
        path
    }
}
