//! The keys of `[mist]`.

use crate::error::{Error, Result};
use crate::scene::schema::key::{Key, Kind, Scope};
use crate::scene::schema::{Table, Values};
use crate::scene::snow::has_grains;
use crate::snow::mist::{FASTEST_WIND, Params};

type Scopes = &'static [(&'static str, Scope)];
const FIRST: Scopes = &[("mist", Scope::First)];
const STEP: Scopes = &[("mist", Scope::Step)];

/// All of them.
pub const MIST_KEYS: &[Key] = &[
    Key::new("mist", "cell", Kind::Cells(0.25, 64.0), "edge of a cell of air (m)")
        .or_cells(4.0 / 3.0)
        .concerns(FIRST),
    Key::new(
        "mist",
        "from_speed",
        Kind::Number(0.0, 1000.0, "m/s"),
        "grains faster than this raise mist along their path (m/s)",
    )
    .or("2.0")
    .concerns(STEP),
    Key::new("mist", "falling", Kind::Flag, "whether falling grains raise mist too")
        .or("false")
        .concerns(STEP),
    Key::new("mist", "gravity", Kind::Number(-100.0, 100.0, "m/s2"), "of the air where there is mist (m/s2)")
        .or("-2.0")
        .concerns(STEP),
    Key::new(
        "mist",
        "half_life",
        Kind::Number(0.001, 1.0e6, "s"),
        "time in which half of the mist dissipates (s)",
    )
    .or("1.0")
    .concerns(STEP),
    Key::new(
        "mist",
        "wind",
        Kind::NumbersOrFile(3, FASTEST_WIND, "m/s", &["vdb"]),
        "velocity (m/s), or a grid of velocities, that carries the air along where there is mist",
    )
    .or("[0.0, 0.0, 0.0]")
    .concerns(FIRST),
    Key::new(
        "mist",
        "turbulence",
        Kind::Number(0.0, 1000.0, "m/s2"),
        "acceleration by eddies (m/s2, root mean square)",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        "mist",
        "turbulence_size",
        Kind::Cells(2.0, 1.0e6),
        "size of the eddies (m), at least 8 cells of air; default: 24 cells of air",
    )
    .or_nothing()
    .such_as("0.4")
    .concerns(STEP),
    Key::new(
        "mist",
        "confinement",
        Kind::Number(0.0, 100.0, "1/s"),
        "strength of vorticity confinement, which keeps small eddies alive (1/s); 0 = off",
    )
    .or("0.0")
    .concerns(STEP),
    Key::new(
        "mist",
        "noise",
        Kind::Number(0.0, 1.0, ""),
        "maximum share of the density of new mist that noise removes",
    )
    .or("0.3")
    .concerns(STEP),
    Key::new(
        "mist",
        "noise_size",
        Kind::Cells(0.25, 1.0e6),
        "size of that noise (m), at least a cell of air; default: 4 cells of air",
    )
    .or_nothing()
    .such_as("0.05")
    .concerns(STEP),
    Key::new("mist", "seed", Kind::Whole(0, i32::MAX as i64), "another seed gives other noise and eddies")
        .or("0")
        .concerns(STEP),
];

/// Checks the keys in combination.
///
/// # Errors
/// Mist without grains; sizes too small for the cell.
pub fn check_mist(table: &Table, values: &Values) -> Result<()> {
    if !has_grains(values) {
        return Err(table.error("from_speed", "is of grains that raise mist: the scene needs `[grains]` too"));
    }
    let Some(params) = mist_params(values) else { return Ok(()) };
    params.validate().map_err(|error| match error {
        Error::Argument(what) => {
            let key = what.split(' ').next().unwrap_or_default();
            let key = MIST_KEYS.iter().find(|declared| declared.name == key).map_or("cell", |key| key.name);
            table.error(key, what.strip_prefix(key).unwrap_or(&what).trim_start())
        }
        other => other,
    })
}

/// The parameters of a scene's mist; `None` if it has none. A wind given as a grid is not included.
pub fn mist_params(values: &Values) -> Option<Params> {
    let number = |name: &str| values.number(&format!("mist.{name}"));
    let value = |name: &str| values.get(&format!("mist.{name}"));
    let defaults = Params::for_cell(number("cell")?);
    Some(Params {
        from_speed: values.settled("mist", None, "from_speed"),
        falling: values.settled("mist", None, "falling"),
        gravity: values.settled("mist", None, "gravity"),
        half_life: values.settled("mist", None, "half_life"),
        wind: value("wind").and_then(|value| value.numbers()).unwrap_or_default(),
        turbulence: values.settled("mist", None, "turbulence"),
        turbulence_size: number("turbulence_size").unwrap_or(defaults.turbulence_size),
        confinement: values.settled("mist", None, "confinement"),
        noise: values.settled("mist", None, "noise"),
        noise_size: number("noise_size").unwrap_or(defaults.noise_size),
        seed: values.settled::<i64>("mist", None, "seed") as i32,
        ..defaults
    })
}

/// Whether a scene has mist.
pub fn has_mist(values: &Values) -> bool {
    values.number("mist.cell").is_some()
}
