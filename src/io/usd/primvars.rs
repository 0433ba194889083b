//! Arrays of a mesh in USD: one primvar for each, or for three that are the components of a vector or of a colour.
//!
//! `red`, `green` and `blue`, or `Cdx`, `Cdy` and `Cdz` (Houdini's `Cd`), become `displayColor`, USD's name for the colours of a mesh, and
//! `alpha` becomes `displayOpacity`: with the values of the file, bytes divided by 255. `NAMEx`, `NAMEy` and `NAMEz` become the vector
//! `NAME`.

use super::layer::{Attribute, Value};
use super::text::prim_name;
use crate::geometry::mesh::attributes::{MeshArray, Number, On};

/// A primvar without its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Primvar {
    /// Type: `float[]`.
    class: &'static str,
    /// Name, with its namespace: `primvars:mask`.
    name: String,
    interpolation: &'static str,
}

impl Primvar {
    /// Its attribute, without a value.
    pub(in crate::io) fn attribute(&self) -> Attribute {
        Attribute::new(self.class, &*self.name).interpolated(self.interpolation)
    }
}

/// The primvars of a mesh with these arrays, whose values do not matter.
pub fn primvars(arrays: &[&MeshArray]) -> Vec<Primvar> {
    grouped(arrays).into_iter().map(|group| group.primvar).collect()
}

/// The primvars of a mesh at a frame, without the values of the faces that are not in `faces`. Arrays of corners have three values for
/// each triangle.
pub(in crate::io) fn attributes(arrays: &[&MeshArray], faces: Faces<'_>, frame: i32) -> Vec<Attribute> {
    let attribute = |group: Group<'_>| group.primvar.attribute().at(frame, group.values(faces));
    grouped(arrays).into_iter().map(attribute).collect()
}

/// A primvar with the arrays that it is made of: one or three.
struct Group<'a> {
    primvar: Primvar,
    parts: Vec<&'a MeshArray>,
    /// Whether its values are fractions of 1, which files may store as bytes.
    is_fraction: bool,
}

impl Group<'_> {
    fn values(&self, faces: Faces<'_>) -> Value {
        let part = |array: &MeshArray| -> Vec<f64> {
            let whole = if array.number == Number::U8 { 255.0 } else { 1.0 };
            let mut values = match array.on {
                On::Vertices => array.values.clone(),
                On::Faces => faces.of_faces(&array.values),
                On::Corners => faces.of_corners(&array.values),
            };
            if self.is_fraction {
                values.iter_mut().for_each(|value| *value = f64::from(*value as f32 / whole));
            }
            values
        };
        let parts: Vec<Vec<f64>> = self.parts.iter().map(|array| part(array)).collect();
        match &parts[..] {
            [x, y, z] => {
                let vectors = x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z]);
                match self.primvar.class {
                    "double3[]" => Value::DoubleVectors(vectors.collect()),
                    "int3[]" => {
                        Value::IntVectors(vectors.map(|parts| parts.map(|part| part as i32)).collect())
                    }
                    _ => Value::Vectors(vectors.map(|parts| parts.map(|part| part as f32)).collect()),
                }
            }
            parts => {
                let values = parts.iter().flatten();
                match self.primvar.class {
                    "double[]" => Value::Doubles(values.copied().collect()),
                    "uint[]" => Value::Uints(values.map(|value| *value as u32).collect()),
                    "int[]" => Value::Ints(values.map(|value| *value as i32).collect()),
                    _ => Value::Floats(values.map(|value| *value as f32).collect()),
                }
            }
        }
    }
}

/// Which faces of a mesh are written.
#[derive(Debug, Clone, Copy)]
pub(in crate::io) enum Faces<'a> {
    All,
    Only(&'a [usize]),
}

impl Faces<'_> {
    /// Those of some values, one for each face, that belong to these faces.
    pub fn of_faces<T: Copy>(self, values: &[T]) -> Vec<T> {
        match self {
            Self::All => values.to_vec(),
            Self::Only(kept) => kept.iter().map(|face| values[*face]).collect(),
        }
    }

    /// As [`Faces::of_faces`], of values for the three corners of each face.
    pub fn of_corners<T: Copy>(self, values: &[T]) -> Vec<T> {
        match self {
            Self::All => values.to_vec(),
            Self::Only(kept) => {
                kept.iter().flat_map(|face| &values[3 * face..3 * face + 3]).copied().collect()
            }
        }
    }
}

/// The primvar planned for some arrays.
struct Draft {
    name: String,
    /// Type of a value.
    class: &'static str,
    /// Indices of the arrays.
    members: Vec<usize>,
    is_fraction: bool,
}

