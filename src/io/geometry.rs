//! What a file of meshes or points holds, part by part, as packed arrays: for hosts that show it.
//!
//! | file | parts |
//! |---|---|
//! | .usdc, .usd | a part for each prim of type Mesh or, if there is none, for that of type Points |
//! | .ply | one: a mesh, or points if there are no faces |
//! | .obj, .stl | one mesh |
//! | .bgeo, .vtk, .vtu, .xyz | one part of points |
//!
//! Arrays have the same names and types whichever file they are from: vectors and colours are joined (`vx`, `vy` and `vz` become `v`; `red`,
//! `green` and `blue`, or `Cdx`, `Cdy` and `Cdz`, become `color`, bytes divided by 255), texture coordinates are `uv`, and short integers have
//! 32 bits.

use std::path::Path;

use super::files::caught::caught;
use super::files::source;
use super::mesh::{self, extension};
use super::particles;
use super::usd::primvars::{members_of, vector_of};
use crate::error::{Error, Result, one_line};
use crate::geometry::mesh::attributes::{MeshArray, Number, On};
use crate::geometry::points::{Column, Points, Values};
use crate::geometry::{PolygonMesh, Uvs, points};

/// A mesh, or points: then it has no faces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Part {
    /// Name of its prim in USD; empty in other files, which have one part.
    pub name: String,
    /// The colour of all of it, each part 0 to 1: in USD a constant `displayColor`.
    pub color: Option<[f32; 3]>,
    /// Positions (m where the file states its unit, Y up).
    pub positions: Vec<[f32; 3]>,
    /// Number of corners of each face.
    pub face_counts: Vec<u32>,
    /// The vertex of each corner of each face, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// All other arrays, by name.
    pub arrays: Vec<Array>,
}

/// A named array of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name, not empty.
    pub name: String,
    /// The elements that it has values for; points count as vertices.
    pub on: On,
    /// Numbers of each element: 1, 2 (`uv`) or 3.
    pub components: usize,
    /// The numbers, element by element.
    pub values: ArrayValues,
}

/// The numbers of an array.
#[derive(Debug, Clone, PartialEq)]
pub enum ArrayValues {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
    /// 32-bit integers.
    I32(Vec<i32>),
    /// Unsigned 32-bit integers.
    U32(Vec<u32>),
    /// 64-bit integers.
    I64(Vec<i64>),
    /// Bytes; also `true` (1) and `false` (0).
    U8(Vec<u8>),
}

/// Reads a file.
///
/// # Errors
/// As [`mesh::read_any`] and [`particles::read`]; a file of another kind.
pub fn read(path: &Path) -> Result<Vec<Part>> {
    let ending = extension(path);
    if !mesh::EXTENSIONS.contains(&&*ending)
        || particles::may_hold_mesh(path) && particles::holds_points(path)?
    {
        let cloud = particles::read(path)?;
        let positions = cloud.positions.iter().map(|at| at.map(|x| x as f32).into()).collect();
        return Ok(vec![Part::of_points(positions, cloud.attributes)]);
    }
    if !matches!(&*ending, "usdc" | "usd") {
        return Ok(vec![Part::of_mesh(String::new(), mesh::read_any(path)?)]);
    }
    let bytes = source::read(path)?;
    let parse = || mesh::usd::parse_each(&bytes).map_err(|what| Error::file(path, one_line(&what)));
    let meshes = caught(path, parse)?;
    let part = |(prim, color, mesh): (String, Option<[f32; 3]>, PolygonMesh)| {
        if !mesh.positions.is_empty() || !mesh.ends.is_empty() {
            mesh.validate().map_err(|what| Error::file(path, format!("{prim}: {what}")))?;
        }
        let name = prim.rsplit('/').next().unwrap_or_default();
        Ok(Part { color, ..Part::of_mesh(name.into(), mesh) })
    };
    meshes.into_iter().map(part).collect()
}

