//! The keys of `[shallow]`, of what a scene with it may have many of, and those of `[output]` in such scenes.

use crate::io::mesh::EXTENSIONS;
use crate::scene::schema::key::{Key, Kind, OBJECT, Scope};
use crate::scene::schema::{FAR, NO_ORIGIN, ORIGIN, ORIGIN_MEANS};

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("liquid", Scope::First)];
const STEP: Scopes = &[("liquid", Scope::Step)];
const OUTPUT: Scopes = &[("liquid", Scope::Output)];

/// A mesh, a level set or an image of heights.
const TERRAINS: &[&str] = &[EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2], "vdb", "png"];
/// Most of a volume, and of a rate (ml, ml/s): a cubic kilometre.
const MOST_ML: f64 = 1.0e15;
/// Frames that a scene may name.
const FRAMES: Kind = Kind::Whole(-1_000_000_000, 1_000_000_000);
/// Lengths of obstacles, and radii of circles (m).
const LENGTH: Kind = Kind::Number(0.0, FAR, "m");

/// Concentrations by the names of scalars.
const NAMED: Kind = Kind::Named(1.0e9);
const CARRIES: &str =
    "concentrations of scalars in it, by their names; of those that are not named: their `start`";

/// Of sources, drains and absorbers.
const FOLLOWS: &str =
    "true: it moves with the place of the terrain, a sequence, that is nearest to `at` at the first frame";

