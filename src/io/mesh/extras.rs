//! The contents of a mesh file besides its shape.

use std::path::Path;

use super::extension;
use crate::error::Result;
use crate::io::files::{source, text};

/// Names of the contents of a mesh file besides positions and faces, in the plural: "UVs", "normals" ... Empty for file types that have none.
///
/// # Errors
/// A file that cannot be read.
pub fn of(path: &Path) -> Result<Vec<&'static str>> {
    Ok(match extension(path).as_str() {
        "obj" => obj(&source::read(path)?),
        "ply" => ply(&source::read(path)?),
        "usdc" | "usd" => usd(path)?,
        _ => Vec::new(),
    })
}

/// USD's normals are computed anew, so that they are no loss.
fn usd(path: &Path) -> Result<Vec<&'static str>> {
    let mesh = super::read_any(path)?;
    let has = |names: &[&str]| mesh.arrays.iter().any(|array| names.contains(&&*array.name));
    let found = [
        ("UVs", mesh.uvs.is_some()),
        ("colours", has(&["red", "green", "blue", "alpha"])),
        ("velocities", has(&["vx", "vy", "vz"])),
    ];
    Ok(found.into_iter().filter(|(_, found)| *found).map(|(name, _)| name).collect())
}

fn obj(bytes: &[u8]) -> Vec<&'static str> {
    let names = [
        (&[&b"vt"[..]][..], "UVs"),
        (&[b"vn"], "normals"),
        (&[b"usemtl", b"mtllib"], "materials"),
        (&[b"g", b"o"], "groups"),
        (&[b"l", b"p", b"curv", b"surf"], "lines and points"),
    ];
    let mut found = [false; 5];
    for (_, line) in text::lines(bytes) {
        let word = line.trim_ascii().split(u8::is_ascii_whitespace).next().unwrap_or(line);
        if let Some(at) = names.iter().position(|(words, _)| words.contains(&word)) {
            found[at] = true;
        }
    }
    names.iter().zip(found).filter(|(_, found)| *found).map(|((_, name), _)| *name).collect()
}

fn ply(bytes: &[u8]) -> Vec<&'static str> {
    let head = text::lines(bytes).map(|(_, line)| line).take_while(|line| line.trim_ascii() != b"end_header");
    let names = [
        (&["s", "t", "u", "v", "texture_u", "texture_v", "texcoord"][..], "UVs"),
        (&["nx", "ny", "nz"], "normals"),
        (&["red", "green", "blue", "alpha"], "colours"),
        (&["vx", "vy", "vz"], "velocities"),
    ];
    let mut found = [false; 4];
    for line in head {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let (Some("property"), Some(last)) = (words.next(), words.last()) else { continue };
        if let Some(at) = names.iter().position(|(words, _)| words.contains(&last)) {
            found[at] = true;
        }
    }
    names.iter().zip(found).filter(|(_, found)| *found).map(|((_, name), _)| *name).collect()
}
