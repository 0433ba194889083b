//! Wavefront OBJ: positions, vertex colours (three numbers after the position), texture coordinates and faces, in the file's order;
//! everything else is ignored. A line that ends in a backslash continues on the next.

use std::io::Write;

use super::ply_write::Carried;
use crate::geometry::mesh::attributes::{MeshArray, Number, On};
use crate::geometry::mesh::uvs;
use crate::geometry::{PolygonMesh, TriMesh, Uvs, Vec3};
use crate::io::files::{source, text};

/// The contents of a file for a mesh without vertices.
const EMPTY: &[u8] = b"# an empty mesh\n";
/// Lines between two checks of the stop flag.
const PIECE: usize = 1 << 14;
/// Names of the arrays for the three numbers after a vertex's position.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// Reads positions, minus an origin that is subtracted in 64 bits, faces and texture coordinates. Other lines may have any encoding.
pub(in crate::io) fn parse(bytes: &[u8], origin: [f64; 3]) -> Result<PolygonMesh, String> {
    let mut reader = Reader { origin, ..Reader::default() };
    let mut lines = text::lines(text::without_mark(bytes)?);
    let mut joined = Vec::new();
    while let Some((number, line)) = lines.next() {
        source::check_every(number, PIECE)?;
        let read = match continued_statement(line) {
            None => reader.line(line),
            Some(begin) => {
                joined.clear();
                joined.extend_from_slice(begin);
                for (_, line) in lines.by_ref() {
                    // As white space: the text after the line end begins a new word.
                    joined.push(b' ');
                    let more = without_backslash(line);
                    joined.extend_from_slice(more.unwrap_or(line));
                    if more.is_none() {
                        break;
                    }
                }
                reader.line(&joined)
            }
        };
        read.map_err(|what| format!("line {number}: {what}"))?;
    }
    Ok(reader.finish())
}

/// A line without the final backslash that continues it on the next line.
fn without_backslash(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

/// As [`without_backslash`], for the lines that are read: a comment, or the name of a material or group, may end in a meaningless backslash, which
/// must not swallow the vertex after it.
fn continued_statement(line: &[u8]) -> Option<&[u8]> {
    let begin = without_backslash(line)?;
    let word = begin.trim_ascii_start().split(u8::is_ascii_whitespace).next();
    let is_read = matches!(word, Some(b"v" | b"vt" | b"f"));
    (is_read && !begin.contains(&b'#')).then_some(begin)
}

/// Whether this is a file that frazil wrote for a mesh without vertices: having no vertices proves nothing, as unrelated text has none
/// either.
pub(in crate::io) fn is_our_empty_file(bytes: &[u8]) -> bool {
    bytes == EMPTY
}

/// The contents of the lines so far.
#[derive(Default)]
struct Reader {
    origin: [f64; 3],
    mesh: PolygonMesh,
    coordinates: Vec<[f32; 2]>,
    /// For each corner its index into `coordinates`, or [`uvs::NONE`].
    corner_uvs: Vec<u32>,
    /// Red, green and blue of the vertices, as long as all have them.
    colours: Vec<[f32; 3]>,
}

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), String> {
        let line = line.split(|&byte| byte == b'#').next().unwrap_or(line).trim_ascii();
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => self.vertex(words),
            Some(b"vt") => self.texture_coordinates(words),
            Some(b"f") => self.face(words),
            _ => Ok(()),
        }
    }

    fn vertex<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let mut position = [0.0; 3];
        for (value, origin) in position.iter_mut().zip(self.origin) {
            let word = words.next().unwrap_or_default();
            let read = text::coordinate(word, origin).filter(|value| value.is_finite());
            *value = read.ok_or_else(|| {
                let what = "the vertex is not three finite numbers";
                let has_comma = text::has_decimal_comma(word);
                if has_comma { format!("{what}: {}", text::not_a_number(word)) } else { what.into() }
            })?;
        }
        self.mesh.positions.push(Vec3::from(position));
        let mut next = || words.next().and_then(number).filter(|value| value.is_finite());
        if let (Some(red), Some(green), Some(blue)) = (next(), next(), next()) {
            self.colours.push([red, green, blue]);
        }
        Ok(())
    }

    /// Reads texture coordinates: v is optional. Values that are not finite count as missing when a face refers to them.
    fn texture_coordinates<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let mut next = |default: f32| words.next().map_or(Some(default), number).unwrap_or(f32::NAN);
        self.coordinates.push([next(f32::NAN), next(0.0)]);
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let begin = self.mesh.corners.len();
        let mut corners = Vec::new();
        for word in words {
            let mut parts = word.split(|&byte| byte == b'/');
            let vertex = parts.next().and_then(|part| index(part, self.mesh.positions.len()));
            corners.push(vertex.ok_or_else(|| out_of_range(word, "vertex", self.mesh.positions.len()))?);
            let uv = match parts.next() {
                None | Some(b"") => uvs::NONE,
                Some(part) => {
                    let count = self.coordinates.len();
                    let uv =
                        index(part, count).ok_or_else(|| out_of_range(word, "texture coordinates", count))?;
                    if uvs::is_finite(self.coordinates[uv as usize]) { uv } else { uvs::NONE }
                }
            };
            self.corner_uvs.push(uv);
        }
        self.mesh.push(corners);
        // A face of fewer than three corners is ignored.
        let is_face = self.mesh.corners.len() > begin;
        if !is_face {
            self.corner_uvs.truncate(begin);
        }
        Ok(())
    }

    fn finish(self) -> PolygonMesh {
        let (corners, count) = (&self.mesh.corners, self.mesh.positions.len());
        let uvs = Uvs::of_corners(self.coordinates, self.corner_uvs, corners, count);
        let colour = |(channel, name): (usize, &&str)| MeshArray {
            name: name.to_string(),
            on: On::Vertices,
            number: Number::F32,
            values: self.colours.iter().map(|colour| f64::from(colour[channel])).collect(),
        };
        let has_colours = self.colours.len() == count;
        let arrays = if has_colours { COLOURS.iter().enumerate().map(colour).collect() } else { Vec::new() };
        PolygonMesh { uvs, arrays, ..self.mesh }
    }
}

