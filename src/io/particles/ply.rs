//! Points as Stanford PLY: vertices without faces.
//!
//! A vector attribute takes three properties, its name with x, y and z appended (`v`: vx, vy, vz; `rest`: restx ...). `bool` becomes
//! `uchar`. PLY has no 64-bit integers: they become `int` if all of them fit, else `double`. A comment holds the voxel size. Positions are
//! `float`, or `double` where adjacent 32-bit numbers are over a thousandth of a voxel apart.

use std::io::Write;
use std::path::Path;

use super::{ParticleData, integers, scalars, vectors};
use crate::error::{Error, Result, fail_if};
use crate::geometry::DVec3;
use crate::geometry::mesh::spacing;
use crate::geometry::points::{Attribute, Points, Values};
use crate::io::files::numbers::Numbers;
use crate::io::files::source::Parsed;
use crate::io::files::{atomic, source};
use crate::io::mesh::ply;
use crate::io::mesh::ply::Element;

/// Prefix of the comment with the voxel size (m).
const VOXEL: &str = "frazil voxel_size";
/// Maximum spacing of 32-bit numbers (voxels) with which positions are still written in 32 bits.
const MAX_ROUNDING: f64 = 1e-3;

/// Whether a .ply file has vertices and no faces. A file that has neither holds a mesh if it declares zero faces, and points if it does not
/// declare faces.
pub(super) fn holds_points(bytes: &[u8]) -> bool {
    let is_face = |element: &Element| element.name == "face" || element.name == "tristrips";
    ply::open(bytes).is_ok_and(|body| {
        let has_vertices = body.elements.iter().any(|e| e.name == "vertex" && e.count > 0);
        !body.elements.iter().any(|e| is_face(e) && (e.count > 0 || !has_vertices))
    })
}

/// Reads the vertices of a .ply file as points. `id` becomes 64-bit integers, `active` and `trapped` become `bool`; other integers of up to
/// 32 bits become 32-bit ones, floats become 32-bit ones, and three properties that end in x, y and z become vectors. A value that is the
/// same at all points is stored once. Lists are ignored.
///
/// # Errors
/// A missing, cut or malformed file; numbers that are not finite, or too large for their type.
pub fn read(path: &Path) -> Result<ParticleData> {
    let bytes = source::read(path)?;
    parse(&bytes).map_err(|what| Error::file(path, what))
}

/// As [`read`], from the bytes of the file.
pub(in crate::io) fn parse(bytes: &[u8]) -> Parsed<ParticleData> {
    let mut body = ply::open(bytes)?;
    let at = body.elements.iter().position(|element| element.name == "vertex").expect("open looks for it");
    let vertices = body.elements.swap_remove(at);
    fail_if(at > 0, || "the .ply file has something before its vertices".to_string())?;
    // A damaged count must not allocate more than the file could fill.
    let names: Vec<String> = vertices.properties.iter().map(|property| property.name.clone()).collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for row in 0..vertices.count {
        body.row(&vertices, row, |property, value| columns[property].push(value))?;
    }
    let position = |axis: &str| names.iter().position(|name| name == axis).expect("open looks for them");
    let axes = ["x", "y", "z"].map(position);
    let positions: Vec<DVec3> =
        (0..vertices.count).map(|row| DVec3::from(axes.map(|axis| columns[axis][row]))).collect();
    let attributes = attributes(&vertices, &names, &mut columns)?;
    let voxel_size = body.comments.iter().find_map(|line| line.strip_prefix(VOXEL)?.trim().parse().ok());
    Ok(ParticleData { positions, attributes, voxel_size })
}

