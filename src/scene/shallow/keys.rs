//! The keys of `[shallow]`, of the arrays of tables and of `[output]` in such scenes.

use crate::io::mesh::EXTENSIONS;
use crate::scene::schema::declaration::Kind::{
    Choice, Choices, File, Flag, Number, Numbers, Poses, Text, Whole,
};
use crate::scene::schema::declaration::{Key, Kind, OBJECT, Scope, Scopes, key, optional, or, required};
use crate::scene::schema::{FAR, NO_ORIGIN, ORIGIN, ORIGIN_MEANS};

/// Extensions of a terrain: a mesh, a level set or an image of heights.
const TERRAINS: &[&str] =
    &[EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2], EXTENSIONS[3], EXTENSIONS[4], "vdb", "png"];
/// Maximum of a volume, and of a rate (ml, ml/s): a cubic kilometre.
const MAX_ML: f64 = 1.0e15;
/// Frame numbers allowed in a scene.
const FRAMES: Kind = Kind::Whole(-1_000_000_000, 1_000_000_000);
/// Lengths of obstacles, and radii of circles (m).
const LENGTH: Kind = Kind::Number(0.0, FAR, "m");

/// Concentrations by names of scalars.
const CONCENTRATIONS: Kind = Kind::Named(1.0e9);
/// Meaning of `carries`.
const CARRIES: &str =
    "concentrations of scalars in it, by name; for scalars that are not named: their `start`";

/// Meaning of `follows` of sources, drains and absorbers.
const FOLLOWS: &str =
    "true: it moves with the point of the terrain, a sequence, that is nearest to `at` at the first frame";

const FIRST: Scopes = &[("liquid", Scope::First)];
const STEP: Scopes = &[("liquid", Scope::Step)];
const OUTPUT: Scopes = &[("liquid", Scope::Output)];

