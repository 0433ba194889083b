//! The keys of `[grains]`, and the keys of objects that concern grains.

use crate::error::Result;
use crate::scene::schema::key::{Key, Kind, OBJECT, Scope};
use crate::scene::schema::{FAR, Table, Values, rounded};
use crate::snow::{grain_cohesion, grain_friction};

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("grains", Scope::First)];
const STEP: Scopes = &[("grains", Scope::Step)];

/// Maximum attraction (weights of a grain).
const MOST_ATTRACTION: f64 = 1000.0;

/// All of them.
pub const GRAIN_KEYS: &[Key] = &[
    Key::new(
        "grains",
        "preset",
        Kind::Choice(&["powder", "packed", "wet"]),
        "kind of snow: sets the defaults of the keys below",
    )
    .or_nothing()
    .such_as("\"powder\"")
    .concerns(STEP),
    Key::new("grains", "radius", Kind::Cells(0.02, 0.5), "radius of a grain (m); default: a third of a cell")
        .or_cells(1.0 / 3.0)
        .concerns(FIRST),
    Key::new(
        "grains",
        "compression",
        Kind::Number(0.0, 1.0, ""),
        "share of the removed snow that is compressed and does not become grains",
    )
    .or("0.75")
    .with_presets(&[("powder", "0.8"), ("packed", "0.5"), ("wet", "0.7")])
    .concerns(STEP),
    Key::new(
        "grains",
        "repose_angle_deg",
        Kind::Number(0.0, grain_friction::STEEPEST, "degrees"),
        "slope at which a poured pile comes to rest",
    )
    .or("32.0")
    .with_presets(&[("powder", "36.0"), ("packed", "38.0"), ("wet", "34.0")])
    .concerns(STEP),
    Key::new(
        "grains",
        "stands",
        Kind::Number(0.0, 1000.0, "m"),
        "height of the tallest wall of grains that stays up (m)",
    )
    .or("0.0")
    .with_presets(&[("packed", "0.1"), ("wet", "0.25")])
    .concerns(STEP),
    Key::new(
        "grains",
        "friction",
        Kind::Number(0.0, 1.0, ""),
        "between grains, instead of repose_angle_deg; grains do not rotate, so low values suffice",
    )
    .or_nothing()
    .such_as("0.2")
    .concerns(STEP),
    Key::new(
        "grains",
        "attraction",
        Kind::Number(0.0, MOST_ATTRACTION, "weights of a grain"),
        "between grains that nearly touch, instead of stands",
    )
    .or_nothing()
    .such_as("4.0")
    .concerns(STEP),
    Key::new(
        "grains",
        "restitution",
        Kind::Number(0.0, 1.0, ""),
        "share of their speed that grains keep when they bounce",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        "grains",
        "air",
        Kind::Number(0.0, 1.0, ""),
        "air drag: share of its velocity that a grain keeps over a second",
    )
    .or("0.5")
    .with_presets(&[("powder", "0.3"), ("wet", "0.8")])
    .concerns(STEP),
    Key::new(
        "grains",
        "air_by_density",
        Kind::Flag,
        "whether grains in dense groups feel less air drag than those in thin spray",
    )
    .or("false")
    .concerns(STEP),
    Key::new("grains", "gravity", Kind::Number(-100.0, 100.0, "m/s2"), "along y (m/s2)")
        .or("-9.81")
        .concerns(STEP),
    Key::new(
        "grains",
        "rest",
        Kind::Flag,
        "whether grains that lie still come to rest until something wakes them",
    )
    .or("true")
    .concerns(STEP),
    Key::new(
        "grains",
        "active_distance",
        Kind::Number(1.0e-5, FAR, "m"),
        "slow grains farther than this (m) from objects and fast grains rest at once; no effect with rest = false",
    )
    .or_nothing()
    .such_as("0.15")
    .concerns(STEP),
    Key::new(
        "grains",
        "substeps",
        Kind::Whole(1, 1000),
        "sub-steps of a frame; default: from size, time and speed",
    )
    .or_nothing()
    .such_as("20")
    .concerns(STEP),
    Key::new(
        "grains",
        "max",
        Kind::Whole(1, 60_000_000),
        "maximum number of grains: a frame that would have more is an error",
    )
    // No existing frame depends on it.
    .or("20000000"),
    Key::new(
        "grains",
        "lifetime",
        Kind::Number(0.001, 1.0e6, "s"),
        "age at which a grain is removed (s)",
    )
    .or_nothing()
    .such_as("10.0")
    .concerns(STEP),
    Key::new(
        "grains",
        "keep_box",
        Kind::Numbers(6, FAR, "m"),
        "grains outside this box are removed: x0, y0, z0, x1, y1, z1 (m)",
    )
    .or_nothing()
    .such_as("[-3.0, -1.0, -3.0, 3.0, 3.0, 3.0]")
    .concerns(STEP),
    Key::new(
        "grains",
        "initial",
        Kind::File(&["ply", "vdb"]),
        "points that become grains at the first frame, with their velocities v, if any",
    )
    .or_nothing()
    .such_as("\"drift.ply\"")
    .concerns(FIRST),
    Key::new("grains", "seed", Kind::Whole(0, i32::MAX as i64), "another seed scatters new grains differently")
        .or("0")
        .concerns(STEP),
    Key::new(
        OBJECT,
        "compression",
        Kind::Number(0.0, 1.0, ""),
        "instead of grains.compression, for the snow that it removes",
    )
    .or_nothing()
    .such_as("0.9")
    .concerns(STEP),
    Key::new(
        OBJECT,
        "stick",
        Kind::Number(0.0, 1000.0, "weights of a grain"),
        "attraction between it and the grains that touch it",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        OBJECT,
        "friction",
        Kind::Number(0.0, 10.0, ""),
        "between it and grains; loose grains that slide over it while it stands still have the friction between grains",
    )
    .or("0.3")
    .concerns(STEP),
];

