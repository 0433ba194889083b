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

/// Names of keys that are declared with a default.
fn declared(files: &[PathBuf]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let has_keys = |path: &&PathBuf| {
        path.ends_with("keys.rs") || path.parent().is_some_and(|folder| folder.ends_with("keys"))
    };
    for path in files.iter().filter(has_keys) {
        // `key(STEP, "grains", "rest", Flag, or("true"))`, with `OBJECT` for a table that all systems share.
        for key in text(path).split("key(").skip(1).filter(|key| key.contains(", or(")) {
            let table = usize::from(!key.split('"').next().unwrap_or_default().contains("OBJECT"));
            names.extend(key.split('"').skip(1).step_by(2).nth(table).map(String::from));
        }
    }
    names
}

/// Names of keys whose value is replaced where there is none: `number("name").unwrap_or(1.0)`, in one statement or field.
fn replaced(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for call in ["find(\"", "number(\"", "value(\"", "flag(\"", "whole(\"", "text(\"", "name, \""] {
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
    let declared = declared(&files);
    for name in ["opaque_depth", "friction", "falls_height", "thickens_from", "turbulence", "fps", "kept"] {
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
    assert_eq!(replaced("opaque_depth: number(\"opaque_depth\").unwrap_or(0.01),"), ["opaque_depth"]);
}
