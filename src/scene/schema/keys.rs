//! The keys that all systems share, those of each system, and the settings that a stage depends on.

use std::sync::LazyLock;

use super::key::Scope::{First, Object, Step};
use super::key::{Key, Kind, OBJECT, Scope};
use crate::error::Result;
use crate::io::files::sequence::Pattern;
use crate::io::mesh::EXTENSIONS;
use crate::io::records::input_hashes::Seen;
use crate::scene::run::{CONTENT, Settings};
use crate::scene::{Role, Scene, System, shallow, snow, surface};

/// Farthest coordinate allowed in a scene (m): f32 positions keep millimetres up to here.
pub const FAR: f64 = 1.0e5;

/// The origin of a file: of any map projection, in any unit.
pub const ORIGIN: Kind = Kind::Numbers(3, 1.0e12, "");
/// What it means.
pub const ORIGIN_MEANS: &str =
    "position in the file's unit and axes that becomes the origin, subtracted in 64 bits";
/// Its default.
pub const NO_ORIGIN: &str = "[0.0, 0.0, 0.0]";

type Scopes = &'static [(&'static str, Scope)];

/// For every stage that uses the objects.
const MOVES: Scopes = &[("base", Object), ("grains", Object), ("mist", Object), ("objects", Step)];

/// Tables whose stages exist only if a scene has the table.
pub const OPTIONAL: &[&str] = &["grains", "mist"];

/// Extensions of moving objects: characters and meshes.
const MOVING: &[&str] = &["glb", "gltf", EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2]];

const SHOT: &[Key] = &[
    Key::new("shot", "frames", Kind::Frames, "first and last").begins_with("\"1-120\"").concerns(&[
        ("base", First),
        ("grains", First),
        ("mist", First),
        ("objects", First),
        ("volumes", First),
        ("surface", First),
        ("liquid", First),
    ]),
    Key::new("shot", "fps", Kind::Number(0.001, 100_000.0, "frames per second"), "frames per second")
        .or("24.0")
        .concerns(&[
            ("base", Step),
            ("grains", Step),
            ("mist", Step),
            ("objects", Step),
            ("volumes", Step),
            ("surface", First),
            ("liquid", Step),
        ]),
];

const OBJECTS: &[Key] = &[
    Key::new(OBJECT, "file", Kind::File(MOVING), "character, mesh, or sequence \"body.%04d.obj\"")
        .begins_with("\"hero.glb\"")
        .concerns(MOVES),
    Key::new(OBJECT, "node", Kind::Text, "only nodes of this name (* matches any letters) and their descendants")
        .or_nothing()
        .of_characters()
        .such_as("\"hero*\"")
        .concerns(MOVES),
    Key::new(OBJECT, "clip", Kind::Text, "required if there are several; \"\": the rest pose")
        .or_nothing()
        .of_characters()
        .such_as("\"Walk\"")
        .concerns(MOVES),
    Key::new(OBJECT, "loop", Kind::Flag, "the clip starts again when it ends")
        .or("true")
        .of_characters()
        .concerns(MOVES),
    Key::new(OBJECT, "offset", Kind::Number(-1.0e7, 1.0e7, "frames"), "frames by which a sequence or clip starts later")
        .or("0.0")
        .concerns(MOVES),
    Key::new(OBJECT, "scale", Kind::Number(1.0e-9, 1.0e9, ""), "from the file's unit to metres: 0.01 for centimetres")
        .or("1.0")
        .concerns(MOVES),
    Key::new(OBJECT, "up", Kind::Choice(&["y", "z"]), "the file's upward axis: y or z").or("\"y\"").concerns(MOVES),
    Key::new(OBJECT, "origin", ORIGIN, ORIGIN_MEANS).or(NO_ORIGIN).concerns(MOVES),
    Key::new(
        OBJECT,
        "role",
        Kind::Choice(&["collide", "base", "grains", "static", "ignore"]),
        "collide, base (removes snow, pushes no grains), grains (pushes grains, removes no snow), static (the snow lies on it from the start) or ignore",
    )
    .or("\"collide\"")
    .concerns(MOVES),
    Key::new(OBJECT, "ease", Kind::Flag, "true: smooth motion through the keys, from rest to rest; false: linear between them").or("false").concerns(MOVES),
    Key::new(OBJECT, "keys", Kind::Poses(FAR), "rigid motion on top of the file's own: m, degrees about x, then y, then z")
        .or("[]")
        .begins_with(
            "[\n    { frame = 1, at = [0.0, 0.1, -2.5] },\n    { frame = 120, at = [0.0, 0.1, 2.5], turn_deg = [0.0, 0.0, 0.0] },\n]",
        )
        .concerns(MOVES),
];

