//! The settings that a stage depends on, and the differences between two sets of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::Result;
use crate::io::files::sequence::Pattern;
use crate::io::records::input_hashes::InputHashes;
use crate::scene::schema::declaration::Key;
use crate::scene::schema::declaration::Scope::{First, Object};
use crate::scene::schema::values::key_path;
use crate::scene::{Role, Scene};

/// Maximum length of a former value in messages.
const MAX_LENGTH: usize = 80;
/// Prefix of a hash that replaces a file's name: the same content under another name is the same input.
pub const CONTENT: &str = "content ";

/// Settings by key: `snow.noise.size`, `object[1].scale`.
pub type Settings = BTreeMap<String, String>;

/// Keys whose defaults have changed: what a folder that was made before has, and what the same scene says now. Such a folder is resumed:
/// its frames stay as they are, and new ones are written in the new way.
const NEW_DEFAULTS: [(&str, Option<&str>, Option<&str>); 10] = [
    ("output.surface", Some(r#"["ply"]"#), Some(r#"["usd"]"#)),
    ("output.liquid", Some(r#"["ply"]"#), Some(r#"["usd"]"#)),
    ("output.terrain", None, Some(r#"["usd"]"#)),
    ("output.grains", Some(r#"["vdb"]"#), None),
    ("output.grains", Some(r#"["vdb", "usd"]"#), None),
    ("output.mist_half", None, Some("true")),
    ("output.names", None, Some(r#""houdini""#)),
    ("output.mesh", Some("[]"), None),
    ("output.mesh_adaptivity", None, Some("0.05")),
    ("output.objects", Some("[]"), Some(r#"["usd"]"#)),
];

/// The keys whose values differ, each with the former value.
pub(in crate::scene) fn changed(before: &Settings, after: &Settings) -> Vec<String> {
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let differs = |key: &&&String| {
        let (was, is) = (before.get(**key).map(String::as_str), after.get(**key).map(String::as_str));
        was != is && !NEW_DEFAULTS.contains(&(key.as_str(), was, is))
    };
    let described = |key: &String| match (before.get(key), override_key(key)) {
        (Some(value), key) if value.starts_with(CONTENT) => format!("{key} had different contents"),
        (Some(value), key) if key == "shot.frames" => format!("{key} began at {value}"),
        (Some(value), key) if value.len() > MAX_LENGTH => key,
        (Some(value), key) => format!("{key} was {value}"),
        (None, key) => format!("{key} was not set"),
    };
    keys.iter().filter(differs).map(|key| described(key)).collect()
}

/// A key as `--set` names it: `object.1.scale`, not `object[1].scale`.
fn override_key(key: &str) -> String {
    key.replace('[', ".").replace(']', "")
}

/// The settings that a stage depends on, with the content of the objects' files instead of their names. Only objects with these roles
/// count, and of a static object only the keys that matter to it. Of the shot's frames only the first counts: a shot may be extended.
///
/// # Errors
/// A file that cannot be read.
pub fn settings_of(
    scene: &Scene,
    stage: &str,
    input_hashes: &InputHashes,
    roles: &[Role],
) -> Result<Settings> {
    let mut settings: Settings = scene
        .values
        .iter()
        .filter(|(key, _, _)| key.scope(stage).is_some())
        .filter(|(key, object, _)| {
            match object.and_then(|index| scene.objects.get(index)).map(|object| object.role) {
                None => true,
                Some(role) if !roles.contains(&role) => false,
                Some(Role::Static) => key.name == "role" || key.scope(stage) == Some(Object),
                Some(_) => true,
            }
        })
        .map(|(key, object, value)| (key_path(key, object), value.to_string()))
        .collect();
    for (index, object) in scene.objects.iter().enumerate().filter(|(_, o)| roles.contains(&o.role)) {
        let content = match (Pattern::parse(&object.file), object.role) {
            (None, _) => input_hashes.hash(&object.file)?,
            (Some(pattern), Role::Static) => {
                let at = f64::from(scene.shot.frames.first) - object.offset;
                let [below, above] =
                    [at.floor(), at.ceil()].map(|frame| input_hashes.hash(&pattern.path(frame as i32)));
                below? + &above?
            }
            (Some(_), _) => "of each frame".to_string(),
        };
        settings.insert(format!("object[{}].file", index + 1), format!("{CONTENT}{content}"));
    }
    settings.insert("shot.frames".into(), scene.shot.frames.first.to_string());
    // Other versions may compute different results.
    settings.insert("frazil".into(), env!("CARGO_PKG_VERSION").into());
    Ok(settings)
}

/// Those of a stage's settings that determine its first state: keys with the scope [`First`].
pub fn settings_of_first_state(keys: &[Key], settings: &Settings, stage: &str) -> Settings {
    let is_first = |path: &str| {
        let (table, name) = path.rsplit_once('.').unwrap_or_default();
        // Without the index of `object[1]`.
        let table = table.split('[').next().unwrap_or(table);
        let declared = keys.iter().find(|key| key.table == table && key.name == name);
        declared.is_some_and(|key| key.scope(stage) == Some(First))
    };
    let own = settings.iter().filter(|(path, _)| is_first(path));
    own.map(|(path, value)| (path.clone(), value.clone())).collect()
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
        let (before, after) = (
            settings(&[("output.liquid", r#"["ply"]"#)]),
            settings(&[("output.liquid", r#"["usd"]"#), ("output.terrain", r#"["usd"]"#)]),
        );
        assert_eq!(changed(&before, &after), Vec::<String>::new());
        assert_eq!(changed(&after, &before).len(), 2);
        let file =
            |content: &str| BTreeMap::from([("object[1].file".to_string(), format!("{CONTENT}{content}"))]);
        assert_eq!(changed(&file("a"), &file("b")), ["object.1.file had different contents"]);
    }
}
