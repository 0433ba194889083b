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

/// Functions that write a struct of their caller: each with a parameter that points to one of the header's structs and is not const.
pub fn struct_writers() -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/frazil.h");
    let text = fs::read_to_string(path).expect("the header");
    let names =
        |line: &str| line.strip_prefix("} ").and_then(|rest| rest.strip_suffix(';')).map(str::to_string);
    let structs: BTreeSet<String> =
        text.lines().filter_map(names).filter(|name| name.starts_with("frz_")).collect();
    let mut writers = BTreeSet::new();
    for statement in text.split(';') {
        let code = statement.rsplit("*/").next().unwrap_or_default();
        let Some((before, parameters)) = code.split_once('(') else { continue };
        let name = before.split_whitespace().last().unwrap_or_default().trim_start_matches('*');
        let writes = |parameter: &str| {
            let kind = parameter.split_once('*').map(|(kind, _)| kind.trim());
            kind.is_some_and(|kind| structs.contains(kind))
        };
        if name.starts_with("frz_") && parameters.split(',').any(writes) {
            writers.insert(name.to_string());
        }
    }
    writers
}

/// Functions without a text, or that no program of tests/ctest calls.
pub fn bare_functions() -> Vec<String> {
    let mut called = BTreeSet::new();
    for folder in ["common", "full", "core"] {
        add_words(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ctest").join(folder), &mut called);
    }
    let bare = |(name, text): &(String, String)| text.trim().len() < 40 || !called.contains(name);
    functions().into_iter().filter(bare).map(|(name, _)| name).collect()
}

/// Adds the words of a folder's programs.
fn add_words(folder: &Path, words: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("a folder of programs").flatten() {
        let name = entry.file_name().into_string().unwrap_or_default();
        // A program of random calls does not show what they should do.
        let is_program = [".c", ".cpp", ".h"].iter().any(|ending| name.ends_with(ending));
        if !is_program || name.starts_with("misuse") {
            continue;
        }
        let text = fs::read_to_string(entry.path()).expect("a program");
        let found = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        words.extend(found.map(str::to_string));
    }
}
