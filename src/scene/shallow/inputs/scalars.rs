//! Scalars that the liquid of a scene carries: dyes, ages, and decaying quantities.

use crate::error::Result;
use crate::scene::Scene;
use crate::scene::schema::{Table, Value, Values};
use crate::scene::shallow::{ML, Shallow, TimedFlowPoint};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::{self, Law, Scalar, Thickening};

/// Names that arrays of the surface already have in some file format.
const RESERVED_NAMES: [&str; 13] =
    ["x", "y", "z", "v", "vx", "vy", "vz", "depth", "layer", "alpha", "falling", "points", "velocities"];

/// A scalar of a scene's liquid.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneScalar {
    /// Name, law and range.
    pub scalar: Scalar,
    /// Concentration in liquid that does not specify one.
    pub start: f64,
}

impl SceneScalar {
    /// The scalars of a scene, in the file's order.
    pub(in crate::scene::shallow) fn all_of(values: &Values) -> Vec<Self> {
        (0..values.count("scalar")).map(|index| Self::of(values, index)).collect()
    }

    fn of(values: &Values, index: usize) -> Self {
        let own = values.element("scalar", index);
        let law = match (own.text("law"), own.find("half_life")) {
            (Some("decays"), Some(half_life)) => Law::Decays(half_life),
            (Some("ages"), _) => Law::Ages,
            _ => Law::Dye,
        };
        let scalar = Scalar { name: own.get("name"), law, range: own.get("range") };
        Self { scalar, start: own.get("start") }
    }
}

/// How the first scalar that thickens the liquid does so.
pub(in crate::scene::shallow) fn thickening(values: &Values) -> Option<Thickening> {
    (0..values.count("scalar")).find_map(|scalar| {
        let own = values.element("scalar", scalar);
        let (times, to) = (own.find("thickens_times")?, own.find("thickens_to")?);
        Some(Thickening { scalar, from: own.get("thickens_from"), to, times })
    })
}

/// Index of the first scalar that stains.
pub(in crate::scene::shallow) fn staining(values: &Values) -> Option<usize> {
    (0..values.count("scalar")).find(|index| values.element("scalar", *index).get("stains"))
}

/// Concentrations of all scalars in the liquid of a pour or a source: by its `carries`, or else the scalar's `start`.
pub(in crate::scene::shallow) fn concentrations(values: &Values, table: &str, index: usize) -> Vec<f64> {
    let named = values.element(table, index).value("carries").and_then(Value::named);
    let own = |carried: SceneScalar| {
        named.and_then(|named| named.get(&carried.scalar.name)).copied().unwrap_or(carried.start)
    };
    SceneScalar::all_of(values).into_iter().map(own).collect()
}

/// Checks the keys of a `[[scalar]]` in combination; earlier scalars have been read.
///
/// # Errors
/// A name that no array can have, or that is taken; a key that its law does not have, or a missing one; one scalar too many.
pub(in crate::scene::shallow) fn check(index: usize, table: &Table, values: &Values) -> Result<()> {
    let all = SceneScalar::all_of(values);
    let SceneScalar { scalar, start } = &all[index];
    let name = &*scalar.name;
    if index >= MAX_SCALARS {
        return Err(
            table.error("name", format!("is one too many: a liquid carries {MAX_SCALARS} scalars at most"))
        );
    }
    let is_word = |name: &str| {
        let is_letter = |byte: u8| byte.is_ascii_alphabetic() || byte == b'_';
        name.bytes().next().is_some_and(is_letter)
            && name.bytes().all(|byte| is_letter(byte) || byte.is_ascii_digit())
    };
    if !is_word(name) {
        return Err(table.error("name", "must consist of letters, digits and _, and begin with no digit"));
    }
    if RESERVED_NAMES.contains(&name) {
        return Err(
            table.error("name", format!("must not be \"{name}\": the surface has an array of that name"))
        );
    }
    if all[..index].iter().any(|other| other.scalar.name == scalar.name) {
        return Err(table.error("name", format!("must not be \"{name}\": another scalar has that name")));
    }
    let own = values.element("scalar", index);
    match (own.text("law"), table.has("half_life")) {
        (Some("decays"), false) => {
            return Err(table.error("half_life", "is missing: a scalar that decays needs one"));
        }
        (Some("dye" | "ages"), true) => {
            return Err(table.error("half_life", "is for law = \"decays\": leave it out"));
        }
        _ => {}
    }
    if start.abs() > scalar.range {
        return Err(table.error("start", format!("must lie within -{0} to {0}, its range", scalar.range)));
    }
    if own.get("stains") {
        if !values.table("shallow").get::<bool>("stains") {
            return Err(table.error("stains", "must be false where shallow.stains is"));
        }
        if staining(values).is_some_and(|first| first < index) {
            return Err(table.error("stains", "must be false: another scalar stains"));
        }
    }
    check_thickening(index, table, values, scalar.range)
}