impl Part {
    /// Memory of its arrays (bytes).
    pub fn memory_bytes(&self) -> u64 {
        let numbers = |array: &Array| match &array.values {
            ArrayValues::F32(all) => size_of_val(&all[..]),
            ArrayValues::F64(all) => size_of_val(&all[..]),
            ArrayValues::I32(all) => size_of_val(&all[..]),
            ArrayValues::U32(all) => size_of_val(&all[..]),
            ArrayValues::I64(all) => size_of_val(&all[..]),
            ArrayValues::U8(all) => all.len(),
        };
        let arrays: usize = self.arrays.iter().map(numbers).sum();
        let faces = size_of_val(&self.face_counts[..]) + size_of_val(&self.corners[..]);
        (size_of_val(&self.positions[..]) + faces + arrays) as u64
    }

    /// A mesh.
    fn of_mesh(name: String, mesh: PolygonMesh) -> Self {
        let face_counts = mesh.polygons().map(|face| face.len() as u32).collect();
        let mut arrays: Vec<Array> = mesh.uvs.as_ref().map(Array::of_uvs).into_iter().collect();
        arrays.extend(joined(&mesh.arrays));
        let positions = mesh.positions.iter().map(|&at| at.into()).collect();
        Self { name, color: None, positions, face_counts, corners: mesh.corners, arrays }
    }

    /// Points with their attributes.
    fn of_points(positions: Vec<[f32; 3]>, attributes: Vec<points::Attribute>) -> Self {
        let count = positions.len();
        let array = |attribute: points::Attribute| {
            let (components, values) = match attribute.values {
                Values::Float(column) => (1, ArrayValues::F32(each(column, count))),
                Values::Int(column) => (1, ArrayValues::I32(each(column, count))),
                Values::Long(column) => (1, ArrayValues::I64(each(column, count))),
                Values::Bool(column) => {
                    (1, ArrayValues::U8(each(column, count).into_iter().map(u8::from).collect()))
                }
                Values::Vector(column) => (3, ArrayValues::F32(each(column, count).into_flattened())),
            };
            Array { name: attribute.name, on: On::Vertices, components, values }
        };
        let arrays = attributes.into_iter().map(array).collect();
        Self { positions, arrays, ..Self::default() }
    }
}

impl From<Points> for Part {
    fn from(points: Points) -> Self {
        let position = |point| points.position(point).map(|x| x as f32).into();
        let positions = (0..points.count()).map(position).collect();
        Self::of_points(positions, points.attributes)
    }
}

/// The values of all points.
fn each<T: Copy>(column: Column<T>, count: usize) -> Vec<T> {
    match column {
        Column::Each(values) => values,
        Column::Uniform(value) => vec![value; count],
    }
}

impl Array {
    fn of_uvs(uvs: &Uvs) -> Self {
        let (on, pairs) = match &uvs.corners {
            None => (On::Vertices, uvs.coordinates.clone()),
            Some(corners) => {
                (On::Corners, corners.iter().map(|&index| uvs.coordinates[index as usize]).collect())
            }
        };
        Self { name: "uv".into(), on, components: 2, values: ArrayValues::F32(pairs.into_flattened()) }
    }

    /// An array whose components are arrays of a mesh, of one kind.
    fn of(name: &str, parts: &[&MeshArray], is_colour: bool) -> Self {
        let first = parts[0];
        let count = first.values.len();
        let all = (0..count).flat_map(|element| parts.iter().map(move |part| part.values[element]));
        let values = match first.number {
            Number::U8 if is_colour => ArrayValues::F32(all.map(|byte| byte as f32 / 255.0).collect()),
            Number::F32 => ArrayValues::F32(all.map(|number| number as f32).collect()),
            Number::F64 => ArrayValues::F64(all.collect()),
            Number::U8 => ArrayValues::U8(all.map(|number| number as u8).collect()),
            Number::U32 => ArrayValues::U32(all.map(|number| number as u32).collect()),
            Number::I8 | Number::I16 | Number::U16 | Number::I32 => {
                ArrayValues::I32(all.map(|number| number as i32).collect())
            }
        };
        Self { name: name.into(), on: first.on, components: parts.len(), values }
    }
}

