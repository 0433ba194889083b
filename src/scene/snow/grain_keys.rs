//! The keys of `[grains]`, and those that grains have of each object.

use crate::scene::text::Values;
use crate::scene::text::key::{Key, Kind, OBJECT, Scope};
use crate::snow::grain_friction;

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("grains", Scope::First)];
const STEP: Scopes = &[("grains", Scope::Step)];

/// All of them.
pub const GRAIN_KEYS: &[Key] = &[
    Key::new("grains", "radius", Kind::Cells(0.02, 0.5), "of a grain (m); a third of a cell")
        .or_cells(1.0 / 3.0)
        .concerns(FIRST),
    Key::new(
        "grains",
        "compression",
        Kind::Number(0.0, 1.0, ""),
        "share of the removed snow that is pressed together and becomes no grains",
    )
    .or("0.75")
    .concerns(STEP),
    Key::new(
        "grains",
        "repose_angle_deg",
        Kind::Number(0.0, grain_friction::STEEPEST, "degrees"),
        "slope at which a poured pile comes to rest",
    )
    .or("32.0")
    .concerns(STEP),
    Key::new(
        "grains",
        "friction",
        Kind::Number(0.0, 1.0, ""),
        "between grains, in place of repose_angle_deg; they do not turn, so that little holds much",
    )
    .or_nothing()
    .such_as("0.3")
    .concerns(STEP),
    Key::new(
        "grains",
        "attraction",
        Kind::Number(0.0, 1000.0, "weights of a grain"),
        "with which grains that all but touch hold each other",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        "grains",
        "air",
        Kind::Number(0.0, 1.0, ""),
        "share of its velocity that a grain keeps in a second",
    )
    .or("0.5")
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
        "substeps",
        Kind::Whole(1, 1000),
        "of a frame, in place of the rule by size, time and speed",
    )
    .or_nothing()
    .such_as("20")
    .concerns(STEP),
    Key::new(
        "grains",
        "max",
        Kind::Whole(1, 60_000_000),
        "most grains: a frame that would have more is an error",
    )
    .or("20000000")
    .concerns(STEP),
    Key::new("grains", "seed", Kind::Whole(0, i32::MAX as i64), "another one scatters new grains otherwise")
        .or("0")
        .concerns(STEP),
    Key::new(OBJECT, "friction", Kind::Number(0.0, 10.0, ""), "of grains against it")
        .or("0.3")
        .concerns(STEP),
];

/// Whether a scene has grains.
pub fn has_grains(values: &Values) -> bool {
    values.number("grains.radius").is_some()
}
