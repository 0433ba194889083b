//! Words: what a conversion leaves out, and names that are not text.

use crate::program::{CUBE, Folder, command, works};
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;

#[test]
fn convert_says_what_it_leaves_out() {
    let folder = Folder::empty();
    fs::write(folder.join("plain.obj"), CUBE).unwrap();
    fs::write(folder.join("rich.obj"), format!("vt 0 0\nusemtl wood\n{CUBE}")).unwrap();
    assert_eq!(works(&folder, "convert plain.obj plain.ply"), "");
    let said = works(&folder, "convert rich.obj rich.ply");
    assert!(said.contains("rich.obj: UVs and materials are not carried over"), "{said}");
    assert_eq!(works(&folder, "convert rich.obj rich.ply -q"), "");
}

#[test]
fn convert_keeps_the_arrays_of_meshes() {
    let folder = &Folder::empty();
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                property float vx\nproperty float vy\nproperty float vz\nproperty uchar red\nproperty uchar green\n\
                property uchar blue\nproperty double mask\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0 1 2 3 255 0 51 .25\n1 0 0 1 2 3 0 0 0 .5\n0 1 0 1 2 3 0 0 0 1\n3 0 1 2\n";
    fs::write(folder.join("rich.ply"), text).unwrap();
    let arrays = |name: &str| -> Vec<String> {
        let mesh = frazil::io::mesh::read_detailed(&folder.join(name)).unwrap();
        mesh.arrays.iter().map(|array| format!("{} {}", array.name, array.values[0] as f32)).collect()
    };
    assert_eq!(works(folder, "convert rich.ply same.ply"), "");
    assert_eq!(arrays("same.ply"), ["vx 1", "vy 2", "vz 3", "red 255", "green 0", "blue 51", "mask 0.25"]);
    // In another space velocities are others.
    assert!(
        works(folder, "convert rich.ply large.ply --scale 2").contains("velocities are not carried over")
    );
    assert_eq!(arrays("large.ply"), ["red 255", "green 0", "blue 51", "mask 0.25"]);
    let said = works(folder, "convert rich.ply rich.obj");
    assert!(!said.contains("colours") && said.contains("arrays are not carried over: mask"), "{said}");
    assert_eq!(arrays("rich.obj"), ["red 1", "green 0", "blue 0.2"].map(String::from));
}

#[test]
fn names_that_are_not_text_are_files_like_others() {
    let folder = Folder::empty();
    let name = OsStr::from_bytes(b"cube\xff.obj");
    fs::write(folder.join(name), CUBE).unwrap();
    for arguments in ["info --report told.json", "mesh check --report told.json"] {
        let output = command(&folder, arguments).arg(name).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && stderr.is_empty(), "{arguments}: {stderr}");
        assert!(fs::read_to_string(folder.join("told.json")).unwrap().contains("cube"));
    }
    for arguments in ["check", "snow -o out", "preview -o out.png", "vdb to-mesh -o out.obj"] {
        let missing = OsStr::from_bytes(b"none\xff.toml");
        let output = command(&folder, arguments).arg(missing).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
        assert!(!stderr.contains("internal error") && stderr.lines().count() == 1, "{stderr}");
    }
    let output = command(&folder, "check a.toml --set").arg(OsStr::from_bytes(b"a\xff=1")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
