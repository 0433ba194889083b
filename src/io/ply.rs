//! Stanford PLY: ascii and binary of both byte orders; faces as lists or as triangle strips; texture coordinates of vertices
//! (s and t, u and v, texture_u and texture_v) or of the corners of faces (a list texcoord).

use std::collections::HashMap;
use std::io::Write;

use super::source;
use crate::base::{PolygonMesh, TriMesh, Uvs, Vec3, uvs};

/// Names of a vertex' texture coordinates.
const PLACES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

/// Rows between two looks at whether to stop.
const PIECE: usize = 1 << 14;

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Int(usize),
    Unsigned(usize),
    Float(usize),
}

pub(super) struct Property {
    pub name: String,
    kind: Kind,
    /// Kind of the count, for a list.
    pub list: Option<Kind>,
}

impl Property {
    /// Whether its numbers are floats.
    pub fn is_float(&self) -> bool {
        matches!(self.kind, Kind::Float(_))
    }
}

pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

/// A file whose header is read.
pub(super) struct Body<'a> {
    pub elements: Vec<Element>,
    /// The texts of comments.
    pub comments: Vec<String>,
    reader: Reader<'a>,
}

impl Body<'_> {
    /// Reads the next row of an element; each property that is not a list is handed over by its index.
    pub fn row(
        &mut self,
        element: &Element,
        row: usize,
        mut take: impl FnMut(usize, f64),
    ) -> Result<(), String> {
        if row.is_multiple_of(PIECE) && source::is_stopped() {
            return Err("stopped".into());
        }
        for (n, property) in element.properties.iter().enumerate() {
            let read = match property.list {
                None => self.reader.number(property.kind).map(|value| take(n, value)),
                Some(count) => self.reader.list(count, property.kind).map(drop),
            };
            read.map_err(|fault| fault.at(element, row))?;
        }
        Ok(())
    }
}

/// Reads the header of a file that has vertices.
pub(super) fn open(bytes: &[u8]) -> Result<Body<'_>, String> {
    let end = find(bytes, b"end_header").ok_or("not a .ply file, or its header is cut short")?;
    let body =
        end + bytes[end..].iter().position(|&byte| byte == b'\n').ok_or("the .ply header is cut short")? + 1;
    let header = std::str::from_utf8(&bytes[..end]).map_err(|_| "the .ply header is not text")?;
    let (format, elements) = parse_header(header)?;
    check_coordinates(&elements)?;
    let comments = header.lines().filter_map(|line| line.strip_prefix("comment "));
    let comments = comments.map(|text| text.trim().to_string()).collect();
    Ok(Body { elements, comments, reader: Reader { format, bytes: &bytes[body..], at: 0 } })
}

/// Reads the vertices and faces of a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<PolygonMesh, String> {
    let Body { elements, mut reader, .. } = open(bytes)?;
    let mut parsed = Parsed::new(&elements);
    // An element without properties has no rows in the file, whatever its count.
    for element in elements.iter().filter(|element| !element.properties.is_empty()) {
        for row in 0..element.count {
            if row.is_multiple_of(PIECE) && source::is_stopped() {
                return Err("stopped".into());
            }
            read_row(&mut reader, element, &mut parsed).map_err(|fault| fault.at(element, row))?;
        }
    }
    Ok(parsed.finish())
}

/// The mesh so far, and the texture coordinates of its vertices or corners.
struct Parsed {
    mesh: PolygonMesh,
    /// Names of the vertices' texture coordinates, where they have any.
    names: Option<[&'static str; 2]>,
    of_vertices: Vec<[f32; 2]>,
    /// Of the corners: the different ones, and each corner's index or none.
    of_corners: Vec<[f32; 2]>,
    known: HashMap<[u32; 2], u32>,
    at: Vec<u32>,
}

impl Parsed {
    fn new(elements: &[Element]) -> Self {
        let vertex = elements.iter().find(|element| element.name == "vertex");
        let has = |name: &&str| {
            vertex.is_some_and(|vertex| vertex.properties.iter().any(|p| p.name == *name && p.list.is_none()))
        };
        Self {
            mesh: PolygonMesh::default(),
            names: PLACES.into_iter().find(|pair| pair.iter().all(has)),
            of_vertices: Vec::new(),
            of_corners: Vec::new(),
            known: HashMap::new(),
            at: Vec::new(),
        }
    }

    /// Adds a face, with two texture coordinates for each corner, one after another, or none.
    fn face(&mut self, corners: Vec<u32>, places: &[f64]) {
        let has = places.len() == 2 * corners.len();
        for corner in 0..corners.len() {
            let place = [0, 1].map(|axis| if has { places[2 * corner + axis] as f32 } else { f32::NAN });
            let index = if uvs::is_finite(place) { self.index(place) } else { uvs::NONE };
            self.at.push(index);
        }
        self.mesh.push(corners);
        // A face of fewer than three corners is none.
        self.at.truncate(self.mesh.corners.len());
    }

