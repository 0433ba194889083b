//! Wavefront OBJ: positions and faces; everything else is passed over.

use std::io::Write;

use crate::base::{PolygonMesh, TriMesh, Vec3};

/// Reads positions and faces.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonMesh, String> {
    check_numbers(bytes)?;
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let geometry = geometry(bytes);
    let mut reader = std::io::BufReader::new(geometry.as_slice());
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

/// The lines of vertices and faces without comments: tobj doubles the vertices of a mesh wherever a group or a material
/// begins, which would open it, and refuses a comment behind a face.
fn geometry(bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    for line in bytes.split(|&byte| byte == b'\n') {
        let line = line.split(|&byte| byte == b'#').next().unwrap_or(line).trim_ascii();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or(line);
        if matches!(word, b"v" | b"vt" | b"vn" | b"f") {
            kept.extend_from_slice(line);
            kept.push(b'\n');
        }
    }
    kept
}

/// Finds what tobj would pass over or report without a line: bad numbers, vertices out of range.
fn check_numbers(bytes: &[u8]) -> Result<(), String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "the .obj file is not text".to_string())?;
    let mut vertices = 0i64;
    for (number, line) in text.lines().enumerate() {
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
                            "line {}: the face names vertex {word}, but there are {vertices} before it",
                            number + 1
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
