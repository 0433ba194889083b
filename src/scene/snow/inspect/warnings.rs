//! Settings of a scene's grains that have no effect, or probably not the intended one.

use crate::error::Result;
use crate::geometry::shape::bounds;
use crate::scene::schema::{Value, Values, rounded};
use crate::scene::{Object, Scene};
use crate::sweep::Body;

/// Warnings about keys that another one replaces, unless they have their defaults.
pub(in crate::scene::snow) fn replaced(values: &Values) -> Vec<String> {
    let number = |name: &str| values.number(&format!("grains.{name}"));
    let pairs = [("friction", "repose_angle_deg"), ("attraction", "stands")];
    let given = pairs.into_iter().filter_map(|(key, other)| Some((key, number(key)?, other, number(other)?)));
    given
        .filter(|(_, _, other, value)| {
            values.declared_default("grains", other) != Some(Value::Number(*value))
        })
        .map(|(key, own, other, value)| {
            format!("grains.{key} = {own} replaces grains.{other} = {value}, which has no effect")
        })
        .collect()
}

/// The warning about an object that removes snow and is smaller than a grain at a time (s).
pub(in crate::scene::snow) fn too_small(
    scene: &Scene,
    object: &Object,
    body: &Body,
    time: f64,
) -> Result<Option<String>> {
    let Some(radius) = scene.values.number("grains.radius").filter(|_| object.role.removes()) else {
        return Ok(None);
    };
    let mut pose = Vec::new();
    body.motion().pose(time, &mut pose)?;
    let (low, high) = bounds(&pose);
    let (size, diameter) = ((high - low).max(), 2.0 * radius);
    Ok((size < diameter).then(|| {
        format!(
            "{} is {} m large, smaller than a grain of {} m: the snow that it removes makes no grains; choose a smaller grains.radius",
            body.name().unwrap_or("an object"),
            rounded(size),
            rounded(diameter)
        )
    }))
}
