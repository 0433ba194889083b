//! The keys that all systems share.

use super::declaration::Kind::{Choice, File, Flag, Frames, Number, Poses, Text};
use super::declaration::Scope::{First, Object, Step};
use super::declaration::{Key, Kind, OBJECT, Scopes, key, optional, or, required};
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

/// For every stage that uses the objects.
const MOVES: Scopes = &[("base", Object), ("grains", Object), ("mist", Object), ("objects", Step)];

/// Tables whose stages exist only if a scene has the table.
pub const OPTIONAL_TABLES: &[&str] = &["grains", "mist"];

/// Extensions of moving objects: characters and meshes.
const MOVING: &[&str] = &["glb", "gltf", EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2]];

/// The stages that begin with the shot.
const BEGIN: Scopes = &[
    ("base", First),
    ("grains", First),
    ("mist", First),
    ("objects", First),
    ("volumes", First),
    ("surface", First),
    ("liquid", First),
];
/// The stages whose steps take the time between two frames.
const STEPS: Scopes = &[
    ("base", Step),
    ("grains", Step),
    ("mist", Step),
    ("objects", Step),
    ("volumes", Step),
    ("surface", First),
    ("liquid", Step),
];

pub const SHOT: &[Key] = &[
    key(BEGIN, "shot", "frames", Frames, required("\"1-120\"").shown()).means("first and last"),
    key(STEPS, "shot", "fps", Number(0.001, 100_000.0, "frames per second"), or("24.0"))
        .means("frames per second"),
];

pub const OBJECTS: &[Key] = &[
    key(MOVES, OBJECT, "file", File(MOVING), required("\"hero.glb\"").shown())
        .means("character, mesh, or sequence \"body.%04d.obj\""),
    key(MOVES, OBJECT, "node", Text, optional("\"hero*\""))
        .of_characters()
        .means("only nodes of this name (* matches any letters) and their descendants"),
    key(MOVES, OBJECT, "clip", Text, optional("\"Walk\""))
        .of_characters()
        .means("required if there are several; \"\": the rest pose"),
    key(MOVES, OBJECT, "loop", Flag, or("true")).of_characters().means("the clip starts again when it ends"),
    key(MOVES, OBJECT, "offset", Number(-1.0e7, 1.0e7, "frames"), or("0.0"))
        .means("frames by which a sequence or clip starts later"),
    key(MOVES, OBJECT, "scale", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("from the file's unit to metres: 0.01 for centimetres"),
    key(MOVES, OBJECT, "up", Choice(&["y", "z"]), or("\"y\"")).means("the file's upward axis: y or z"),
    key(MOVES, OBJECT, "origin", ORIGIN, or(NO_ORIGIN)).means(ORIGIN_MEANS),
    key(MOVES, OBJECT, "role", Choice(&["collide", "base", "grains", "static", "ignore"]), or("\"collide\""))
        .means("collide, base (removes snow, pushes no grains), grains (pushes grains, removes no snow), static (the snow lies on it from the start) or ignore"),
    key(MOVES, OBJECT, "ease", Flag, or("false"))
        .means("true: smooth motion through the keys, from rest to rest; false: linear between them"),
    key(MOVES, OBJECT, "keys", Poses(FAR), or("[]").such_as("[\n    { frame = 1, at = [0.0, 0.1, -2.5] },\n    { frame = 120, at = [0.0, 0.1, 2.5], turn_deg = [0.0, 0.0, 0.0] },\n]").shown())
        .means("rigid motion on top of the file's own: m, degrees about x, then y, then z"),
];

/// Of all systems.
pub const OUTPUT: &[Key] =
    &[key(&[], "output", "usd", Flag, or("true"))
        .means("shot.usda: the whole shot for programs that read USD")];

/// The tables of some keys, in their order.
pub fn tables(keys: &[Key]) -> Vec<&'static str> {
    let mut out: Vec<&str> = keys.iter().map(|key| key.table).collect();
    out.dedup();
    out
}
