//! A key's default is declared once, with the key: nothing that reads its value has another.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else {
            out.push(path);
        }
    }
}

/// Without its unit tests.
fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap().split("#[cfg(test)]").next().unwrap_or_default().to_string()
}

/// Names of keys that have a default, by the reference of all keys, which another test compares with their declarations.
fn declared() -> BTreeSet<String> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let text = ["scene.md", "surface.md"].map(|name| fs::read_to_string(docs.join(name)).unwrap()).concat();
    let rows = text.lines().filter(|line| line.starts_with("| `"));
    let cells = rows.map(|row| row.split(" | ").map(str::trim).collect::<Vec<_>>());
    let with_default = cells.filter(|cells| cells.len() > 3 && cells[2].starts_with('`'));
    with_default.map(|cells| cells[0].trim_matches(['|', ' ', '`']).to_string()).collect()
}

/// Names of keys whose value is replaced where there is none: `find("name").unwrap_or(1.0)`, in one statement or field.
fn replaced(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for call in ["find(\"", "number(\"", "value(\"", "text(\"", "name, \""] {
        for rest in text.split(call).skip(1) {
            let Some((name, rest)) = rest.split_once("\")") else { continue };
            let end = rest.find([';', ',']).unwrap_or(rest.len());
            if rest[..end].contains(".unwrap_or(") || rest[..end].contains(".map_or(usual") {
                names.push(name.rsplit('.').next().unwrap_or(name).to_string());
            }
        }
    }
    names
}

#[test]
fn a_default_is_declared_once() {
    let mut files = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene"), &mut files);
    let declared = declared();
    for name in
        ["opaque_depth", "friction", "falls_height", "thickens_from", "turbulence", "fps", "kept", "min_drop"]
    {
        assert!(declared.contains(name), "{name} is not among {declared:?}");
    }
    let second = |path: &PathBuf| {
        let names = replaced(&text(path)).into_iter().filter(|name| declared.contains(name));
        let at = path.clone();
        names.map(move |name| format!("{}: {name}", at.display())).collect::<Vec<_>>()
    };
    let second: Vec<String> = files.iter().flat_map(second).collect();
    assert!(second.is_empty(), "second defaults; TableValues::get has the declared one: {second:#?}");
    // What this looks for.
    assert_eq!(replaced("opaque_depth: find(\"opaque_depth\").unwrap_or(0.01),"), ["opaque_depth"]);
}
