//! Binary USD that is read: what frazil and OpenUSD write comes back, and damage is one sentence.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::clients;
use crate::common::skip::skipped;
use crate::program::{Folder, fails, works};
use frazil::geometry::mesh::attributes::{MeshArray, Number, On};
use frazil::geometry::points::{Attribute, Column, Points, Values};
use frazil::geometry::{DVec3, DetailedMesh, TriMesh, Uvs, Vec3};
use frazil::io::mesh::Carried;
use frazil::io::usd::{self, Format, MeshFrame, Shading, Units};
use frazil::io::{mesh, particles};

/// A strip of triangles with velocities, a seam, and arrays of every kind and type.
fn strip(count: usize) -> (DetailedMesh, Vec<Vec3>) {
    let positions: Vec<Vec3> =
        (0..count + 2).map(|n| Vec3::new(n as f32 * 0.1, (n % 2) as f32, 0.3 / (n + 1) as f32)).collect();
    let triangles: Vec<[u32; 3]> = (0..count as u32).map(|n| [n, n + 1, n + 2]).collect();
    let array = |name: &str, on: On, number, value: fn(usize) -> f64| MeshArray {
        name: name.into(),
        on,
        number,
        values: (0..on.count(count + 2, count)).map(value).collect(),
    };
    let arrays = vec![
        array("red", On::Vertices, Number::F32, |n| (n % 3) as f64 * 0.25),
        array("green", On::Vertices, Number::F32, |n| (n % 5) as f64 * 0.125),
        array("blue", On::Vertices, Number::F32, |_| 1.0),
        array("alpha", On::Vertices, Number::F32, |n| f64::from(1.0 / (n + 1) as f32)),
        array("part", On::Faces, Number::I32, |n| n as f64 * -100_000.0),
        array("number", On::Faces, Number::U32, |n| 4_000_000_000.0 + n as f64),
        array("dry", On::Corners, Number::F64, |n| n as f64 * 0.1),
    ];
    let coordinates = (0..3 * count).map(|n| [n as f32, 0.5]).collect();
    let uvs = Some(Uvs { coordinates, corners: Some((0..3 * count as u32).collect()), missing: 0 });
    let velocities = positions.iter().map(|p| p * 2.0).collect();
    (DetailedMesh { mesh: TriMesh { positions, triangles }, uvs, arrays }, velocities)
}

/// The bytes of a file of one frame with meshes.
fn meshes(names: &[&str], detailed: &DetailedMesh, velocities: &[Vec3], units: Units) -> Vec<u8> {
    let arrays: Vec<&MeshArray> = detailed.arrays.iter().collect();
    let carried = Carried { velocities, uvs: detailed.uvs.as_ref(), arrays: &arrays };
    let frames: Vec<MeshFrame<'_>> =
        names.iter().map(|name| MeshFrame::of(name, &detailed.mesh, &carried, Shading::Creased)).collect();
    usd::clip("objects", 7, 24.0, units, &frames).bytes(Format::Binary).unwrap()
}

fn read(bytes: &[u8]) -> frazil::Result<DetailedMesh> {
    mesh::parse_polygons(Path::new("a.usdc"), bytes).map(|mesh| mesh.into_detailed())
}

#[test]
fn a_mesh_comes_back_with_all_that_it_carries() {
    // Fewer numbers than are packed, and more.
    for count in [2, 60] {
        let (given, velocities) = strip(count);
        let found = read(&meshes(&["hero"], &given, &velocities, Units::OWN)).unwrap();
        assert_eq!((&found.mesh, &found.uvs), (&given.mesh, &given.uvs));
        for array in &given.arrays {
            assert!(found.arrays.contains(array), "{}: {:?}", array.name, found.arrays);
        }
        for (axis, name) in ["vx", "vy", "vz"].into_iter().enumerate() {
            let values: Vec<f64> = velocities.iter().map(|velocity| velocity[axis].into()).collect();
            let wanted = MeshArray { name: name.into(), on: On::Vertices, number: Number::F32, values };
            assert!(found.arrays.contains(&wanted), "{name}");
        }
        assert_eq!(found.arrays.len(), given.arrays.len() + 3);
    }
}

