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
    sample(&mut out, "float3[] extent", None, &list(extent(points, pscale).iter(), |out, p| vector(out, *p)));
    sample(&mut out, "point3f[] points", None, &list(places.iter(), |out, p| vector(out, (*p).into())));
    for Attribute { name, values } in &points.attributes {
        let interpolation = Some(if values.is_uniform() { "constant" } else { "vertex" });
        match (name.as_str(), values) {
            // USD has one of each for all points.
            ("v", Values::Vector(column)) => {
                let each = (0..points.count()).map(|point| column.get(point));
                sample(&mut out, "vector3f[] velocities", None, &list(each, vector));
            }
            ("id", Values::Long(column)) => {
                let each = (0..points.count()).map(|point| column.get(point));
                sample(&mut out, "int64[] ids", None, &list(each, number));
            }
            ("id", Values::Int(column)) => {
                let each = (0..points.count()).map(|point| column.get(point));
                sample(&mut out, "int64[] ids", None, &list(each, number));
            }
            ("pscale", Values::Float(column)) => {
                let widths = list(column.stored().iter(), |out, radius| number(out, 2.0 * radius));
                sample(&mut out, "float[] widths", interpolation, &widths);
            }
            _ => {
                let (class, values) = primvar(values);
                let declared = format!("{class} primvars:{}", prim_name(name));
                sample(&mut out, &declared, interpolation, &values);
            }
        }
    }
    out.push_str("}\n");
    out
}

/// Type and values of a primvar.
fn primvar(values: &Values) -> (&'static str, String) {
    match values {
        Values::Float(column) => ("float[]", list(column.stored().iter(), number)),
        Values::Int(column) => ("int[]", list(column.stored().iter(), number)),
        Values::Long(column) => ("int64[]", list(column.stored().iter(), number)),
        Values::Bool(column) => {
            ("bool[]", list(column.stored().iter(), |out, yes| number(out, u8::from(*yes))))
        }
        Values::Vector(column) => ("float3[]", list(column.stored().iter(), |out, v| vector(out, *v))),
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
