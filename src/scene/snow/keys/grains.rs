//! The keys of `[grains]`, and the keys of objects that concern grains.

use crate::error::Result;
use crate::scene::schema::declaration::Kind::{Cells, Choice, File, Flag, Number, Numbers, Whole};
use crate::scene::schema::declaration::{Key, OBJECT, Scope, Scopes, key, optional, or, or_cells};
use crate::scene::schema::{FAR, Table, Values, rounded};
use crate::snow::{grain_cohesion, grain_friction};

/// Maximum attraction (weights of a grain).
const MAX_ATTRACTION: f64 = 1000.0;

const FIRST: Scopes = &[("grains", Scope::First)];
const STEP: Scopes = &[("grains", Scope::Step)];

/// The keys of grains.
pub const GRAIN_KEYS: &[Key] = &[
    key(STEP, "grains", "preset", Choice(&["powder", "packed", "wet"]), optional("\"powder\""))
        .means("kind of snow: sets the defaults of the keys below"),
    key(FIRST, "grains", "radius", Cells(0.02, 0.5), or_cells(1.0 / 3.0))
        .means("radius of a grain (m); default: a third of a cell"),
    key(STEP, "grains", "compression", Number(0.0, 1.0, ""), or("0.75"))
        .with_presets(&[("powder", "0.8"), ("packed", "0.5"), ("wet", "0.7")])
        .means("share of the removed snow that is compressed and does not become grains"),
    key(STEP, "grains", "repose_angle_deg", Number(0.0, grain_friction::MAX_REPOSE, "degrees"), or("32.0"))
        .with_presets(&[("powder", "36.0"), ("packed", "38.0"), ("wet", "34.0")])
        .means("slope at which a poured pile comes to rest"),
    key(STEP, "grains", "stands", Number(0.0, 1000.0, "m"), or("0.0"))
        .with_presets(&[("packed", "0.1"), ("wet", "0.25")])
        .means("height of the tallest wall of grains that stays up (m)"),
    key(STEP, "grains", "friction", Number(0.0, 1.0, ""), optional("0.2"))
        .means("between grains, instead of repose_angle_deg; grains do not rotate, so low values suffice"),
    key(STEP, "grains", "attraction", Number(0.0, MAX_ATTRACTION, "weights of a grain"), optional("4.0"))
        .means("between grains that nearly touch, instead of stands"),
    key(STEP, "grains", "restitution", Number(0.0, 1.0, ""), or("0.0"))
        .means("share of their speed that grains keep when they bounce"),
    key(STEP, "grains", "air", Number(0.0, 1.0, ""), or("0.5"))
        .with_presets(&[("powder", "0.3"), ("wet", "0.8")])
        .means("air drag: share of its velocity that a grain keeps over a second"),
    key(STEP, "grains", "air_by_density", Flag, or("false"))
        .means("whether grains in dense groups feel less air drag than those in thin spray"),
    key(STEP, "grains", "gravity", Number(-100.0, 100.0, "m/s2"), or("-9.81")).means("along y (m/s2)"),
    key(STEP, "grains", "rest", Flag, or("true"))
        .means("whether grains that lie still come to rest until something wakes them"),
    key(STEP, "grains", "active_distance", Number(1.0e-5, FAR, "m"), optional("0.15"))
        .means("slow grains farther than this (m) from objects and fast grains rest at once; no effect with rest = false"),
    key(STEP, "grains", "substeps", Whole(1, 1000), optional("20"))
        .means("sub-steps of a frame; default: computed from size, time and speed"),
    // No existing frame depends on it.
    key(&[], "grains", "max", Whole(1, 60_000_000), or("20000000"))
        .means("maximum number of grains: a frame that would have more is an error"),
    key(STEP, "grains", "lifetime", Number(0.001, 1.0e6, "s"), optional("10.0"))
        .means("age at which a grain is removed (s)"),
    key(STEP, "grains", "keep_box", Numbers(6, FAR, "m"), optional("[-3.0, -1.0, -3.0, 3.0, 3.0, 3.0]"))
        .means("grains outside this box are removed: x0, y0, z0, x1, y1, z1 (m)"),
    key(FIRST, "grains", "initial", File(&["ply", "vdb", "usdc", "usd"]), optional("\"drift.ply\""))
        .means("points that become grains at the first frame, with their velocities v, if any"),
    key(STEP, "grains", "seed", Whole(0, i32::MAX as i64), or("0"))
        .means("another seed scatters new grains differently"),
    key(STEP, OBJECT, "compression", Number(0.0, 1.0, ""), optional("0.9"))
        .means("instead of grains.compression, for the snow that it removes"),
    key(STEP, OBJECT, "stick", Number(0.0, 1000.0, "weights of a grain"), or("0.0"))
        .means("attraction between it and the grains that touch it"),
    key(STEP, OBJECT, "friction", Number(0.0, 10.0, ""), or("0.3"))
        .means("between it and grains; loose grains that slide over it while it stands still have the friction between grains"),
];

/// Checks the keys in combination.
///
/// # Errors
/// A box without a volume.
pub fn check_grains(table: &Table, values: &Values) -> Result<()> {
    let grains = values.table("grains");
    if let Some([x0, y0, z0, x1, y1, z1]) = grains.find::<[f64; 6]>("keep_box")
        && (x1 <= x0 || y1 <= y0 || z1 <= z0)
    {
        let what = "must be [x0, y0, z0, x1, y1, z1] with x0 < x1, y0 < y1 and z0 < z1";
        return Err(table.error("keep_box", what));
    }
    let Some(radius) = grains.find("radius") else { return Ok(()) };
    if material(values, radius)[1] > MAX_ATTRACTION {
        let repose = repose_of(values);
        let highest = grain_cohesion::wall_of(MAX_ATTRACTION, 2.0 * radius, repose);
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
    let (grains, repose) = (values.table("grains"), repose_of(values));
    let of_wall = || grain_cohesion::of_wall(grains.get("stands"), 2.0 * radius, repose);
    let attraction = grains.find("attraction").unwrap_or_else(of_wall);
    let of_repose = || grain_friction::of_repose(repose, attraction > 0.0);
    let friction = grains.find("friction").unwrap_or_else(of_repose);
    [friction, attraction]
}

/// The angle of repose (degrees): as given, or from the friction.
fn repose_of(values: &Values) -> f64 {
    let grains = values.table("grains");
    match grains.find("friction") {
        Some(friction) => grain_friction::repose_of(friction, true),
        None => grains.get("repose_angle_deg"),
    }
}

/// Whether a scene has grains.
pub fn has_grains(values: &Values) -> bool {
    values.number("grains.radius").is_some()
}