#[test]
fn several_meshes_are_one_after_another_in_metres_with_y_up() {
    let (given, velocities) = strip(20);
    let centimetres = Units { metres: 0.01, z_up: true };
    let found = read(&meshes(&["a", "b"], &given, &velocities, centimetres)).unwrap();
    let count = given.mesh.positions.len();
    assert_eq!((found.mesh.positions.len(), found.mesh.triangles.len()), (2 * count, 40));
    assert_eq!(found.mesh.triangles[20], given.mesh.triangles[0].map(|vertex| vertex + count as u32));
    for (n, position) in found.mesh.positions.iter().enumerate() {
        let [x, y, z] = given.mesh.positions[n % count].map(|part| f64::from(part) * 0.01).into();
        assert_eq!(*position, DVec3::new(x, z, -y).cast::<f32>());
    }
    let speeds = found.of_vertices("v").unwrap();
    assert!((speeds[3] - f64::from(velocities[3].norm()) * 0.01).abs() < 1e-6);
    assert_eq!(found.arrays.len(), given.arrays.len() + 3);
}

#[test]
fn a_frame_without_faces_is_empty_and_faces_without_an_area_are_gone() {
    let folder = Folder::empty();
    let (mut given, _) = strip(2);
    let nothing = DetailedMesh::default();
    fs::write(folder.join("none.usdc"), meshes(&["liquid"], &nothing, &[], Units::OWN)).unwrap();
    assert!(mesh::read_any(&folder.join("none.usdc")).unwrap().positions.is_empty());
    fails(&folder, "mesh check none.usdc", 2, &["none.usdc", "no faces"]);
    given.mesh.triangles[0] = [1, 1, 2];
    let found = read(&meshes(&["hero"], &given, &[], Units::OWN)).unwrap();
    assert_eq!(found.mesh.triangles, given.mesh.triangles[1..]);
}

#[test]
fn points_come_back_with_their_attributes() {
    let count = 40;
    let positions: Vec<DVec3> = (0..count).map(|n| DVec3::new(f64::from(n), 0.5, -0.25)).collect();
    let each = |value: fn(i32) -> f32| Column::Each((0..count).map(value).collect());
    let attributes = [
        ("v", Values::Vector(Column::Each((0..count).map(|n| [n as f32, 0.1, -2.0]).collect()))),
        ("id", Values::Long(Column::Each((0..count).map(|n| i64::from(n) << 33).collect()))),
        ("pscale", Values::Float(each(|n| 0.01 + n as f32 * 0.001))),
        ("density", Values::Float(Column::Uniform(0.3))),
        ("source_frame", Values::Int(Column::Each((0..count).map(|n| n / 7).collect()))),
        ("active", Values::Bool(Column::Each((0..count).map(|n| n % 2 == 0).collect()))),
        ("rest", Values::Vector(Column::Each((0..count).map(|n| [0.1, n as f32, 1e-7]).collect()))),
    ];
    let attributes = attributes.map(|(name, values)| Attribute { name: name.into(), values }).to_vec();
    let points = Points { attributes, ..Points::at(1.0, &positions).unwrap() };
    let bytes = usd::points::frame("grains", 3, 24.0, &points).bytes(Format::Binary).unwrap();
    let found = particles::parse(Path::new("a.usdc"), &bytes).unwrap();
    assert_eq!(found.positions, positions);
    for Attribute { name, values } in &points.attributes {
        assert_eq!(found.attribute(name), Some(values), "{name}");
    }
    assert_eq!(found.attributes.len(), points.attributes.len());
    let error = mesh::parse_polygons(Path::new("a.usdc"), &bytes).unwrap_err().to_string();
    assert_eq!(error, "a.usdc: it has no mesh");
}

