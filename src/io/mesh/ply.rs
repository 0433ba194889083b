//! Stanford PLY: ascii and binary in both byte orders; faces as lists or as triangle strips; texture coordinates of vertices (s and t, u
//! and v, texture_u and texture_v) or of the corners of faces (a list texcoord); all other numbers of vertices, faces and corners (lists as
//! long as faces) except normals, which are not valid for a mesh that moves.

use std::collections::HashMap;

use super::ply_header::{self, Format, Header};
use crate::geometry::mesh::attributes::{MeshArray, Number, On};
use crate::geometry::mesh::uvs;
use crate::geometry::{PolygonMesh, Uvs, Vec3};
use crate::io::files::{source, text};

pub(in crate::io) use super::ply_header::{Element, NAMES};

/// Names of a vertex's texture coordinates.
pub(in crate::io) const UV_NAMES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

/// Properties that do not become arrays: positions and normals.
const NO_ARRAYS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Rows between two checks of the stop flag.
const PIECE: usize = 1 << 14;

/// A file whose header has been read.
pub(in crate::io) struct Body<'a> {
    pub elements: Vec<Element>,
    /// The texts of comments.
    pub comments: Vec<String>,
    reader: Reader<'a>,
}

impl Body<'_> {
    /// Reads the next row of an element and passes on each property that is not a list, by its index.
    pub fn row(
        &mut self,
        element: &Element,
        row: usize,
        mut take: impl FnMut(usize, f64),
    ) -> Result<(), String> {
        source::check_every(row, PIECE)?;
        for (n, property) in element.properties.iter().enumerate() {
            let read = match property.list {
                None => self.reader.number(property.number).map(|value| take(n, value)),
                Some(count) => self.reader.list(count, property.number).map(drop),
            };
            read.map_err(|fault| fault.at(element, row))?;
        }
        Ok(())
    }
}

/// Reads the header of a file that has vertices.
pub(in crate::io) fn open(bytes: &[u8]) -> Result<Body<'_>, String> {
    let Header { format, elements, comments, body } = ply_header::read(bytes)?;
    Ok(Body { elements, comments, reader: Reader { format, bytes: body, at: 0 } })
}

/// Reads the vertices, minus an origin that is subtracted in 64 bits, and the faces of a PLY file.
pub(in crate::io) fn parse(bytes: &[u8], origin: [f64; 3]) -> Result<PolygonMesh, String> {
    let Body { elements, mut reader, .. } = open(bytes)?;
    let mut parsed = Parsed::new(&elements, origin);
    // An element without properties has no rows in the file, whatever its count.
    for element in elements.iter().filter(|element| !element.properties.is_empty()) {
        for row in 0..element.count {
            source::check_every(row, PIECE)?;
            read_row(&mut reader, element, &mut parsed).map_err(|fault| fault.at(element, row))?;
        }
    }
    Ok(parsed.finish())
}

