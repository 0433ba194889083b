//! Arrays of a mesh as USD text: one primvar for each, or for three that are the components of a vector or of a colour.
//!
//! `red`, `green` and `blue`, or `Cdx`, `Cdy` and `Cdz` (Houdini's `Cd`), become `displayColor`, USD's name for the colours of a mesh, and
//! `alpha` becomes `displayOpacity`: with the values of the file, bytes divided by 255. `NAMEx`, `NAMEy` and `NAMEz` become the vector
//! `NAME`.

use std::fmt::Write;

use super::{list, prim_name};
use crate::geometry::mesh::attributes::{MeshArray, Number, On};

/// A primvar without its values: its name and its interpolation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Primvar {
    /// Type and name: `float[] primvars:mask`.
    declared: String,
    interpolation: &'static str,
}

/// The primvars of a mesh with these arrays, whose values do not matter.
pub fn primvars(arrays: &[&MeshArray]) -> Vec<Primvar> {
    grouped(arrays).into_iter().map(|group| group.primvar).collect()
}

/// Declares the interpolation of primvars whose values are elsewhere.
pub(in crate::io) fn declare(out: &mut String, indent: &str, primvars: &[Primvar]) {
    for Primvar { declared, interpolation } in primvars {
        let _ =
            write!(out, "{indent}{declared} (\n{indent}    interpolation = \"{interpolation}\"\n{indent})\n");
    }
}

/// Writes the primvars of one frame; arrays of corners have three values for each triangle.
pub(in crate::io) fn write(out: &mut String, indent: &str, frame: i32, arrays: &[&MeshArray]) {
    for Group { primvar, parts, is_fraction } in grouped(arrays) {
        declare(out, indent, std::slice::from_ref(&primvar));
        let number = |out: &mut String, array: &MeshArray, at: usize| {
            if is_fraction { fraction(out, array, at) } else { number(out, array.number, array.values[at]) }
        };
        let count = parts.iter().map(|part| part.values.len()).min().unwrap_or(0);
        let values = list(0..count, |out, at| match parts[..] {
            [x, y, z] => {
                let mut before = "(";
                for part in [x, y, z] {
                    out.push_str(before);
                    number(out, part, at);
                    before = ", ";
                }
                out.push(')');
            }
            _ => parts.iter().for_each(|part| number(out, part, at)),
        });
        let _ = writeln!(out, "{indent}{}.timeSamples = {{ {frame}: {values} }}", primvar.declared);
    }
}

/// A primvar with the arrays that it is made of: one or three.
struct Group<'a> {
    primvar: Primvar,
    parts: Vec<&'a MeshArray>,
    /// Whether its values are fractions of 1, which files may store as bytes.
    is_fraction: bool,
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

/// The vector that three arrays form.
struct Vector {
    parts: [String; 3],
    name: String,
    is_colour: bool,
}

const COLOUR: &str = "displayColor";
const OPACITY: &str = "displayOpacity";
/// Names with a meaning for renderers, which an array of single numbers must not take.
const TAKEN: [&str; 5] = [COLOUR, "points", "normals", "velocities", "accelerations"];

/// Each array once, ordered by the first component of each group.
fn grouped<'a>(arrays: &[&'a MeshArray]) -> Vec<Group<'a>> {
    let mut out = Vec::new();
    let mut written = vec![false; arrays.len()];
    // Texture coordinates already use this name.
    let mut taken = vec!["st".to_string()];
    for (at, array) in arrays.iter().enumerate() {
        if written[at] {
            continue;
        }
        let draft = vector_at(arrays, &written, at).unwrap_or_else(|| single(array, at));
        draft.members.iter().for_each(|member| written[*member] = true);
        let declared = format!("{}[] primvars:{}", draft.class, unique(draft.name, &mut taken));
        let primvar = Primvar { declared, interpolation: interpolation(array.on) };
        let parts = draft.members.iter().map(|member| arrays[*member]).collect();
        out.push(Group { primvar, parts, is_fraction: draft.is_fraction });
    }
    out
}

