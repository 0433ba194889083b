//! The settings that a stage's output depends on, and what two of them differ in.

use std::collections::{BTreeMap, BTreeSet};

use toml::Value;

use super::objects::is_character;
use super::{Ground, Layer, Role, Scene};
use crate::error::{Error, Result};
use crate::io::hash;
use crate::io::sequence::Pattern;
use crate::motion::Character;

/// Former values longer than this are not told.
const LONG: usize = 80;
/// What stands in place of a file's name: the same content under another name is the same input.
const CONTENT: &str = "content ";

/// Settings by key: `snow.noise.size`, `object[1].scale`.
pub(super) type Settings = BTreeMap<String, String>;

/// The settings that the base depends on. Of the frames only the first counts: a shot may grow.
///
/// # Errors
/// An input that cannot be read.
pub(super) fn of_base(scene: &Scene) -> Result<Settings> {
    let unreadable = || Error::Internal("the resolved scene cannot be read".into());
    let mut settings = flattened(&scene.to_toml()).ok_or_else(unreadable)?;
    settings.insert("shot.frames".into(), scene.shot.frames.first.to_string());
    settings.remove("output.usd");
    // Another version may compute another layer.
    settings.insert("frazil".into(), env!("CARGO_PKG_VERSION").into());
    for (key, content) in contents(scene)? {
        settings.insert(key, format!("{CONTENT}{content}"));
    }
    Ok(settings)
}

/// Hashes of the files that settings name, by key; of a moving sequence none, since its frames count one by one.
///
/// # Errors
/// A file that cannot be read.
fn contents(scene: &Scene) -> Result<Vec<(String, String)>> {
    let mut out = Vec::new();
    if let Some(Ground::Mesh(path)) = &scene.snow.ground {
        out.push(("snow.ground".to_string(), hash::of_file(path)?));
    }
    if let Layer::Top(path) | Layer::Grid(path) = &scene.snow.layer {
        out.push(("snow.top".to_string(), hash::of_file(path)?));
    }
    for (index, object) in scene.objects.iter().enumerate() {
        let content = match (Pattern::parse(&object.file), object.role) {
            (_, Role::Ignore) => "ignored".to_string(),
            (None, _) if is_character(&object.file) => Character::content(&object.file)?,
            (None, _) => hash::of_file(&object.file)?,
            (Some(pattern), Role::Static) => {
                let at = f64::from(scene.shot.frames.first) - object.offset;
                let frames = [at.floor(), at.ceil()].map(|frame| hash::of_file(&pattern.path(frame as i32)));
                let [below, above] = frames;
                below? + &above?
            }
            (Some(_), Role::Collide) => "of each frame".to_string(),
        };
        out.push((format!("object[{}].file", index + 1), content));
    }
    Ok(out)
}

/// The keys whose values differ, each with the former value.
pub(super) fn changed(before: &Settings, after: &Settings) -> Vec<String> {
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let differs = |key: &&&String| before.get(**key) != after.get(**key);
    let told = |key: &String| match before.get(key) {
        Some(value) if value.starts_with(CONTENT) => format!("{key} had another content"),
        Some(value) if key == "shot.frames" => format!("{key} began at {value}"),
        Some(value) if value.len() > LONG => key.clone(),
        Some(value) => format!("{key} was {value}"),
        None => format!("{key} was not there"),
    };
    keys.iter().filter(differs).map(|key| told(key)).collect()
}

/// Values by key: `snow.noise.size`, `object[1].file`.
fn flattened(text: &str) -> Option<Settings> {
    let mut out = BTreeMap::new();
    for (key, value) in text.parse::<toml::Table>().ok()? {
        flatten(key, &value, &mut out);
    }
    Some(out)
}

fn flatten(key: String, value: &Value, out: &mut Settings) {
    match value {
        Value::Table(table) => {
            table.iter().for_each(|(name, value)| flatten(format!("{key}.{name}"), value, out))
        }
        Value::Array(items) if key == "object" => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, item)| flatten(format!("{key}[{}]", index + 1), item, out));
        }
        value => {
            out.insert(key, value.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named_with_the_former_value() {
        let settings = |text: &str| flattened(text).unwrap();
        let before =
            settings("[snow]\ndepth = 0.3\ncell = 0.1\n[[object]]\nscale = 1.0\n[[object]]\nup = \"z\"\n");
        assert_eq!(changed(&before, &before), Vec::<String>::new());
        let after = settings("# Other words.\n[snow]\ndepth = 0.2\ncell = 0.1\n[[object]]\nscale = 1.0\n");
        assert_eq!(changed(&before, &after), ["object[2].up was \"z\"", "snow.depth was 0.3"]);
        let file =
            |content: &str| BTreeMap::from([("object[1].file".to_string(), format!("{CONTENT}{content}"))]);
        assert_eq!(changed(&file("a"), &file("b")), ["object[1].file had another content"]);
    }
}
