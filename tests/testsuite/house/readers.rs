//! What reads our files with another library must not link ours: it would prove less.

use std::fs;
use std::path::{Path, PathBuf};

/// The programs that link crate vdb-rs, and what they include.
const APART: [&str; 2] = ["tests/common/program.rs", "tests/readers.rs"];

/// Every Rust file below a folder of the crate, from the crate's root.
fn sources(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut out = Vec::new();
    for entry in fs::read_dir(root.join(folder)).unwrap() {
        let path = entry.unwrap().path();
        let path = path.strip_prefix(root).unwrap().to_path_buf();
        match path.extension().is_some_and(|extension| extension == "rs") {
            _ if root.join(&path).is_dir() => out.extend(sources(path.to_str().unwrap())),
            true => out.push(path),
            false => {}
        }
    }
    out
}

#[test]
fn no_program_links_frazil_and_vdb_rs() {
    let [ours, theirs] = ["frazil", "vdb_rs"].map(|name| format!("{name}::"));
    let files: Vec<PathBuf> = ["benches", "tests", "examples"].into_iter().flat_map(sources).collect();
    assert!(APART.iter().all(|file| files.iter().any(|path| path.ends_with(file))), "{files:?}");
    for path in files {
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(&path)).unwrap();
        let word = if APART.iter().any(|file| path.ends_with(file)) { &ours } else { &theirs };
        assert!(!text.contains(word.as_str()), "{} uses {word}", path.display());
    }
}
