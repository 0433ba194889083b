//! The keys of `[shallow]`, of its tables that may occur many times, and of `[output]` in such scenes.

use crate::io::mesh::EXTENSIONS;
use crate::scene::schema::key::{Key, Kind, OBJECT, Scope};
use crate::scene::schema::{FAR, NO_ORIGIN, ORIGIN, ORIGIN_MEANS};

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("liquid", Scope::First)];
const STEP: Scopes = &[("liquid", Scope::Step)];
const OUTPUT: Scopes = &[("liquid", Scope::Output)];

/// A mesh, a level set or an image of heights.
const TERRAINS: &[&str] = &[EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2], "vdb", "png"];
/// Maximum of a volume, and of a rate (ml, ml/s): a cubic kilometre.
const MOST_ML: f64 = 1.0e15;
/// Frame numbers allowed in a scene.
const FRAMES: Kind = Kind::Whole(-1_000_000_000, 1_000_000_000);
/// Lengths of obstacles, and radii of circles (m).
const LENGTH: Kind = Kind::Number(0.0, FAR, "m");

/// Concentrations by the names of scalars.
const NAMED: Kind = Kind::Named(1.0e9);
const CARRIES: &str =
    "concentrations of scalars in it, by name; for scalars that are not named: their `start`";

/// For sources, drains and absorbers.
const FOLLOWS: &str =
    "true: it moves with the point of the terrain, a sequence, that is nearest to `at` at the first frame";

