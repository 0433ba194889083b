//! The C header, read as text.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The functions that the header declares, with the text before each.
pub fn functions() -> Vec<(String, String)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/frazil.h");
    let text = fs::read_to_string(path).expect("the header");
    let mut out = Vec::new();
    let mut comment = String::new();
    // The first comment is the preamble.
    for part in text.split_inclusive("*/").skip(1) {
        let (code, next) = part.split_once("/**").unwrap_or((part, ""));
        // A declaration is a type, the name and its arguments: the first name with a bracket behind it.
        if let Some((before, _)) = code.split_once('(') {
            let name = before.rsplit(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
            if name.starts_with("frz_") && !code.contains("typedef") {
                out.push((name.to_string(), comment.clone()));
            }
        }
        comment = next.trim_end_matches("*/").to_string();
    }
    out
}

/// Functions without a text, or that no program of tests/ctest calls.
pub fn bare_functions() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ctest");
    let mut called = BTreeSet::new();
    for entry in fs::read_dir(folder).expect("tests/ctest").flatten() {
        let name = entry.file_name().into_string().unwrap_or_default();
        // A program of random calls does not show what they should do.
        if !(name.ends_with(".c") || name.ends_with(".cpp") || name.ends_with(".h"))
            || name.starts_with("misuse")
        {
            continue;
        }
        let text = fs::read_to_string(entry.path()).expect("a program");
        for word in text.split(|c: char| !(c.is_alphanumeric() || c == '_')) {
            called.insert(word.to_string());
        }
    }
    let bare = |(name, text): &(String, String)| text.trim().len() < 40 || !called.contains(name);
    functions().into_iter().filter(bare).map(|(name, _)| name).collect()
}
