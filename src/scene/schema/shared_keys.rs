//! The keys that all systems share.

use super::declaration::Kind::{Choice, File, Flag, Frames, Number, Poses, Text};
use super::declaration::Scope::{First, Object, Step};
use super::declaration::{Key, Kind, OBJECT, Scopes, key, optional, or, required};
use crate::io::mesh::EXTENSIONS;

/// Farthest coordinate allowed in a scene (m): f32 positions keep millimetres up to here.
pub const FAR: f64 = 1.0e5;

/// Values of an `origin`: coordinates of any map projection, in any unit.
pub const ORIGIN: Kind = Kind::Numbers(3, 1.0e12, "");
/// The meaning of `origin`.
pub const ORIGIN_MEANS: &str =
    "position in the file's unit and axes that becomes the origin, subtracted in 64 bits";
/// The default of `origin`.
pub const NO_ORIGIN: &str = "[0.0, 0.0, 0.0]";

/// Scopes of the keys of objects.
const OBJECT_SCOPES: Scopes = &[("base", Object), ("grains", Object), ("mist", Object), ("objects", Step)];

/// Tables whose stages exist only if a scene has the table.
pub const OPTIONAL_TABLES: &[&str] = &["grains", "mist"];

/// Extensions of objects: characters and meshes.
const OBJECT_EXTENSIONS: &[&str] =
    &["glb", "gltf", EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2], EXTENSIONS[3], EXTENSIONS[4]];

/// Scopes of `shot.frames`: the first frame determines the first state.
const FRAMES_SCOPES: Scopes = &[
    ("base", First),
    ("grains", First),
    ("mist", First),
    ("objects", First),
    ("volumes", First),
    ("surface", First),
    ("liquid", First),
];
/// Scopes of `shot.fps`.
const FPS_SCOPES: Scopes = &[
    ("base", Step),
    ("grains", Step),
    ("mist", Step),
    ("objects", Step),
    ("volumes", Step),
    ("surface", First),
    ("liquid", Step),
];

pub const SHOT: &[Key] = &[
    key(FRAMES_SCOPES, "shot", "frames", Frames, required("\"1-120\"").shown()).means("first and last"),
    key(FPS_SCOPES, "shot", "fps", Number(0.001, 100_000.0, "frames per second"), or("24.0"))
        .means("frames per second"),
];

pub const OBJECTS: &[Key] = &[
    key(OBJECT_SCOPES, OBJECT, "file", File(OBJECT_EXTENSIONS), required("\"hero.glb\"").shown())
        .means("character, mesh, or sequence \"body.%04d.obj\""),
    key(OBJECT_SCOPES, OBJECT, "node", Text, optional("\"hero*\""))
        .of_characters()
        .means("only nodes of this name (* matches any characters) and their descendants"),
    key(OBJECT_SCOPES, OBJECT, "clip", Text, optional("\"Walk\""))
        .of_characters()
        .means("required if there are several; \"\": the rest pose"),
    key(OBJECT_SCOPES, OBJECT, "loop", Flag, or("true")).of_characters().means("the clip starts again when it ends"),
    key(OBJECT_SCOPES, OBJECT, "offset", Number(-1.0e7, 1.0e7, "frames"), or("0.0"))
        .means("frames by which a sequence or clip starts later"),
    key(OBJECT_SCOPES, OBJECT, "scale", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("from the file's unit to metres: 0.01 for centimetres"),
    key(OBJECT_SCOPES, OBJECT, "up", Choice(&["y", "z"]), or("\"y\"")).means("the file's upward axis: y or z"),
    key(OBJECT_SCOPES, OBJECT, "origin", ORIGIN, or(NO_ORIGIN)).means(ORIGIN_MEANS),
    key(OBJECT_SCOPES, OBJECT, "role", Choice(&["collide", "base", "grains", "static", "ignore"]), or("\"collide\""))
        .means("collide, base (removes snow, pushes no grains), grains (pushes grains, removes no snow), static (the snow lies on it from the start) or ignore"),
    key(OBJECT_SCOPES, OBJECT, "ease", Flag, or("false"))
        .means("true: smooth motion through the keys, from rest to rest; false: linear between them"),
    key(OBJECT_SCOPES, OBJECT, "keys", Poses(FAR), or("[]").such_as("[\n    { frame = 1, at = [0.0, 0.1, -2.5] },\n    { frame = 120, at = [0.0, 0.1, 2.5], turn_deg = [0.0, 0.0, 0.0] },\n]").shown())
        .means("rigid motion on top of the file's own: m, degrees about x, then y, then z"),
];

/// The key of `[output]` that all systems have.
pub const OUTPUT: &[Key] =
    &[key(&[], "output", "usd", Flag, or("true"))
        .means("shot.usda: the whole shot for programs that read USD")];

/// The tables of keys, in the order of the keys.
pub fn tables(keys: &[Key]) -> Vec<&'static str> {
    let mut out: Vec<&str> = keys.iter().map(|key| key.table).collect();
    out.dedup();
    out
}