/// The vector or colour that three arrays form.
pub(in crate::io) struct Vector {
    /// Names of its components.
    pub parts: [String; 3],
    /// Name of its primvar.
    pub name: String,
    /// Whether it is a colour.
    pub is_colour: bool,
}

const COLOUR: &str = "displayColor";
const OPACITY: &str = "displayOpacity";
/// Names with a meaning for renderers, which an array of single numbers must not take.
const TAKEN: [&str; 5] = [COLOUR, "points", "normals", "velocities", "accelerations"];

/// Each array once, ordered by the first component of each group.
fn grouped<'a>(arrays: &[&'a MeshArray]) -> Vec<Group<'a>> {
    let mut out = Vec::new();
    let mut written = vec![false; arrays.len()];
    // Texture coordinates and normals have these names.
    let mut taken = vec!["st".to_string(), "normals".to_string()];
    for (at, array) in arrays.iter().enumerate() {
        if written[at] {
            continue;
        }
        let draft = vector_at(arrays, &written, at).unwrap_or_else(|| single(array, at));
        draft.members.iter().for_each(|member| written[*member] = true);
        let name = format!("primvars:{}", unique(draft.name, &mut taken));
        let primvar = Primvar { class: draft.class, name, interpolation: interpolation(array.on) };
        let parts = draft.members.iter().map(|member| arrays[*member]).collect();
        out.push(Group { primvar, parts, is_fraction: draft.is_fraction });
    }
    out
}

/// An array that is not part of a vector or colour.
fn single(array: &MeshArray, at: usize) -> Draft {
    let members = vec![at];
    if array.name == "alpha" && can_be_colours(array.number) {
        return Draft { name: OPACITY.into(), class: "float[]", members, is_fraction: true };
    }
    let mut name = prim_name(&array.name);
    if TAKEN.contains(&name.as_str()) {
        name.push('_');
    }
    Draft { name, class: scalar(array.number), members, is_fraction: false }
}

/// The vector or colour that an array is a component of, if all its components exist and are of one kind.
fn vector_at(arrays: &[&MeshArray], written: &[bool], at: usize) -> Option<Draft> {
    let array = arrays[at];
    let Vector { parts, name, is_colour } = vector_of(&array.name)?;
    let class = match is_colour {
        true => can_be_colours(array.number).then_some("color3f[]"),
        false => triple(array.number),
    }?;
    let members = members_of(arrays, written, array, &parts);
    Some(Draft { name, class, members: members?, is_fraction: is_colour })
}

/// The indices of the arrays that are the components of a vector, if all of them are there, of the kind of `first` and not used yet.
pub(in crate::io) fn members_of(
    arrays: &[&MeshArray],
    used: &[bool],
    first: &MeshArray,
    parts: &[String; 3],
) -> Option<Vec<usize>> {
    let member = |part: &String| {
        let is_match =
            |other: &&MeshArray| other.name == *part && (other.on, other.number) == (first.on, first.number);
        arrays.iter().position(is_match).filter(|found| !used[*found])
    };
    parts.iter().map(member).collect()
}

/// The vector or colour that an array of this name may be a component of.
pub(in crate::io) fn vector_of(name: &str) -> Option<Vector> {
    const COLOURS: [&str; 3] = ["red", "green", "blue"];
    if COLOURS.contains(&name) {
        let parts = COLOURS.map(String::from);
        return Some(Vector { parts, name: COLOUR.into(), is_colour: true });
    }
    let stem = name.strip_suffix(['x', 'y', 'z']).filter(|stem| !stem.is_empty())?;
    let parts = ["x", "y", "z"].map(|axis| format!("{stem}{axis}"));
    let is_colour = stem == "Cd";
    let name = if is_colour { COLOUR.into() } else { prim_name(stem) };
    Some(Vector { parts, name, is_colour })
}

/// A name that no other primvar of the mesh has: the given name, with a number if it is already taken. The result counts as taken from then
/// on.
pub(in crate::io) fn unique(name: String, taken: &mut Vec<String>) -> String {
    let mut own = name.clone();
    let mut number = 2;
    while taken.contains(&own) {
        own = format!("{name}_{number}");
        number += 1;
    }
    taken.push(own.clone());
    own
}

fn interpolation(on: On) -> &'static str {
    match on {
        On::Vertices => "vertex",
        On::Corners => "faceVarying",
        On::Faces => "uniform",
    }
}

/// Whether numbers of this type can be colours.
fn can_be_colours(number: Number) -> bool {
    number.is_float() || number == Number::U8
}

fn scalar(number: Number) -> &'static str {
    match number {
        Number::F32 => "float[]",
        Number::F64 => "double[]",
        Number::U32 => "uint[]",
        // Few programs read smaller types.
        Number::I8 | Number::U8 | Number::I16 | Number::U16 | Number::I32 => "int[]",
    }
}