/// Checks how a scalar thickens the liquid; earlier scalars have been read.
///
/// # Errors
/// A key without the others; a concentration out of range; a second scalar that thickens, or a liquid that cannot be thickened.
fn check_thickening(index: usize, table: &Table, values: &Values, range: f64) -> Result<()> {
    let own = values.element("scalar", index);
    if own.value("thickens_times").is_none() {
        return match table.has("thickens_to") {
            true => Err(table.error("thickens_to", "is for a scalar with `thickens_times`: leave it out")),
            false => Ok(()),
        };
    }
    let Some(to) = own.find("thickens_to") else {
        return Err(table.error("thickens_to", "is missing: a scalar with `thickens_times` needs one"));
    };
    let from: f64 = own.get("thickens_from");
    for (name, concentration) in [("thickens_from", from), ("thickens_to", to)] {
        if concentration.abs() > range {
            return Err(table.error(name, format!("must lie within -{range} to {range}, its range")));
        }
    }
    if from == to {
        return Err(table.error("thickens_to", format!("must not be `thickens_from`, {from}")));
    }
    if thickening(values).is_some_and(|law| law.scalar < index) {
        return Err(table.error("thickens_times", "is one too many: another scalar thickens the liquid"));
    }
    if crate::scene::shallow::params(values).liquid.viscosity == 0.0 {
        return Err(table.error("thickens_times", "must be left out where shallow.viscosity is 0"));
    }
    Ok(())
}

/// Checks the scalars of a pour or a source.
///
/// # Errors
/// A name that no scalar has; a concentration out of range.
pub(in crate::scene::shallow) fn check_concentrations(
    name: &str,
    index: usize,
    table: &Table,
    values: &Values,
) -> Result<()> {
    let Some(named) = values.element(name, index).value("carries").and_then(Value::named) else {
        return Ok(());
    };
    let all = SceneScalar::all_of(values);
    for (name, concentration) in named {
        let Some(SceneScalar { scalar, .. }) = all.iter().find(|carried| carried.scalar.name == *name) else {
            return Err(table.error("carries", format!("names `{name}`, which is the name of no [[scalar]]")));
        };
        if concentration.abs() > scalar.range {
            let what = format!(
                "has {name} = {concentration}, which is not within -{0} to {0}, its range",
                scalar.range
            );
            return Err(table.error("carries", what));
        }
    }
    Ok(())
}

impl Shallow {
    /// Sets the scalars of a dry liquid.
    ///
    /// # Errors
    /// Errors of the library, with the scene's name.
    pub(in crate::scene::shallow) fn set_scalars(
        &self,
        scene: &Scene,
        liquid: &mut shallow::Shallow,
    ) -> Result<()> {
        let scalars: Vec<Scalar> = self.scalars.iter().map(|carried| carried.scalar.clone()).collect();
        if scalars.is_empty() {
            return Ok(());
        }
        liquid.set_scalars(&scalars).map_err(|error| error.in_file_at(&scene.path, "scalar.1: "))
    }

    /// Sets the scalars of sources, once the sources are set.
    ///
    /// # Errors
    /// None for a scene that was read.
    pub(in crate::scene::shallow) fn set_source_scalars(&self, liquid: &mut shallow::Shallow) -> Result<()> {
        let is_source =
            |(_, point): &(usize, &TimedFlowPoint)| point.name.0 == "source" && !point.carries.is_empty();
        let mut sources = self.points.iter().enumerate().filter(is_source);
        sources.try_for_each(|(index, point)| liquid.set_sourced(index, &point.carries))
    }

    /// Concentrations of liquid that does not specify them.
    pub(in crate::scene::shallow) fn start(&self) -> Vec<f64> {
        self.scalars.iter().map(|carried| carried.start).collect()
    }
}

/// The amounts that the balances of liquid and scalars share, as fields of a JSON object in ml.
macro_rules! amounts_in_ml {
    ($balance:expr) => {{
        let balance = &$balance;
        let amounts = [
            ("inside_ml", balance.inside),
            ("poured_ml", balance.poured),
            ("sourced_ml", balance.sourced),
            ("drained_ml", balance.drained),
            ("absorbed_ml", balance.absorbed),
            ("lost_ml", balance.lost),
            ("gained_ml", balance.gained),
            ("falling_ml", balance.falling),
        ];
        let fields = amounts.map(|(name, amount)| (name.to_string(), serde_json::Value::from(amount / ML)));
        serde_json::Map::from_iter(fields)
    }};
}
pub(in crate::scene::shallow) use amounts_in_ml;

/// The balance of each scalar, by name: concentration x volume (the scalar's unit x ml).
pub(in crate::scene::shallow) fn balances(
    liquid: &shallow::Shallow,
) -> Result<serde_json::Map<String, serde_json::Value>> {
    let scalars = liquid.scalars().iter().enumerate();
    scalars
        .map(|(index, scalar)| {
            let balance = liquid.scalar_balance(index)?;
            let mut fields = amounts_in_ml!(balance);
            fields.insert("held_ml".into(), (balance.held / ML).into());
            fields.insert("grown_ml".into(), (balance.grown / ML).into());
            fields.insert("dried_ml".into(), (balance.dried / ML).into());
            fields.insert("missing".into(), (balance.error as f64).into());
            Ok((scalar.name.clone(), fields.into()))
        })
        .collect()
}
