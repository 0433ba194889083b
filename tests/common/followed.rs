//! Shots of `frazil surface`: caches of numbered particles, meshes that carry much, and what the frames have.

use std::fs;
use std::path::Path;

use frazil::geometry::mesh::attributes::{MeshArray, Number, On};
use frazil::geometry::{DetailedMesh, Uvs};
use frazil::io::mesh;
use serde_json::Value;

pub fn array(name: &str, on: On, number: Number, values: Vec<f64>) -> MeshArray {
    MeshArray { name: name.into(), on, number, values }
}

/// Numbers that count.
pub fn counted(count: usize) -> Vec<f64> {
    (0..count).map(|n| (n % 251) as f64).collect()
}

/// Texture coordinates of so many triangles with a seam along each edge.
pub fn seamed(faces: usize) -> Uvs {
    Uvs {
        coordinates: (0..3 * faces).map(|n| [n as f32 / 7.0, 1.0 / (1.0 + n as f32)]).collect(),
        corners: Some((0..3 * faces as u32).collect()),
        missing: 0,
    }
}

pub fn write_mesh(path: &Path, mesh: &DetailedMesh) {
    let arrays: Vec<&MeshArray> = mesh.arrays.iter().collect();
    let carried = mesh::Carried { uvs: mesh.uvs.as_ref(), arrays: &arrays, ..Default::default() };
    mesh::write_carried(path, &mesh.mesh, &carried).expect("a file");
}

/// A frame's mesh as it was written: in .ply, if the shot has it, whose arrays have the types of the first mesh's.
#[track_caller]
pub fn frame(folder: &Path, out: &str, frame: i32) -> DetailedMesh {
    let file = |kind: &str| folder.join(format!("{out}/surface/surface.{frame:04}.{kind}"));
    let [ply, usd] = ["ply", "usdc"].map(file);
    mesh::read_detailed(if ply.is_file() { &ply } else { &usd }).expect("a mesh")
}

/// The values of one of its arrays.
#[track_caller]
pub fn values<'a>(mesh: &'a DetailedMesh, name: &str) -> &'a [f64] {
    &mesh.arrays.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

/// A frame's report.
#[track_caller]
pub fn report(folder: &Path, out: &str, frame: i32) -> Value {
    let text = fs::read(folder.join(format!("{out}/report/surface.{frame:04}.json"))).expect("a report");
    serde_json::from_slice(&text).expect("JSON")
}

/// A whole number of it.
#[track_caller]
pub fn reported(folder: &Path, out: &str, frame: i32, key: &str) -> u64 {
    let report = report(folder, out, frame);
    report[key].as_u64().unwrap_or_else(|| panic!("{key} of frame {frame} is {}", report[key]))
}
