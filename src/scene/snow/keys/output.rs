//! The keys of `[output]` in scenes with snow.

use crate::scene::schema::declaration::Kind::{Choice, Choices, Flag, Number, Whole};
use crate::scene::schema::declaration::{Key, Scope, Scopes, key, optional, or};

const BASE: Scopes = &[("base", Scope::Output)];
const GRAINS: Scopes = &[("grains", Scope::Output)];
const MIST: Scopes = &[("mist", Scope::Output)];
const VOLUMES: Scopes = &[("volumes", Scope::Output)];
const OBJECTS: Scopes = &[("objects", Scope::Output)];

/// The keys of output.
pub const OUTPUT_KEYS: &[Key] = &[
    key(BASE, "output", "base", Choices(&["vdb"]), or("[\"vdb\"]"))
        .means("base/base.%04d.vdb: surface, compression, touched; [] = none"),
    key(BASE, "output", "base_mode", Choice(&["full", "delta"]), or("\"full\""))
        .means("full, or delta: first frame whole, then only changes (`frazil vdb rebuild`)"),
    key(BASE, "output", "half", Flag, or("false")).means("16-bit values of the base and of what was removed, for rendering only"),
    key(BASE, "output", "removed", Choices(&["vdb"]), or("[\"vdb\"]"))
        .means("removed/removed.%04d.vdb: the snow that each frame removed"),
    key(GRAINS, "output", "grains", Choices(&["usd", "vdb", "ply"]), optional("[\"usd\"]"))
        .means("\"usd\", \"vdb\", \"ply\": grains/, points with v, id, active, trapped, pscale, source_frame, rest; default: \"usd\", and \"vdb\" with grains_mode = \"delta\""),
    key(GRAINS, "output", "grains_mode", Choice(&["full", "delta"]), or("\"full\""))
        .means("full, or delta: .vdb files of the first and every 24th frame whole, then only changes (`frazil vdb rebuild`)"),
    key(MIST, "output", "mist", Choices(&["vdb"]), or("[\"vdb\"]"))
        .means("mist/mist.%04d.vdb: density, and vel (m/s) at the cells' centres; [] = none"),
    key(MIST, "output", "mist_half", Flag, or("true")).means("the mist in 16-bit values, as renderers use them; false = 32 bits"),
    key(MIST, "output", "names", Choice(&["houdini", "blender"]), or("\"houdini\""))
        .means("name of the mist's grid of velocities: `vel`, which Houdini looks for, or `velocity`, for Blender's motion blur"),
    key(VOLUMES, "output", "fog", Choices(&["base", "grains", "mist"]), or("[]"))
        .means("fog/fog.%04d.vdb: densities for rendering, a grid for each of these (see docs/snow.md)"),
    key(VOLUMES, "output", "snow", Flag, or("false"))
        .means("snow/snow.%04d.vdb: one level set of the base and the resting grains, on voxels fine enough for the grains (large)"),
    key(VOLUMES, "output", "mesh", Choices(&["usd", "ply"]), optional("[\"usd\"]"))
        .means("\"usd\", \"ply\": mesh/, the triangulated surface of the base; default: \"usd\" where the base's files are exact"),
    key(VOLUMES, "output", "mesh_adaptivity", Number(0.0, 1.0, ""), or("0.05"))
        .means("how far triangles are merged where the mesh is flat; 0 = not at all (8 times the size)"),
    key(OBJECTS, "output", "objects", Choices(&["usd", "ply"]), or("[\"usd\"]"))
        .means("\"usd\", \"ply\": objects/, the moving objects, with velocities"),
    key(&[], "output", "keep_states", Whole(0, 1_000_000), or("0"))
        .means("keeps the exact states of grains and mist every N frames, so that `--from` goes back at most N; 0 = only those of the last two"),
];
