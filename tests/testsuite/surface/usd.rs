//! `frazil surface` in USD: all that the mesh carries, and what each frame adds, as primvars.

use crate::common::skip::skipped;
use std::fs;
use std::path::Path;

use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::{DVec3, DetailedMesh, Vec3};
use frazil::io::mesh;
use serde_json::json;

use crate::common::clients;
use crate::common::followed::{self, counted, write_mesh};
use crate::common::liquids::{ball, write_numbered};
use crate::common::usda::{self, numbers};
use crate::program::{Folder, works};

/// Two frames of a ball of particles that travels, and a mesh around it with colours, masks and a triangle that is too far away to
/// have a distance.
fn write_shot(folder: &Path) {
    let ball = ball(5.0, 6, 0.25);
    for frame in 1..=2 {
        let by = DVec3::new(0.002, 0.0, 0.0) * f64::from(frame - 1);
        let positions: Vec<DVec3> = ball.positions.iter().map(|position| position + by).collect();
        write_numbered(&folder.join(format!("ball.{frame:04}.bgeo")), &positions, 0);
    }
    let mut body = ball.mesh;
    let far = body.positions.len() as u32;
    body.positions.extend([0.3, 0.31, 0.32].map(|x| Vec3::new(x, 10.0 * (x - 0.3) * (x - 0.3), 0.01)));
    body.triangles.push([far, far + 1, far + 2]);
    let (vertices, faces) = (body.positions.len(), body.triangles.len());
    let array = |name: &str, on, number, count| followed::array(name, on, number, counted(count));
    let arrays = vec![
        array("red", On::Vertices, Number::U8, vertices),
        array("green", On::Vertices, Number::U8, vertices),
        array("blue", On::Vertices, Number::U8, vertices),
        array("mask", On::Vertices, Number::F64, vertices),
        array("part.1", On::Faces, Number::I32, faces),
        array("wet", On::Corners, Number::F32, 3 * faces),
    ];
    write_mesh(&folder.join("ball.ply"), &DetailedMesh { mesh: body, uvs: None, arrays });
}

const SHOT: &str = "surface -p ball.%04d.bgeo -m ball.ply --spacing 0.01 --set surface.rebuild=false";

/// Name, type and interpolation of the primvars.
const PRIMVARS: [(&str, &str, &str); 7] = [
    ("displayColor", "color3f[]", "vertex"),
    ("mask", "double[]", "vertex"),
    ("part_1", "int[]", "uniform"),
    ("wet", "float[]", "faceVarying"),
    ("delta", "float[]", "vertex"),
    ("flagged", "int[]", "vertex"),
    ("rebuilt", "int[]", "uniform"),
];

/// The values of a primvar, from the .ply of the same frame: one for each, or three.
fn values(made: &DetailedMesh, name: &str) -> Vec<Vec<f64>> {
    let array = |name: &str| followed::values(made, name);
    let share = |value: &f64| f64::from(*value as f32 / 255.0);
    match name {
        "displayColor" => {
            let [r, g, b] = ["red", "green", "blue"].map(array);
            (0..r.len()).map(|at| [r, g, b].map(|part| share(&part[at])).to_vec()).collect()
        }
        "part_1" => array("part.1").iter().map(|value| vec![*value]).collect(),
        _ => array(name).iter().map(|value| vec![*value]).collect(),
    }
}

fn same(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

#[test]
fn the_arrays_of_a_mesh_and_of_each_frame_are_primvars() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(folder, &format!("{SHOT} -o out --set output.surface=[\"ply\",\"usd\"]"));
    let file = |name: &str| folder.join("out").join(name);
    // The shot, the manifest of its clips and every clip say the same of them.
    for name in ["shot.usda", "surface/surface.manifest.usda", "surface/surface.0001.usdc"] {
        let text = usda::text(&file(name));
        for (primvar, class, interpolation) in PRIMVARS {
            let after = text.split(&format!("{class} primvars:{primvar} (")).nth(1);
            let after = after.unwrap_or_else(|| panic!("{name}: no {primvar}")).trim_start();
            assert!(after.starts_with(&format!("interpolation = \"{interpolation}\"")), "{name}: {primvar}");
        }
    }
    let python = clients::usd_python();
    for frame in 1..=2 {
        let text = usda::text(&file(&format!("surface/surface.{frame:04}.usdc")));
        let made = mesh::read_detailed(&file(&format!("surface/surface.{frame:04}.ply"))).unwrap();
        let delta = numbers(&text, "primvars:delta");
        assert_eq!(delta.iter().filter(|delta| delta.is_nan()).count(), 3, "the triangle that is far away");
        let mut wanted = serde_json::Map::new();
        for (primvar, class, interpolation) in PRIMVARS {
            let values = values(&made, primvar);
            let flat: Vec<f32> = values.iter().flatten().map(|value| *value as f32).collect();
            let there = numbers(&text, &format!("primvars:{primvar}"));
            assert!(same(&there, &flat), "{primvar} at frame {frame}");
            let one = json!({ "type": class, "interpolation": interpolation, "values": values });
            wanted.insert(primvar.into(), one);
        }
        let Some(python) = &python else { continue };
        // Through the clips of the shot, and alone.
        fs::write(file("wanted.json"), serde_json::Value::Object(wanted).to_string()).unwrap();
        for (name, prim) in [
            ("shot.usda".to_string(), "/shot/surface/surface"),
            (format!("surface/surface.{frame:04}.usdc"), "/surface/surface"),
        ] {
            let said =
                clients::usd_reads_arrays(python, &file(&name), prim, frame, &file("wanted.json")).unwrap();
            assert_eq!(said, "7 arrays");
        }
    }
    if python.is_none() {
        skipped("no usd-core");
    }
    match clients::validators() {
        Some(python) => {
            let said = clients::usd_is_whole(&python, &folder.join("out")).unwrap();
            assert!(said.starts_with("2 parts"), "{said}");
        }
        None => skipped("no usd-validation-nvidia"),
    }
}

#[test]
fn usd_has_the_attributes_that_are_asked_for() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(
        folder,
        &format!("{SHOT} -o out --set output.surface=[\"usd\"] --set output.attributes=[\"flagged\"]"),
    );
    for name in ["shot.usda", "surface/surface.manifest.usda", "surface/surface.0002.usdc"] {
        let text = usda::text(&folder.join("out").join(name));
        assert!(text.contains("primvars:flagged") && !text.contains("primvars:delta"), "{name}: {text}");
    }
    let text = usda::text(&folder.join("out/surface/surface.0002.usdc"));
    let flagged = numbers(&text, "primvars:flagged");
    let count = flagged.len();
    assert_eq!(flagged[count - 3..], [1.0; 3], "the triangle that is far away");
}