/// Values other than the position; takes the columns that hold scalars.
fn attributes(vertices: &Element, names: &[String], columns: &mut [Vec<f64>]) -> Parsed<Vec<Attribute>> {
    let mut out = Vec::new();
    let index = |name: &str| names.iter().position(|other| other == name);
    for (n, (name, property)) in names.iter().zip(&vertices.properties).enumerate() {
        let of_vector = |end: char| {
            let stem = name.strip_suffix(end)?;
            let axes = ["x", "y", "z"].map(|axis| index(&format!("{stem}{axis}")));
            let [x, y, z] = [axes[0]?, axes[1]?, axes[2]?];
            [x, y, z].iter().all(|&axis| vertices.properties[axis].is_float()).then_some((stem, [x, y, z]))
        };
        if property.list.is_some() || ["x", "y", "z"].contains(&name.as_str()) {
            continue;
        }
        // The first of the three represents the vector.
        if ['y', 'z'].into_iter().any(|end| of_vector(end).is_some()) {
            continue;
        }
        let (name, values) = match of_vector('x') {
            Some((stem, axes)) => {
                let vector = |row: usize| axes.map(|axis| columns[axis][row] as f32);
                (stem, vectors((0..vertices.count).map(vector)))
            }
            None => {
                let is_float = property.is_float() || ["id", "active", "trapped"].contains(&&**name);
                let column = std::mem::take(&mut columns[n]);
                let fits_int = !is_float && column.iter().all(|&value| f64::from(value as i32) == value);
                let numbers = if is_float {
                    Numbers::Floats(column)
                } else {
                    Numbers::Integers(integers(name, &column)?)
                };
                (&**name, scalars(name, numbers, fits_int)?)
            }
        };
        out.push(Attribute { name: name.to_string(), values });
    }
    Ok(out)
}

/// Writes points as binary little-endian PLY, whole or not at all.
///
/// # Errors
/// 64-bit integers that a `double` does not hold; what the operating system reports.
pub fn write(path: &Path, points: &Points) -> Result<()> {
    let attributes = ply_attributes(points).map_err(|what| Error::file(path, what))?;
    atomic::write(path, |out| write_to(out, points, &attributes, true))
}

/// As [`write()`], without the voxel size: for points that have voxels only because [`Points`] require them.
///
/// # Errors
/// As [`write()`].
pub fn write_without_voxels(path: &Path, points: &Points) -> Result<()> {
    let attributes = ply_attributes(points).map_err(|what| Error::file(path, what))?;
    atomic::write(path, |out| write_to(out, points, &attributes, false))
}

/// The bytes of a file that [`write()`] would write.
///
/// # Errors
/// As [`write()`].
pub fn to_bytes(points: &Points) -> Result<Vec<u8>> {
    let attributes = ply_attributes(points).map_err(Error::Argument)?;
    let mut out = Vec::new();
    write_to(&mut out, points, &attributes, true).map_err(|error| Error::Internal(error.to_string()))?;
    Ok(out)
}

fn ply_attributes(points: &Points) -> Parsed<Vec<PlyAttribute<'_>>> {
    points.attributes.iter().map(ply_attribute).collect()
}

/// An attribute in the form in which PLY holds it.
struct PlyAttribute<'a> {
    /// Type and names of its properties.
    kind: &'static str,
    names: Vec<String>,
    values: &'a Values,
}

fn ply_attribute(attribute: &Attribute) -> Parsed<PlyAttribute<'_>> {
    let Attribute { name, values } = attribute;
    let kind = match values {
        Values::Float(_) | Values::Vector(_) => "float",
        Values::Int(_) => "int",
        Values::Bool(_) => "uchar",
        Values::Long(column) => {
            let stored = column.stored();
            if stored.iter().all(|&value| i32::try_from(value).is_ok()) {
                "int"
            } else if stored.iter().all(|value| value.unsigned_abs() <= 1 << 53) {
                "double"
            } else {
                return Err(format!("attribute \"{name}\" has integers over 2^53, which .ply cannot hold"));
            }
        }
    };
    let names = match values {
        Values::Vector(_) => ["x", "y", "z"].map(|axis| format!("{name}{axis}")).to_vec(),
        _ => vec![name.clone()],
    };
    // The words of a header are separated by spaces.
    match names.iter().find(|name| name.contains(char::is_whitespace)) {
        Some(name) => Err(format!("the name \"{name}\" has a space, which .ply cannot hold")),
        None => Ok(PlyAttribute { kind, names, values }),
    }
}