    fn index(&mut self, place: [f32; 2]) -> u32 {
        let next = self.of_corners.len() as u32;
        let index = *self.known.entry(place.map(|value| (value + 0.0).to_bits())).or_insert(next);
        if index == next {
            self.of_corners.push(place);
        }
        index
    }

    fn finish(self) -> PolygonMesh {
        let (corners, count) = (&self.mesh.corners, self.mesh.positions.len());
        let uvs = match Uvs::of_corners(self.of_corners, self.at, corners, count) {
            None if self.names.is_some() => {
                let is_missing = |place: &[f32; 2]| !uvs::is_finite(*place);
                let missing = self.of_vertices.iter().filter(|place| is_missing(place)).count();
                let known = |place: [f32; 2]| if uvs::is_finite(place) { place } else { [0.0; 2] };
                let places = self.of_vertices.into_iter().map(known).collect();
                Some(Uvs { places, corners: None, missing })
            }
            of_corners => of_corners,
        };
        PolygonMesh { uvs, ..self.mesh }
    }
}

fn find(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    bytes.windows(needle.len()).position(|window| window == needle)
}

fn parse_header(header: &str) -> Result<(Format, Vec<Element>), String> {
    let mut lines = header.lines();
    if lines.next().map(str::trim) != Some("ply") {
        return Err("not a .ply file".into());
    }
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    for (number, line) in lines.enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = || format!("line {}: \"{}\" is not a line of a .ply header", number + 2, line.trim());
        match words.as_slice() {
            ["format", "ascii", _] => format = Some(Format::Ascii),
            ["format", "binary_little_endian", _] => format = Some(Format::Little),
            ["format", "binary_big_endian", _] => format = Some(Format::Big),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong())?;
                elements.push(Element { name: name.to_string(), count, properties: Vec::new() });
            }
            ["property", "list", count, kind, name] => {
                let (list, kind) =
                    (Some(kind_of(count).ok_or_else(wrong)?), kind_of(kind).ok_or_else(wrong)?);
                let element = elements.last_mut().ok_or_else(wrong)?;
                element.properties.push(Property { name: name.to_string(), kind, list });
            }
            ["property", kind, name] => {
                let kind = kind_of(kind).ok_or_else(wrong)?;
                let element = elements.last_mut().ok_or_else(wrong)?;
                element.properties.push(Property { name: name.to_string(), kind, list: None });
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return Err(wrong()),
        }
    }
    Ok((format.ok_or("the .ply header names no format")?, elements))
}

/// A vertex without one of x, y, z would lie at 0.
fn check_coordinates(elements: &[Element]) -> Result<(), String> {
    let vertex =
        elements.iter().find(|element| element.name == "vertex").ok_or("the .ply file has no vertices")?;
    let has = |axis: &str| vertex.properties.iter().any(|p| p.name == axis && p.list.is_none());
    match ["x", "y", "z"].into_iter().find(|axis| !has(axis)) {
        Some(axis) => Err(format!("the vertices of the .ply file have no property {axis}")),
        None => Ok(()),
    }
}

fn kind_of(name: &str) -> Option<Kind> {
    Some(match name {
        "char" | "int8" => Kind::Int(1),
        "short" | "int16" => Kind::Int(2),
        "int" | "int32" => Kind::Int(4),
        "uchar" | "uint8" => Kind::Unsigned(1),
        "ushort" | "uint16" => Kind::Unsigned(2),
        "uint" | "uint32" => Kind::Unsigned(4),
        "float" | "float32" => Kind::Float(4),
        "double" | "float64" => Kind::Float(8),
        _ => return None,
    })
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
    /// In words.
    fn at(self, element: &Element, row: usize) -> String {
        let place = format_args!("{} {} of {}", element.name, row + 1, element.count);
        match self {
            Self::End => format!("the .ply file ends in {place}"),
            Self::Text(text) => format!("{place}: \"{text}\" is not a number"),
            Self::Count(count) => format!("{place} cannot have {count} entries"),
        }
    }
}

impl Reader<'_> {
    /// The numbers of a list, after their count.
    fn list(&mut self, count: Kind, kind: Kind) -> Result<Vec<f64>, Fault> {
        let count = self.number(count)?;
        // A damaged count must not allocate more than the file could fill.
        if !(0.0..=self.bytes.len() as f64).contains(&count) {
            return Err(Fault::Count(count));
        }
        (0..count as usize).map(|_| self.number(kind)).collect()
    }

    fn number(&mut self, kind: Kind) -> Result<f64, Fault> {
        if self.format == Format::Ascii {
            let rest = &self.bytes[self.at..];
            let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or(Fault::End)?;
            let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
            self.at += start + length;
            let text = String::from_utf8_lossy(&rest[start..start + length]);
            return text.parse().map_err(|_| Fault::Text(text.chars().take(40).collect()));
        }
        let (Kind::Int(size) | Kind::Unsigned(size) | Kind::Float(size)) = kind;
        let raw = self.bytes.get(self.at..self.at + size).ok_or(Fault::End)?;
        self.at += size;
        let mut wide = [0u8; 8];
        wide[..size].copy_from_slice(raw);
        if self.format == Format::Big {
            wide[..size].reverse();
        }
        let bits = u64::from_le_bytes(wide);
        let unused = 64 - 8 * size as u32;
        Ok(match kind {
            Kind::Unsigned(_) => bits as f64,
            Kind::Int(_) => ((bits << unused) as i64 >> unused) as f64,
            Kind::Float(4) => f64::from(f32::from_bits(bits as u32)),
            Kind::Float(_) => f64::from_bits(bits),
        })
    }
}