/// The mesh so far, and the texture coordinates of its vertices or corners.
struct Parsed {
    origin: [f64; 3],
    mesh: PolygonMesh,
    /// Names of the vertices' texture coordinates, if any.
    names: Option<[&'static str; 2]>,
    of_vertices: Vec<[f32; 2]>,
    /// Coordinates of the corners: the distinct ones, and each corner's index or none.
    of_corners: Vec<[f32; 2]>,
    known: HashMap<[u32; 2], u32>,
    at: Vec<u32>,
    /// Other arrays, each with the index of its property; without values if they cannot be kept.
    arrays: Vec<(usize, MeshArray)>,
}

/// The arrays that the properties of vertices and faces become.
fn arrays_of(elements: &[Element], names: Option<[&str; 2]>) -> Vec<(usize, MeshArray)> {
    // Triangles of strips are faces that have no rows of their own.
    let has_strips = elements.iter().any(|element| element.name == "tristrips" && element.count > 0);
    let mut out = Vec::new();
    for element in elements.iter().filter(|element| ["vertex", "face"].contains(&&*element.name)) {
        let is_vertex = element.name == "vertex";
        for (index, property) in element.properties.iter().enumerate() {
            let name = &*property.name;
            let on = match (is_vertex, property.list) {
                (true, None) if !NO_ARRAYS.contains(&name) && !names.is_some_and(|n| n.contains(&name)) => {
                    On::Vertices
                }
                (false, None) if !has_strips => On::Faces,
                (false, Some(_)) if !has_strips && !LISTS.contains(&name) => On::Corners,
                _ => continue,
            };
            let (name, number) = (property.name.clone(), property.number);
            out.push((index, MeshArray { name, on, number, values: Vec::new() }));
        }
    }
    out
}

/// Lists of faces that do not become arrays.
const LISTS: [&str; 3] = ["vertex_indices", "vertex_index", "texcoord"];

impl Parsed {
    fn new(elements: &[Element], origin: [f64; 3]) -> Self {
        let vertex = elements.iter().find(|element| element.name == "vertex");
        let has = |name: &&str| {
            vertex.is_some_and(|vertex| vertex.properties.iter().any(|p| p.name == *name && p.list.is_none()))
        };
        let names = UV_NAMES.into_iter().find(|pair| pair.iter().all(has));
        Self {
            origin,
            mesh: PolygonMesh::default(),
            names,
            arrays: arrays_of(elements, names),
            of_vertices: Vec::new(),
            of_corners: Vec::new(),
            known: HashMap::new(),
            at: Vec::new(),
        }
    }

    /// Adds values to the array of a property, if it is one.
    fn add(&mut self, on: On, property: usize, values: &[f64]) {
        let is_match = |(index, array): &&mut (usize, MeshArray)| *index == property && array.on == on;
        if let Some((_, array)) = self.arrays.iter_mut().find(is_match) {
            array.values.extend_from_slice(values);
        }
    }

    /// Adds a face, with two texture coordinates for each corner, one after another, or none.
    fn face(&mut self, corners: Vec<u32>, face_uvs: &[f64]) {
        let has_uvs = face_uvs.len() == 2 * corners.len();
        for corner in 0..corners.len() {
            let uv = [0, 1].map(|axis| if has_uvs { face_uvs[2 * corner + axis] as f32 } else { f32::NAN });
            let index = if uvs::is_finite(uv) { self.index(uv) } else { uvs::NONE };
            self.at.push(index);
        }
        self.mesh.push(corners);
        // A face of fewer than three corners is ignored.
        self.at.truncate(self.mesh.corners.len());
    }

    /// Index of a corner's coordinates among the distinct ones.
    fn index(&mut self, uv: [f32; 2]) -> u32 {
        let next = self.of_corners.len() as u32;
        let index = *self.known.entry(uv.map(|value| (value + 0.0).to_bits())).or_insert(next);
        if index == next {
            self.of_corners.push(uv);
        }
        index
    }

    fn finish(self) -> PolygonMesh {
        let (corners, count) = (&self.mesh.corners, self.mesh.positions.len());
        let uvs = match Uvs::of_corners(self.of_corners, self.at, corners, count) {
            None if self.names.is_some() => {
                let missing = self.of_vertices.iter().filter(|uv| !uvs::is_finite(**uv)).count();
                let known = |uv: [f32; 2]| if uvs::is_finite(uv) { uv } else { [0.0; 2] };
                let coordinates = self.of_vertices.into_iter().map(known).collect();
                Some(Uvs { coordinates, corners: None, missing })
            }
            of_corners => of_corners,
        };
        let [vertices, corners, faces] =
            [self.mesh.positions.len(), self.mesh.corners.len(), self.mesh.ends.len()];
        let is_whole = |array: &MeshArray| {
            array.values.len()
                == match array.on {
                    On::Vertices => vertices,
                    On::Corners => corners,
                    On::Faces => faces,
                }
        };
        let arrays = self.arrays.into_iter().map(|(_, array)| array).filter(is_whole).collect();
        PolygonMesh { uvs, arrays, ..self.mesh }
    }
}

struct Reader<'a> {
    format: Format,
    bytes: &'a [u8],
    at: usize,
}