/// Whatever is read is whole, and whatever is not is a sentence about the file; nothing panics on the way.
#[track_caller]
fn is_whole_or_refused(bytes: &[u8], what: &str) -> bool {
    let start = Instant::now();
    let path = Path::new("a.usdc");
    let mesh = mesh::parse_polygons(path, bytes).map(|mesh| {
        let mesh = mesh.into_detailed();
        let [vertices, faces] = [mesh.mesh.positions.len(), mesh.mesh.triangles.len()];
        for array in &mesh.arrays {
            assert_eq!(array.values.len(), array.on.count(vertices, faces), "{what}: {}", array.name);
        }
        let corners = mesh.uvs.and_then(|uvs| uvs.corners);
        assert!(corners.is_none_or(|corners| corners.len() == 3 * faces), "{what}");
    });
    let points = particles::parse(path, bytes).map(drop);
    let is_read = mesh.is_ok() || points.is_ok();
    for error in [mesh.err(), points.err()].into_iter().flatten() {
        let text = error.to_string();
        assert!(text.starts_with("a.usdc: ") && !text.contains('\n'), "{what}: {text}");
        // As a panic is reported.
        assert!(!text.contains("it contradicts itself"), "{what}: {text}");
    }
    assert!(start.elapsed() < Duration::from_secs(5), "{what}: {:?}", start.elapsed());
    is_read
}

/// Files with meshes and with points.
fn samples() -> Vec<Vec<u8>> {
    let (given, velocities) = strip(20);
    let attributes = ["density", "heat"].map(|name| Attribute {
        name: name.into(),
        values: Values::Float(Column::Each((0..30).map(|n| (n % 3) as f32).collect())),
    });
    let positions: Vec<DVec3> = (0..30).map(|n| DVec3::new(f64::from(n), 0.5, -0.25)).collect();
    let points = Points { attributes: attributes.to_vec(), ..Points::at(1.0, &positions).unwrap() };
    let points = usd::points::frame("grains", 3, 24.0, &points).bytes(Format::Binary).unwrap();
    vec![meshes(&["a", "b"], &given, &velocities, Units::OWN), points]
}

#[test]
fn cut_files_are_refused() {
    for bytes in samples() {
        assert!(is_whole_or_refused(&bytes, "whole"));
        for length in 0..bytes.len() {
            assert!(!is_whole_or_refused(&bytes[..length], &format!("cut at {length}")));
        }
    }
}

#[test]
fn changed_files_are_whole_or_a_sentence() {
    changed_are_whole_or_refused(&samples());
}

/// As many changed copies of each sample as `FRAZIL_FUZZ` says: 10,000 were tried when this was made.
fn changed_are_whole_or_refused(samples: &[Vec<u8>]) {
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(500);
    for (number, bytes) in samples.iter().enumerate() {
        let read = (0..count).filter(|&seed| {
            let mut state: u64 = seed;
            let mut below = |end: usize| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((state >> 33) as usize) % end
            };
            let mut changed = bytes.clone();
            // Half of the changes are in the sections at the end, which describe all else.
            let start = if below(2) == 0 { 0 } else { bytes.len().saturating_sub(1500) };
            for _ in 0..1 + below(4) {
                let at = start + below(bytes.len() - start);
                let odd = [0u64, 1, 0x7fff_ffff, 0xffff_ffff, 1 << 40, u64::MAX][below(6)].to_le_bytes();
                match below(4) {
                    0 => changed[at] ^= 1 << below(8),
                    1 => changed[at] = below(256) as u8,
                    width => {
                        let end = (at + 4 * (width - 1)).min(changed.len());
                        changed[at..end].copy_from_slice(&odd[..end - at]);
                    }
                }
            }
            is_whole_or_refused(&changed, &format!("sample {number} with seed {seed}"))
        });
        println!("sample {number}: {} of {count} were read", read.count());
    }
}

#[test]
fn what_cannot_be_read_is_said() {
    let folder = Folder::empty();
    let (given, _) = strip(2);
    let bytes = meshes(&["hero"], &given, &[], Units::OWN);
    let mut newer = bytes.clone();
    newer[9] = 99;
    let cases = [
        ("text.usd", b"#usda 1.0\n".to_vec(), "text file"),
        ("other.usdc", b"PXR-".to_vec(), "no binary USD"),
        ("newer.usdc", newer, "version 0.99"),
        ("empty.usdc", Vec::new(), "empty"),
    ];
    for (name, bytes, what) in cases {
        fs::write(folder.join(name), bytes).unwrap();
        fails(&folder, &format!("info {name}"), 2, &[name, what]);
    }
}