/// Those of `[shallow]`.
pub const KEYS: &[Key] = &[
    Key::new(
        "shallow",
        "terrain",
        Kind::File(TERRAINS),
        "what the liquid flows over: a mesh, open or closed, a sequence \"organ.%04d.ply\" of one that moves, a level set, or a grey image of heights",
    )
    .begins_with("\"terrain.obj\"")
    .concerns(FIRST),
    Key::new("shallow", "terrain_size", Kind::Numbers(2, FAR, "m"), "of an image, which lies around the origin: lengths along x and z (m)")
        .or_nothing()
        .such_as("[0.2, 0.2]")
        .concerns(FIRST),
    Key::new("shallow", "terrain_height", Kind::Numbers(2, FAR, "m"), "of an image: heights of black and of white (m)")
        .or_nothing()
        .such_as("[0.0, 0.02]")
        .concerns(FIRST),
    Key::new("shallow", "scale", Kind::Number(1.0e-9, 1.0e9, ""), "from a mesh's unit to metres: 0.001 for millimetres")
        .or("1.0")
        .concerns(FIRST),
    Key::new("shallow", "up", Kind::Choice(&["y", "z"]), "a mesh's upward axis: y or z").or("\"y\"").concerns(FIRST),
    Key::new("shallow", "origin", ORIGIN, ORIGIN_MEANS).or(NO_ORIGIN).concerns(FIRST),
    Key::new("shallow", "offset", Kind::Whole(-10_000_000, 10_000_000), "frames that a sequence starts later").or("0").concerns(STEP),
    Key::new("shallow", "cell", Kind::Number(1.0e-6, 1000.0, "m"), "edge of a cell on the ground (m)")
        .begins_with("0.001")
        .concerns(FIRST),
    Key::new(
        "shallow",
        "area",
        Kind::Numbers(4, FAR, "m"),
        "of the cells: x0, z0, x1, z1 (m), to whole cells; left out: as far as the terrain goes at the first frame",
    )
    .or_nothing()
    .such_as("[-0.1, -0.1, 0.1, 0.1]")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "bottom",
        Kind::Number(-FAR, FAR, "m"),
        "least height (m) of ground and liquid; left out: the terrain's lowest place, of a sequence deeper by as much as top is higher",
    )
    .or_nothing()
    .such_as("-0.01")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "top",
        Kind::Number(-FAR, FAR, "m"),
        "greatest height (m); left out: above the terrain's highest place by a quarter of its height, at least 0.1 m",
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
        "of blood: true: its viscosity falls with shear (Carreau's law), whatever viscosity says",
    )
    .or("false")
    .concerns(STEP),
    Key::new("shallow", "gravity", Kind::Numbers(3, 1000.0, "m/s2"), "x, y, z (m/s2); it may lean by up to 45 degrees")
        .or("[0.0, -9.81, 0.0]")
        .concerns(STEP),
    Key::new(
        "shallow",
        "border",
        Kind::Choice(&["open", "closed", "absorbing"]),
        "of the area: open: liquid flows off; closed: a wall; absorbing: liquid at rest, into which waves leave",
    )
    .or("\"open\"")
    .concerns(FIRST),
    Key::new("shallow", "fill", Kind::Number(-FAR, FAR, "m"), "height up to which liquid stands at the first frame (m)")
        .or_nothing()
        .such_as("0.005")
        .concerns(FIRST),
    Key::new("shallow", "kept", Kind::Number(0.0, 1.0, ""), "share of its momentum that liquid keeps in a second, besides what viscosity takes")
        .or("0.5")
        .concerns(STEP),
    Key::new(
        "shallow",
        "pace",
        Kind::Choice(&["exact", "realtime"]),
        "exact: as many steps as waves need; realtime: steps of at most `step`, in which waves of deep liquid, and fast films on slopes, are slower",
    )
    .or("\"exact\"")
    .concerns(STEP),
    Key::new("shallow", "step", Kind::Number(1.0e-6, 1.0, "s"), "longest step of realtime (s)").or("0.003").concerns(STEP),
    Key::new(
        "shallow",
        "friction",
        Kind::Choice(&["ground", "walls"]),
        "where viscosity holds the liquid back: ground: right where it is far wider than deep; walls: also at walls and ceilings, in channels and ducts, which takes longer",
    )
    .or("\"ground\"")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "rest",
        Kind::Number(0.0, 0.01, "m/s"),
        "velocity (m/s) below which liquid whose surface is level comes to rest, and then takes no time: 1e-6 does well; 0: never",
    )
    .or("0")
    .concerns(STEP),
    Key::new(
        "shallow",
        "falls",
        Kind::Flag,
        "true: liquid falls freely over edges, through holes and into the void, in drops and strands; else it is below at once",
    )
    .or("false")
    .concerns(FIRST),
    Key::new("shallow", "falls_height", LENGTH, "height from which on it falls freely (m); an edge of a cell at least")
        .or("0.01")
        .concerns(FIRST),
    Key::new("shallow", "falls_drop_ml", Kind::Number(0.0, MOST_ML, "ml"), "volume of a drop (ml): where it takes longer than 8 intervals liquid drips").or("6.5e-5").concerns(FIRST),
    Key::new("shallow", "falls_interval", Kind::Number(1.0e-4, 1.0, "s"), "time between the drops of a strand (s)")
        .or("0.008333333333333333")
        .concerns(FIRST),
    Key::new(
        "shallow",
        "falls_most",
        Kind::Whole(1, 1 << 20),
        "most drops in the air: where there would be more, liquid is below at once",
    )
    .or("8192")
    .concerns(FIRST),
    Key::new(
        "shallow",
        "lifts",
        Kind::Flag,
        "of a mesh: true: its bumps do not show through films, and the rim of the liquid does not hover (minimum heights); false: films are 0.05 cells above the ground",
    )
    .or("true")
    .concerns(OUTPUT),
    Key::new(
        "shallow",
        "skirts",
        Kind::Flag,
        "true: where the ground ends, as at the edges of shelves and holes, the surface goes on to there and comes down to it; false: it ends in the middle of the last cell, open below",
    )
    .or("true")
    .concerns(OUTPUT),
    Key::new(
        "shallow",
        "stains",
        Kind::Flag,
        "of a mesh: true: the liquid leaves stains on it, and terrain/terrain.%04d.ply is the terrain (m, Y up) with an array `stain`, 0 to 1, on its vertices",
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

/// Those of what there may be many of, and of the output.
pub const MANY_KEYS: &[Key] = &[
    Key::new("scalar", "name", Kind::Text, "of what the liquid carries, up to four: an array of the surface's vertices has it; letters, digits and _")
        .such_as("\"dye\"")
        .concerns(FIRST),
    Key::new(
        "scalar",
        "law",
        Kind::Choice(&["dye", "decays", "ages"]),
        "dye: it is only carried; decays: half of it goes in each half_life; ages: it is the time (s) since the liquid came in",
    )
    .or("\"dye\"")
    .concerns(FIRST),
    Key::new("scalar", "half_life", Kind::Number(1.0e-6, 1.0e12, "s"), "of one that decays (s)")
        .or_nothing()
        .such_as("60.0")
        .concerns(FIRST),
    Key::new("scalar", "range", Kind::Number(1.0e-9, 1.0e9, ""), "concentrations lie within -range to range, and are kept to a 2^20th of it; of ages the oldest (s)")
        .or("1.0")
        .concerns(FIRST),
    Key::new("scalar", "start", Kind::Number(-1.0e9, 1.0e9, ""), "concentration of what stands up to `fill`, and of pours and sources whose `carries` does not name it")
        .or("0.0")
        .concerns(FIRST),
    Key::new(
        "scalar",
        "stains",
        Kind::Flag,
        "of one of them, with shallow.stains: true: its concentration over its range stains, and clear liquid washes stains off; without one any liquid stains",
    )
    .or("false")
    .concerns(STEP),
    Key::new(
        "scalar",
        "thickens_times",
        Kind::Number(1.0e-6, 1.0e9, ""),
        "of one of them: from the concentration `thickens_to` on the liquid's viscosity is so many times its own, up to `thickens_from` its own, and linear between them",
    )
    .or_nothing()
    .such_as("5.0")
    .concerns(STEP),
    Key::new("scalar", "thickens_from", Kind::Number(-1.0e9, 1.0e9, ""), "concentration up to which viscosity is the liquid's own, within the range")
        .or("0.0")
        .concerns(STEP),
    Key::new("scalar", "thickens_to", Kind::Number(-1.0e9, 1.0e9, ""), "concentration from which on it is `thickens_times` that, within the range; it may be the lesser one")
        .or_nothing()
        .such_as("1.0")
        .concerns(STEP),
    Key::new("pour", "at", Kind::Numbers(3, FAR, "m"), "middle (m): liquid is poured onto the ground nearest to it")
        .such_as("[0.0, 0.05, 0.0]")
        .concerns(STEP),
    Key::new("pour", "radius", LENGTH, "of the circle, seen from above, in which it is poured (m)").such_as("0.005").concerns(STEP),
    Key::new("pour", "volume_ml", Kind::Number(0.0, MOST_ML, "ml"), "how much (ml)").such_as("1.0").concerns(STEP),
    Key::new("pour", "carries", NAMED, CARRIES).or("{}").such_as("{ dye = 1.0 }").concerns(STEP),
    Key::new("pour", "frame", FRAMES, "when; left out: at the first frame").or_nothing().such_as("1").concerns(STEP),
    Key::new("source", "at", Kind::Numbers(3, FAR, "m"), "middle (m): liquid comes onto the ground nearest to it")
        .begins_with("[0.0, 0.05, 0.0]")
        .concerns(STEP),
    Key::new("source", "radius", LENGTH, "of the circle, seen from above, in which it comes (m)")
        .begins_with("0.002")
        .concerns(STEP),
    Key::new("source", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "how much comes in a second (ml)")
        .begins_with("0.5")
        .concerns(STEP),
    Key::new("source", "carries", NAMED, CARRIES).or("{}").such_as("{ dye = 1.0 }").concerns(STEP),
    Key::new("source", "from", FRAMES, "first frame; left out: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("source", "until", FRAMES, "last frame; left out: to the end").or_nothing().such_as("120").concerns(STEP),
    Key::new("source", "follows", Kind::Flag, FOLLOWS).or("false").concerns(STEP),
    Key::new("source", "frequency", Kind::Number(0.0, 1.0e6, "1/s"), "pulse frequency of its rate (1/s)")
        .or("0.0")
        .such_as("1.2")
        .concerns(STEP),
    Key::new("source", "swing", Kind::Number(0.0, 1.0, ""), "share of its rate by which it swells and falls")
        .or("0.0")
        .such_as("0.6")
        .concerns(STEP),
    Key::new("drain", "at", Kind::Numbers(3, FAR, "m"), "middle (m): liquid goes from the ground nearest to it")
        .such_as("[0.05, 0.0, 0.0]")
        .concerns(STEP),
    Key::new("drain", "radius", LENGTH, "of the circle, seen from above, from which it goes (m)").such_as("0.004").concerns(STEP),
    Key::new("drain", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "how much goes in a second (ml), as long as there is some")
        .such_as("0.5")
        .concerns(STEP),
    Key::new("drain", "orifice_mm2", Kind::Number(0.0, 1.0e12, "mm2"), "area of a hole through which it runs out by its own weight, `rate_ml` at most; left out: it is pumped")
        .or_nothing()
        .such_as("20.0")
        .concerns(STEP),
    Key::new("drain", "discharge", Kind::Number(0.0, 1.0, ""), "share of the hole that the jet fills: 0.6 to 0.65 for a sharp edge")
        .or("0.62")
        .concerns(STEP),
    Key::new("drain", "frequency", Kind::Number(0.0, 1.0e6, "1/s"), "pulse frequency of its rate (1/s)")
        .or("0.0")
        .concerns(STEP),
    Key::new("drain", "swing", Kind::Number(0.0, 1.0, ""), "share of its rate by which it swells and falls")
        .or("0.0")
        .concerns(STEP),
    Key::new("drain", "from", FRAMES, "first frame; left out: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("drain", "until", FRAMES, "last frame; left out: to the end").or_nothing().such_as("120").concerns(STEP),
    Key::new("drain", "follows", Kind::Flag, FOLLOWS).or("false").concerns(STEP),
    Key::new("absorber", "at", Kind::Numbers(3, FAR, "m"), "middle (m): liquid goes into gauze on the ground nearest to it")
        .such_as("[0.05, 0.0, 0.0]")
        .concerns(STEP),
    Key::new("absorber", "radius", LENGTH, "of the gauze, seen from above (m)").such_as("0.01").concerns(STEP),
    Key::new("absorber", "rate_ml", Kind::Number(0.0, MOST_ML, "ml/s"), "how much it takes up in a second (ml)")
        .such_as("0.5")
        .concerns(STEP),
    Key::new("absorber", "capacity_ml", Kind::Number(0.0, MOST_ML, "ml"), "how much it holds (ml)").such_as("2.0").concerns(STEP),
    Key::new("absorber", "from", FRAMES, "first frame; left out: from the beginning").or_nothing().such_as("1").concerns(STEP),
    Key::new("absorber", "until", FRAMES, "last frame; left out: to the end").or_nothing().such_as("120").concerns(STEP),
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
    Key::new(OBJECT, "length", LENGTH, "of a capsule, along y, between the middles of its ends (m)")
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
    Key::new(OBJECT, "ease", Kind::Flag, "true: keys are joined smoothly, from rest to rest; else straight").or("false").concerns(STEP),
    Key::new(
        OBJECT,
        "keys",
        Kind::Poses(FAR),
        "where it is at frames: m, degrees about x, then y, then z; of a file one at most",
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
        "\"vdb\": volume/volume.%04d.vdb: density, the share of each voxel of the size of a cell that is liquid",
    )
    .or("[]")
    .such_as("[\"vdb\"]")
    .concerns(OUTPUT),
];
