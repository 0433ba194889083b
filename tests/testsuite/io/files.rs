//! Mesh files: what is written is read back, and what is malformed is refused in one sentence.

use std::path::{Path, PathBuf};

use crate::common::shapes::{blob, cuboid};
use crate::program::Folder;
use frazil::geometry::{TriMesh, Vec3};
use frazil::io::files::atomic;
use frazil::io::mesh;
use proptest::prelude::*;

/// Writes `content` to `name` in a fresh folder.
fn file(name: &str, content: &[u8]) -> (Folder, PathBuf) {
    let folder = Folder::empty();
    let path = folder.join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

fn read(name: &str, content: &[u8]) -> frazil::Result<TriMesh> {
    let (_folder, path) = file(name, content);
    mesh::read(&path)
}

/// The message of a refused file: one line that names the file.
fn refusal(name: &str, content: &[u8]) -> String {
    let what = match read(name, content) {
        Ok(mesh) => panic!("{name} was read as {} triangles", mesh.triangles.len()),
        Err(error) => error.to_string(),
    };
    assert!(what.contains(name) && !what.contains('\n'), "{what}");
    what
}

fn ply(format: &str, properties: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {format} 1.0\n{properties}end_header\n").into_bytes();
    bytes.extend_from_slice(body);
    bytes
}

const XYZ: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\n";

#[test]
fn a_closed_obj_stays_closed_across_groups_and_materials() {
    let mut text = String::from("mtllib missing.mtl\n");
    let cube = cuboid([1.0, 2.0, 3.0]);
    for p in &cube.positions {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for (i, [a, b, c]) in cube.triangles.iter().enumerate() {
        if i % 3 == 0 {
            text += &format!("g part{i}\nusemtl paint{i}\n");
        }
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    let read = read("cube.obj", text.as_bytes()).unwrap();
    assert!(read.is_manifold(), "groups tore the cube apart: {} vertices", read.positions.len());
    assert_eq!(read.euler_characteristic(), 2);
    assert!((read.volume() - 6.0).abs() < 1e-6);
}

#[test]
fn obj_takes_seams_negative_indices_polygons_and_crlf() {
    let text = "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nvt 0 0\r\nvt 1 1\r\nvn 0 0 1\r\n\
                f 1/1/1 2/2/1 3/1/1 4/2/1\r\nf -4 -3 -2\r\n";
    let mesh = read("quad.obj", text.as_bytes()).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (3, 4));
    assert!((mesh.area() - 1.5).abs() < 1e-12);
}

#[test]
fn a_concave_face_becomes_triangles_inside_it() {
    let arrow = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\n";
    for face in ["1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3"] {
        let mesh = read("arrow.obj", format!("{arrow}f {face}\n").as_bytes()).unwrap();
        assert!((mesh.area() - 1.0).abs() < 1e-6, "{face}: {}", mesh.area());
    }
    let body = b"0 0 0\n2 1 0\n0 2 0\n1 1 0\n4 0 1 2 3\n";
    let mesh = read("arrow.ply", &ply("ascii", &XYZ.replace("vertex 3", "vertex 4"), body)).unwrap();
    assert!((mesh.area() - 1.0).abs() < 1e-6, "{}", mesh.area());
}

#[test]
fn a_ply_word_that_is_not_a_number_is_reported() {
    let what = refusal("word.ply", &ply("ascii", XYZ, b"0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"));
    assert!(what.contains("vertex 2 of 3") && what.contains("\"zero\" is not a number"), "{what}");
}

#[test]
fn an_obj_face_may_end_in_a_comment() {
    let text = "v 0 0 0\nv 1 0 0 # right\nv 0 1 0\nf 1 2 3 # front\n";
    assert_eq!(read("noted.obj", text.as_bytes()).unwrap().triangles.len(), 1);
}

#[test]
fn bad_obj_lines_are_named() {
    let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let bad = [
        ("v 0 0\nf 1 2 3\n", 4),
        ("v 0 nan 0\nf 1 2 3\n", 4),
        ("v inf 0 0\nf 1 2 3\n", 4),
        ("v 0 1e99 0\nf 1 2 3\n", 4),
        ("v 0 x 0\nf 1 2 3\n", 4),
        ("f 1 2 3\nf 1 2 4\n", 5),
        ("f 1 2 -4\n", 4),
        ("f 0 1 2\n", 4),
        ("f a b c\n", 4),
    ];
    for (tail, line) in bad {
        let what = refusal("bad.obj", format!("{head}{tail}").as_bytes());
        assert!(what.contains(&format!("line {line}")), "{tail:?}: {what}");
    }
    refusal("none.obj", head.as_bytes());
    refusal("none.obj", b"");
}

#[test]
fn ply_of_every_encoding_holds_the_same_triangle() {
    let values = [0.1f32, -2.5, 1e-7, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let want: Vec<Vec3> = values.chunks(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    let text: Vec<String> = values.iter().map(f32::to_string).collect();
    let mut little: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    little.push(3);
    little.extend([0i32, 1, 2].iter().flat_map(|v| v.to_le_bytes()));
    let mut big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    big.push(3);
    big.extend([0i32, 1, 2].iter().flat_map(|v| v.to_be_bytes()));
    let ascii = format!("{}\n3 0 1 2\n", text.join(" "));
    let bodies =
        [("ascii", ascii.as_bytes()), ("binary_little_endian", &little), ("binary_big_endian", &big)];
    for (format, body) in bodies {
        let bytes = ply(format, XYZ, body);
        let mesh = read("one.ply", &bytes).unwrap();
        assert_eq!((&mesh.positions, mesh.triangles.as_slice()), (&want, [[0, 1, 2]].as_slice()), "{format}");
        // Cut anywhere, the file is refused (but for an ascii file's last line end).
        for length in 0..bytes.len() - usize::from(format == "ascii") {
            refusal("cut.ply", &bytes[..length]);
        }
    }
}

#[test]
fn bad_plys_are_refused() {
    let points = "0 0 0 1 0 0 0 1 0\n";
    refusal("bad.ply", b"solid cube\n");
    refusal("bad.ply", &ply("ascii", XYZ, format!("{points}3 0 1 3\n").as_bytes()));
    refusal("bad.ply", &ply("ascii", XYZ, format!("{points}3 0 1 -1\n").as_bytes()));
    refusal("bad.ply", &ply("ascii", XYZ, b"0 0 nan 1 0 0 0 1 0\n3 0 1 2\n"));
    refusal("bad.ply", &ply("ascii", XYZ, b"0 0 zero 1 0 0 0 1 0\n3 0 1 2\n"));
    refusal("bad.ply", &ply("ascii", XYZ, format!("{points}-3 0 1 2\n").as_bytes()));
    refusal("bad.ply", &ply("morse", XYZ, points.as_bytes()));
    refusal("bad.ply", &ply("ascii", &XYZ.replace("face 1", "face 0"), points.as_bytes()));
    refusal("bad.ply", &ply("ascii", &XYZ.replace("vertex 3", "vertex 99999999999"), points.as_bytes()));
    let huge = format!("{points}4000000000 0 1 2\n");
    refusal("bad.ply", &ply("ascii", &XYZ.replace("uchar", "uint"), huge.as_bytes()));
}

#[test]
fn a_ply_without_a_coordinate_is_refused() {
    let flat = XYZ.replace("property float z\n", "");
    refusal("flat.ply", &ply("ascii", &flat, b"0 0 1 0 0 1\n3 0 1 2\n"));
}

#[test]
fn a_fractional_ply_index_is_refused() {
    refusal("half.ply", &ply("ascii", XYZ, b"0 0 0 1 0 0 0 1 0\n3 0 1 1.5\n"));
}

#[test]
fn missing_files_other_formats_and_folders_are_refused() {
    let missing = mesh::read(Path::new("no/such/body.obj")).unwrap_err().to_string();
    assert!(missing.contains("no/such/body.obj"), "{missing}");
    refusal("scene.fbx", b"x");
    let cube = cuboid([1.0; 3]);
    assert!(mesh::write(Path::new("cube.fbx"), &cube).is_err());
    assert!(mesh::write(Path::new("no/such/cube.ply"), &cube).is_err());
}

#[test]
fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
    let (folder, path) = file("kept.ply", b"old");
    let full = || std::io::Error::from_raw_os_error(28);
    let error = atomic::write(&path, |out| out.write_all(b"half").and(Err(full()))).unwrap_err();
    assert!(matches!(&error, frazil::Error::Io { path: at, .. } if *at == path), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    atomic::write_bytes(&path, b"new").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Positions come back to the bit from both formats.
    #[test]
    fn round_trips_keep_every_bit(seed in prop::collection::vec(prop::array::uniform3(prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO), 3..40)) {
        let count = seed.len() as u32;
        // Neither in the order of their use, nor all of them used.
        let triangles = (1..count).rev().map(|i| [i, i - 1, (i + 1) % count]).filter(|t| !t.contains(&1) || count == 3).collect();
        let mesh = TriMesh { positions: seed.into_iter().map(Vec3::from).collect(), triangles };
        let folder = Folder::empty();
        for name in ["a.ply", "a.obj"] {
            let path = folder.join(name);
            mesh::write(&path, &mesh).unwrap();
            let read = mesh::read(&path).unwrap();
            prop_assert_eq!(&read.triangles, &mesh.triangles);
            for (a, b) in read.positions.iter().zip(&mesh.positions) {
                prop_assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits));
            }
        }
    }

    /// No bytes make a reader panic.
    #[test]
    fn damaged_files_never_panic(at in 0usize..2000, byte: u8) {
        let folder = Folder::empty();
        for name in ["b.ply", "b.obj"] {
            let path = folder.join(name);
            mesh::write(&path, &blob(1.0, 2)).unwrap();
            let mut bytes = std::fs::read(&path).unwrap();
            let length = bytes.len();
            bytes[at % length] = byte;
            std::fs::write(&path, &bytes).unwrap();
            if let Ok(mesh) = mesh::read(&path) {
                prop_assert!(mesh.validate().is_ok());
            }
        }
    }
}
