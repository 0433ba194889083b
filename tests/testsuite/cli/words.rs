//! Words: what a conversion leaves out, and names that are not text.

use crate::program::{CUBE, command, works};
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;

#[test]
fn convert_says_what_it_leaves_out() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plain.obj"), CUBE).unwrap();
    fs::write(folder.path().join("rich.obj"), format!("vt 0 0\nusemtl wood\n{CUBE}")).unwrap();
    assert_eq!(works(folder.path(), "convert plain.obj plain.ply"), "");
    let said = works(folder.path(), "convert rich.obj rich.ply");
    assert!(said.contains("rich.obj: UVs and materials are not carried over"), "{said}");
    assert_eq!(works(folder.path(), "convert rich.obj rich.ply -q"), "");
}

#[test]
fn names_that_are_not_text_are_files_like_others() {
    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"cube\xff.obj");
    fs::write(folder.path().join(name), CUBE).unwrap();
    for arguments in ["info --report told.json", "mesh check --report told.json"] {
        let output = command(folder.path(), arguments).arg(name).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && stderr.is_empty(), "{arguments}: {stderr}");
        assert!(fs::read_to_string(folder.path().join("told.json")).unwrap().contains("cube"));
    }
    for arguments in ["check", "snow -o out", "preview -o out.png", "vdb to-mesh -o out.obj"] {
        let missing = OsStr::from_bytes(b"none\xff.toml");
        let output = command(folder.path(), arguments).arg(missing).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
        assert!(!stderr.contains("internal error") && stderr.lines().count() == 1, "{stderr}");
    }
    let output =
        command(folder.path(), "check a.toml --set").arg(OsStr::from_bytes(b"a\xff=1")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
