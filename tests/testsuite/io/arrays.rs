//! Arrays of meshes in USD: `convert` writes each as a primvar.

use crate::common::skip::skipped;
use std::fs;

use crate::common::clients;
use crate::common::usda::numbers;
use crate::program::{Folder, works};
use serde_json::{Value, json};

/// A square with arrays of its vertices, of itself and of its corners.
const RICH: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
property float vx\nproperty float vy\nproperty float vz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
property uchar alpha\nproperty double mask\nproperty float restx\nproperty float resty\nproperty float restz\n\
property short wet.spot\nproperty short wet-spot\nelement face 1\nproperty list uchar int vertex_indices\nproperty uint part\n\
property list uchar float dry\nend_header\n\
0 0 0 1 2 3 255 0 51 255 .25 0 .5 1 -3 1\n1 0 0 1 2 4 0 0 0 0 .5 1 .5 1 4 2\n1 1 0 1 2 5 0 0 0 51 1 2 .5 1 5 3\n\
0 1 0 1 2 6 0 255 0 255 -3 3 .5 1 6 4\n4 0 1 2 3 4000000000 4 .5 .25 -1.5 8\n";

fn one(class: &str, interpolation: &str, values: Value) -> Value {
    json!({ "type": class, "interpolation": interpolation, "values": values })
}

/// Name, type, interpolation and values of each primvar, by hand.
fn wanted() -> Value {
    json!({
        "displayColor": one("color3f[]", "vertex", json!([[1, 0, 0.2], [0, 0, 0], [0, 0, 0], [0, 1, 0]])),
        "displayOpacity": one("float[]", "vertex", json!([1, 0, 0.2, 1])),
        "mask": one("double[]", "vertex", json!([0.25, 0.5, 1, -3])),
        "rest": one("float3[]", "vertex", json!([[0, 0.5, 1], [1, 0.5, 1], [2, 0.5, 1], [3, 0.5, 1]])),
        "wet_spot": one("int[]", "vertex", json!([-3, 4, 5, 6])),
        "wet_spot_2": one("int[]", "vertex", json!([1, 2, 3, 4])),
        // Two triangles come of the square.
        "part": one("uint[]", "uniform", json!([4_000_000_000_u32, 4_000_000_000_u32])),
        "dry": one("float[]", "faceVarying", json!([0.5, 0.25, -1.5, 0.5, -1.5, 8])),
    })
}

/// All numbers of a value of JSON.
fn flat(value: &Value) -> Vec<f32> {
    match value.as_array() {
        Some(parts) => parts.iter().flat_map(flat).collect(),
        None => vec![value.as_f64().unwrap() as f32],
    }
}

#[test]
fn convert_writes_the_arrays_of_a_mesh_as_primvars() {
    let folder = &Folder::empty();
    fs::write(folder.join("rich.ply"), RICH).unwrap();
    assert_eq!(works(folder, "convert rich.ply rich.usda"), "");
    let text = fs::read_to_string(folder.join("rich.usda")).unwrap();
    for (name, want) in wanted().as_object().unwrap() {
        let word = |key: &str| want[key].as_str().unwrap();
        let declared = format!(
            "        {} primvars:{name} (\n            interpolation = \"{}\"\n        )\n",
            word("type"),
            word("interpolation")
        );
        assert!(text.contains(&declared), "{name}: {text}");
        assert_eq!(numbers(&text, &format!("primvars:{name}")), flat(&want["values"]), "{name}");
    }
    assert_eq!(text.matches(".timeSamples").count(), 8 + 8, "{text}");
    // The file's own velocities, not those of a mesh that stands still.
    assert_eq!(numbers(&text, "velocities"), [1.0, 2.0, 3.0, 1.0, 2.0, 4.0, 1.0, 2.0, 5.0, 1.0, 2.0, 6.0]);
    // In another space they would be others.
    let said = works(folder, "convert rich.ply large.usda --scale 2");
    assert!(said.contains("velocities are not carried over"), "{said}");
    let large = fs::read_to_string(folder.join("large.usda")).unwrap();
    assert_eq!(numbers(&large, "velocities"), [0.0; 12]);
    assert_eq!(numbers(&large, "primvars:mask"), [0.25, 0.5, 1.0, -3.0]);
    let Some(python) = clients::usd_python() else { return skipped("no usd-core") };
    fs::write(folder.join("wanted.json"), wanted().to_string()).unwrap();
    let (file, wanted) = (folder.join("rich.usda"), folder.join("wanted.json"));
    let said = clients::usd_reads_arrays(&python, &file, "/meshes/rich", 1, &wanted).unwrap();
    assert_eq!(said, "8 arrays");
}

#[test]
fn an_obj_with_colours_has_them_in_usd() {
    let folder = &Folder::empty();
    fs::write(folder.join("tint.obj"), "v 0 0 0 1 .5 0\nv 1 0 0 0 1 0\nv 0 1 0 .25 0 1\nf 1 2 3\n").unwrap();
    assert_eq!(works(folder, "convert tint.obj tint.usda"), "");
    let text = fs::read_to_string(folder.join("tint.usda")).unwrap();
    assert!(text.contains("color3f[] primvars:displayColor (\n"), "{text}");
    let want = [1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.25, 0.0, 1.0];
    assert_eq!(numbers(&text, "primvars:displayColor"), want);
}