fn write_to(
    out: &mut dyn Write,
    points: &Points,
    attributes: &[PlyAttribute<'_>],
    keeps_voxels: bool,
) -> std::io::Result<()> {
    let farthest = points.bounds().map_or(0.0, |(low, high)| low.amax().max(high.amax()));
    let is_far = spacing(farthest) > MAX_ROUNDING * points.voxel_size;
    let positions = if is_far { "double" } else { "float" };
    let voxel = if keeps_voxels { format!("comment {VOXEL} {}\n", points.voxel_size) } else { String::new() };
    let mut head =
        format!("ply\nformat binary_little_endian 1.0\n{voxel}element vertex {}\n", points.count());
    for axis in ["x", "y", "z"] {
        head += &format!("property {positions} {axis}\n");
    }
    for PlyAttribute { kind, names, .. } in attributes {
        names.iter().for_each(|name| head += &format!("property {kind} {name}\n"));
    }
    out.write_all((head + "end_header\n").as_bytes())?;
    let mut row = Vec::new();
    for point in 0..points.count() {
        row.clear();
        for part in points.position(point).iter() {
            match is_far {
                true => row.extend(part.to_le_bytes()),
                false => row.extend((*part as f32).to_le_bytes()),
            }
        }
        for PlyAttribute { kind, values, .. } in attributes {
            match values {
                Values::Float(column) => row.extend(column.get(point).to_le_bytes()),
                Values::Int(column) => row.extend(column.get(point).to_le_bytes()),
                Values::Bool(column) => row.push(column.get(point).into()),
                Values::Long(column) if *kind == "int" => {
                    row.extend((column.get(point) as i32).to_le_bytes())
                }
                Values::Long(column) => row.extend((column.get(point) as f64).to_le_bytes()),
                Values::Vector(column) => {
                    column.get(point).iter().for_each(|part| row.extend(part.to_le_bytes()))
                }
            }
        }
        out.write_all(&row)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::points::Column;

    #[test]
    fn what_is_written_is_read_and_a_cut_file_is_refused() {
        for far in [0.0, 1.0e6] {
            let positions =
                [[0.26 + far, -0.26, 0.0], [1.0 + far, 0.0, -3.0], [far, 0.0, 0.0]].map(DVec3::from);
            let mut points = Points::at(0.5, &positions).unwrap();
            points.set("v", Values::Vector(Column::Each(vec![[0.0, 1.0, -2.0], [3.0; 3], [4.0; 3]])));
            points.set("id", Values::Long(Column::Each(vec![5, 1 << 40, 7])));
            points.set("pscale", Values::Float(Column::Uniform(0.1)));
            points.set("active", Values::Bool(Column::Each(vec![true, false, true])));
            points.set("trapped", Values::Bool(Column::Each(vec![false, false, true])));
            points.set("source_frame", Values::Int(Column::Each(vec![-1, 2, 3])));
            let attributes: Vec<PlyAttribute<'_>> =
                points.attributes.iter().map(|a| ply_attribute(a).unwrap()).collect();
            let mut bytes = Vec::new();
            write_to(&mut bytes, &points, &attributes, true).unwrap();
            let back = parse(&bytes).unwrap().into_points(None).unwrap();
            assert_eq!((&back.attributes, back.voxel_size), (&points.attributes, 0.5));
            for point in 0..3 {
                assert!((back.position(point) - points.position(point)).norm() < 1e-3 * 0.5);
            }
            (0..bytes.len()).for_each(|cut| assert!(parse(&bytes[..cut]).is_err(), "{cut} bytes"));
        }
    }
}
