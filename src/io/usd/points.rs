//! Points in USD: one `Points` prim, one file per frame.

use super::file::{Contents, File, Units, bounds, extent_value};
use super::layer::{Attribute, Layer, Prim, Value};
use super::primvars::unique;
use super::text::prim_name;
use crate::geometry::Vec3;
use crate::geometry::points::{self, Points, Values};

/// The points of one frame. `v`, or `velocity`, `velocities` or `vel`, becomes `velocities` (m/s), `id` becomes the prim's `ids`, and
/// `pscale` becomes `widths` (twice the value: USD uses diameters, m); every other attribute is a primvar of its name, with the
/// interpolation `constant` if all points share one value. Metres, Y up.
pub fn frame(name: &str, frame: i32, fps: f64, points: &Points) -> File {
    let mut root = Prim::def("Points", prim_name(name));
    let extent = extent(points);
    attributes(points, extent, frame).into_iter().for_each(|attribute| root.add(attribute));
    let contents = Contents { points: Some(points.count()), faces: None, extent };
    let contents = vec![(root.name.clone(), contents)];
    File { layer: Layer::new(root, Units::OWN.metadata_of_frame(frame, fps)), contents }
}

/// The attributes of points at a frame.
fn attributes(points: &Points, extent: Option<[[f32; 3]; 2]>, frame: i32) -> Vec<Attribute> {
    let positions = (0..points.count()).map(|point| points.position(point).cast::<f32>().into());
    let shown = if points.count() == 0 { "invisible" } else { "inherited" };
    let own = [Value::Token(shown.into()), extent_value(extent), Value::Vectors(positions.collect())];
    let (velocities, each) = (velocities(points), 0..points.count());
    let value = |attribute: &points::Attribute| match (&attribute.name[..], &attribute.values) {
        // USD requires one value per point for velocities and ids, and for widths wherever it computes an extent.
        (name, Values::Vector(column)) if Some(name) == velocities => {
            Value::Vectors(each.clone().map(|point| column.get(point)).collect())
        }
        ("id", Values::Long(column)) => Value::Longs(each.clone().map(|point| column.get(point)).collect()),
        ("id", Values::Int(column)) => {
            Value::Longs(each.clone().map(|point| column.get(point).into()).collect())
        }
        ("pscale", Values::Float(column)) => {
            Value::Floats(each.clone().map(|point| 2.0 * column.get(point)).collect())
        }
        (_, values) => primvar(values),
    };
    let values = own.into_iter().chain(points.attributes.iter().map(value));
    declared(points).into_iter().zip(values).map(|(attribute, value)| attribute.at(frame, value)).collect()
}

/// The attributes that [`frame`] writes for such points, without values: for the stage's prim whose value clips hold the points, and for
/// the clip manifest.
pub(in crate::io) fn declared(points: &Points) -> Vec<Attribute> {
    const OWN: [(&str, &str); 3] = [("token", "visibility"), ("float3[]", "extent"), ("point3f[]", "points")];
    let (mut taken, velocities) = (Vec::new(), velocities(points));
    let of = |attribute| declaration(attribute, velocities, &mut taken);
    OWN.map(Attribute::declared).into_iter().chain(points.attributes.iter().map(of)).collect()
}

/// Names of velocities, in lower case; of several such attributes the first in this list is used.
pub const VELOCITIES: [&str; 4] = ["v", "velocity", "velocities", "vel"];

/// The name of the attribute that holds the velocities.
fn velocities(points: &Points) -> Option<&str> {
    let named = |name: &&str| {
        let is_match = |attribute: &&points::Attribute| {
            matches!(attribute.values, Values::Vector(_)) && attribute.name.to_lowercase() == **name
        };
        points.attributes.iter().find(is_match)
    };
    VELOCITIES.iter().find_map(named).map(|attribute| &attribute.name[..])
}