/// Why a row cannot be read.
enum Fault {
    End,
    Text(String),
    Count(f64),
}

impl Fault {
    /// As a message.
    fn at(self, element: &Element, row: usize) -> String {
        let row = format_args!("{} {} of {}", element.name, row + 1, element.count);
        match self {
            Self::End => format!("the .ply file ends in {row}"),
            Self::Text(what) => format!("{row}: {what}"),
            Self::Count(count) => format!("{row} cannot have {count} entries"),
        }
    }
}

impl Reader<'_> {
    /// The numbers of a list, after their count.
    fn list(&mut self, count: Number, number: Number) -> Result<Vec<f64>, Fault> {
        let count = self.number(count)?;
        // A damaged count must not allocate more than the file could fill.
        if !(0.0..=self.bytes.len() as f64).contains(&count) {
            return Err(Fault::Count(count));
        }
        (0..count as usize).map(|_| self.number(number)).collect()
    }

    fn number(&mut self, number: Number) -> Result<f64, Fault> {
        if self.format == Format::Ascii {
            let rest = &self.bytes[self.at..];
            let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or(Fault::End)?;
            let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
            self.at += start + length;
            let word = &rest[start..start + length];
            return text::number(word).ok_or_else(|| Fault::Text(text::not_a_number(word)));
        }
        let size = number.size();
        let raw = self.bytes.get(self.at..self.at + size).ok_or(Fault::End)?;
        self.at += size;
        let mut wide = [0u8; 8];
        wide[..size].copy_from_slice(raw);
        if self.format == Format::Big {
            wide[..size].reverse();
        }
        let bits = u64::from_le_bytes(wide);
        let unused = 64 - 8 * size as u32;
        Ok(match number {
            Number::U8 | Number::U16 | Number::U32 => bits as f64,
            Number::I8 | Number::I16 | Number::I32 => ((bits << unused) as i64 >> unused) as f64,
            Number::F32 => f64::from(f32::from_bits(bits as u32)),
            Number::F64 => f64::from_bits(bits),
        })
    }
}

/// Reads one row of an element.
fn read_row(reader: &mut Reader<'_>, element: &Element, parsed: &mut Parsed) -> Result<(), Fault> {
    let (mut position, mut uv) = ([0.0f64; 3], [0.0f64; 2]);
    let (mut corners, mut face_uvs) = (Vec::new(), Vec::new());
    let is_vertex = element.name == "vertex";
    // The values of a face, whose corners are known only at its end.
    let (mut of_face, mut of_corners) = (Vec::new(), Vec::new());
    for (index, property) in element.properties.iter().enumerate() {
        let name = property.name.as_str();
        match property.list {
            None => {
                let value = reader.number(property.number)?;
                if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
                    position[axis] = value;
                } else if let Some(axis) =
                    parsed.names.and_then(|names| names.iter().position(|n| *n == name))
                {
                    uv[axis] = value;
                } else if is_vertex {
                    parsed.add(On::Vertices, index, &[value]);
                } else {
                    of_face.push((index, value));
                }
            }
            Some(count) => {
                let values = reader.list(count, property.number)?;
                match (element.name.as_str(), name) {
                    ("face", "vertex_indices" | "vertex_index") => {
                        corners = values.into_iter().map(vertex).collect();
                    }
                    ("face", "texcoord") => face_uvs = values,
                    ("tristrips", _) => add_strips(&values, parsed),
                    ("face", _) => of_corners.push((index, values)),
                    _ => {}
                }
            }
        }
    }
    match element.name.as_str() {
        "vertex" => {
            let position = [0, 1, 2].map(|axis| (position[axis] - parsed.origin[axis]) as f32);
            parsed.mesh.positions.push(Vec3::from(position));
            if parsed.names.is_some() {
                parsed.of_vertices.push(uv.map(|value| value as f32));
            }
        }
        "face" => {
            if corners.len() >= 3 {
                of_face.into_iter().for_each(|(index, value)| parsed.add(On::Faces, index, &[value]));
                of_corners.into_iter().for_each(|(index, values)| {
                    if values.len() == corners.len() {
                        parsed.add(On::Corners, index, &values);
                    }
                });
            }
            parsed.face(corners, &face_uvs);
        }
        _ => {}
    }
    Ok(())
}