/// Of all systems.
const OUTPUT: &[Key] =
    &[Key::new("output", "usd", Kind::Flag, "shot.usda: the whole shot for programs that read USD")
        .or("true")];

/// The keys of a system's scenes, in the order of a scene: the system's keys between the shot and the objects, and its own keys of objects
/// after the shared ones.
pub fn of(system: System) -> &'static [Key] {
    static SNOW: LazyLock<Vec<Key>> = LazyLock::new(|| {
        let own = [snow::KEYS, snow::GRAIN_KEYS, snow::MIST_KEYS, snow::OUTPUT_KEYS];
        ordered([SHOT, OBJECTS, &own.concat()[..], OUTPUT])
    });
    static SURFACE: LazyLock<Vec<Key>> = LazyLock::new(|| ordered([SHOT, surface::KEYS, OUTPUT]));
    static SHALLOW: LazyLock<Vec<Key>> =
        LazyLock::new(|| ordered([SHOT, shallow::KEYS, shallow::MANY_KEYS, OUTPUT]));
    match system {
        System::Snow => &SNOW,
        System::Surface => &SURFACE,
        System::Shallow => &SHALLOW,
    }
}

fn ordered<const N: usize>(lists: [&[Key]; N]) -> Vec<Key> {
    let mut keys = lists.concat();
    keys.sort_by_key(|key| match key.table {
        "shot" => 0,
        OBJECT => 2,
        "output" => 3,
        _ => 1,
    });
    keys
}

/// The tables of some keys, in their order.
pub fn tables(keys: &[Key]) -> Vec<&'static str> {
    let mut out: Vec<&str> = keys.iter().map(|key| key.table).collect();
    out.dedup();
    out
}

/// The settings that a stage depends on, with the content of the objects' files instead of their names. Only objects with these roles
/// count, each according to its role. Of the frames only the first counts: a shot may be extended.
///
/// # Errors
/// A file that cannot be read.
pub fn settings_of(scene: &Scene, stage: &str, seen: &Seen, roles: &[Role]) -> Result<Settings> {
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
        .map(|(key, object, value)| (super::values::path(key, object), value.to_string()))
        .collect();
    for (index, object) in scene.objects.iter().enumerate().filter(|(_, o)| roles.contains(&o.role)) {
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
        settings.insert(format!("object[{}].file", index + 1), format!("{CONTENT}{content}"));
    }
    settings.insert("shot.frames".into(), scene.shot.frames.first.to_string());
    // Other versions may compute different results.
    settings.insert("frazil".into(), env!("CARGO_PKG_VERSION").into());
    Ok(settings)
}

/// Those of a stage's settings that determine its first state.
pub fn first_of(system: System, settings: &Settings, stage: &str) -> Settings {
    let is_first = |path: &str| {
        let (table, name) = path.rsplit_once('.').unwrap_or_default();
        // The index is dropped: `object[1]`.
        let table = table.split('[').next().unwrap_or(table);
        let declared = of(system).iter().find(|key| key.table == table && key.name == name);
        declared.is_some_and(|key| key.scope(stage) == Some(First))
    };
    let own = settings.iter().filter(|(path, _)| is_first(path));
    own.map(|(path, value)| (path.clone(), value.clone())).collect()
}
