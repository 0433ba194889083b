//! Points as USD text: one `Points` prim, one file per frame.

use std::fmt::Write;

use super::primvars::unique;
use super::{Units, list, prim_name, primvars, quoted, vector};
use crate::geometry::mesh::attributes::Number;
use crate::geometry::points::{Attribute, Column, Points, Values};
use crate::geometry::{DVec3, Vec3};

/// The points of one frame. `v`, or `velocity`, `velocities` or `vel`, becomes `velocities` (m/s), `id` becomes the prim's `ids`, and
/// `pscale` becomes `widths` (twice the value: USD uses diameters, m); every other attribute is a primvar of its name, with the
/// interpolation `constant` if all points share one value. Metres, Y up.
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
    let positions: Vec<Vec3> = (0..points.count()).map(|point| points.position(point).cast()).collect();
    sample(&mut out, EXTENT, None, &list(extent(points, pscale).iter(), |out, p| vector(out, *p)));
    sample(&mut out, POSITIONS, None, &list(positions.iter(), |out, p| vector(out, (*p).into())));
    let velocities = velocities(points);
    for (attribute, (declared, interpolation)) in points.attributes.iter().zip(declarations(points)) {
        let each = 0..points.count();
        let values = match (&attribute.name[..], &attribute.values) {
            // USD requires one value per point for velocities and ids.
            (name, Values::Vector(column)) if Some(name) == velocities => {
                list(each.map(|point| column.get(point)), vector)
            }
            ("id", Values::Long(column)) => list(each.map(|point| column.get(point)), integer),
            ("id", Values::Int(column)) => list(each.map(|point| column.get(point)), integer),
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

/// The attribute declarations that [`frame`] writes for such points, without values: for the stage's prim whose value clips hold the
/// points, and for the clip manifest.
pub(in crate::io) fn declared(points: &Points, indent: &str) -> String {
    let mut out = format!("{indent}{EXTENT}\n{indent}{POSITIONS}\n");
    for (declared, interpolation) in declarations(points) {
        let of = interpolation
            .map_or(String::new(), |word| format!(" (\n{indent}    interpolation = \"{word}\"\n{indent})"));
        let _ = writeln!(out, "{indent}{declared}{of}");
    }
    out
}

const EXTENT: &str = "float3[] extent";
const POSITIONS: &str = "point3f[] points";

/// Type and name of each attribute, and its interpolation if the name does not imply it; all names are unique.
fn declarations(points: &Points) -> Vec<(String, Option<&'static str>)> {
    let (mut taken, velocities) = (Vec::new(), velocities(points));
    points.attributes.iter().map(|attribute| declaration(attribute, velocities, &mut taken)).collect()
}

/// Names of velocities, in lower case; of several such attributes the first in this list is used.
pub const VELOCITIES: [&str; 4] = ["v", "velocity", "velocities", "vel"];

/// The name of the attribute that holds the velocities.
fn velocities(points: &Points) -> Option<&str> {
    let named = |name: &&str| {
        let is_match = |attribute: &&Attribute| {
            matches!(attribute.values, Values::Vector(_)) && attribute.name.to_lowercase() == **name
        };
        points.attributes.iter().find(is_match)
    };
    VELOCITIES.iter().find_map(named).map(|attribute| &attribute.name[..])
}

fn declaration(
    attribute: &Attribute,
    velocities: Option<&str>,
    taken: &mut Vec<String>,
) -> (String, Option<&'static str>) {
    let Attribute { name, values } = attribute;
    let interpolation = Some(if values.is_uniform() { "constant" } else { "vertex" });
    match (&name[..], values) {
        (name, Values::Vector(_)) if Some(name) == velocities => ("vector3f[] velocities".into(), None),
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
            (format!("{class} primvars:{}", unique(prim_name(name), taken)), interpolation)
        }
    }
}

/// Values of a primvar.
fn primvar(values: &Values) -> String {
    match values {
        Values::Float(column) => list(column.stored().iter(), |out, value| number(out, *value)),
        Values::Int(column) => list(column.stored().iter(), integer),
        Values::Long(column) => list(column.stored().iter(), integer),
        Values::Bool(column) => list(column.stored().iter(), |out, yes| integer(out, u8::from(*yes))),
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

fn integer(out: &mut String, number: impl std::fmt::Display) {
    let _ = write!(out, "{number}");
}

fn number(out: &mut String, value: f32) {
    primvars::number(out, Number::F32, value.into());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_of_any_name_are_those_of_usd() {
        let names = |names: &[&str]| {
            let mut points = Points::at(1.0, &[DVec3::zeros()]).unwrap();
            for name in names {
                let values = Values::Vector(Column::Each(vec![[1.0, 2.0, 3.0]]));
                points.attributes.push(Attribute { name: (*name).into(), values });
            }
            (frame("drop", 3, 24.0, &points), declared(&points, ""))
        };
        for name in ["v", "vel", "Velocity", "velocities"] {
            let (text, over) = names(&[name]);
            assert!(text.contains("vector3f[] velocities.timeSamples = { 3: [(1, 2, 3)] }"), "{text}");
            assert!(!text.contains("primvars") && over.contains("vector3f[] velocities\n"), "{text}");
        }
        // Only one of several is used.
        let (text, over) = names(&["vel", "v"]);
        for text in [text, over] {
            assert!(text.matches("vector3f[] velocities").count() == 1, "{text}");
            assert!(text.contains("float3[] primvars:vel"), "{text}");
        }
    }

    #[test]
    fn attributes_whose_names_become_one_stay_apart_and_numbers_are_those_of_usd() {
        let mut points = Points::at(1.0, &[DVec3::zeros(), DVec3::new(1.0, 0.0, 0.0)]).unwrap();
        for (name, numbers) in [("a.b", vec![0.5, f32::NAN]), ("a_b", vec![1.0, 2e20])] {
            let values = Values::Float(Column::Each(numbers));
            points.attributes.push(Attribute { name: name.into(), values });
        }
        let text = frame("drop", 3, 24.0, &points);
        for line in ["a_b.timeSamples = { 3: [0.5, nan] }", "a_b_2.timeSamples = { 3: [1, 2e20] }"] {
            assert!(text.contains(&format!("float[] primvars:{line}")), "{text}");
        }
        let over = declared(&points, "");
        assert!(over.contains("primvars:a_b (") && over.contains("primvars:a_b_2 ("), "{over}");
    }
}
