//! Triangle soup on the command line: solids whose corners are off by rounding, and repairs that lose what encloses nothing.

use std::path::Path;

use crate::common::bodies::Dice;
use crate::common::soups::solids;
use crate::program::{Folder, fails, frazil, works};
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::Value;

fn report(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn write(folder: &Path, name: &str, mesh: &TriMesh) {
    mesh::write(&folder.join(name), mesh).unwrap();
}

#[test]
fn soup_that_is_off_by_rounding_is_a_solid_for_every_tool() {
    let folder = &Folder::empty();
    let mut dice = Dice(11);
    for solid in solids(&mut dice).into_iter().take(3) {
        let soup = solid.soup(1.0, DVec3::new(20.0, 0.0, -7.0), 4, &mut dice);
        write(folder, "soup.ply", &soup);
        let near = |volume: &Value| {
            let volume = volume.as_f64().unwrap();
            assert!(
                (volume / solid.volume - 1.0).abs() < 0.01,
                "{}: {volume}, not {}",
                solid.name,
                solid.volume
            );
        };
        let said = works(folder, "mesh check soup.ply");
        assert!(said.contains("a solid, once vertices within rounding of one position are joined"), "{said}");
        let checked = report(&works(folder, "mesh check soup.ply --json"));
        assert_eq!(
            (&checked[0]["solid"], &checked[0]["ambiguous_vertices"]),
            (&Value::Bool(true), &0.into())
        );
        assert!(checked[0]["near_vertices"].as_u64().unwrap() > 0);
        near(&checked[0]["volume_m3"]);
        // In another unit, too.
        let checked = report(&works(folder, "mesh check soup.ply --json --scale 0.3"));
        assert_eq!(checked[0]["solid"], true, "{}", solid.name);
        let output = frazil(folder, "mesh repair soup.ply -o solid.ply --json");
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        near(&report(&String::from_utf8(output.stdout).unwrap())["volume_m3"]);
        let output = frazil(folder, "vdb from-mesh soup.ply --cell 0.02 -o grid.vdb");
        assert!(
            output.status.success() && output.stderr.is_empty(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        near(&report(&works(folder, "info grid.vdb --measure --json"))[0]["holds"][0]["volume_m3"]);
    }
}

/// Triangles that do not hang together, in a box of 10 m.
fn shreds(count: usize, dice: &mut Dice) -> TriMesh {
    let mut mesh = TriMesh::default();
    for at in 0..count as u32 {
        let middle = dice.vector(5.0);
        mesh.positions.extend((0..3).map(|_| (middle + dice.vector(0.5)).cast::<f32>()));
        mesh.triangles.push([3 * at, 3 * at + 1, 3 * at + 2]);
    }
    mesh
}

#[test]
fn a_repair_that_would_lose_nearly_all_fails() {
    let folder = &Folder::empty();
    let mut mesh = shreds(400, &mut Dice(2));
    mesh.append(&TriMesh::cuboid([0.0; 3], [0.3; 3]));
    write(folder, "shreds.ply", &mesh);
    fails(
        folder,
        "mesh repair shreds.ply -o solid.ply",
        2,
        &["shreds.ply", "nearly all of the mesh would be lost"],
    );
    assert!(!folder.join("solid.ply").exists());
}

#[test]
fn a_repair_that_loses_a_sheet_says_so() {
    let folder = &Folder::empty();
    let mut mesh = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    let sheet = TriMesh {
        positions: [[0.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 1.0], [0.0, 2.0, 1.0]]
            .map(Vec3::from)
            .to_vec(),
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    };
    mesh.append(&sheet);
    write(folder, "lid.ply", &mesh);
    let said = works(folder, "mesh repair lid.ply -o solid.ply");
    for words in ["lid.ply", "a solid now, but not all of it", "its box has shrunk by 1.0000 m", "warn"] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    // What is all there is not warned of.
    write(folder, "cube.ply", &TriMesh::cuboid([0.0; 3], [1.0; 3]));
    let mut open = TriMesh::cuboid([0.0; 3], [1.0; 3]);
    open.triangles.truncate(10);
    open.append(&TriMesh::cuboid([0.5; 3], [1.5; 3]));
    write(folder, "open.ply", &open);
    for name in ["cube.ply", "open.ply"] {
        let said = works(folder, &format!("mesh repair {name} -o solid.ply"));
        assert!(!said.contains("warn") && !said.contains("not all"), "{said}");
    }
}
