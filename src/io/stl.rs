//! STL, binary and text: triangles whose corners are joined where they have the same place.

use std::collections::HashMap;
use std::io::{Cursor, Write};

use super::source;
use crate::base::{PolygonMesh, TriMesh, Vec3};

/// Triangles between two looks at whether to stop.
const PIECE: usize = 1 << 14;
/// Bytes of a binary file before its triangles, and of each of them.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads the triangles of an STL file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonMesh, String> {
    let told = bytes.get(80..HEADER).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let length = HEADER + told * TRIANGLE;
    let is_text = bytes.starts_with(b"solid") && bytes.len() != length;
    if !is_text && (bytes.len() < HEADER || bytes.len() < length) {
        return Err(format!(
            "the .stl file is cut short: {told} triangles need {length} bytes, not {}",
            bytes.len()
        ));
    }
    let mut copy = bytes.to_vec();
    if !is_text {
        // Some programs begin binary files with the word that text files begin with.
        copy[..5].fill(b' ');
    }
    let mut reader = Cursor::new(copy);
    let triangles = stl_io::create_stl_reader(&mut reader)
        .map_err(|error| format!("the .stl file cannot be read ({error})"))?;
    let mut mesh = PolygonMesh::default();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for (number, triangle) in triangles.enumerate() {
        if number % PIECE == 0 && source::is_stopped() {
            return Err("stopped".into());
        }
        let triangle =
            triangle.map_err(|error| format!("triangle {} cannot be read ({error})", number + 1))?;
        let corners = triangle.vertices.map(|vertex| {
            // Adding zero makes -0 and 0 the same.
            let place = vertex.0.map(|value| value + 0.0);
            *known.entry(place.map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(Vec3::from(place));
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.push(corners);
    }
    Ok(mesh)
}

/// Writes binary STL.
pub(super) fn write(out: &mut dyn Write, mesh: &TriMesh) -> std::io::Result<()> {
    let mut header = [0u8; 80];
    header[..6].copy_from_slice(b"frazil");
    out.write_all(&header)?;
    out.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        for value in [normal, a, b, c].iter().flat_map(|p| p.iter()) {
            out.write_all(&value.to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_a_cut_file_is_refused() {
        let mesh = TriMesh {
            positions: vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh).unwrap();
        let read = parse(&bytes).unwrap().into_triangles();
        assert_eq!(read.positions.len(), 4);
        assert!(read.is_manifold() && (read.volume() - 1.0 / 6.0).abs() < 1e-7);
        (0..bytes.len()).for_each(|length| assert!(parse(&bytes[..length]).is_err(), "{length}"));
        bytes[..6].copy_from_slice(b"solid ");
        assert_eq!(parse(&bytes).unwrap().ends.len(), 4);
    }

    #[test]
    fn text_is_read() {
        let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
                    endsolid a\n";
        assert_eq!(parse(text.as_bytes()).unwrap().into_triangles().triangles, [[0, 1, 2]]);
        assert!(parse(b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 x 0\n").is_err());
    }
}
