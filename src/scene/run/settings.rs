//! The settings that a stage depends on, and the differences between two sets of them.

use std::collections::{BTreeMap, BTreeSet};

/// Former values longer than this are not reported.
const LONG: usize = 80;
/// Prefix of a hash instead of a file's name: the same content under another name is the same input.
pub const CONTENT: &str = "content ";

/// Settings by key: `snow.noise.size`, `object[1].scale`.
pub type Settings = BTreeMap<String, String>;

/// The keys whose values differ, each with the former value.
pub(in crate::scene) fn changed(before: &Settings, after: &Settings) -> Vec<String> {
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let differs = |key: &&&String| before.get(**key) != after.get(**key);
    let told = |key: &String| match (before.get(key), named(key)) {
        (Some(value), key) if value.starts_with(CONTENT) => format!("{key} had another content"),
        (Some(value), key) if key == "shot.frames" => format!("{key} began at {value}"),
        (Some(value), key) if value.len() > LONG => key,
        (Some(value), key) => format!("{key} was {value}"),
        (None, key) => format!("{key} was not there"),
    };
    keys.iter().filter(differs).map(|key| told(key)).collect()
}

/// A key as `--set` names it: `object.1.scale`, not `object[1].scale`.
fn named(key: &str) -> String {
    key.replace('[', ".").replace(']', "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named_with_the_former_value() {
        let settings = |all: &[(&str, &str)]| -> Settings {
            all.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
        };
        let before = settings(&[("snow.depth", "0.3"), ("snow.cell", "0.1"), ("object[2].up", "\"z\"")]);
        assert_eq!(changed(&before, &before), Vec::<String>::new());
        let after = settings(&[("snow.depth", "0.2"), ("snow.cell", "0.1")]);
        assert_eq!(changed(&before, &after), ["object.2.up was \"z\"", "snow.depth was 0.3"]);
        let file =
            |content: &str| BTreeMap::from([("object[1].file".to_string(), format!("{CONTENT}{content}"))]);
        assert_eq!(changed(&file("a"), &file("b")), ["object.1.file had another content"]);
    }
}