fn number(word: &[u8]) -> Option<f32> {
    text::number(word)
}

/// A zero-based index from one that counts from 1 or, if negative, backward from the last.
fn index(word: &[u8], count: usize) -> Option<u32> {
    let number: i64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    let index = if number < 0 { count as i64 + number } else { number - 1 };
    (0..count as i64).contains(&index).then_some(index as u32)
}

fn out_of_range(word: &[u8], what: &str, count: usize) -> String {
    format!("the face names {what} {}, but there are {count} before it", text::shown(word))
}

/// Writes positions, colours and texture coordinates where there are any, and triangles.
pub(in crate::io) fn write(
    out: &mut dyn Write,
    mesh: &TriMesh,
    carried: &Carried<'_>,
) -> std::io::Result<()> {
    let Carried { uvs, arrays, .. } = carried;
    let colour = |name: &str| arrays.iter().find(|array| array.on == On::Vertices && array.name == name);
    let colours = COLOURS.map(colour);
    let share = |array: &MeshArray, vertex: usize| {
        // Integers are bytes.
        array.values[vertex] as f32 / if array.number == Number::U8 { 255.0 } else { 1.0 }
    };
    if mesh.positions.is_empty() {
        // An empty file would look as if it had been cut short.
        return out.write_all(EMPTY);
    }
    for (vertex, p) in mesh.positions.iter().enumerate() {
        match colours {
            [Some(r), Some(g), Some(b)] => {
                let [r, g, b] = [r, g, b].map(|array| share(array, vertex));
                writeln!(out, "v {} {} {} {r} {g} {b}", p.x, p.y, p.z)?;
            }
            _ => writeln!(out, "v {} {} {}", p.x, p.y, p.z)?,
        }
    }
    let Some(uvs) = uvs else {
        return mesh
            .triangles
            .iter()
            .try_for_each(|[a, b, c]| writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1));
    };
    for [u, v] in &uvs.coordinates {
        writeln!(out, "vt {u} {v}")?;
    }
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let indices = uvs.indices(&mesh.triangles, index);
        let [a, b, c] = [0, 1, 2].map(|corner| format!("{}/{}", triangle[corner] + 1, indices[corner] + 1));
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