/// An array that is not part of a vector or colour.
fn single(array: &MeshArray, at: usize) -> Draft {
    let members = vec![at];
    if array.name == "alpha" && can_be_colours(array.number) {
        return Draft { name: OPACITY.into(), class: "float", members, is_fraction: true };
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
        true => can_be_colours(array.number).then_some("color3f"),
        false => triple(array.number),
    }?;
    let members: Option<Vec<usize>> = parts
        .iter()
        .map(|part| {
            let is_match = |other: &&MeshArray| {
                other.name == *part && (other.on, other.number) == (array.on, array.number)
            };
            arrays.iter().position(is_match).filter(|found| !written[*found])
        })
        .collect();
    Some(Draft { name, class, members: members?, is_fraction: is_colour })
}

/// The vector or colour that an array of this name may be a component of.
fn vector_of(name: &str) -> Option<Vector> {
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
        Number::F32 => "float",
        Number::F64 => "double",
        Number::U32 => "uint",
        // Few programs read smaller types.
        Number::I8 | Number::U8 | Number::I16 | Number::U16 | Number::I32 => "int",
    }
}

/// The type of a vector; USD has no vectors of unsigned integers.
fn triple(number: Number) -> Option<&'static str> {
    match number {
        Number::F32 => Some("float3"),
        Number::F64 => Some("double3"),
        Number::U32 => None,
        Number::I8 | Number::U8 | Number::I16 | Number::U16 | Number::I32 => Some("int3"),
    }
}

/// Floats from this value on are written with an exponent.
const EXPONENT_FROM: f64 = 1e16;

/// Writes a number in USD's syntax.
pub(in crate::io) fn number(out: &mut String, number: Number, value: f64) {
    let _ = match number {
        // USD accepts NaN only in lower case, and takes long numbers without an exponent for integers.
        _ if value.is_nan() => write!(out, "nan"),
        Number::F32 if value.abs() >= EXPONENT_FROM => write!(out, "{:e}", value as f32),
        Number::F64 if value.abs() >= EXPONENT_FROM => write!(out, "{value:e}"),
        Number::F32 => write!(out, "{}", value as f32),
        Number::F64 => write!(out, "{value}"),
        Number::I8 | Number::U8 | Number::I16 | Number::U16 | Number::I32 | Number::U32 => {
            write!(out, "{}", value as i64)
        }
    };
}

/// Writes a value as a fraction of 1.
fn fraction(out: &mut String, array: &MeshArray, at: usize) {
    let whole = if array.number == Number::U8 { 255.0 } else { 1.0 };
    number(out, Number::F32, f64::from(array.values[at] as f32 / whole));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(name: &str, on: On, number: Number, values: &[f64]) -> MeshArray {
        MeshArray { name: name.into(), on, number, values: values.to_vec() }
    }

    fn declared(arrays: &[MeshArray]) -> Vec<String> {
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        primvars(&arrays).into_iter().map(|one| format!("{} {}", one.declared, one.interpolation)).collect()
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
            array("id", On::Faces, Number::U32, &[4_294_967_295.0]),
            array("far", On::Faces, Number::F64, &[-1e300]),
            array("red", On::Vertices, Number::U8, &[255.0, 0.0, 51.0]),
            array("green", On::Vertices, Number::U8, &[0.0, 0.0, 51.0]),
            array("blue", On::Vertices, Number::U8, &[0.0, 255.0, 51.0]),
        ];
        let mut out = String::new();
        write(&mut out, "", 7, &arrays.iter().collect::<Vec<_>>());
        let lines: Vec<&str> = out.lines().filter(|line| line.contains("timeSamples")).collect();
        let want = [
            "float[] primvars:delta.timeSamples = { 7: [0.1, nan, -inf] }",
            "uint[] primvars:id.timeSamples = { 7: [4294967295] }",
            "double[] primvars:far.timeSamples = { 7: [-1e300] }",
            "color3f[] primvars:displayColor.timeSamples = { 7: [(1, 0, 0), (0, 0, 1), (0.2, 0.2, 0.2)] }",
        ];
        assert_eq!(lines, want);
    }
}