fn declaration(
    points::Attribute { name, values }: &points::Attribute,
    velocities: Option<&str>,
    taken: &mut Vec<String>,
) -> Attribute {
    let interpolation = if values.is_uniform() { "constant" } else { "vertex" };
    match (&name[..], values) {
        (name, Values::Vector(_)) if Some(name) == velocities => Attribute::new("vector3f[]", "velocities"),
        ("id", Values::Long(_) | Values::Int(_)) => Attribute::new("int64[]", "ids"),
        ("pscale", Values::Float(_)) => Attribute::new("float[]", "widths").interpolated("vertex"),
        _ => {
            let class = match values {
                Values::Float(_) => "float[]",
                Values::Int(_) => "int[]",
                Values::Long(_) => "int64[]",
                Values::Bool(_) => "bool[]",
                Values::Vector(_) => "float3[]",
            };
            let name = format!("primvars:{}", unique(prim_name(name), taken));
            Attribute::new(class, name).interpolated(interpolation)
        }
    }
}

/// Values of a primvar.
fn primvar(values: &Values) -> Value {
    match values {
        Values::Float(column) => Value::Floats(column.stored().to_vec()),
        Values::Int(column) => Value::Ints(column.stored().to_vec()),
        Values::Long(column) => Value::Longs(column.stored().to_vec()),
        Values::Bool(column) => Value::Bools(column.stored().to_vec()),
        Values::Vector(column) => Value::Vectors(column.stored().to_vec()),
    }
}

/// The corners of a box around the points with their radii (m), in 32 bits as USD computes it.
fn extent(points: &Points) -> Option<[[f32; 3]; 2]> {
    let radius = |point: usize| match points.attribute("pscale") {
        Some(Values::Float(column)) => column.get(point),
        _ => 0.0,
    };
    let ends = |point: usize| {
        let (position, radius) = (points.position(point).cast::<f32>(), Vec3::repeat(radius(point)));
        (position - radius, position + radius)
    };
    bounds((0..points.count()).map(ends))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::geometry::points::Column;
    use crate::io::usd::Format;

    fn written(points: &Points) -> String {
        String::from_utf8(frame("drop", 3, 24.0, points).bytes(Format::Text).unwrap()).unwrap()
    }

    /// Classes and names of the declared attributes.
    fn names(points: &Points) -> Vec<String> {
        declared(points).into_iter().map(|one| format!("{} {}", one.class, one.name)).collect()
    }

    #[test]
    fn velocities_of_any_name_are_those_of_usd() {
        let named = |names: &[&str]| {
            let mut points = Points::at(1.0, &[DVec3::zeros()]).unwrap();
            for name in names {
                let values = Values::Vector(Column::Each(vec![[1.0, 2.0, 3.0]]));
                points.attributes.push(points::Attribute { name: (*name).into(), values });
            }
            points
        };
        for name in ["v", "vel", "Velocity", "velocities"] {
            let points = named(&[name]);
            let (text, declared) = (written(&points), names(&points));
            assert!(text.contains("vector3f[] velocities.timeSamples = { 3: [(1, 2, 3)] }"), "{text}");
            assert!(
                !text.contains("primvars") && declared.contains(&"vector3f[] velocities".into()),
                "{text}"
            );
        }
        // Only one of several is used.
        let points = named(&["vel", "v"]);
        let (text, declared) = (written(&points), names(&points));
        assert!(text.matches("vector3f[] velocities").count() == 1, "{text}");
        assert!(text.contains("float3[] primvars:vel"), "{text}");
        assert_eq!(declared[3..], ["float3[] primvars:vel", "vector3f[] velocities"]);
    }

    #[test]
    fn attributes_whose_names_become_one_stay_apart_and_numbers_are_those_of_usd() {
        let mut points = Points::at(1.0, &[DVec3::zeros(), DVec3::new(1.0, 0.0, 0.0)]).unwrap();
        for (name, numbers) in [("a.b", vec![0.5, f32::NAN]), ("a_b", vec![1.0, 2e20])] {
            let values = Values::Float(Column::Each(numbers));
            points.attributes.push(points::Attribute { name: name.into(), values });
        }
        let text = written(&points);
        for line in ["a_b.timeSamples = { 3: [0.5, nan] }", "a_b_2.timeSamples = { 3: [1, 2e20] }"] {
            assert!(text.contains(&format!("float[] primvars:{line}")), "{text}");
        }
        assert_eq!(names(&points)[3..], ["float[] primvars:a_b", "float[] primvars:a_b_2"]);
    }
}