/// Checks the keys in combination.
///
/// # Errors
/// A box without a volume.
pub fn check_grains(table: &Table, values: &Values) -> Result<()> {
    let keep_box = values.get("grains.keep_box").and_then(|value| value.numbers());
    if let Some([x0, y0, z0, x1, y1, z1]) = keep_box
        && (x1 <= x0 || y1 <= y0 || z1 <= z0)
    {
        let what = "must be [x0, y0, z0, x1, y1, z1] with x0 < x1, y0 < y1 and z0 < z1";
        return Err(table.error("keep_box", what));
    }
    let Some(radius) = values.number("grains.radius") else { return Ok(()) };
    if material(values, radius)[1] > MOST_ATTRACTION {
        let repose = repose_of(values);
        let highest = grain_cohesion::wall_of(MOST_ATTRACTION, 2.0 * radius, repose);
        // Slightly less, so that the printed value is accepted.
        let highest = rounded(highest * (1.0 - 1.0e-4));
        let what = format!(
            "is too high: grains with a radius of {} m and an angle of repose of {} degrees stand at most {highest} m high",
            rounded(radius),
            rounded(repose)
        );
        return Err(table.error("stands", what));
    }
    Ok(())
}

/// Friction between grains of a radius (m), and their attraction (weights of a grain): as given, or derived from the angle of repose and
/// the height of a wall.
pub fn material(values: &Values, radius: f64) -> [f64; 2] {
    let number = |name: &str| values.number(&format!("grains.{name}"));
    let repose = repose_of(values);
    let of_wall = || grain_cohesion::of_wall(number("stands").unwrap_or_default(), 2.0 * radius, repose);
    let attraction = number("attraction").unwrap_or_else(of_wall);
    let friction = number("friction").unwrap_or_else(|| grain_friction::of_repose(repose, attraction > 0.0));
    [friction, attraction]
}

/// The angle of repose (degrees): as given, or from the friction.
fn repose_of(values: &Values) -> f64 {
    let number = |name: &str| values.number(&format!("grains.{name}"));
    let of_friction = number("friction").map(|friction| grain_friction::repose_of(friction, true));
    of_friction.or_else(|| number("repose_angle_deg")).unwrap_or_default()
}

/// Whether a scene has grains.
pub fn has_grains(values: &Values) -> bool {
    values.number("grains.radius").is_some()
}
