//! What git tracks is written by people: nothing that a tool builds.

use crate::common::skip::skipped;
use std::path::Path;
use std::process::Command;

/// Folders and endings of what cargo, make, cmake, Python and mcs write.
const FOLDERS: [&str; 8] =
    ["target", "__pycache__", "dist", "build", "CMakeFiles", "node_modules", ".pytest_cache", "egg-info"];
const ENDINGS: [&str; 15] = [
    "pyc", "pyo", "o", "a", "so", "dll", "dylib", "exe", "rlib", "rmeta", "whl", "deb", "vdb", "usda", "usdc",
];

fn git(arguments: &[&str]) -> Option<String> {
    let output =
        Command::new("git").arg("-C").arg(env!("CARGO_MANIFEST_DIR")).args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn no_built_file_is_tracked() {
    let Some(tracked) = git(&["ls-files"]).filter(|list| !list.is_empty()) else {
        skipped("the sources are not in a repository of git");
        return;
    };
    let is_built = |path: &&str| {
        let path = Path::new(path);
        let folders = || path.parent().into_iter().flat_map(Path::iter).filter_map(|part| part.to_str());
        let is_in = |folder: &&str| folders().any(|part| part.ends_with(*folder));
        FOLDERS.iter().any(is_in) || ENDINGS.iter().any(|ending| path.extension() == Some(ending.as_ref()))
    };
    let built: Vec<&str> = tracked.lines().filter(is_built).collect();
    assert!(built.is_empty(), "{built:?}");
    let ignored = git(&["ls-files", "--cached", "--ignored", "--exclude-standard"]).unwrap_or_default();
    assert_eq!(ignored, "", "tracked, and ignored");
}

#[test]
fn what_tools_write_is_ignored() {
    let written = [
        "target/release/frazil",
        "python/frazil/__pycache__/mesh.cpython-311.pyc",
        "tests/python/__pycache__/test_frazil.cpython-311.pyc",
        "python/dist/frazil-0.2.0.whl",
        "python/build/lib/frazil/mesh.py",
        "python/frazil.egg-info/PKG-INFO",
        "dist/frazil.tar.gz",
        "tests/ctest/full/build/CMakeCache.txt",
        "tests/ctest/core/CMakeFiles/x",
        "examples/csharp/Spill.exe",
        "examples/c/press_snow.o",
    ];
    if git(&["ls-files"]).is_none_or(|list| list.is_empty()) {
        skipped("the sources are not in a repository of git");
        return;
    }
    for path in written {
        assert!(git(&["check-ignore", "-q", path]).is_some(), "{path} is not ignored");
    }
}
