//! The keys of `[mist]`.

use crate::error::{Error, Result};
use crate::scene::schema::declaration::Kind::{Cells, Flag, Number, NumbersOrFile, Whole};
use crate::scene::schema::declaration::{Key, Scope, Scopes, key, optional, or, or_cells};
use crate::scene::schema::{Table, Values};
use crate::scene::snow::has_grains;
use crate::snow::mist::{FASTEST_WIND, Params};

const FIRST: Scopes = &[("mist", Scope::First)];
const STEP: Scopes = &[("mist", Scope::Step)];

/// The keys of mist.
pub const MIST_KEYS: &[Key] = &[
    key(FIRST, "mist", "cell", Cells(0.25, 64.0), or_cells(4.0 / 3.0)).means("edge of a cell of air (m)"),
    key(STEP, "mist", "from_speed", Number(0.0, 1000.0, "m/s"), or("2.0"))
        .means("grains faster than this raise mist along their path (m/s)"),
    key(STEP, "mist", "falling", Flag, or("false")).means("whether falling grains raise mist too"),
    key(STEP, "mist", "gravity", Number(-100.0, 100.0, "m/s2"), or("-2.0"))
        .means("of the air where there is mist (m/s2)"),
    key(STEP, "mist", "half_life", Number(0.001, 1.0e6, "s"), or("1.0"))
        .means("time in which half of the mist dissipates (s)"),
    key(FIRST, "mist", "wind", NumbersOrFile(3, FASTEST_WIND, "m/s", &["vdb"]), or("[0.0, 0.0, 0.0]"))
        .means("velocity (m/s), or a grid of velocities, that carries the air along where there is mist"),
    key(STEP, "mist", "turbulence", Number(0.0, 1000.0, "m/s2"), or("0.0"))
        .means("acceleration by eddies (m/s2, root mean square)"),
    key(STEP, "mist", "turbulence_size", Cells(2.0, 1.0e6), optional("0.4"))
        .means("size of the eddies (m), at least 8 cells of air; default: 24 cells of air"),
    key(STEP, "mist", "confinement", Number(0.0, 100.0, "1/s"), or("0.0"))
        .means("strength of vorticity confinement, which keeps small eddies alive (1/s); 0 = off"),
    key(STEP, "mist", "noise", Number(0.0, 1.0, ""), or("0.3"))
        .means("maximum share of the density of new mist that noise removes"),
    key(STEP, "mist", "noise_size", Cells(0.25, 1.0e6), optional("0.05"))
        .means("size of that noise (m), at least a cell of air; default: 4 cells of air"),
    key(STEP, "mist", "seed", Whole(0, i32::MAX as i64), or("0"))
        .means("another seed gives other noise and eddies"),
];

/// Checks the keys in combination.
///
/// # Errors
/// Mist without grains; sizes too small for the cell.
pub fn check_mist(table: &Table, values: &Values) -> Result<()> {
    if !has_grains(values) {
        return Err(table
            .error("from_speed", "is the speed of grains that raise mist: the scene needs `[grains]` too"));
    }
    let Some(params) = mist_params(values) else { return Ok(()) };
    params.validate().map_err(|error| match error {
        Error::Argument(what) => {
            let key = what.split(' ').next().unwrap_or_default();
            let key = MIST_KEYS
                .iter()
                .find(|declared_default| declared_default.name == key)
                .map_or("cell", |key| key.name);
            table.error(key, what.strip_prefix(key).unwrap_or(&what).trim_start())
        }
        other => other,
    })
}

/// The parameters of a scene's mist; `None` if it has none. A wind given as a grid is not included.
pub fn mist_params(values: &Values) -> Option<Params> {
    let mist = values.table("mist");
    let defaults = Params::for_cell(mist.find("cell")?);
    Some(Params {
        from_speed: mist.get("from_speed"),
        falling: mist.get("falling"),
        gravity: mist.get("gravity"),
        half_life: mist.get("half_life"),
        wind: mist.find("wind").unwrap_or_default(),
        turbulence: mist.get("turbulence"),
        turbulence_size: mist.find("turbulence_size").unwrap_or(defaults.turbulence_size),
        confinement: mist.get("confinement"),
        noise: mist.get("noise"),
        noise_size: mist.find("noise_size").unwrap_or(defaults.noise_size),
        seed: mist.get("seed"),
        ..defaults
    })
}

/// Whether a scene has mist.
pub fn has_mist(values: &Values) -> bool {
    values.number("mist.cell").is_some()
}