/// The type of a vector; USD has no vectors of unsigned integers.
fn triple(number: Number) -> Option<&'static str> {
    match number {
        Number::F32 => Some("float3[]"),
        Number::F64 => Some("double3[]"),
        Number::U32 => None,
        Number::I8 | Number::U8 | Number::I16 | Number::U16 | Number::I32 => Some("int3[]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(name: &str, on: On, number: Number, values: &[f64]) -> MeshArray {
        MeshArray { name: name.into(), on, number, values: values.to_vec() }
    }

    fn declared(arrays: &[MeshArray]) -> Vec<String> {
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        primvars(&arrays)
            .into_iter()
            .map(|one| format!("{} {} {}", one.class, one.name, one.interpolation))
            .collect()
    }

    #[test]
    fn arrays_are_grouped_by_their_names_and_no_name_is_there_twice() {
        let one = |name: &str, on, number| array(name, on, number, &[]);
        let arrays = [
            one("velz", On::Vertices, Number::F32),
            one("velx", On::Vertices, Number::F32),
            one("red", On::Vertices, Number::U8),
            one("vely", On::Vertices, Number::F32),
            one("green", On::Vertices, Number::U8),
            one("blue", On::Vertices, Number::U8),
            one("alpha", On::Vertices, Number::U8),
            one("red", On::Faces, Number::U8),
            one("wet spot", On::Corners, Number::F64),
            one("wet.spot", On::Faces, Number::U32),
            one("st", On::Vertices, Number::I16),
            one("max", On::Vertices, Number::F32),
        ];
        let want = [
            "float3[] primvars:vel vertex",
            "color3f[] primvars:displayColor vertex",
            "float[] primvars:displayOpacity vertex",
            "int[] primvars:red uniform",
            "double[] primvars:wet_spot faceVarying",
            "uint[] primvars:wet_spot_2 uniform",
            "int[] primvars:st_2 vertex",
            "float[] primvars:max vertex",
        ];
        assert_eq!(declared(&arrays), want);
    }

    #[test]
    fn parts_of_different_kinds_stay_apart() {
        let one = |name: &str, on, number| array(name, on, number, &[]);
        let arrays = [
            one("ax", On::Vertices, Number::F32),
            one("ay", On::Faces, Number::F32),
            one("az", On::Vertices, Number::F32),
            one("red", On::Vertices, Number::I32),
            one("green", On::Vertices, Number::I32),
            one("blue", On::Vertices, Number::I32),
            one("Cdx", On::Vertices, Number::F32),
            one("Cdy", On::Vertices, Number::F32),
            one("Cdz", On::Vertices, Number::F32),
            one("Cdx", On::Vertices, Number::F32),
        ];
        let want = [
            "float[] primvars:ax vertex",
            "float[] primvars:ay uniform",
            "float[] primvars:az vertex",
            "int[] primvars:red vertex",
            "int[] primvars:green vertex",
            "int[] primvars:blue vertex",
            "color3f[] primvars:displayColor vertex",
            "float[] primvars:Cdx vertex",
        ];
        assert_eq!(declared(&arrays), want);
    }

    #[test]
    fn values_are_those_of_the_arrays() {
        let arrays = [
            array("delta", On::Vertices, Number::F32, &[0.1f32.into(), f64::NAN, f64::NEG_INFINITY]),
            array("id", On::Faces, Number::U32, &[4_294_967_295.0, 7.0]),
            array("far", On::Faces, Number::F64, &[-1e300, 0.5]),
            array("red", On::Vertices, Number::U8, &[255.0, 0.0, 51.0]),
            array("green", On::Vertices, Number::U8, &[0.0, 0.0, 51.0]),
            array("blue", On::Vertices, Number::U8, &[0.0, 255.0, 51.0]),
        ];
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        let values = |faces| -> Vec<Value> {
            attributes(&arrays, faces, 7)
                .into_iter()
                .flat_map(|one| one.samples)
                .map(|(_, value)| value)
                .collect()
        };
        let [Value::Floats(delta), rest @ ..] = &values(Faces::All)[..] else { panic!() };
        assert!(delta[0] == 0.1 && delta[1].is_nan() && delta[2] == f32::NEG_INFINITY, "{delta:?}");
        let colours = Value::Vectors(vec![[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.2, 0.2, 0.2]]);
        assert_eq!(
            rest,
            [Value::Uints(vec![u32::MAX, 7]), Value::Doubles(vec![-1e300, 0.5]), colours.clone()]
        );
        let [_, rest @ ..] = &values(Faces::Only(&[1]))[..] else { panic!() };
        assert_eq!(rest, [Value::Uints(vec![7]), Value::Doubles(vec![0.5]), colours]);
    }
}
