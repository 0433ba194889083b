//! Wavefront OBJ: positions and faces; everything else is passed over.

use std::io::Write;

use super::source;
use crate::base::{PolygonMesh, TriMesh, Vec3};
use crate::error::one_line;

/// Lines between two looks at whether to stop.
const PIECE: usize = 1 << 14;
/// Letters of a word that a message repeats.
const LONGEST_WORD: usize = 40;
/// What some programs put before the first line of a text in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads positions and faces.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonMesh, String> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    check_numbers(bytes)?;
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let geometry = geometry(bytes);
    let mut reader = std::io::BufReader::new(Stoppable(geometry.as_slice()));
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, no_materials)
        .map_err(|error| format!("the .obj file cannot be read ({error})"))?;
    let mut mesh = PolygonMesh::default();
    for tobj::Model { mesh: part, .. } in models {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])));
        let mut corners = part.indices.into_iter().map(|index| first + index);
        // Without a list of sizes all faces are triangles.
        let triangles = corners.len() / 3;
        let sizes = if part.face_arities.is_empty() { vec![3; triangles] } else { part.face_arities };
        sizes.into_iter().for_each(|size| mesh.push(corners.by_ref().take(size as usize)));
    }
    Ok(mesh)
}

/// Bytes whose reader fails once it is to stop.
struct Stoppable<'a>(&'a [u8]);

impl std::io::Read for Stoppable<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if source::is_stopped() { Err(std::io::Error::other("stopped")) } else { self.0.read(out) }
    }
}

/// The lines of vertices and faces without comments: tobj doubles the vertices of a mesh wherever a group or a material
/// begins, which would open it, and refuses a comment behind a face.
fn geometry(bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        // The reader behind this one stops too.
        if number % PIECE == 0 && source::is_stopped() {
            break;
        }
        let line = line.split(|&byte| byte == b'#').next().unwrap_or(line).trim_ascii();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or(line);
        if matches!(word, b"v" | b"vt" | b"vn" | b"f") {
            kept.extend_from_slice(line);
            kept.push(b'\n');
        }
    }
    kept
}

/// Finds what tobj would pass over or report without a line: bad numbers, vertices out of range. Other lines may be of
/// any encoding.
fn check_numbers(bytes: &[u8]) -> Result<(), String> {
    let mut vertices = 0i64;
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        if number % PIECE == 0 && source::is_stopped() {
            return Err("stopped".into());
        }
        let line = line.trim_ascii();
        if !matches!(line.first(), Some(b'v' | b'f')) {
            continue;
        }
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                vertices += 1;
                let values: Vec<Option<f32>> = words.take(3).map(|word| word.parse().ok()).collect();
                if values.len() < 3 || values.iter().any(|value| !value.is_some_and(f32::is_finite)) {
                    return Err(format!("line {}: the vertex is not three finite numbers", number + 1));
                }
            }
            Some("f") => {
                for word in words.take_while(|word| !word.starts_with('#')) {
                    let index: Option<i64> = word.split('/').next().and_then(|index| index.parse().ok());
                    let known =
                        index.is_some_and(|i| (1..=vertices).contains(&i) || (-vertices..=-1).contains(&i));
                    if !known {
                        return Err(format!(
                            "line {}: the face names vertex {}, but there are {vertices} before it",
                            number + 1,
                            one_line(&word.chars().take(LONGEST_WORD).collect::<String>())
                        ));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Writes positions and triangles.
pub(super) fn write(out: &mut dyn Write, mesh: &TriMesh) -> std::io::Result<()> {
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(())
}
