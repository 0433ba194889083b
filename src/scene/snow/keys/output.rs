//! The keys of `[output]` in scenes with snow.

use crate::scene::schema::key::{Key, Kind, Scope};

type Scopes = &'static [(&'static str, Scope)];
const BASE_OUTPUT: Scopes = &[("base", Scope::Output)];
const VOLUMES_OUTPUT: Scopes = &[("volumes", Scope::Output)];

/// All of them.
pub const OUTPUT_KEYS: &[Key] = &[
    Key::new(
        "output",
        "base",
        Kind::Choices(&["vdb"]),
        "base/base.%04d.vdb: surface, compression, touched; [] = none",
    )
    .or("[\"vdb\"]")
    .concerns(BASE_OUTPUT),
    Key::new(
        "output",
        "base_mode",
        Kind::Choice(&["full", "delta"]),
        "full, or delta: first frame whole, then only changes (`frazil vdb rebuild`)",
    )
    .or("\"full\"")
    .concerns(BASE_OUTPUT),
    Key::new("output", "half", Kind::Flag, "16-bit values, for rendering only")
        .or("false")
        .concerns(BASE_OUTPUT),
    Key::new(
        "output",
        "removed",
        Kind::Choices(&["vdb"]),
        "removed/removed.%04d.vdb: the snow that each frame removed",
    )
    .or("[\"vdb\"]")
    .concerns(BASE_OUTPUT),
    Key::new(
        "output",
        "grains",
        Kind::Choices(&["vdb", "ply", "usd"]),
        "grains/grains.%04d.vdb: points with v, id, active, trapped, pscale, source_frame, rest; also \"ply\", \"usd\" (large)",
    )
    .or("[\"vdb\"]")
    .concerns(&[("grains", Scope::Output)]),
    Key::new(
        "output",
        "grains_mode",
        Kind::Choice(&["full", "delta"]),
        "full, or delta: .vdb files of the first and every 24th frame whole, then only changes (`frazil vdb rebuild`)",
    )
    .or("\"full\"")
    .concerns(&[("grains", Scope::Output)]),
    Key::new(
        "output",
        "mist",
        Kind::Choices(&["vdb"]),
        "mist/mist.%04d.vdb: density, and vel (m/s) at the cells' centres; [] = none",
    )
    .or("[\"vdb\"]")
    .concerns(&[("mist", Scope::Output)]),
    Key::new(
        "output",
        "fog",
        Kind::Choices(&["base", "grains", "mist"]),
        "fog/fog.%04d.vdb: densities for rendering, a grid for each of these (see docs/snow.md)",
    )
    .or("[]")
    .concerns(VOLUMES_OUTPUT),
    Key::new(
        "output",
        "snow",
        Kind::Flag,
        "snow/snow.%04d.vdb: one level set of the base and the resting grains, on voxels fine enough for the grains (large)",
    )
    .or("false")
    .concerns(VOLUMES_OUTPUT),
    Key::new(
        "output",
        "mesh",
        Kind::Choices(&["ply", "usd"]),
        "\"ply\", \"usd\": mesh/, the triangulated surface of the base (large)",
    )
    .or("[]")
    .concerns(VOLUMES_OUTPUT),
    Key::new(
        "output",
        "objects",
        Kind::Choices(&["usd", "ply"]),
        "\"usd\", \"ply\": objects/, the moving objects, with velocities",
    )
    .or("[]")
    .concerns(&[("objects", Scope::Output)]),
];
