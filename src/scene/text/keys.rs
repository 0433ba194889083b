//! The keys of a scene, each declared once: what it means, and what of each stage depends on it.

use std::collections::BTreeMap;

use toml::Value;

use crate::error::{Error, Result};
use crate::io::seen::Seen;
use crate::io::sequence::Pattern;
use crate::scene::shot::{CONTENT, Settings};
use crate::scene::{Role, Scene};

/// What of a stage depends on a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The state before the first frame, and all that follows.
    First,
    /// Every step.
    Step,
    /// What is written of a frame.
    Output,
    /// As its object's role has it: the first state for a static one, every step for one that moves.
    Object,
}

/// A key of a scene.
pub struct Key {
    /// Its table, as in `snow.noise`; `object` for all objects.
    pub table: &'static str,
    /// Its name in the table.
    pub name: &'static str,
    /// What it means, in the resolved scene.
    pub meaning: &'static str,
    /// The stages that depend on it.
    pub scopes: &'static [(&'static str, Scope)],
}

use Scope::{First, Object, Output, Step};

/// Keys of objects that move in every stage that knows them.
const MOVES: &[(&str, Scope)] = &[("base", Object), ("objects", Step)];
const FIRST: &[(&str, Scope)] = &[("base", First)];
const STEP: &[(&str, Scope)] = &[("base", Step)];
const OUTPUT: &[(&str, Scope)] = &[("base", Output)];

const fn key(
    table: &'static str,
    name: &'static str,
    scopes: &'static [(&'static str, Scope)],
    meaning: &'static str,
) -> Key {
    Key { table, name, meaning, scopes }
}

/// All of them, in the order in which the resolved scene has them.
pub const KEYS: &[Key] = &[
    key("shot", "frames", &[("base", First), ("objects", First)], "first and last"),
    key("shot", "fps", &[("base", Step), ("objects", Step)], "frames per second"),
    key("snow", "ground", FIRST, "height of a level plane (m), or a mesh"),
    key("snow", "area", FIRST, "x0, z0, x1, z1 (m)"),
    key("snow", "depth", FIRST, "above ground and static objects (m)"),
    key("snow", "top", FIRST, "mesh of the top surface, or the layer as a level set"),
    key("snow", "cell", FIRST, "edge of a voxel (m)"),
    key("snow", "min_crumb", STEP, "islands of fewer voxels are taken away; 0 = none"),
    key("snow.noise", "amplitude", STEP, "greatest displacement, outward only (m); 0 = off"),
    key("snow.noise", "size", STEP, "size of the largest features (m)"),
    key("snow.noise", "octaves", STEP, "each of half the size of the one before"),
    key("snow.noise", "seed", STEP, ""),
    key("object", "file", MOVES, "character, mesh or sequence"),
    key("object", "node", MOVES, "only nodes of this name and what hangs on them"),
    key("object", "clip", MOVES, "empty: the pose at rest"),
    key("object", "loop", MOVES, "the clip starts again when it ends"),
    key("object", "offset", MOVES, "frames that a sequence or clip starts later"),
    key("object", "scale", MOVES, "from the file's unit to metres"),
    key("object", "up", MOVES, "the file's upward axis: y or z"),
    key("object", "role", MOVES, "collide, static or ignore"),
    key("object", "noise", STEP, "ragged edges"),
    key("object", "ease", MOVES, "smooth between keys, else straight"),
    key("object", "keys", MOVES, "rigid motion over the file's own"),
    key("output", "base", OUTPUT, "base/base.%04d.vdb: surface, compression, touched"),
    key("output", "base_mode", OUTPUT, "full, or delta: first frame whole, then what changed"),
    key("output", "half", OUTPUT, "16-bit values, for rendering only"),
    key("output", "removed", OUTPUT, "removed/removed.%04d.vdb: what each frame took away"),
    key(
        "output",
        "objects",
        &[("objects", Output)],
        "\"usd\", \"ply\": objects/, as they moved, with velocities",
    ),
    key("output", "usd", &[], "shot.usda: the whole shot for programs that read USD"),
];

/// The names of a table's keys.
pub fn names(table: &str) -> Vec<&'static str> {
    KEYS.iter().filter(|key| key.table == table).map(|key| key.name).collect()
}

/// A key's declaration by its path in settings: `snow.noise.size`, `object[1].scale`.
pub fn find(path: &str) -> Option<&'static Key> {
    let (table, name) = path.rsplit_once('.')?;
    let table = table.split('[').next().unwrap_or(table);
    KEYS.iter().find(|key| key.table == table && key.name == name)
}

/// What of a stage depends on a key.
pub fn scope(path: &str, stage: &str) -> Option<Scope> {
    find(path)?.scopes.iter().find(|(name, _)| *name == stage).map(|(_, scope)| *scope)
}

/// The settings that a stage depends on, with the content of the objects' files in place of their names; of the objects
/// those with these roles count, each as its role has it. Of the frames only the first counts: a shot may grow.
///
/// # Errors
/// A file that cannot be read.
pub fn settings_of(scene: &Scene, stage: &str, seen: &Seen, roles: &[Role]) -> Result<Settings> {
    let unreadable = || Error::Internal("the resolved scene cannot be read".into());
    let mut settings = flattened(&scene.to_toml()).ok_or_else(unreadable)?;
    settings.retain(|key, _| scope(key, stage).is_some());
    for (index, object) in scene.objects.iter().enumerate() {
        let of_object = format!("object[{}].", index + 1);
        let of_static =
            |key: &str| key == "role" || scope(&format!("object.{key}"), stage) == Some(Scope::Object);
        let counts =
            |key: &str| roles.contains(&object.role) && (object.role != Role::Static || of_static(key));
        settings.retain(|key, _| key.strip_prefix(&of_object).is_none_or(counts));
        if roles.contains(&object.role) {
            let content = match (Pattern::parse(&object.file), object.role) {
                (None, _) => seen.hash(&object.file)?,
                (Some(pattern), Role::Static) => {
                    let at = f64::from(scene.shot.frames.first) - object.offset;
                    let [below, above] =
                        [at.floor(), at.ceil()].map(|frame| seen.hash(&pattern.path(frame as i32)));
                    below? + &above?
                }
                (Some(_), _) => "of each frame".to_string(),
            };
            settings.insert(format!("{of_object}file"), format!("{CONTENT}{content}"));
        }
    }
    settings.insert("shot.frames".into(), scene.shot.frames.first.to_string());
    // Another version may compute something else.
    settings.insert("frazil".into(), env!("CARGO_PKG_VERSION").into());
    Ok(settings)
}

/// The values of a scene's text by key: `snow.noise.size`, `object[1].file`.
pub fn flattened(text: &str) -> Option<Settings> {
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
