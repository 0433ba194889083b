//! The keys of `[surface]`, and those of `[output]` in such scenes.

use crate::io::mesh::EXTENSIONS;
use crate::scene::schema::declaration::Kind::{Choice, Choices, File, Flag, Number, Whole};
use crate::scene::schema::declaration::{Key, Scope, Scopes, key, optional, or, required};
use crate::scene::schema::{NO_ORIGIN, ORIGIN, ORIGIN_MEANS};

/// Extensions of particle files, of which "gz" is that of .bgeo.gz.
const PARTICLES: &[&str] = &["bgeo", "bhclassic", "gz", "ply", "usdc", "usd", "vdb", "vtk", "vtu", "xyz"];

const FIRST: Scopes = &[("surface", Scope::First)];
const STEP: Scopes = &[("surface", Scope::Step)];
const OUTPUT: Scopes = &[("surface", Scope::Output)];

/// The keys of a mesh that follows a liquid.
pub const KEYS: &[Key] = &[
    key(FIRST, "surface", "particles", File(PARTICLES), required("\"spot.%04d.bgeo\"").shown())
        .means("of the liquid: a sequence \"spot.%04d.bgeo\""),
    key(FIRST, "surface", "mesh", File(&EXTENSIONS), optional("\"spot.ply\"").shown())
        .means("the mesh at the first frame, in the particles' space; left out: the particles' own surface at that frame"),
    key(STEP, "surface", "resculpt", File(&EXTENSIONS), optional("\"sculpts/spot.%04d.ply\""))
        .means("edited meshes, a sequence: each file replaces the mesh at its frame, which must be after the first"),
    key(FIRST, "surface", "scale", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("from the files' unit to metres: 0.01 for centimetres"),
    key(FIRST, "surface", "up", Choice(&["y", "z"]), or("\"y\"")).means("the files' upward axis: y or z"),
    key(FIRST, "surface", "origin", ORIGIN, or(NO_ORIGIN)).means(ORIGIN_MEANS),
    key(FIRST, "surface", "offset", Number(-1.0e7, 1.0e7, "frames"), or("0.0"))
        .means("frames by which the sequence starts later"),
    key(FIRST, "surface", "speed", Number(0.01, 100.0, ""), or("1.0"))
        .means("frames of the sequence that pass in one frame of the shot"),
    key(FIRST, "surface", "spacing", Number(1.0e-6, 1.0e6, "m"), optional("0.0086"))
        .means("initial distance between particles (m), r; default: estimated at the first frame, and logged"),
    key(FIRST, "surface", "cell", Number(0.125, 2.0, "r"), or("0.5"))
        .means("edge of a cell of the particles' surface (r)"),
    key(STEP, "surface", "change", Number(0.001, 100.0, "r"), or("0.5"))
        .means("vertices that would be moved farther than this (r) to keep their detail are flagged: the liquid merged or split there"),
    key(FIRST, "surface", "rebuild", Flag, or("true"))
        .means("true: the mesh is cut and rebuilt where the liquid merges or splits, and closed first; false: it is only flagged there"),
    key(STEP, "surface", "match", Choice(&["flagged", "every"]), or("\"flagged\""))
        .means("where a mesh that is rebuilt takes the liquid's topology; flagged: only around flagged vertices, and at drops; every: everywhere in each frame, also at bubbles, which takes longer"),
    key(STEP, "surface", "min_drop", Whole(0, 1_000_000), or("8"))
        .means("minimum number of particles of a part (inside it, or up to half a spacing outside): with `rebuild`, parts with fewer are removed unless the mesh is a single part, and drops with fewer get no mesh; 0 and 1: only parts without any are removed"),
    key(STEP, "surface", "ahead", Whole(0, 100), or("4"))
        .means("number of frames before a merge or split over which a mesh that is rebuilt eases towards it; 0: no easing, the new shape appears in one frame"),
    key(STEP, "surface", "weighting", Choice(&["affine", "mean"]), or("\"affine\""))
        .means("how particles carry vertices: by affine maps, or by their mean as in the thesis, which lags behind"),
    key(STEP, "surface", "half_life", Number(1.0e-3, 1.0e6, "s"), optional("2.0"))
        .means("time in which half of the detail fades (s), except where the mesh's array `detail` is 1; left out: no detail fades with time"),
    key(STEP, "surface", "fade", Number(0.0, 1000.0, ""), or("0.0"))
        .means("how much detail fades where the mesh is stretched or pressed: to exp(-fade) while lengths change by a factor of e"),
    key(OUTPUT, "output", "surface", Choices(&["ply", "usd", "obj"]), or("[\"usd\"]"))
        .means("\"usd\" (in shot.usda), \"ply\", \"obj\": surface/, the mesh at each frame"),
    key(OUTPUT, "output", "attributes", Choices(&["v", "delta", "flagged", "rebuilt"]), or("[\"v\", \"delta\", \"flagged\", \"rebuilt\"]"))
        .means("of its vertices: velocity over the coming frame (m/s), distance kept from the particles' surface (m), 1 where flagged; of its faces: 1 where new, 2 where its texture is torn"),
];
