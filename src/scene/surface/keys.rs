//! The keys of `[surface]`, and those of `[output]` in such scenes.

use crate::io::mesh::EXTENSIONS;
use crate::scene::schema::key::{Key, Kind, Scope};
use crate::scene::schema::{NO_ORIGIN, ORIGIN, ORIGIN_MEANS};

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("surface", Scope::First)];
const STEP: Scopes = &[("surface", Scope::Step)];
const OUTPUT: Scopes = &[("surface", Scope::Output)];

/// Last extensions of particle files: "gz" is that of .bgeo.gz.
const PARTICLES: &[&str] = &["bgeo", "bhclassic", "gz", "ply", "vdb", "vtk", "vtu", "xyz"];

/// All of them.
pub const KEYS: &[Key] = &[
    Key::new("surface", "particles", Kind::File(PARTICLES), "of the liquid: a sequence \"spot.%04d.bgeo\"")
        .begins_with("\"spot.%04d.bgeo\"")
        .concerns(FIRST),
    Key::new(
        "surface",
        "mesh",
        Kind::File(&EXTENSIONS),
        "as it is at the first frame, in the particles' space; left out: the particles' own surface there",
    )
    .or_nothing()
    .begins_with("\"spot.ply\"")
    .concerns(FIRST),
    Key::new(
        "surface",
        "resculpt",
        Kind::File(&EXTENSIONS),
        "edited meshes, a sequence: at each frame after the first that has a file, the mesh is replaced by it",
    )
    .or_nothing()
    .such_as("\"sculpts/spot.%04d.ply\"")
    .concerns(STEP),
    Key::new("surface", "scale", Kind::Number(1.0e-9, 1.0e9, ""), "from the files' unit to metres: 0.01 for centimetres")
        .or("1.0")
        .concerns(FIRST),
    Key::new("surface", "up", Kind::Choice(&["y", "z"]), "the files' upward axis: y or z").or("\"y\"").concerns(FIRST),
    Key::new("surface", "origin", ORIGIN, ORIGIN_MEANS).or(NO_ORIGIN).concerns(FIRST),
    Key::new("surface", "offset", Kind::Number(-1.0e7, 1.0e7, "frames"), "frames that the sequence starts later")
        .or("0.0")
        .concerns(FIRST),
    Key::new("surface", "speed", Kind::Number(0.01, 100.0, ""), "frames of the sequence that pass in one of the shot")
        .or("1.0")
        .concerns(FIRST),
    Key::new(
        "surface",
        "spacing",
        Kind::Number(1.0e-6, 1.0e6, "m"),
        "initial distance between particles (m), r; default: estimated at the first frame, and logged",
    )
    .or_nothing()
    .such_as("0.0086")
    .concerns(FIRST),
    Key::new("surface", "cell", Kind::Number(0.125, 2.0, "r"), "edge of a cell of the particles' surface (r)")
        .or("0.5")
        .concerns(FIRST),
    Key::new(
        "surface",
        "change",
        Kind::Number(0.001, 100.0, "r"),
        "vertices that would be moved farther to keep their detail are flagged: the liquid merged or split there (r)",
    )
    .or("0.5")
    .concerns(STEP),
    Key::new(
        "surface",
        "rebuild",
        Kind::Flag,
        "true: the mesh is cut and rebuilt where the liquid merges or splits, and closed first; false: it is only flagged there",
    )
    .or("true")
    .concerns(FIRST),
    Key::new(
        "surface",
        "match",
        Kind::Choice(&["flagged", "every"]),
        "where a mesh that is rebuilt takes the liquid's topology: flagged, where vertices find a change, and at drops; every: all over it in each frame, also at bubbles, which takes longer",
    )
    .or("\"flagged\"")
    .concerns(STEP),
    Key::new(
        "surface",
        "min_drop",
        Kind::Whole(0, 1_000_000),
        "of a mesh that is rebuilt, parts of fewer particles (inside, or half a spacing outside) are taken away, but not the last part, and drops of fewer get no mesh; 0 and 1: only parts without any go",
    )
    .or("8")
    .concerns(STEP),
    Key::new(
        "surface",
        "ahead",
        Kind::Whole(0, 100),
        "frames before a merge or split from which on a mesh that is rebuilt eases towards it; 0: it is there from one frame to the next",
    )
    .or("4")
    .concerns(STEP),
    Key::new(
        "surface",
        "weighting",
        Kind::Choice(&["affine", "mean"]),
        "how particles carry vertices: by affine maps, or by their mean as in the thesis, which lags behind",
    )
    .or("\"affine\"")
    .concerns(STEP),
    Key::new(
        "surface",
        "half_life",
        Kind::Number(1.0e-3, 1.0e6, "s"),
        "time in which half of the detail fades (s), but where the mesh's array `detail` is 1; left out: it stays",
    )
    .or_nothing()
    .such_as("2.0")
    .concerns(STEP),
    Key::new(
        "surface",
        "fade",
        Kind::Number(0.0, 1000.0, ""),
        "how much detail fades where the mesh is stretched or pressed: to exp(-fade) while lengths change by a factor of e",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        "output",
        "surface",
        Kind::Choices(&["ply", "usd", "obj"]),
        "\"ply\", \"usd\", \"obj\": surface/, the mesh at each frame",
    )
    .or("[\"ply\"]")
    .concerns(OUTPUT),
    Key::new(
        "output",
        "attributes",
        Kind::Choices(&["v", "delta", "flagged", "rebuilt"]),
        "of its vertices: velocity over the coming frame (m/s), distance kept from the particles' surface (m), 1 where flagged; of its faces: 1 where made, 2 where its texture is torn",
    )
    .or("[\"v\", \"delta\", \"flagged\", \"rebuilt\"]")
    .concerns(OUTPUT),
];
