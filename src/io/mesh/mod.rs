//! Meshes in files, by extension: Wavefront .obj, Stanford .ply, .stl.

#[doc(hidden)]
pub mod extras;
mod obj;
pub(in crate::io) mod ply;
mod ply_header;
mod ply_write;
mod stl;
mod stl_text;

use std::path::Path;

use super::files::caught::caught;
use super::files::{atomic, source};
use crate::error::{Error, Result};
use crate::geometry::{DVec3, DetailedMesh, PolygonMesh, TriMesh};

pub use ply_write::Carried;

/// Formats that are read and written, by extension.
pub const EXTENSIONS: [&str; 3] = ["obj", "ply", "stl"];

/// Reads a mesh in triangles: all its vertices, in the file's order.
///
/// # Errors
/// A missing, empty, cut or malformed file; no faces; vertices that are not finite; indices out of range.
pub fn read(path: &Path) -> Result<TriMesh> {
    read_polygons(path).map(PolygonMesh::into_triangles)
}

/// Reads a mesh with its polygons: two meshes with the same polygons then get the same triangles.
///
/// # Errors
/// As [`read`].
pub fn read_polygons(path: &Path) -> Result<PolygonMesh> {
    read_polygons_from(path, DVec3::zeros())
}

/// As [`read_polygons`], with positions less `origin`: see [`parse_polygons_from`].
///
/// # Errors
/// As [`read`].
pub fn read_polygons_from(path: &Path, origin: DVec3) -> Result<PolygonMesh> {
    parse_polygons_from(path, &source::read(path)?, origin)
}

/// As [`read_polygons`], from the bytes of the file.
///
/// # Errors
/// As [`read`].
pub fn parse_polygons(path: &Path, bytes: &[u8]) -> Result<PolygonMesh> {
    parse_polygons_from(path, bytes, DVec3::zeros())
}

/// As [`parse_polygons`], with positions less `origin` (in the file's unit and axes), which is subtracted in 64 bits while they
/// are read: coordinates of a map projection, as far as the file holds them, keep all their digits.
///
/// # Errors
/// As [`read`].
pub fn parse_polygons_from(path: &Path, bytes: &[u8], origin: DVec3) -> Result<PolygonMesh> {
    let mesh = parse(path, bytes, origin)?;
    mesh.validate().map_err(|error| Error::file(path, error.to_string()))?;
    Ok(mesh)
}

/// As [`read_polygons`], of a file that may hold an empty mesh, as frames of a liquid that has not come yet, or is gone, do: one that
/// says so, as a .ply of 0 faces and an .obj of ours do, and any .stl.
///
/// # Errors
/// As [`read`], but for a mesh that has neither vertices nor faces.
pub fn read_any(path: &Path) -> Result<PolygonMesh> {
    read_any_from(path, DVec3::zeros())
}

/// As [`read_any`], with positions less `origin`: see [`parse_polygons_from`].
///
/// # Errors
/// As [`read_any`].
pub fn read_any_from(path: &Path, origin: DVec3) -> Result<PolygonMesh> {
    let bytes = source::read(path)?;
    let mesh = parse(path, &bytes, origin)?;
    let is_empty = mesh.positions.is_empty() && mesh.ends.is_empty();
    if !is_empty || extension(path) == "obj" && !obj::is_empty_of_ours(&bytes) {
        mesh.validate().map_err(|error| Error::file(path, error.to_string()))?;
    }
    Ok(mesh)
}

/// The mesh as the file has it, which may be empty or invalid.
fn parse(path: &Path, bytes: &[u8], origin: DVec3) -> Result<PolygonMesh> {
    if bytes.is_empty() {
        return Err(Error::file(path, "the file is empty"));
    }
    let origin = origin.into();
    let parse = || match extension(path).as_str() {
        "obj" => obj::parse(bytes, origin).map(|mesh| (mesh, None)),
        "ply" => ply::parse(bytes, origin).map(|mesh| (mesh, None)),
        "stl" => stl::parse(bytes, origin),
        other => Err(format!(
            "a mesh file must be {}, not \".{other}\"",
            EXTENSIONS.map(|e| format!(".{e}")).join(", ")
        )),
    };
    let (mesh, warning) = caught(path, || parse().map_err(|what| Error::file(path, what)))?;
    if let Some(warning) = warning {
        log::warn!("{}: {warning}", path.display());
    }
    Ok(mesh)
}

/// Reads a mesh in triangles with all that it carries.
///
/// # Errors
/// As [`read`].
pub fn read_detailed(path: &Path) -> Result<DetailedMesh> {
    read_polygons(path).map(PolygonMesh::into_detailed)
}

/// Writes a mesh, whole or not at all.
///
/// # Errors
/// Another extension than .obj, .ply or .stl; what the operating system reports.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    write_carried(path, mesh, &Carried::default())
}

/// As [`write()`], with what the mesh carries as far as the format holds it: .ply all, .obj texture coordinates (see
/// [`holds_uvs`]) and colours.
///
/// # Errors
/// As [`write()`].
pub fn write_carried(path: &Path, mesh: &TriMesh, carried: &Carried<'_>) -> Result<()> {
    match extension(path).as_str() {
        "obj" => atomic::write(path, |out| obj::write(out, mesh, carried)),
        "ply" => atomic::write(path, |out| ply_write::write(out, mesh, carried)),
        "stl" => atomic::write(path, |out| stl::write(out, mesh)),
        _ => Err(Error::file(path, "a mesh file must be .obj, .ply or .stl")),
    }
}

/// Whether a file of this name can hold texture coordinates.
pub fn holds_uvs(path: &Path) -> bool {
    matches!(extension(path).as_str(), "obj" | "ply" | "usda")
}

/// The bytes of a .ply file.
pub fn ply_bytes(mesh: &TriMesh, carried: &Carried<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    ply_write::write(&mut bytes, mesh, carried).expect("memory takes all bytes");
    bytes
}

/// The bytes of an .obj file.
pub fn obj_bytes(mesh: &TriMesh, carried: &Carried<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    obj::write(&mut bytes, mesh, carried).expect("memory takes all bytes");
    bytes
}

/// The extension of a file's name in lower case; empty without one.
pub fn extension(path: &Path) -> String {
    path.extension().and_then(|text| text.to_str()).unwrap_or("").to_lowercase()
}
