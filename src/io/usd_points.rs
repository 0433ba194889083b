//! Points as USD text: one `Points` prim, one file a frame.

use std::fmt::Write;

use super::usd::{Units, list, prim_name, quoted};
use crate::base::points::{Attribute, Column, Points, Values};
use crate::base::{DVec3, Vec3};

/// The points of one frame. `v` becomes `velocities` (m/s), `id` the prim's `ids`, `pscale` `widths` (twice as much: USD has
/// diameters, m); every other attribute is a primvar of its name, with the interpolation `constant` where all points share
/// one value. Metres, Y up.
pub fn frame(name: &str, frame: i32, fps: f64, points: &Points) -> String {
    let name = prim_name(name);
    let mut out = format!(
        "#usda 1.0\n(\n    defaultPrim = {}\n    startTimeCode = {frame}\n    endTimeCode = {frame}\n    \
         timeCodesPerSecond = {fps}\n{})\n\ndef Points \"{name}\"\n{{\n",
        quoted(&name),
        Units::OWN.head()
    );
    let pscale = match points.attribute("pscale") {
        Some(Values::Float(column)) => Some(column),
        _ => None,
    };
    let sample = |out: &mut String, declared: &str, interpolation: Option<&str>, values: &str| {
        if let Some(word) = interpolation {
            let _ = write!(out, "    {declared} (\n        interpolation = \"{word}\"\n    )\n");
        }
        let _ = writeln!(out, "    {declared}.timeSamples = {{ {frame}: {values} }}");
    };
    let places: Vec<Vec3> = (0..points.count()).map(|point| points.position(point).cast()).collect();
    sample(&mut out, EXTENT, None, &list(extent(points, pscale).iter(), |out, p| vector(out, *p)));
    sample(&mut out, PLACES, None, &list(places.iter(), |out, p| vector(out, (*p).into())));
    for attribute in &points.attributes {
        let (declared, interpolation) = declaration(attribute);
        let each = 0..points.count();
        let values = match (&attribute.name[..], &attribute.values) {
            // USD has one of each for all points.
            ("v", Values::Vector(column)) => list(each.map(|point| column.get(point)), vector),
            ("id", Values::Long(column)) => list(each.map(|point| column.get(point)), number),
            ("id", Values::Int(column)) => list(each.map(|point| column.get(point)), number),
            ("pscale", Values::Float(column)) => {
                list(column.stored().iter(), |out, radius| number(out, 2.0 * radius))
            }
            (_, values) => primvar(values),
        };
        sample(&mut out, &declared, interpolation, &values);
    }
    out.push_str("}\n");
    out
}

/// What [`frame`] writes of points with these attributes, without values: for what is over them in a stage.
pub(super) fn declared(points: &Points, indent: &str) -> String {
    let mut out = format!("{indent}{EXTENT}\n{indent}{PLACES}\n");
    for (declared, interpolation) in points.attributes.iter().map(declaration) {
        let of = interpolation
            .map_or(String::new(), |word| format!(" (\n{indent}    interpolation = \"{word}\"\n{indent})"));
        let _ = writeln!(out, "{indent}{declared}{of}");
    }
    out
}

const EXTENT: &str = "float3[] extent";
const PLACES: &str = "point3f[] points";

/// Type and name of an attribute, and its interpolation where that is not known from the name.
fn declaration(attribute: &Attribute) -> (String, Option<&'static str>) {
    let Attribute { name, values } = attribute;
    let interpolation = Some(if values.is_uniform() { "constant" } else { "vertex" });
    match (&name[..], values) {
        ("v", Values::Vector(_)) => ("vector3f[] velocities".into(), None),
        ("id", Values::Long(_) | Values::Int(_)) => ("int64[] ids".into(), None),
        ("pscale", Values::Float(_)) => ("float[] widths".into(), interpolation),
        _ => {
            let class = match values {
                Values::Float(_) => "float[]",
                Values::Int(_) => "int[]",
                Values::Long(_) => "int64[]",
                Values::Bool(_) => "bool[]",
                Values::Vector(_) => "float3[]",
            };
            (format!("{class} primvars:{}", prim_name(name)), interpolation)
        }
    }
}

/// Values of a primvar.
fn primvar(values: &Values) -> String {
    match values {
        Values::Float(column) => list(column.stored().iter(), number),
        Values::Int(column) => list(column.stored().iter(), number),
        Values::Long(column) => list(column.stored().iter(), number),
        Values::Bool(column) => list(column.stored().iter(), |out, yes| number(out, u8::from(*yes))),
        Values::Vector(column) => list(column.stored().iter(), |out, v| vector(out, *v)),
    }
}

/// The corners of a box around the points with their radii (m).
fn extent(points: &Points, pscale: Option<&Column<f32>>) -> [[f32; 3]; 2] {
    let radius = pscale.map_or(0.0, |column| column.stored().iter().copied().fold(0.0, f32::max));
    let reach = DVec3::repeat(radius.into());
    let (low, high) =
        points.bounds().map_or_else(Default::default, |(low, high)| (low - reach, high + reach));
    [low.cast::<f32>().into(), high.cast::<f32>().into()]
}

fn number(out: &mut String, number: impl std::fmt::Display) {
    let _ = write!(out, "{number}");
}

fn vector(out: &mut String, [x, y, z]: [f32; 3]) {
    let _ = write!(out, "({x}, {y}, {z})");
}
