//! The keys that all systems share.

use super::key::Scope::{First, Object, Step};
use super::key::{Key, Kind, OBJECT, Scope};
use crate::io::mesh::EXTENSIONS;

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

pub const SHOT: &[Key] = &[
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

pub const OBJECTS: &[Key] = &[
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
pub const OUTPUT: &[Key] =
    &[Key::new("output", "usd", Kind::Flag, "shot.usda: the whole shot for programs that read USD")
        .or("true")];

/// The tables of some keys, in their order.
pub fn tables(keys: &[Key]) -> Vec<&'static str> {
    let mut out: Vec<&str> = keys.iter().map(|key| key.table).collect();
    out.dedup();
    out
}