/// A vertex index; other values than integers from 0 become one that validation refuses.
fn vertex(value: f64) -> u32 {
    if (0.0..f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0 { value as u32 } else { u32::MAX }
}

/// Strips end at -1; every other triangle is flipped.
fn add_strips(values: &[f64], parsed: &mut Parsed) {
    for strip in values.split(|&value| value < 0.0) {
        for (number, three) in strip.windows(3).enumerate() {
            let [a, b, c] = [vertex(three[0]), vertex(three[1]), vertex(three[2])];
            parsed.face(if number % 2 == 0 { vec![a, b, c] } else { vec![b, a, c] }, &[]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ply_write::{Carried, write};
    use super::*;
    use crate::geometry::TriMesh;

    #[test]
    fn what_is_written_is_read_and_a_cut_file_is_refused() {
        let mesh = TriMesh {
            positions: vec![Vec3::new(0.1, -2.5, 1e-7), Vec3::x(), Vec3::y()],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, &Carried::default()).unwrap();
        assert_eq!(parse(&bytes, [0.0; 3]).unwrap().into_triangles(), mesh);
        (0..bytes.len()).for_each(|cut| assert!(parse(&bytes[..cut], [0.0; 3]).is_err(), "{cut} bytes"));
    }

    #[test]
    fn ascii_polygons_and_strips_become_triangles() {
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 1\nproperty list uchar int vertex_indices\nelement tristrips 1\n\
                    property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n5 0 1 2 3 -1\n";
        let mesh = parse(text.as_bytes(), [0.0; 3]).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 2], [2, 1, 3]]);
    }

    #[test]
    fn arrays_of_vertices_faces_and_corners_are_kept() {
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                    property float nx\nproperty uchar red\nproperty double mask\n\
                    element face 3\nproperty int part\nproperty list uchar int vertex_indices\nproperty list uchar float wet\n\
                    end_header\n0 0 0 1 255 0.1\n1 0 0 1 0 2\n1 1 0 1 7 3\n0 1 0 1 8 4\n\
                    5 4 0 1 2 3 4 .5 .25 .125 1\n6 2 0 1 2 9 9\n-7 3 2 1 0 3 9 8 7\n";
        let mesh = parse(text.as_bytes(), [0.0; 3]).unwrap().into_detailed();
        assert_eq!(mesh.mesh.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
        let array = |name: &str| mesh.arrays.iter().find(|array| array.name == name).unwrap();
        assert_eq!(mesh.arrays.len(), 4);
        assert_eq!(
            (array("red").number, &array("red").values[..]),
            (Number::U8, &[255.0, 0.0, 7.0, 8.0][..])
        );
        assert_eq!(array("mask").values, [0.1, 2.0, 3.0, 4.0]);
        assert_eq!((array("part").on, &array("part").values[..]), (On::Faces, &[5.0, 5.0, -7.0][..]));
        assert_eq!(array("wet").values, [0.5, 0.25, 0.125, 0.5, 0.125, 1.0, 9.0, 8.0, 7.0]);
        let arrays: Vec<&MeshArray> = mesh.arrays.iter().collect();
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh.mesh, &Carried { arrays: &arrays, ..Carried::default() }).unwrap();
        let again = parse(&bytes, [0.0; 3]).unwrap().into_detailed();
        assert_eq!(again.mesh, mesh.mesh);
        arrays.iter().for_each(|array| assert!(again.arrays.contains(array), "{}", array.name));
    }
}
