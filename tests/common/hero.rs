//! A skinned figure that walks in its position, as a .glb file: made by code, for demonstrations and tests.

use std::f32::consts::PI;

use serde_json::{Value, json};

/// Speed of its standing foot (m/s): what keys must carry it along at.
pub const SPEED: f32 = 1.1;
/// Seconds of a round, keys of it.
const ROUND: f32 = 1.0;
const KEYS: usize = 24;
/// Lengths of thigh and shin (m).
const THIGH: f32 = 0.42;
const SHIN: f32 = 0.42;
/// How far the hips sink for the step (m), how high a foot is lifted.
const SINK: f32 = 0.07;
const LIFT: f32 = 0.3;

/// Joints: name, parent, position at rest (m).
const JOINTS: [(&str, usize, [f32; 3]); 10] = [
    ("hips", 0, [0.0, 0.92, 0.0]),
    ("thigh_l", 0, [0.1, 0.92, 0.0]),
    ("shin_l", 1, [0.1, 0.5, 0.0]),
    ("foot_l", 2, [0.1, 0.08, 0.0]),
    ("thigh_r", 0, [-0.1, 0.92, 0.0]),
    ("shin_r", 4, [-0.1, 0.5, 0.0]),
    ("foot_r", 5, [-0.1, 0.08, 0.0]),
    ("spine", 0, [0.0, 1.0, 0.0]),
    ("arm_l", 7, [0.23, 1.4, 0.0]),
    ("arm_r", 7, [-0.23, 1.4, 0.0]),
];

#[derive(Default)]
struct Skin {
    positions: Vec<[f32; 3]>,
    joints: Vec<[u8; 4]>,
    weights: Vec<[f32; 4]>,
    indices: Vec<u32>,
}

impl Skin {
    /// A closed tube of rings: middle and half widths along x and z of each; `hangs` gives two joints and the part of
    /// the second at a height.
    fn tube(&mut self, rings: &[([f32; 3], f32, f32)], hangs: impl Fn(f32) -> (u8, u8, f32)) {
        const AROUND: u32 = 20;
        let first = self.positions.len() as u32;
        let mut add = |position: [f32; 3]| {
            let (a, b, part) = hangs(position[1]);
            self.positions.push(position);
            self.joints.push([a, b, 0, 0]);
            self.weights.push([1.0 - part, part, 0.0, 0.0]);
        };
        for (middle, wide, deep) in rings {
            for i in 0..AROUND {
                let angle = 2.0 * PI * i as f32 / AROUND as f32;
                add([middle[0] + wide * angle.sin(), middle[1], middle[2] + deep * angle.cos()]);
            }
        }
        add(rings[0].0);
        add(rings[rings.len() - 1].0);
        let last = rings.len() as u32 - 1;
        let at = |ring: u32, i: u32| first + ring * AROUND + i % AROUND;
        let ends = [first + (last + 1) * AROUND, first + (last + 1) * AROUND + 1];
        for i in 0..AROUND {
            for ring in 0..last {
                let (a, b, c, d) = (at(ring, i), at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i));
                self.indices.extend([a, b, c, a, c, d]);
            }
            self.indices.extend([ends[0], at(0, i + 1), at(0, i)]);
            self.indices.extend([ends[1], at(last, i), at(last, i + 1)]);
        }
    }

    /// A ball-shaped tube from one height to another.
    fn bulge(&mut self, x: f32, low: f32, high: f32, wide: f32, deep: f32, joint: u8) {
        let ring = |i: u32| {
            let t = (i as f32 + 0.5) / 12.0;
            let round = (PI * t).sin().powf(0.6);
            ([x, low + (high - low) * t, 0.0], wide * round, deep * round)
        };
        self.tube(&(0..12).map(ring).collect::<Vec<_>>(), |_| (joint, joint, 0.0));
    }

    fn leg(&mut self, x: f32, thigh: u8) {
        let ring = |i: u32| {
            let t = i as f32 / 23.0;
            ([x, 0.07 + t * 0.88, 0.0], 0.05 + 0.035 * t, 0.055 + 0.04 * t)
        };
        // The knee bends over 0.16 m.
        let hangs = |y: f32| (thigh, thigh + 1, ((0.58 - y) / 0.16).clamp(0.0, 1.0));
        self.tube(&(0..24).map(ring).collect::<Vec<_>>(), hangs);
        // A boot: long, flat below.
        let sole = |i: u32| {
            let t = i as f32 / 5.0;
            ([x, 0.1 * t, 0.045 - 0.02 * t], 0.052 - 0.004 * t, 0.15 - 0.05 * t * t)
        };
        self.tube(&(0..6).map(sole).collect::<Vec<_>>(), |_| (thigh + 2, thigh + 2, 0.0));
    }
}

