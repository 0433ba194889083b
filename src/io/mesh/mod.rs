//! Meshes in files, by extension: Wavefront .obj, Stanford .ply, .stl, binary USD (.usdc, .usd).

#[doc(hidden)]
pub mod extras;
mod obj;
pub(in crate::io) mod ply;
mod ply_header;
pub(in crate::io) mod ply_write;
mod stl;
mod stl_solids;
mod stl_text;
pub(in crate::io) mod usd;

use std::path::Path;

use super::files::caught::caught;
use super::files::{atomic, source};
use crate::error::{Error, Result, fail_if, one_line};
use crate::geometry::{DVec3, DetailedMesh, PolygonMesh, TriMesh};

pub use ply_write::Carried;

/// Formats that can be read, by extension. [`write()`] writes the first three, and [`crate::io::usd`] the others.
pub const EXTENSIONS: [&str; 5] = ["obj", "ply", "stl", "usdc", "usd"];

/// Reads a mesh as triangles: all its vertices, in the file's order.
///
/// # Errors
/// A file that is missing, empty, cut short or malformed; no faces; vertices that are not finite; indices out of range.
pub fn read(path: &Path) -> Result<TriMesh> {
    read_polygons(path).map(PolygonMesh::into_triangles)
}

/// Reads a mesh with its polygons uncut.
///
/// # Errors
/// As [`read`].
pub fn read_polygons(path: &Path) -> Result<PolygonMesh> {
    read_polygons_from(path, DVec3::zeros())
}

/// As [`read_polygons`], with positions relative to `origin`: see [`parse_polygons_from`].
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

/// As [`parse_polygons`], with positions relative to `origin` (in the file's unit and axes), which is subtracted in 64 bits while they are
/// read: map-projection coordinates keep all the digits that the file has.
///
/// # Errors
/// As [`read`].
pub fn parse_polygons_from(path: &Path, bytes: &[u8], origin: DVec3) -> Result<PolygonMesh> {
    let mesh = parse(path, bytes, origin)?;
    mesh.validate().map_err(|error| Error::file(path, error.to_string()))?;
    Ok(mesh)
}

/// As [`read_polygons`], for a file that may hold an empty mesh, such as a frame of a liquid before it appears or after it is gone. The
/// file must declare this, as a .ply with 0 faces, a mesh in USD and an .obj by frazil do, or be an .stl.
///
/// # Errors
/// As [`read`], except for a mesh that has neither vertices nor faces.
pub fn read_any(path: &Path) -> Result<PolygonMesh> {
    read_any_from(path, DVec3::zeros())
}

/// As [`read_any`], with positions relative to `origin`: see [`parse_polygons_from`].
///
/// # Errors
/// As [`read_any`].
pub fn read_any_from(path: &Path, origin: DVec3) -> Result<PolygonMesh> {
    let bytes = source::read(path)?;
    let mesh = parse(path, &bytes, origin)?;
    let is_empty = mesh.positions.is_empty() && mesh.ends.is_empty();
    if !is_empty || extension(path) == "obj" && !obj::is_our_empty_file(&bytes) {
        mesh.validate().map_err(|error| Error::file(path, error.to_string()))?;
    }
    Ok(mesh)
}

/// The mesh as it is in the file; it may be empty or invalid.
fn parse(path: &Path, bytes: &[u8], origin: DVec3) -> Result<PolygonMesh> {
    fail_if(bytes.is_empty(), || Error::file(path, "the file is empty"))?;
    let origin = origin.into();
    let parse = || match extension(path).as_str() {
        "obj" => obj::parse(bytes, origin).map(|mesh| (mesh, None)),
        "ply" => ply::parse(bytes, origin).map(|mesh| (mesh, None)),
        "stl" => stl::parse(bytes, origin),
        "usdc" | "usd" => usd::parse(bytes, origin),
        other => Err(format!(
            "a mesh file must be {}, not \".{other}\"",
            EXTENSIONS.map(|e| format!(".{e}")).join(", ")
        )),
    };
    let (mesh, warning) = caught(path, || parse().map_err(|what| Error::file(path, one_line(&what))))?;
    if let Some(warning) = warning {
        log::warn!("{}: {}", path.display(), one_line(&warning));
    }
    Ok(mesh)
}

/// Reads a mesh as triangles, with all its attributes.
///
/// # Errors
/// As [`read`].
pub fn read_detailed(path: &Path) -> Result<DetailedMesh> {
    read_polygons(path).map(PolygonMesh::into_detailed)
}

/// Writes a mesh, whole or not at all.
///
/// # Errors
/// An extension other than .obj, .ply or .stl; what the operating system reports.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    write_carried(path, mesh, &Carried::default())
}

/// As [`write()`], with the data that the mesh carries, as far as the format can hold them: .ply holds everything, .obj texture coordinates
/// (see [`holds_uvs`]) and colours, .stl nothing.
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
    matches!(extension(path).as_str(), "obj" | "ply" | "usda" | "usdc" | "usd")
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

/// The extension of a file's name in lower case; empty if there is none.
pub fn extension(path: &Path) -> String {
    path.extension().and_then(|text| text.to_str()).unwrap_or("").to_lowercase()
}