/// The keys of `[shallow]`.
pub const KEYS: &[Key] = &[
    Key::new(
        "shallow",
        "terrain",
        Kind::File(TERRAINS),
        "what the liquid flows over: an open or closed mesh, a sequence \"organ.%04d.ply\" of a moving mesh, a level set, or a greyscale image of heights",
    )
    .begins_with("\"terrain.obj\"")
    .concerns(FIRST),
    Key::new("shallow", "terrain_size", Kind::Numbers(2, FAR, "m"), "size of an image, which is centred at the origin: lengths along x and z (m)")
        .or_nothing()
        .such_as("[0.2, 0.2]")
        .concerns(FIRST),
    Key::new("shallow", "terrain_height", Kind::Numbers(2, FAR, "m"), "heights of an image's black and white (m)")
        .or_nothing()
        .such_as("[0.0, 0.02]")
        .concerns(FIRST),
    Key::new("shallow", "scale", Kind::Number(1.0e-9, 1.0e9, ""), "from a mesh's unit to metres: 0.001 for millimetres")
        .or("1.0")
        .concerns(FIRST),
    Key::new("shallow", "up", Kind::Choice(&["y", "z"]), "a mesh's upward axis: y or z").or("\"y\"").concerns(FIRST),
    Key::new("shallow", "origin", ORIGIN, ORIGIN_MEANS).or(NO_ORIGIN).concerns(FIRST),
    Key::new("shallow", "offset", Kind::Whole(-10_000_000, 10_000_000), "frames by which a sequence starts later").or("0").concerns(STEP),
    Key::new("shallow", "cell", Kind::Number(1.0e-6, 1000.0, "m"), "edge of a cell on the ground (m)")
        .begins_with("0.001")
        .concerns(FIRST),
    Key::new(
        "shallow",
        "area",
        Kind::Numbers(4, FAR, "m"),
        "extent of the cells: x0, z0, x1, z1 (m), rounded to whole cells; default: that of the terrain at the first frame",
    )
    .or_nothing()
    .such_as("[-0.1, -0.1, 0.1, 0.1]")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "bottom",
        Kind::Number(-FAR, FAR, "m"),
        "minimum height (m) of ground and liquid; default: the terrain's lowest point, for a sequence lower by the same margin as top",
    )
    .or_nothing()
    .such_as("-0.01")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "top",
        Kind::Number(-FAR, FAR, "m"),
        "maximum height (m); default: above the terrain's highest point by a margin of a quarter of its height, at least 0.1 m",
    )
    .or_nothing()
    .such_as("0.1")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "liquid",
        Kind::Choice(&["water", "blood", "paint", "honey"]),
        "water, blood, paint or honey: its viscosity, and its look",
    )
    .or("\"blood\"")
    .concerns(STEP),
    Key::new("shallow", "viscosity", Kind::Number(0.0, 1.0e6, "m2/s"), "kinematic viscosity (m2/s)")
        .or("4e-6")
        .with_presets(&[("water", "1e-6"), ("paint", "4e-5"), ("honey", "7e-3")])
        .concerns(STEP),
    Key::new(
        "shallow",
        "thinning",
        Kind::Flag,
        "for blood: true: its viscosity falls with shear (Carreau's law), whatever `viscosity` is",
    )
    .or("false")
    .concerns(STEP),
    Key::new("shallow", "gravity", Kind::Numbers(3, 1000.0, "m/s2"), "x, y, z (m/s2); it may tilt by up to 45 degrees")
        .or("[0.0, -9.81, 0.0]")
        .concerns(STEP),
    Key::new(
        "shallow",
        "border",
        Kind::Choice(&["open", "closed", "absorbing"]),
        "of the area: open: liquid flows off; closed: a wall; absorbing: waves leave into liquid at rest",
    )
    .or("\"open\"")
    .concerns(FIRST),
    Key::new("shallow", "fill", Kind::Number(-FAR, FAR, "m"), "height up to which liquid stands at the first frame (m)")
        .or_nothing()
        .such_as("0.005")
        .concerns(FIRST),
    Key::new("shallow", "kept", Kind::Number(0.0, 1.0, ""), "share of its momentum that liquid keeps over a second, apart from viscous losses")
        .or("0.5")
        .concerns(STEP),
    Key::new(
        "shallow",
        "pace",
        Kind::Choice(&["exact", "realtime"]),
        "exact: as many steps as waves need; realtime: steps of at most `step`, with slower waves in deep liquid and slower fast films on slopes",
    )
    .or("\"exact\"")
    .concerns(STEP),
    Key::new("shallow", "step", Kind::Number(1.0e-6, 1.0, "s"), "longest step of realtime (s)").or("0.003").concerns(STEP),
    Key::new(
        "shallow",
        "friction",
        Kind::Choice(&["ground", "walls"]),
        "where viscous drag acts: ground: accurate for liquid that is far wider than deep; walls: also at walls and ceilings, for channels and ducts, which takes longer",
    )
    .or("\"ground\"")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "rest",
        Kind::Number(0.0, 0.01, "m/s"),
        "velocity (m/s) below which liquid with a level surface comes to rest, and then takes no time to compute: 1e-6 works well; 0: never",
    )
    .or("0")
    .concerns(STEP),
    Key::new(
        "shallow",
        "falls",
        Kind::Flag,
        "true: liquid falls freely over edges, through holes and into the void, in drops and strands; false: it arrives below at once",
    )
    .or("false")
    .concerns(FIRST),
    Key::new("shallow", "falls_height", LENGTH, "minimum height of a free fall (m); at least the edge of a cell")
        .or("0.01")
        .concerns(FIRST),
    Key::new("shallow", "falls_drop_ml", Kind::Number(0.0, MOST_ML, "ml"), "volume of a drop (ml): liquid drips where a drop takes longer than 8 intervals to form").or("6.5e-5").concerns(FIRST),
    Key::new("shallow", "falls_interval", Kind::Number(1.0e-4, 1.0, "s"), "time between the drops of a strand (s)")
        .or("0.008333333333333333")
        .concerns(FIRST),
    Key::new(
        "shallow",
        "falls_most",
        Kind::Whole(1, 1 << 20),
        "maximum number of drops in the air: beyond that, liquid arrives below at once",
    )
    .or("8192")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "lifts",
        Kind::Flag,
        "for a mesh: true: its bumps do not show through films, and the rim of the liquid does not hover (minimum heights); false: films are 0.05 cells above the ground",
    )
    .or("true")
    .concerns(OUTPUT),
    Key::new(
        "shallow",
        "skirts",
        Kind::Flag,
        "true: where the ground ends, as at the edges of shelves and holes, the surface extends to that edge and comes down to it; false: it ends in the middle of the last cell, open below",
    )
    .or("true")
    .concerns(OUTPUT),
    Key::new(
        "shallow",
        "stains",
        Kind::Flag,
        "for a mesh: true: the liquid leaves stains on it, and terrain/terrain.%04d.ply is the terrain (m, Y up) with an array `stain`, 0 to 1, on its vertices",
    )
    .or("false")
    .concerns(FIRST),
    Key::new("shallow", "stain_half_life", Kind::Number(1.0e-3, 1.0e12, "s"), "time in which half of a stain on dry ground fades (s)")
        .or("60.0")
        .concerns(STEP),
    Key::new("shallow", "opaque_depth", Kind::Number(1.0e-6, FAR, "m"), "depth from which the liquid is opaque (m)")
        .or("0.001")
        .with_presets(&[("water", "0.05"), ("paint", "0.0005"), ("honey", "0.02")])
        .concerns(OUTPUT),
];

