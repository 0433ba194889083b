//! STL, binary and text: triangles whose corners are joined if they have the same position.

use std::io::Write;

use super::stl_solids::{HEADER, Joined};
use super::stl_text;
use crate::error::fail_if;
use crate::geometry::{PolygonMesh, TriMesh};
use crate::io::files::{source, text};

/// Triangles between two checks of the stop flag.
const PIECE: usize = 1 << 14;

/// Bytes of a triangle in a binary file, and of the normal at its start.
const TRIANGLE: usize = 50;
const NORMAL: usize = 12;

/// Reads the triangles of an STL file, minus an origin that is subtracted in 64 bits; also returns a warning about the file, if any.
pub(in crate::io) fn parse(bytes: &[u8], origin: [f64; 3]) -> Result<(PolygonMesh, Option<String>), String> {
    let count = bytes.get(80..HEADER).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let length = HEADER + count * TRIANGLE;
    if bytes.len() != length || bytes.len() < HEADER {
        let text = text::without_mark(bytes)?;
        if stl_text::is_text_stl(text) {
            return stl_text::parse(text, origin);
        }
        if !bytes[..bytes.len().min(HEADER)].contains(&0) {
            return Err("not an .stl file: a text one begins with \"solid\"".into());
        }
    }
    fail_if(bytes.len() < length, || {
        format!("the .stl file is cut short: {count} triangles need {length} bytes, not {}", bytes.len())
    })?;
    let mut joined = Joined::default();
    for (number, triangle) in bytes[HEADER..length].chunks_exact(TRIANGLE).enumerate() {
        source::check_every(number, PIECE)?;
        let value = |at: usize| {
            let raw = &triangle[NORMAL + 4 * at..][..4];
            f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]])
        };
        for corner in 0..3 {
            let position = [0, 1, 2].map(|axis| subtract(value(3 * corner + axis), origin[axis]));
            let corner = joined.corner(position);
            joined.mesh.corners.push(corner);
        }
        joined.mesh.ends.push(joined.mesh.corners.len() as u32);
    }
    let more = bytes.len() - length;
    let warning = (more > 0)
        .then(|| format!("{more} bytes after the {count} triangles that its header declares are not read"));
    Ok((joined.mesh, warning))
}

fn subtract(value: f32, origin: f64) -> f32 {
    if origin == 0.0 { value } else { (f64::from(value) - origin) as f32 }
}

/// Writes binary STL.
pub(in crate::io) fn write(out: &mut dyn Write, mesh: &TriMesh) -> std::io::Result<()> {
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
    use crate::geometry::test_meshes::tetrahedron;

    fn read(bytes: &[u8]) -> Result<TriMesh, String> {
        parse(bytes, [0.0; 3]).map(|(mesh, _)| mesh.into_triangles())
    }

    #[test]
    fn what_is_written_is_read_and_a_cut_file_is_refused() {
        let mut bytes = Vec::new();
        write(&mut bytes, &tetrahedron(0.0)).unwrap();
        let mesh = read(&bytes).unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert!(mesh.is_manifold() && (mesh.volume() - 1.0 / 6.0).abs() < 1e-7);
        (0..bytes.len()).for_each(|length| assert!(read(&bytes[..length]).is_err(), "{length}"));
        // Some programs begin binary files with the word with which text files begin.
        bytes[..6].copy_from_slice(b"solid ");
        assert_eq!(read(&bytes).unwrap(), mesh);
        assert!(read(&bytes[..200]).unwrap_err().contains("cut short"));
        bytes.extend(b"more");
        let (again, warning) = parse(&bytes, [0.0; 3]).unwrap();
        assert!(again.into_triangles() == mesh && warning.unwrap().starts_with("4 bytes"));
    }
}