/// Where a foot's joint is at a part of the round, from the hip's joint (z, y), and the foot's pitch (radians).
fn foot(part: f32) -> ([f32; 2], f32) {
    let (reach, rest) = (SPEED * ROUND / 4.0, SINK - THIGH - SHIN);
    if part < 0.5 {
        return ([reach - SPEED * ROUND * part, rest], 0.0);
    }
    let t = 2.0 * part - 1.0;
    // Toes hang while the foot is lifted.
    ([-reach * (PI * t).cos(), rest + LIFT * (PI * t).sin()], 0.6 * (PI * t).sin() * (1.0 - t))
}

/// Angles about x of thigh, shin and foot at a part of the round, each from its parent.
fn leg_angles(part: f32) -> [f32; 3] {
    let ([z, y], pitch) = foot(part.rem_euclid(1.0));
    let distance = z.hypot(y).min(0.999 * (THIGH + SHIN));
    let bend = ((THIGH * THIGH + distance * distance - SHIN * SHIN) / (2.0 * THIGH * distance)).acos();
    let thigh = z.atan2(-y) + bend;
    let shin = (z - THIGH * thigh.sin()).atan2(-(y + THIGH * thigh.cos()));
    [-thigh, thigh - shin, shin + pitch]
}

/// The file: one skin of ten joints, clips "walk" (a round of one second) and "stand".
pub fn glb() -> Vec<u8> {
    let mut skin = Skin::default();
    skin.leg(0.1, 1);
    skin.leg(-0.1, 4);
    skin.bulge(0.0, 0.82, 1.5, 0.2, 0.13, 7);
    skin.bulge(0.0, 1.46, 1.76, 0.1, 0.12, 7);
    skin.bulge(0.23, 0.78, 1.46, 0.05, 0.055, 8);
    skin.bulge(-0.23, 0.78, 1.46, 0.05, 0.055, 9);
    let mut file = File::default();
    let positions = file.floats("VEC3", skin.positions.as_flattened());
    let (low, high) = bounds(&skin.positions);
    file.accessors[positions]["min"] = json!(low);
    file.accessors[positions]["max"] = json!(high);
    let joints = file.accessor(5121, "VEC4", skin.joints.len(), skin.joints.as_flattened());
    let weights = file.floats("VEC4", skin.weights.as_flattened());
    let indices: Vec<u8> = skin.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
    let indices = file.accessor(5125, "SCALAR", skin.indices.len(), &indices);
    let inverse = |(_, _, [x, y, z]): &(&str, usize, [f32; 3])| {
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -x, -y, -z, 1.0]
    };
    let inverse = file.floats("MAT4", &JOINTS.iter().flat_map(inverse).collect::<Vec<f32>>());
    let node = |(index, (name, parent, position)): (usize, &(&str, usize, [f32; 3]))| {
        let from = if index == 0 { [0.0; 3] } else { JOINTS[*parent].2 };
        let children: Vec<usize> = (1..JOINTS.len()).filter(|child| JOINTS[*child].1 == index).collect();
        let offset: Vec<f32> = (0..3).map(|axis| position[axis] - from[axis]).collect();
        let mut node = json!({ "name": name, "translation": offset });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        node
    };
    let mut nodes: Vec<Value> = JOINTS.iter().enumerate().map(node).collect();
    nodes.push(json!({ "name": "hero", "mesh": 0, "skin": 0 }));
    let animations = [file.walk(), file.stand()];
    let json = json!({
        "asset": { "version": "2.0", "generator": "frazil" },
        "scene": 0, "scenes": [{ "nodes": [0, JOINTS.len()] }], "nodes": nodes,
        "meshes": [{ "name": "hero", "primitives": [{ "indices": indices,
            "attributes": { "POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights } }] }],
        "skins": [{ "joints": (0..JOINTS.len()).collect::<Vec<_>>(), "inverseBindMatrices": inverse }],
        "animations": animations, "accessors": file.accessors, "bufferViews": file.views,
        "buffers": [{ "byteLength": file.bytes.len() }],
    });
    chunks(json.to_string().into_bytes(), file.bytes)
}

fn bounds(positions: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let fold = |pick: fn(f32, f32) -> f32, start: f32| {
        [0, 1, 2].map(|axis| positions.iter().map(|position| position[axis]).fold(start, pick))
    };
    (fold(f32::min, f32::MAX), fold(f32::max, f32::MIN))
}

#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    fn accessor(&mut self, kind: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        let view = self.views.len() - 1;
        self.accessors
            .push(json!({ "bufferView": view, "componentType": kind, "type": shape, "count": count }));
        self.bytes.extend_from_slice(bytes);
        view
    }

    fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(5126, shape, values.len() / width, &bytes)
    }

    fn walk(&mut self) -> Value {
        let parts: Vec<f32> = (0..=KEYS).map(|key| key as f32 / KEYS as f32).collect();
        let times: Vec<f32> = parts.iter().map(|part| part * ROUND).collect();
        let times = self.floats("SCALAR", &times);
        let about_x = |angles: Vec<f32>| -> Vec<f32> {
            angles.iter().flat_map(|angle| [(angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()]).collect()
        };
        let mut rotations: Vec<(usize, Vec<f32>)> = Vec::new();
        for (thigh, shift) in [(1, 0.0), (4, 0.5)] {
            let angles: Vec<[f32; 3]> = parts.iter().map(|part| leg_angles(part + shift)).collect();
            rotations.extend(
                (0..3).map(|which| (thigh + which, angles.iter().map(|angle| angle[which]).collect())),
            );
        }
        for (arm, sign) in [(8, 1.0), (9, -1.0)] {
            rotations.push((arm, parts.iter().map(|part| sign * 0.5 * (2.0 * PI * part).cos()).collect()));
        }
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        let mut channel = |node: usize, path: &str, output: usize| {
            channels.push(json!({ "sampler": samplers.len(), "target": { "node": node, "path": path } }));
            samplers.push(json!({ "input": times, "output": output, "interpolation": "LINEAR" }));
        };
        for (node, angles) in rotations {
            channel(node, "rotation", self.floats("VEC4", &about_x(angles)));
        }
        let sunk: Vec<f32> = parts.iter().flat_map(|_| [0.0, JOINTS[0].2[1] - SINK, 0.0]).collect();
        channel(0, "translation", self.floats("VEC3", &sunk));
        json!({ "name": "walk", "samplers": samplers, "channels": channels })
    }

    fn stand(&mut self) -> Value {
        let input = self.floats("SCALAR", &[0.0]);
        let output = self.floats("VEC3", &JOINTS[0].2);
        json!({ "name": "stand", "samplers": [{ "input": input, "output": output, "interpolation": "STEP" }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] })
    }
}

/// The two chunks of a .glb file.
fn chunks(mut json: Vec<u8>, mut bytes: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((28 + json.len() as u32 + bytes.len() as u32).to_le_bytes());
    for (name, chunk) in [(b"JSON", json), (b"BIN\0", bytes)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(name);
        out.extend(chunk);
    }
    out
}