#[test]
fn convert_carries_everything_through_usd_and_back() {
    let folder = Folder::empty();
    let (given, velocities) = strip(3);
    let arrays: Vec<&MeshArray> = given.arrays.iter().collect();
    let carried = Carried { velocities: &velocities, uvs: given.uvs.as_ref(), arrays: &arrays };
    fs::write(folder.join("a.ply"), mesh::ply_bytes(&given.mesh, &carried)).unwrap();
    for extension in ["usdc", "usd"] {
        assert_eq!(works(&folder, &format!("convert a.ply b.{extension}")), "");
        assert_eq!(works(&folder, &format!("convert b.{extension} c.ply")), "");
        let [a, c] = ["a.ply", "c.ply"].map(|name| mesh::read_detailed(&folder.join(name)).unwrap());
        assert_eq!((&a.mesh, &a.uvs), (&c.mesh, &c.uvs));
        assert_eq!(a.arrays.len(), c.arrays.len());
        a.arrays.iter().for_each(|array| assert!(c.arrays.contains(array), "{}", array.name));
    }
    works(&folder, "convert b.usdc z.usdc --to-up z --to-scale 100");
    works(&folder, "convert z.usdc d.ply");
    let [a, d] = ["a.ply", "d.ply"].map(|name| mesh::read_detailed(&folder.join(name)).unwrap().mesh);
    let far = a.positions.iter().zip(&d.positions).map(|(a, d)| (a - d).norm()).fold(0.0, f32::max);
    assert!(far < 1e-5 && a.triangles == d.triangles, "{far}");
}

/// OpenUSD packs floats that are whole numbers as integers, stores what fits in a value itself, and turns faces round.
#[test]
fn files_of_openusd_are_read() {
    let Some(python) = clients::usd_python() else { return skipped("usd-core is not installed") };
    let folder = Folder::empty();
    clients::usd_writes(&python, &folder).unwrap();
    let found = mesh::read_detailed(&folder.join("mesh.usdc")).unwrap();
    // A quad and a triangle in centimetres with Z up, left-handed.
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, 2.0, 0.0]];
    assert_eq!(found.mesh.positions, positions.map(Vec3::from));
    assert_eq!(found.mesh.triangles, [[3, 2, 1], [3, 1, 0], [4, 1, 0]]);
    let array = |name: &str| &found.arrays.iter().find(|array| array.name == name).unwrap().values[..];
    assert_eq!(array("vx"), [0.0, 0.01, 0.02, 0.03, 0.04].map(|speed: f64| f64::from(speed as f32)));
    assert_eq!(array("heat"), [5.0, 7.0, 5.0, 7.0, 7.0]);
    assert_eq!(array("dry"), [3.0, 2.0, 1.0, 3.0, 1.0, 0.0, 6.0, 5.0, 4.0]);
    assert_eq!(array("whole")[..3], [0.0, 1.0, 2.0]);
    let found = particles::read(&folder.join("points.usdc")).unwrap();
    assert_eq!(found.positions.len(), 100);
    assert_eq!(found.positions[99], DVec3::new(99.0, 0.5, 0.0));
    assert_eq!(found.attribute("pscale"), Some(&Values::Float(Column::Uniform(0.05))));
    assert_eq!(
        found.attribute("id"),
        Some(&Values::Long(Column::Each((0..100).map(|n| n * n - 50).collect())))
    );
    assert_eq!(
        found.attribute("whole"),
        Some(&Values::Float(Column::Each((0..100).map(|n| n as f32).collect())))
    );
    let [moved, baked] = ["moved.usdc", "baked.usdc"].map(|name| mesh::read(&folder.join(name)).unwrap());
    assert_eq!([moved.triangles.len(), baked.triangles.len()], [5 * 4; 2]);
    // The prims come in different orders.
    for triangle in &moved.triangles {
        let corners =
            |mesh: &TriMesh, triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
        let own = corners(&moved, triangle);
        let is_same = |other: &[u32; 3]| {
            let other = corners(&baked, other);
            // In metres, and in one of the files 32-bit floats hold centimetres.
            (0..3).any(|turn| (0..3).all(|corner| (own[corner] - other[(corner + turn) % 3]).norm() < 3e-6))
        };
        assert!(baked.triangles.iter().any(is_same), "{own:?}");
    }
    changed_are_whole_or_refused(&[fs::read(folder.join("moved.usdc")).unwrap()]);
    fails(&folder, "info half.usdc", 2, &["half.usdc", "/scene/half", "xformOp:scale"]);
}
