//! The settings that a stage's output depends on, and what two of them differ in.

use std::collections::{BTreeMap, BTreeSet};

use toml::Value;

use super::{Ground, Layer, Role, Scene};
use crate::error::{Error, Result};
use crate::io::seen::Seen;
use crate::io::sequence::Pattern;

/// Former values longer than this are not told.
const LONG: usize = 80;
/// What stands in place of a file's name: the same content under another name is the same input.
const CONTENT: &str = "content ";

/// Settings by key: `snow.noise.size`, `object[1].scale`.
pub(super) type Settings = BTreeMap<String, String>;

/// The settings that the base depends on. Of the frames only the first counts: a shot may grow.
///
/// `seen` knows the inputs that were read.
///
/// # Errors
/// An input that cannot be read.
pub(super) fn of_base(scene: &Scene, seen: &Seen) -> Result<Settings> {
    let unreadable = || Error::Internal("the resolved scene cannot be read".into());
    let mut settings = flattened(&scene.to_toml()).ok_or_else(unreadable)?;
    settings.insert("shot.frames".into(), scene.shot.frames.first.to_string());
    settings.remove("output.usd");
    // Another version may compute another layer.
    settings.insert("frazil".into(), env!("CARGO_PKG_VERSION").into());
    for (key, content) in contents(scene, seen)? {
        settings.insert(key, format!("{CONTENT}{content}"));
    }
    Ok(settings)
}

/// Hashes of the files that settings name, by key; of a moving sequence none, since its frames count one by one.
///
/// # Errors
/// A file that cannot be read.
fn contents(scene: &Scene, seen: &Seen) -> Result<Vec<(String, String)>> {
    let mut out = Vec::new();
    if let Some(Ground::Mesh(path)) = &scene.snow.ground {
        out.push(("snow.ground".to_string(), seen.hash(path)?));
    }
    if let Layer::Top(path) | Layer::Grid(path) = &scene.snow.layer {
        out.push(("snow.top".to_string(), seen.hash(path)?));
    }
    for (index, object) in scene.objects.iter().enumerate() {
        let content = match (Pattern::parse(&object.file), object.role) {
            (_, Role::Ignore) => "ignored".to_string(),
            (None, _) => seen.hash(&object.file)?,
            (Some(pattern), Role::Static) => {
                let at = f64::from(scene.shot.frames.first) - object.offset;
                let frames = [at.floor(), at.ceil()].map(|frame| seen.hash(&pattern.path(frame as i32)));
                let [below, above] = frames;
                below? + &above?
            }
            (Some(_), Role::Collide) => "of each frame".to_string(),
        };
        out.push((format!("object[{}].file", index + 1), content));
    }
    Ok(out)
}

/// Keys that make the layer before the first frame, besides those of static objects.
const LAYER: [&str; 6] = ["shot.frames", "snow.ground", "snow.area", "snow.depth", "snow.top", "snow.cell"];
/// Keys of a static object that make nothing.
const OF_NO_MATTER: [&str; 2] = ["role", "noise"];

/// The settings that make the layer before the first frame: what was kept cannot go on as another layer. Static objects
/// are counted by themselves: others may come and go.
pub(super) fn of_layer(all: &Settings) -> Settings {
    let mut out: Settings =
        LAYER.iter().filter_map(|key| Some((key.to_string(), all.get(*key)?.clone()))).collect();
    let is_static =
        |index: &usize| all.get(&format!("object[{index}].role")).map(String::as_str) == Some("\"static\"");
    let count = all.keys().filter(|key| key.starts_with("object[") && key.ends_with("].role")).count();
    for (place, index) in (1..=count).filter(is_static).enumerate() {
        let before = format!("object[{index}].");
        for (key, value) in all.iter().filter_map(|(key, value)| Some((key.strip_prefix(&before)?, value))) {
            if !OF_NO_MATTER.contains(&key) {
                out.insert(format!("static object {}: {key}", place + 1), value.clone());
            }
            // When a clip starts depends on it.
            if key == "clip" || key == "loop" {
                out.extend(all.get("shot.fps").map(|fps| ("shot.fps".to_string(), fps.clone())));
            }
        }
    }
    out
}

/// The keys whose values differ, each with the former value.
pub(super) fn changed(before: &Settings, after: &Settings) -> Vec<String> {
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
    fn static_objects_make_the_layer_wherever_they_stand() {
        let layer = |text: &str| of_layer(&flattened(text).unwrap());
        let rock = |scale: f64| format!("[[object]]\nrole = \"static\"\nscale = {scale:?}\nnoise = true\n");
        let foot = "[[object]]\nrole = \"collide\"\nscale = 3.0\n";
        let [one, two] = [layer(&(rock(1.0) + foot)), layer(&(foot.to_string() + foot + &rock(1.0)))];
        assert_eq!(changed(&one, &two), Vec::<String>::new());
        assert_eq!(changed(&one, &layer(&(rock(2.0) + foot))), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&one, &layer(foot)), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&layer(foot), &one), ["static object 1: scale was not there"]);
    }

    #[test]
    fn differences_are_named_with_the_former_value() {
        let settings = |text: &str| flattened(text).unwrap();
        let before =
            settings("[snow]\ndepth = 0.3\ncell = 0.1\n[[object]]\nscale = 1.0\n[[object]]\nup = \"z\"\n");
        assert_eq!(changed(&before, &before), Vec::<String>::new());
        let after = settings("# Other words.\n[snow]\ndepth = 0.2\ncell = 0.1\n[[object]]\nscale = 1.0\n");
        assert_eq!(changed(&before, &after), ["object.2.up was \"z\"", "snow.depth was 0.3"]);
        let file =
            |content: &str| BTreeMap::from([("object[1].file".to_string(), format!("{CONTENT}{content}"))]);
        assert_eq!(changed(&file("a"), &file("b")), ["object.1.file had another content"]);
    }
}
