//! Headers of PLY files.

use crate::geometry::mesh::attributes::Number;
use crate::io::files::text;

/// Encoding of the numbers after a header.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::io) enum Format {
    Ascii,
    Little,
    Big,
}

pub(in crate::io) struct Property {
    pub name: String,
    pub number: Number,
    /// Type of the count, for a list.
    pub list: Option<Number>,
}

impl Property {
    /// Whether its numbers are floats.
    pub fn is_float(&self) -> bool {
        self.number.is_float()
    }
}

pub(in crate::io) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

/// A parsed header.
pub(in crate::io) struct Header<'a> {
    pub format: Format,
    pub elements: Vec<Element>,
    /// The texts of comments.
    pub comments: Vec<String>,
    /// The bytes after it.
    pub body: &'a [u8],
}

/// Reads the header of a file that has vertices.
pub(in crate::io) fn read(bytes: &[u8]) -> Result<Header<'_>, String> {
    let (lines, body) = head(text::without_mark(bytes)?)?;
    let (format, elements) = parse_header(&lines)?;
    check_coordinates(&elements)?;
    let comments = lines.iter().filter_map(|line| line.strip_prefix("comment "));
    let comments = comments.map(|text| text.trim().to_string()).collect();
    Ok(Header { format, elements, comments, body })
}

/// The lines of a header before `end_header`, and the bytes after it. The first line shows how all lines end: if that is a carriage return
/// alone, a line feed after the last of them belongs to the numbers.
fn head(bytes: &[u8]) -> Result<(Vec<String>, &[u8]), String> {
    let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
    let first = bytes.iter().position(is_end).filter(|&end| bytes[..end].trim_ascii() == b"ply");
    let end = first.ok_or("not a .ply file, or its header is cut short")?;
    let has_returns_only = bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n');
    let (mut lines, mut rest) = (Vec::new(), bytes);
    loop {
        let is_end = |byte: &u8| *byte == b'\n' || has_returns_only && *byte == b'\r';
        let end = rest.iter().position(is_end).ok_or("the .ply header is cut short")?;
        let line = &rest[..end];
        rest = &rest[end + 1..];
        if line.trim_ascii_start().split(u8::is_ascii_whitespace).next() == Some(b"end_header") {
            return Ok((lines, rest));
        }
        // Comments may have any encoding.
        lines.push(String::from_utf8_lossy(line).trim().to_string());
    }
}

fn parse_header(lines: &[String]) -> Result<(Format, Vec<Element>), String> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    for (number, line) in lines.iter().enumerate().skip(1) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = || {
            format!(
                "line {}: \"{}\" is not a line of a .ply header",
                number + 1,
                text::shown(line.as_bytes())
            )
        };
        match words.as_slice() {
            ["format", "ascii", _] => format = Some(Format::Ascii),
            ["format", "binary_little_endian", _] => format = Some(Format::Little),
            ["format", "binary_big_endian", _] => format = Some(Format::Big),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong())?;
                elements.push(Element { name: name.to_string(), count, properties: Vec::new() });
            }
            ["property", "list", count, number, name] => {
                let (list, number) =
                    (Some(number_of(count).ok_or_else(wrong)?), number_of(number).ok_or_else(wrong)?);
                let element = elements.last_mut().ok_or_else(wrong)?;
                element.properties.push(Property { name: name.to_string(), number, list });
            }
            ["property", number, name] => {
                let number = number_of(number).ok_or_else(wrong)?;
                let element = elements.last_mut().ok_or_else(wrong)?;
                element.properties.push(Property { name: name.to_string(), number, list: None });
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return Err(wrong()),
        }
    }
    Ok((format.ok_or("the .ply header names no format")?, elements))
}

/// A vertex without one of x, y, z would get 0 for it.
fn check_coordinates(elements: &[Element]) -> Result<(), String> {
    let vertex =
        elements.iter().find(|element| element.name == "vertex").ok_or("the .ply file has no vertices")?;
    let has = |axis: &str| vertex.properties.iter().any(|p| p.name == axis && p.list.is_none());
    match ["x", "y", "z"].into_iter().find(|axis| !has(axis)) {
        Some(axis) => Err(format!("the vertices of the .ply file have no property {axis}")),
        None => Ok(()),
    }
}

fn number_of(name: &str) -> Option<Number> {
    NAMES.iter().find(|(names, _)| names.contains(&name)).map(|(_, number)| *number)
}

/// Types by their names in headers; the first name is the one that we write.
pub(in crate::io) const NAMES: [([&str; 2], Number); 8] = [
    (["char", "int8"], Number::I8),
    (["uchar", "uint8"], Number::U8),
    (["short", "int16"], Number::I16),
    (["ushort", "uint16"], Number::U16),
    (["int", "int32"], Number::I32),
    (["uint", "uint32"], Number::U32),
    (["float", "float32"], Number::F32),
    (["double", "float64"], Number::F64),
];