/// Reads one row of an element.
fn read_row(reader: &mut Reader<'_>, element: &Element, parsed: &mut Parsed) -> Result<(), Fault> {
    let (mut position, mut place) = ([0.0f64; 3], [0.0f64; 2]);
    let (mut corners, mut places) = (Vec::new(), Vec::new());
    for property in &element.properties {
        let name = property.name.as_str();
        match property.list {
            None => {
                let value = reader.number(property.kind)?;
                if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
                    position[axis] = value;
                } else if let Some(axis) =
                    parsed.names.and_then(|names| names.iter().position(|n| *n == name))
                {
                    place[axis] = value;
                }
            }
            Some(count) => {
                let values = reader.list(count, property.kind)?;
                match (element.name.as_str(), name) {
                    ("face", "vertex_indices" | "vertex_index") => {
                        corners = values.into_iter().map(index).collect();
                    }
                    ("face", "texcoord") => places = values,
                    ("tristrips", _) => add_strips(&values, parsed),
                    _ => {}
                }
            }
        }
    }
    match element.name.as_str() {
        "vertex" => {
            parsed.mesh.positions.push(Vec3::from(position.map(|value| value as f32)));
            if parsed.names.is_some() {
                parsed.of_vertices.push(place.map(|value| value as f32));
            }
        }
        "face" => parsed.face(corners, &places),
        _ => {}
    }
    Ok(())
}

/// Indices that are not integers from 0 become one that validation refuses.
fn index(value: f64) -> u32 {
    if (0.0..f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0 { value as u32 } else { u32::MAX }
}

/// Strips end at -1; every other triangle is flipped.
fn add_strips(values: &[f64], parsed: &mut Parsed) {
    for strip in values.split(|&value| value < 0.0) {
        for (number, three) in strip.windows(3).enumerate() {
            let [a, b, c] = [index(three[0]), index(three[1]), index(three[2])];
            parsed.face(if number % 2 == 0 { vec![a, b, c] } else { vec![b, a, c] }, &[]);
        }
    }
}

/// Writes binary little-endian PLY, with velocities when there is one for each vertex, and texture coordinates: s and t of
/// the vertices, or where there are seams a list texcoord of the faces.
pub(super) fn write(
    out: &mut dyn Write,
    mesh: &TriMesh,
    velocities: &[Vec3],
    uvs: Option<&Uvs>,
) -> std::io::Result<()> {
    let moving = velocities.len() == mesh.positions.len();
    let of_vertices = uvs.filter(|uvs| uvs.corners.is_none());
    let of_corners = uvs.filter(|uvs| uvs.corners.is_some());
    let mut names = vec!["x", "y", "z"];
    names.extend(moving.then_some(["vx", "vy", "vz"]).into_iter().flatten());
    names.extend(of_vertices.map(|_| PLACES[0]).into_iter().flatten());
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment frazil\nelement vertex {}",
        mesh.positions.len()
    )?;
    names.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
    let faces = mesh.triangles.len();
    writeln!(out, "element face {faces}\nproperty list uchar uint vertex_indices")?;
    if of_corners.is_some() {
        writeln!(out, "property list uchar float texcoord")?;
    }
    writeln!(out, "end_header")?;
    for (vertex, p) in mesh.positions.iter().enumerate() {
        let velocity = velocities.get(vertex).filter(|_| moving);
        let place = of_vertices.map(|uvs| uvs.places[vertex]);
        let values = p.iter().chain(velocity.into_iter().flatten()).chain(place.iter().flatten());
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
        if let Some(uvs) = of_corners {
            out.write_all(&[6])?;
            for index in uvs.indices(&mesh.triangles, number) {
                for value in uvs.places[index as usize] {
                    out.write_all(&value.to_le_bytes())?;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_a_cut_file_is_refused() {
        let mesh = TriMesh {
            positions: vec![Vec3::new(0.1, -2.5, 1e-7), Vec3::x(), Vec3::y()],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        };
        let mut bytes = Vec::new();
        write(&mut bytes, &mesh, &[], None).unwrap();
        assert_eq!(parse(&bytes).unwrap().into_triangles(), mesh);
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "{length} of {} bytes were accepted", bytes.len());
        }
    }

    #[test]
    fn ascii_polygons_and_strips_become_triangles() {
        let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 1\nproperty list uchar int vertex_indices\nelement tristrips 1\n\
                    property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n5 0 1 2 3 -1\n";
        let mesh = parse(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 2], [2, 1, 3]]);
    }
}