/// The arrays of a mesh, with vectors and colours joined. Names stay unique: a single array keeps its name, and a vector whose name is taken
/// stays apart.
fn joined(arrays: &[MeshArray]) -> Vec<Array> {
    let arrays: Vec<&MeshArray> = arrays.iter().collect();
    let mut out: Vec<Array> = Vec::new();
    let mut is_done = vec![false; arrays.len()];
    for at in 0..arrays.len() {
        if is_done[at] {
            continue;
        }
        let array = arrays[at];
        let is_taken = |name: &str| name == "uv" || arrays.iter().any(|other| other.name == name);
        let vector = vector_of(&array.name).map(|vector| {
            // Without the axis.
            let stem = &vector.parts[0][..vector.parts[0].len() - 1];
            (if vector.is_colour { COLOUR } else { stem }.to_string(), vector)
        });
        let members = vector.as_ref().filter(|(name, _)| !is_taken(name));
        let members = members.and_then(|(_, vector)| members_of(&arrays, &is_done, array, &vector.parts));
        match (vector, members) {
            (Some((name, vector)), Some(members)) => {
                members.iter().for_each(|&member| is_done[member] = true);
                let parts: Vec<&MeshArray> = members.iter().map(|&member| arrays[member]).collect();
                out.push(Array::of(&name, &parts, vector.is_colour));
            }
            _ => {
                is_done[at] = true;
                out.push(Array::of(&array.name, &[array], array.name == "alpha"));
            }
        }
    }
    out
}

/// Name of an array of colours.
const COLOUR: &str = "color";

#[cfg(test)]
mod tests {
    use super::*;

    fn array(name: &str, number: Number, values: &[f64]) -> MeshArray {
        MeshArray { name: name.into(), on: On::Vertices, number, values: values.to_vec() }
    }

    #[test]
    fn components_become_vectors_and_colours() {
        let floats = |name, values: &[f64]| array(name, Number::F32, values);
        let bytes = |name, values: &[f64]| array(name, Number::U8, values);
        let arrays = [
            floats("vx", &[1.0, 4.0]),
            bytes("red", &[255.0, 0.0]),
            floats("depth", &[0.5, 0.25]),
            floats("vy", &[2.0, 5.0]),
            floats("vz", &[3.0, 6.0]),
            bytes("green", &[0.0, 51.0]),
            bytes("blue", &[0.0, 255.0]),
            // Not a vector: its components differ in type.
            floats("wx", &[1.0, 1.0]),
            floats("wy", &[1.0, 1.0]),
            array("wz", Number::I16, &[7.0, -7.0]),
        ];
        let found = joined(&arrays);
        let names: Vec<(&str, usize)> = found.iter().map(|one| (&*one.name, one.components)).collect();
        assert_eq!(names, [("v", 3), ("color", 3), ("depth", 1), ("wx", 1), ("wy", 1), ("wz", 1)]);
        assert_eq!(found[0].values, ArrayValues::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        assert_eq!(found[1].values, ArrayValues::F32(vec![1.0, 0.0, 0.0, 0.0, 0.2, 1.0]));
        assert_eq!(found[5].values, ArrayValues::I32(vec![7, -7]));
    }

    #[test]
    fn a_vector_whose_name_is_taken_stays_apart() {
        let floats = |name| array(name, Number::F32, &[1.0]);
        let found = joined(&[floats("v"), floats("vx"), floats("vy"), floats("vz")]);
        assert_eq!(found.iter().map(|one| &*one.name).collect::<Vec<_>>(), ["v", "vx", "vy", "vz"]);
    }
}