/// The keys of `[shallow]`.
pub const KEYS: &[Key] = &[
    key(FIRST, "shallow", "terrain", File(TERRAINS), required("\"terrain.obj\"").shown())
        .means("what the liquid flows over: an open or closed mesh, a sequence \"organ.%04d.ply\" of a moving mesh, a level set, or a greyscale image of heights"),
    key(FIRST, "shallow", "terrain_size", Numbers(2, FAR, "m"), optional("[0.2, 0.2]"))
        .means("size of an image, which is centred at the origin: lengths along x and z (m)"),
    key(FIRST, "shallow", "terrain_height", Numbers(2, FAR, "m"), optional("[0.0, 0.02]"))
        .means("heights of an image's black and white (m)"),
    key(FIRST, "shallow", "scale", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("from a mesh's unit to metres: 0.001 for millimetres"),
    key(FIRST, "shallow", "up", Choice(&["y", "z"]), or("\"y\"")).means("a mesh's upward axis: y or z"),
    key(FIRST, "shallow", "origin", ORIGIN, or(NO_ORIGIN)).means(ORIGIN_MEANS),
    key(STEP, "shallow", "offset", Whole(-10_000_000, 10_000_000), or("0"))
        .means("frames by which a sequence starts later"),
    key(FIRST, "shallow", "cell", Number(1.0e-6, 1000.0, "m"), required("0.001").shown())
        .means("edge of a cell on the ground (m)"),
    key(FIRST, "shallow", "area", Numbers(4, FAR, "m"), optional("[-0.1, -0.1, 0.1, 0.1]"))
        .means("extent of the cells: x0, z0, x1, z1 (m), rounded to whole cells; default: that of the terrain at the first frame"),
    key(FIRST, "shallow", "bottom", Number(-FAR, FAR, "m"), optional("-0.01"))
        .means("minimum height (m) of ground and liquid; default: the terrain's lowest point; for a sequence, below that by the margin of `top`"),
    key(FIRST, "shallow", "top", Number(-FAR, FAR, "m"), optional("0.1"))
        .means("maximum height (m); default: above the terrain's highest point, or `fill` if that is higher, by a margin of a quarter of the terrain's height, at least 0.1 m"),
    key(STEP, "shallow", "liquid", Choice(&["water", "blood", "paint", "honey"]), or("\"blood\""))
        .means("water, blood, paint or honey: its viscosity, and its look"),
    key(STEP, "shallow", "viscosity", Number(0.0, 1.0e6, "m2/s"), or("4e-6"))
        .with_presets(&[("water", "1e-6"), ("paint", "4e-5"), ("honey", "7e-3")])
        .means("kinematic viscosity (m2/s)"),
    key(STEP, "shallow", "thinning", Flag, or("false"))
        .means("for blood: true: its viscosity falls with shear (Carreau's law), whatever `viscosity` is"),
    key(STEP, "shallow", "gravity", Numbers(3, 1000.0, "m/s2"), or("[0.0, -9.81, 0.0]"))
        .means("x, y, z (m/s2); it may tilt by up to 45 degrees"),
    key(FIRST, "shallow", "border", Choice(&["open", "closed", "absorbing"]), or("\"open\""))
        .means("of the area: open: liquid flows off; closed: a wall; absorbing: waves leave into liquid at rest beyond it"),
    key(FIRST, "shallow", "fill", Number(-FAR, FAR, "m"), optional("0.005"))
        .means("height up to which liquid stands at the first frame (m)"),
    key(STEP, "shallow", "kept", Number(0.0, 1.0, ""), or("0.5"))
        .means("share of its momentum that liquid keeps over a second, apart from viscous losses"),
    key(STEP, "shallow", "pace", Choice(&["exact", "realtime"]), or("\"exact\""))
        .means("exact: as many steps as waves need; realtime: steps of at most `step`, which slow down waves in deep liquid and fast films on slopes"),
    key(STEP, "shallow", "step", Number(1.0e-6, 1.0, "s"), or("0.003")).means("longest step of realtime (s)"),
    key(FIRST, "shallow", "friction", Choice(&["ground", "walls"]), or("\"ground\""))
        .means("where viscous drag acts: ground: accurate for liquid that is far wider than deep; walls: also at walls and ceilings, for channels and ducts, which takes longer"),
    key(STEP, "shallow", "rest", Number(0.0, 0.01, "m/s"), or("0"))
        .means("velocity (m/s) below which liquid with a level surface comes to rest, and then takes no time to compute: 1e-6 works well; 0: never"),
    key(FIRST, "shallow", "falls", Flag, or("false"))
        .means("true: liquid falls freely over edges, through holes and into the void, in drops and strands; false: it arrives below at once"),
    key(FIRST, "shallow", "falls_height", LENGTH, or("0.01"))
        .means("minimum height of a free fall (m); at least the edge of a cell"),
    key(FIRST, "shallow", "falls_drop_ml", Number(0.0, MAX_ML, "ml"), or("6.5e-5"))
        .means("volume of a drop (ml): liquid drips where a drop takes longer than 8 intervals to form"),
    key(FIRST, "shallow", "falls_interval", Number(1.0e-4, 1.0, "s"), or("0.008333333333333333"))
        .means("time between the drops of a strand (s)"),
    key(FIRST, "shallow", "falls_most", Whole(1, 1 << 20), or("8192"))
        .means("maximum number of drops in the air: beyond that, liquid arrives below at once"),
    key(OUTPUT, "shallow", "lifts", Flag, or("true"))
        .means("for a mesh: true: its bumps do not show through films, and the rim of the liquid does not hover (minimum heights); false: films are 0.05 cells above the ground"),
    key(OUTPUT, "shallow", "skirts", Flag, or("true"))
        .means("true: where the ground ends, as at the edges of shelves and holes, the surface extends to that edge and comes down to it; false: it ends in the middle of the last cell, open below"),
    key(FIRST, "shallow", "stains", Flag, or("false"))
        .means("for a mesh: true: the liquid leaves stains on it, and terrain/ has the terrain at each frame (m, Y up) with an array `stain`, 0 to 1, on its vertices, and its colours under them"),
    key(STEP, "shallow", "stain_half_life", Number(1.0e-3, 1.0e12, "s"), or("60.0"))
        .means("time in which half of a stain on dry ground fades (s)"),
    key(OUTPUT, "shallow", "opaque_depth", Number(1.0e-6, FAR, "m"), or("0.001"))
        .with_presets(&[("water", "0.05"), ("paint", "0.0005"), ("honey", "0.02")])
        .means("depth from which the liquid is opaque (m)"),
];

/// The keys of the arrays of tables (`[[scalar]]` to `[[object]]`), and of `[output]`.
pub const TABLE_ARRAY_KEYS: &[Key] = &[
    key(FIRST, "scalar", "name", Text, required("\"dye\""))
        .means("name of a scalar that the liquid carries (at most four scalars), and of its array on the surface's vertices; letters, digits and _"),
    key(FIRST, "scalar", "law", Choice(&["dye", "decays", "ages"]), or("\"dye\""))
        .means("dye: it is only carried; decays: half of it is gone after each half_life; ages: it is the time (s) since the liquid came in"),
    key(FIRST, "scalar", "half_life", Number(1.0e-6, 1.0e12, "s"), optional("60.0"))
        .means("half-life of a scalar that decays (s)"),
    key(FIRST, "scalar", "range", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("concentrations lie within -range to range, with a precision of range / 2^20; for ages: the maximum age (s)"),
    key(FIRST, "scalar", "start", Number(-1.0e9, 1.0e9, ""), or("0.0"))
        .means("concentration in liquid from `fill`, and in pours and sources whose `carries` does not name it"),
    key(STEP, "scalar", "stains", Flag, or("false"))
        .means("for at most one scalar, and only if shallow.stains is true; true: it stains by its concentration / range, and clear liquid washes stains off; without such a scalar any liquid stains"),
    key(STEP, "scalar", "thickens_times", Number(1.0e-6, 1.0e9, ""), optional("5.0"))
        .means("for at most one scalar: factor of the liquid's viscosity from the concentration `thickens_to` on; the factor is 1 up to `thickens_from`, and linear in between"),
    key(STEP, "scalar", "thickens_from", Number(-1.0e9, 1.0e9, ""), or("0.0"))
        .means("concentration up to which the viscosity is unchanged, within the range"),
    key(STEP, "scalar", "thickens_to", Number(-1.0e9, 1.0e9, ""), optional("1.0"))
        .means("concentration from which the viscosity is multiplied by `thickens_times`, within the range; it may be below `thickens_from`"),
    key(STEP, "pour", "at", Numbers(3, FAR, "m"), required("[0.0, 0.05, 0.0]"))
        .means("centre (m): liquid is poured onto the ground nearest to it"),
    key(STEP, "pour", "radius", LENGTH, required("0.005"))
        .means("of the circle that it is poured into, seen from above (m)"),
    key(STEP, "pour", "volume_ml", Number(0.0, MAX_ML, "ml"), required("1.0")).means("volume of the pour (ml)"),
    key(STEP, "pour", "carries", CONCENTRATIONS, or("{}").such_as("{ dye = 1.0 }")).means(CARRIES),
    key(STEP, "pour", "frame", FRAMES, optional("1")).means("frame of the pour; default: the first"),
    key(STEP, "source", "at", Numbers(3, FAR, "m"), required("[0.0, 0.05, 0.0]").shown())
        .means("centre (m): liquid comes onto the ground nearest to it"),
    key(STEP, "source", "radius", LENGTH, required("0.002").shown())
        .means("of the source's circle, seen from above (m)"),
    key(STEP, "source", "rate_ml", Number(0.0, MAX_ML, "ml/s"), required("0.5").shown())
        .means("volume that comes in per second (ml)"),
    key(STEP, "source", "carries", CONCENTRATIONS, or("{}").such_as("{ dye = 1.0 }")).means(CARRIES),
    key(STEP, "source", "from", FRAMES, optional("1")).means("first frame; default: from the beginning"),
    key(STEP, "source", "until", FRAMES, optional("120")).means("last frame; default: to the end"),
    key(STEP, "source", "follows", Flag, or("false")).means(FOLLOWS),
    key(STEP, "source", "frequency", Number(0.0, 1.0e6, "1/s"), or("0.0").such_as("1.2"))
        .means("pulse frequency of its rate (1/s)"),
    key(STEP, "source", "swing", Number(0.0, 1.0, ""), or("0.0").such_as("0.6"))
        .means("amplitude of the pulse, as a share of its rate"),
    key(STEP, "drain", "at", Numbers(3, FAR, "m"), required("[0.05, 0.0, 0.0]"))
        .means("centre (m): liquid leaves the ground nearest to it"),
    key(STEP, "drain", "radius", LENGTH, required("0.004")).means("of the drain's circle, seen from above (m)"),
    key(STEP, "drain", "rate_ml", Number(0.0, MAX_ML, "ml/s"), required("0.5"))
        .means("volume that leaves per second (ml), as long as there is liquid"),
    key(STEP, "drain", "orifice_mm2", Number(0.0, 1.0e12, "mm2"), optional("20.0"))
        .means("area of a hole through which liquid drains by its own weight, at most `rate_ml`; default: it is pumped"),
    key(STEP, "drain", "discharge", Number(0.0, 1.0, ""), or("0.62"))
        .means("share of the hole that the jet fills: 0.6 to 0.65 for a sharp edge"),
    key(STEP, "drain", "frequency", Number(0.0, 1.0e6, "1/s"), or("0.0"))
        .means("pulse frequency of its rate (1/s)"),
    key(STEP, "drain", "swing", Number(0.0, 1.0, ""), or("0.0"))
        .means("amplitude of the pulse, as a share of its rate"),
    key(STEP, "drain", "from", FRAMES, optional("1")).means("first frame; default: from the beginning"),
    key(STEP, "drain", "until", FRAMES, optional("120")).means("last frame; default: to the end"),
    key(STEP, "drain", "follows", Flag, or("false")).means(FOLLOWS),
    key(STEP, "absorber", "at", Numbers(3, FAR, "m"), required("[0.05, 0.0, 0.0]"))
        .means("centre (m): liquid goes into gauze on the ground nearest to it"),
    key(STEP, "absorber", "radius", LENGTH, required("0.01")).means("of the gauze, seen from above (m)"),
    key(STEP, "absorber", "rate_ml", Number(0.0, MAX_ML, "ml/s"), required("0.5"))
        .means("volume that it absorbs per second (ml)"),
    key(STEP, "absorber", "capacity_ml", Number(0.0, MAX_ML, "ml"), required("2.0"))
        .means("volume that it can hold (ml)"),
    key(STEP, "absorber", "from", FRAMES, optional("1")).means("first frame; default: from the beginning"),
    key(STEP, "absorber", "until", FRAMES, optional("120")).means("last frame; default: to the end"),
    key(STEP, "absorber", "follows", Flag, or("false")).means(FOLLOWS),
    key(STEP, OBJECT, "shape", Choice(&["sphere", "capsule", "box"]), optional("\"capsule\""))
        .means("sphere, capsule or box: an obstacle that may move; instead of file"),
    key(STEP, OBJECT, "radius", LENGTH, optional("0.004")).means("of a sphere or capsule (m)"),
    key(STEP, OBJECT, "length", LENGTH, optional("0.06"))
        .means("of a capsule, along y, between the centres of its ends (m)"),
    key(STEP, OBJECT, "size", Numbers(3, FAR, "m"), optional("[0.02, 0.02, 0.02]"))
        .means("of a box: along x, y and z (m)"),
    key(FIRST, OBJECT, "file", File(&EXTENSIONS), optional("\"stone.obj\""))
        .means("a closed mesh that stands on the terrain and does not move"),
    key(FIRST, OBJECT, "scale", Number(1.0e-9, 1.0e9, ""), or("1.0"))
        .means("from the file's unit to metres: 0.01 for centimetres"),
    key(FIRST, OBJECT, "up", Choice(&["y", "z"]), or("\"y\"")).means("the file's upward axis: y or z"),
    key(FIRST, OBJECT, "origin", ORIGIN, or(NO_ORIGIN)).means(ORIGIN_MEANS),
    key(STEP, OBJECT, "ease", Flag, or("false"))
        .means("true: smooth motion through the keys, from rest to rest; false: linear between them"),
    key(STEP, OBJECT, "keys", Poses(FAR), or("[]").such_as("[{ frame = 1, at = [0.05, 0.04, 0.0] }, { frame = 60, at = [-0.05, 0.04, 0.0], turn_deg = [0.0, 0.0, 90.0] }]"))
        .means("poses at frames: m, degrees about x, then y, then z; at most one for a file"),
    key(OUTPUT, "output", "liquid", Choices(&["ply", "usd"]), or("[\"usd\"]"))
        .means("\"usd\" (in shot.usda), \"ply\": liquid/, the surface at each frame"),
    key(OUTPUT, "output", "attributes", Choices(&["v", "depth", "layer", "alpha", "falling", "scalars"]), or("[\"v\", \"depth\", \"layer\", \"alpha\", \"falling\", \"scalars\"]"))
        .means("of its vertices: velocity of the surface (m/s), depth (m), layer from the bottom, opacity: depth / opaque_depth up to 1; with falls, whether it is in the air; each scalar, by its name"),
    key(OUTPUT, "output", "terrain", Choices(&["ply", "usd"]), or("[\"usd\"]"))
        .means("\"usd\" (in shot.usda): terrain and obstacles, in surroundings.usdc or, if they move or are stained, in terrain/ and obstacles/; \"ply\": terrain/, a terrain that moves or is stained"),
    key(OUTPUT, "output", "volume", Choices(&["vdb"]), or("[]").such_as("[\"vdb\"]"))
        .means("\"vdb\": volume/volume.%04d.vdb: density, the liquid share of each voxel, which has the size of a cell"),
];
