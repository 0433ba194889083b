//! Writes Stanford PLY.

use std::io::{Result, Write};

use super::ply::{NAMES, UV_NAMES};
use crate::geometry::mesh::attributes::{MeshArray, Number, On};
use crate::geometry::{TriMesh, Uvs, Vec3};

/// The data that a mesh carries into a file besides its positions.
#[derive(Debug, Clone, Copy, Default)]
pub struct Carried<'a> {
    /// Velocities (m/s), one per vertex, as vx, vy, vz; or none.
    pub velocities: &'a [Vec3],
    /// Texture coordinates: s and t of the vertices or, if there are seams, a list texcoord of the faces.
    pub uvs: Option<&'a Uvs>,
    /// Other arrays (those of corners have three values for each triangle); arrays whose names are taken are omitted.
    pub arrays: &'a [&'a MeshArray],
}

/// Writes binary little-endian PLY.
pub(in crate::io) fn write(out: &mut dyn Write, mesh: &TriMesh, carried: &Carried<'_>) -> Result<()> {
    let Carried { velocities, uvs, .. } = *carried;
    let has_velocities = !velocities.is_empty() && velocities.len() == mesh.positions.len();
    let of_vertices = uvs.filter(|uvs| uvs.corners.is_none());
    let of_corners = uvs.filter(|uvs| uvs.corners.is_some());
    let mut names = vec!["x", "y", "z"];
    names.extend(has_velocities.then_some(["vx", "vy", "vz"]).into_iter().flatten());
    names.extend(of_vertices.map(|_| UV_NAMES[0]).into_iter().flatten());
    let vertices = arrays(carried, On::Vertices, &names);
    let faces = arrays(carried, On::Faces, &["vertex_indices", "texcoord"]);
    let corners = arrays(carried, On::Corners, &["vertex_indices", "texcoord"]);
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment frazil\nelement vertex {}",
        mesh.positions.len()
    )?;
    names.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
    vertices.iter().try_for_each(|array| writeln!(out, "property {} {}", name(array.number), array.name))?;
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices", mesh.triangles.len())?;
    if of_corners.is_some() {
        writeln!(out, "property list uchar float texcoord")?;
    }
    faces.iter().try_for_each(|array| writeln!(out, "property {} {}", name(array.number), array.name))?;
    corners
        .iter()
        .try_for_each(|array| writeln!(out, "property list uchar {} {}", name(array.number), array.name))?;
    writeln!(out, "end_header")?;
    for (vertex, p) in mesh.positions.iter().enumerate() {
        let velocity = velocities.get(vertex).filter(|_| has_velocities);
        let uv = of_vertices.map(|uvs| uvs.coordinates[vertex]);
        let values = p.iter().chain(velocity.into_iter().flatten()).chain(uv.iter().flatten());
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
        vertices.iter().try_for_each(|array| write_number(out, array.number, array.values[vertex]))?;
    }
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
        if let Some(uvs) = of_corners {
            out.write_all(&[6])?;
            for index in uvs.indices(&mesh.triangles, number) {
                for value in uvs.coordinates[index as usize] {
                    out.write_all(&value.to_le_bytes())?;
                }
            }
        }
        faces.iter().try_for_each(|array| write_number(out, array.number, array.values[number]))?;
        for array in &corners {
            out.write_all(&[3])?;
            array.values[3 * number..3 * number + 3]
                .iter()
                .try_for_each(|value| write_number(out, array.number, *value))?;
        }
    }
    Ok(())
}

/// The arrays of a kind, except those whose names are taken.
fn arrays<'a>(carried: &Carried<'a>, on: On, taken: &[&str]) -> Vec<&'a MeshArray> {
    let mut out: Vec<&MeshArray> = Vec::new();
    for array in carried.arrays.iter().filter(|array| array.on == on) {
        if !taken.contains(&&*array.name) && !out.iter().any(|other| other.name == array.name) {
            out.push(array);
        }
    }
    out
}

fn name(number: Number) -> &'static str {
    NAMES.iter().find(|(_, named)| *named == number).map_or("float", |(names, _)| names[0])
}

fn write_number(out: &mut dyn Write, number: Number, value: f64) -> Result<()> {
    match number {
        Number::I8 => out.write_all(&(value as i8).to_le_bytes()),
        Number::U8 => out.write_all(&(value as u8).to_le_bytes()),
        Number::I16 => out.write_all(&(value as i16).to_le_bytes()),
        Number::U16 => out.write_all(&(value as u16).to_le_bytes()),
        Number::I32 => out.write_all(&(value as i32).to_le_bytes()),
        Number::U32 => out.write_all(&(value as u32).to_le_bytes()),
        Number::F32 => out.write_all(&(value as f32).to_le_bytes()),
        Number::F64 => out.write_all(&value.to_le_bytes()),
    }
}