/// The keys of tables that may occur many times, and of the output.
pub const MANY_KEYS: &[Key] = &[
    Key::new("scalar", "name", Kind::Text, "name of a scalar that the liquid carries, up to four, and of its array on the surface's vertices; letters, digits and _")
        .such_as("\"dye\"")
        .concerns(FIRST),
    Key::new(
        "scalar",
        "law",
        Kind::Choice(&["dye", "decays", "ages"]),
        "dye: it is only carried; decays: half of it is gone after each half_life; ages: it is the time (s) since the liquid came in",
    )
    .or("\"dye\"")
    .concerns(FIRST),
    Key::new("scalar", "half_life", Kind::Number(1.0e-6, 1.0e12, "s"), "half-life of one that decays (s)")
        .or_nothing()
        .such_as("60.0")
        .concerns(FIRST),
    Key::new("scalar", "range", Kind::Number(1.0e-9, 1.0e9, ""), "concentrations lie within -range to range, with a precision of range / 2^20; for ages: the maximum age (s)")
        .or("1.0")
        .concerns(FIRST),
    Key::new("scalar", "start", Kind::Number(-1.0e9, 1.0e9, ""), "concentration in liquid from `fill`, and in pours and sources whose `carries` does not name it")
        .or("0.0")
        .concerns(FIRST),
    Key::new(
        "scalar",
        "stains",
        Kind::Flag,
        "for one scalar, with shallow.stains: true: its concentration / range stains, and clear liquid washes stains off; without such a scalar any liquid stains",
    )
    .or("false")
    .concerns(STEP),
    Key::new(
        "scalar",
        "thickens_times",
        Kind::Number(1.0e-6, 1.0e9, ""),
        "for one scalar: factor of the liquid's viscosity from the concentration `thickens_to` on; 1 up to `thickens_from`, and linear between them",
    )
    .or_nothing()
    .such_as("5.0")
    .concerns(STEP),
    Key::new("scalar", "thickens_from", Kind::Number(-1.0e9, 1.0e9, ""), "concentration up to which the viscosity is unchanged, within the range")
        .or("0.0")
        .concerns(STEP),
    Key::new("scalar", "thickens_to", Kind::Number(-1.0e9, 1.0e9, ""), "concentration from which the viscosity is multiplied by `thickens_times`, within the range; it may be below `thickens_from`")
        .or_nothing()
        .such_as("1.0")
        .concerns(STEP),
    Key::new("pour", "at", Kind::Numbers(3, FAR, "m"), "centre (m): liquid is poured onto the ground nearest to it")
        .such_as("[0.0, 0.05, 0.0]")
        .concerns(STEP),
    Key::new("pour", "radius", LENGTH, "of the circle that it is poured into, seen from above (m)").such_as("0.005").concerns(STEP),
    Key::new("pour", "volume_ml", Kind::Number(0.0, MOST_ML, "ml"), "volume of the pour (ml)").such_as("1.0").concerns(STEP),
    Key::new("pour", "carries", NAMED, CARRIES).or("{}").such_as("{ dye = 1.0 }").concerns(STEP),
    Key::new("pour", "frame", FRAMES, "frame of the pour; default: the first").or_nothing().such_as("1").concerns(STEP),
    Key::new("source", "at", Kind::Numbers(3, FAR, "m"), "centre (m): liquid comes onto the ground nearest to it")
        .begins_with("[0.0, 0.05, 0.0]")
        .concerns(STEP),
    Key::new("source", "radius", LENGTH, "of the source's circle, seen from above (m)")
        .begins_with("0.002")
        .concerns(STEP),
    Key::new("source", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "volume that comes in per second (ml)")
        .begins_with("0.5")
        .concerns(STEP),
    Key::new("source", "carries", NAMED, CARRIES).or("{}").such_as("{ dye = 1.0 }").concerns(STEP),
    Key::new("source", "from", FRAMES, "first frame; default: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("source", "until", FRAMES, "last frame; default: to the end").or_nothing().such_as("120").concerns(STEP),
    Key::new("source", "follows", Kind::Flag, FOLLOWS).or("false").concerns(STEP),
    Key::new("source", "frequency", Kind::Number(0.0, 1.0e6, "1/s"), "pulse frequency of its rate (1/s)")
        .or("0.0")
        .such_as("1.2")
        .concerns(STEP),
    Key::new("source", "swing", Kind::Number(0.0, 1.0, ""), "amplitude of the pulse, as a share of its rate")
        .or("0.0")
        .such_as("0.6")
        .concerns(STEP),
    Key::new("drain", "at", Kind::Numbers(3, FAR, "m"), "centre (m): liquid leaves the ground nearest to it")
        .such_as("[0.05, 0.0, 0.0]")
        .concerns(STEP),
    Key::new("drain", "radius", LENGTH, "of the drain's circle, seen from above (m)").such_as("0.004").concerns(STEP),
    Key::new("drain", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "volume that leaves per second (ml), as long as there is liquid")
        .such_as("0.5")
        .concerns(STEP),
    Key::new("drain", "orifice_mm2", Kind::Number(0.0, 1.0e12, "mm2"), "area of a hole through which liquid drains by its own weight, at most `rate_ml`; default: it is pumped")
        .or_nothing()
        .such_as("20.0")
        .concerns(STEP),
    Key::new("drain", "discharge", Kind::Number(0.0, 1.0, ""), "share of the hole that the jet fills: 0.6 to 0.65 for a sharp edge")
        .or("0.62")
        .concerns(STEP),
    Key::new("drain", "frequency", Kind::Number(0.0, 1.0e6, "1/s"), "pulse frequency of its rate (1/s)")
        .or("0.0")
        .concerns(STEP),
    Key::new("drain", "swing", Kind::Number(0.0, 1.0, ""), "amplitude of the pulse, as a share of its rate")
        .or("0.0")
        .concerns(STEP),
    Key::new("drain", "from", FRAMES, "first frame; default: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("drain", "until", FRAMES, "last frame; default: to the end").or_nothing().such_as("120").concerns(STEP),
    Key::new("drain", "follows", Kind::Flag, FOLLOWS).or("false").concerns(STEP),
    Key::new("absorber", "at", Kind::Numbers(3, FAR, "m"), "centre (m): liquid goes into gauze on the ground nearest to it")
        .such_as("[0.05, 0.0, 0.0]")
        .concerns(STEP),
    Key::new("absorber", "radius", LENGTH, "of the gauze, seen from above (m)").such_as("0.01").concerns(STEP),
    Key::new("absorber", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "volume that it absorbs per second (ml)")
        .such_as("0.5")
        .concerns(STEP),
    Key::new("absorber", "capacity_ml", Kind::Number(0.0, MOST_ML, "ml"), "volume that it can hold (ml)").such_as("2.0").concerns(STEP),
    Key::new("absorber", "from", FRAMES, "first frame; default: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("absorber", "until", FRAMES, "last frame; default: to the end").or_nothing().such_as("120").concerns(STEP),
    Key::new("absorber", "follows", Kind::Flag, FOLLOWS).or("false").concerns(STEP),
    Key::new(
        OBJECT,
        "shape",
        Kind::Choice(&["sphere", "capsule", "box"]),
        "sphere, capsule or box: an obstacle that may move; or file",
    )
    .or_nothing()
    .such_as("\"capsule\"")
    .concerns(STEP),
    Key::new(OBJECT, "radius", LENGTH, "of a sphere or capsule (m)").or_nothing().such_as("0.004").concerns(STEP),
    Key::new(OBJECT, "length", LENGTH, "of a capsule, along y, between the centres of its ends (m)")
        .or_nothing()
        .such_as("0.06")
        .concerns(STEP),
    Key::new(OBJECT, "size", Kind::Numbers(3, FAR, "m"), "of a box: along x, y and z (m)").or_nothing().such_as("[0.02, 0.02, 0.02]").concerns(STEP),
    Key::new(OBJECT, "file", Kind::File(&EXTENSIONS), "a closed mesh that stands on the terrain and does not move")
        .or_nothing()
        .such_as("\"stone.obj\"")
        .concerns(FIRST),
    Key::new(OBJECT, "scale", Kind::Number(1.0e-9, 1.0e9, ""), "from the file's unit to metres: 0.01 for centimetres")
        .or("1.0")
        .concerns(FIRST),
    Key::new(OBJECT, "up", Kind::Choice(&["y", "z"]), "the file's upward axis: y or z").or("\"y\"").concerns(FIRST),
    Key::new(OBJECT, "origin", ORIGIN, ORIGIN_MEANS).or(NO_ORIGIN).concerns(FIRST),
    Key::new(OBJECT, "ease", Kind::Flag, "true: smooth motion through the keys, from rest to rest; false: linear between them").or("false").concerns(STEP),
    Key::new(
        OBJECT,
        "keys",
        Kind::Poses(FAR),
        "poses at frames: m, degrees about x, then y, then z; at most one for a file",
    )
    .or("[]")
    .such_as("[{ frame = 1, at = [0.05, 0.04, 0.0] }, { frame = 60, at = [-0.05, 0.04, 0.0], turn_deg = [0.0, 0.0, 90.0] }]")
    .concerns(STEP),
    Key::new("output", "liquid", Kind::Choices(&["ply", "usd"]), "\"ply\", \"usd\": liquid/, the surface at each frame")
        .or("[\"ply\"]")
        .concerns(OUTPUT),
    Key::new(
        "output",
        "attributes",
        Kind::Choices(&["v", "depth", "layer", "alpha", "falling", "scalars"]),
        "of its vertices: velocity of the surface (m/s), depth (m), layer from the bottom, opacity: depth / opaque_depth up to 1; with falls, whether it is in the air; each scalar, by its name",
    )
    .or("[\"v\", \"depth\", \"layer\", \"alpha\", \"falling\", \"scalars\"]")
    .concerns(OUTPUT),
    Key::new(
        "output",
        "volume",
        Kind::Choices(&["vdb"]),
        "\"vdb\": volume/volume.%04d.vdb: density, the liquid share of each voxel, which has the size of a cell",
    )
    .or("[]")
    .such_as("[\"vdb\"]")
    .concerns(OUTPUT),
];
