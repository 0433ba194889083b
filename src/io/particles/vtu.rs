//! .vtu, VTK's XML files: the points of an UnstructuredGrid with their data, all pieces one after another. Cells are skipped.

use std::borrow::Cow;
use std::str::FromStr;

use roxmltree::{Document, Node};

use super::ParticleColumns;
use super::vtu_data::{Codec, File, Inflate, Stream, lz4, zlib};
use crate::io::files::numbers::{Kind, Numbers, Order};

/// Reads the points of a file.
pub(in crate::io) fn parse(bytes: &[u8]) -> Result<ParticleColumns, String> {
    let (text, appended) = split(bytes)?;
    let text = std::str::from_utf8(&text).map_err(|_| "is not a .vtu file: it is not text")?;
    let document =
        Document::parse(text).map_err(|error| format!("is cut short or not a .vtu file: {error}"))?;
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or("nothing");
    if root.tag_name().name() != "VTKFile" || kind != "UnstructuredGrid" {
        return Err(format!("the file holds {kind}: only points of UnstructuredGrid are read"));
    }
    let file = File { codec: codec_of(root)?, appended: appended_of(root, appended)?, length: bytes.len() };
    let grid = child(root, "UnstructuredGrid").ok_or("the .vtu file has no UnstructuredGrid")?;
    let mut all: Option<Piece> = None;
    for (n, node) in children(grid, "Piece").enumerate() {
        let piece = Piece::read(&file, node)?;
        match &mut all {
            // The arrays of a piece without points do not matter.
            Some(_) if piece.count == 0 => {}
            Some(all) if all.count > 0 => {
                all.append(piece)
                    .ok_or_else(|| format!("piece {} has other data than the pieces before it", n + 1))?;
            }
            _ => all = Some(piece),
        }
    }
    let Piece { positions, arrays, left_out, .. } = all.ok_or("the .vtu file has no Piece")?;
    let mut found = ParticleColumns::new(positions);
    for Array { name, kind, components, numbers } in arrays {
        found.add(&name, kind, components, numbers)?;
    }
    left_out.iter().for_each(|name| found.leave_out(name));
    Ok(found)
}

/// Splits a file into its XML and the appended data, which need not be text: the bytes after the underscore of AppendedData.
fn split(bytes: &[u8]) -> Result<(Cow<'_, [u8]>, &[u8]), String> {
    let find = |what: &[u8], from: usize| {
        bytes[from..].windows(what.len()).position(|window| window == what).map(|at| from + at)
    };
    let Some(start) = find(b"<AppendedData", 0) else { return Ok((Cow::Borrowed(bytes), &[])) };
    if !bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        return Err("the .vtu file is cut short".into());
    }
    let open = find(b">", start).ok_or("the .vtu file is cut short")?;
    let data =
        find(b"_", open).ok_or("the appended data of the .vtu file do not begin with an underscore")?;
    let text = [&bytes[..open], b"/></VTKFile>"].concat();
    Ok((Cow::Owned(text), &bytes[data + 1..]))
}

fn codec_of(root: Node<'_, '_>) -> Result<Codec, String> {
    let order = match root.attribute("byte_order") {
        Some("BigEndian") => Order::Big,
        Some("LittleEndian") | None => Order::Little,
        Some(other) => return Err(format!("the .vtu file has the byte order \"{other}\"")),
    };
    let head = match root.attribute("header_type") {
        Some("UInt64") => Kind::U64,
        Some("UInt32") | None => Kind::U32,
        Some(other) => return Err(format!("the .vtu file has headers of type \"{other}\"")),
    };
    let inflate = match root.attribute("compressor") {
        None | Some("") => None,
        Some("vtkZLibDataCompressor") => Some(zlib as Inflate),
        Some("vtkLZ4DataCompressor") => Some(lz4 as Inflate),
        Some(other) => {
            return Err(format!("the .vtu file is compressed by {other}: only zlib and LZ4 are read"));
        }
    };
    Ok(Codec { order, head, inflate })
}

/// The appended data, and whether they are base64 or raw.
fn appended_of<'a>(root: Node<'_, '_>, data: &'a [u8]) -> Result<Option<(bool, &'a [u8])>, String> {
    let Some(node) = child(root, "AppendedData") else { return Ok(None) };
    match node.attribute("encoding") {
        Some("raw") => Ok(Some((false, data))),
        Some("base64") => Ok(Some((true, data))),
        other => {
            Err(format!("the appended data of the .vtu file have the encoding \"{}\"", other.unwrap_or("")))
        }
    }
}

fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// A number in an attribute, or `default` if the attribute is missing.
fn number<T: FromStr>(node: Node<'_, '_>, name: &str, default: Option<T>) -> Result<T, String> {
    match (node.attribute(name), default) {
        (Some(text), _) => text.trim().parse().map_err(|_| format!("the .vtu file has {name}=\"{text}\"")),
        (None, Some(value)) => Ok(value),
        (None, None) => Err(format!("the .vtu file lacks a {name}")),
    }
}

/// An array with one number, or a fixed number of components, for each point.
struct Array {
    name: String,
    kind: Kind,
    components: usize,
    numbers: Numbers,
}

/// The points of a piece of the grid.
struct Piece {
    count: usize,
    positions: Numbers,
    arrays: Vec<Array>,
    left_out: Vec<String>,
}

impl Piece {
    fn read(file: &File<'_>, node: Node<'_, '_>) -> Result<Self, String> {
        let count = number(node, "NumberOfPoints", None)?;
        let points = child(node, "Points").and_then(|points| child(points, "DataArray"));
        let positions = match points {
            Some(node) => Array::read(file, node, count)?,
            None if count == 0 => None,
            None => return Err("the .vtu file has a piece without Points".into()),
        };
        let positions = match positions {
            Some(Array { kind, components: 3, numbers, .. }) if kind.is_float() => numbers,
            None if count == 0 => Kind::F64.empty(),
            _ => return Err("the Points of the .vtu file are not three floats each".into()),
        };
        let (mut arrays, mut left_out) = (Vec::new(), Vec::new());
        let data = child(node, "PointData");
        for node in data.iter().flat_map(|data| data.children()).filter(Node::is_element) {
            match Array::read(file, node, count)? {
                Some(array) => arrays.push(array),
                None => left_out.push(node.attribute("Name").unwrap_or("").to_string()),
            }
        }
        Ok(Self { count, positions, arrays, left_out })
    }

    /// Appends another piece; none if its arrays differ.
    fn append(&mut self, other: Self) -> Option<()> {
        let is_alike =
            |(a, b): (&Array, &Array)| a.name == b.name && a.kind == b.kind && a.components == b.components;
        let has_all =
            self.arrays.len() == other.arrays.len() && self.arrays.iter().zip(&other.arrays).all(is_alike);
        let is_of_one_kind =
            std::mem::discriminant(&self.positions) == std::mem::discriminant(&other.positions);
        if !has_all || !is_of_one_kind {
            return None;
        }
        self.count += other.count;
        self.positions.append(other.positions);
        self.arrays.iter_mut().zip(other.arrays).for_each(|(own, other)| own.numbers.append(other.numbers));
        Some(())
    }
}

impl Array {
    /// Reads an array for `count` points; none if it does not consist of numbers.
    fn read(file: &File<'_>, node: Node<'_, '_>, count: usize) -> Result<Option<Self>, String> {
        let name = node.attribute("Name").unwrap_or("").to_string();
        let kind = node.attribute("type").and_then(kind_of);
        let Some(kind) = kind.filter(|_| node.has_tag_name("DataArray")) else { return Ok(None) };
        let components = number(node, "NumberOfComponents", Some(1usize))?;
        let of_array = |what: String| format!("the array \"{name}\" {what}");
        let numbers = count.checked_mul(components);
        let numbers = numbers.ok_or_else(|| of_array("is too large".into()))?;
        let text = || node.children().filter(Node::is_text).filter_map(|text| text.text());
        let read = match node.attribute("format") {
            Some("ascii") => file.words(kind, numbers, text().flat_map(str::split_ascii_whitespace)),
            Some("binary") => {
                let packed: Vec<u8> =
                    text().flat_map(str::bytes).filter(|byte| !byte.is_ascii_whitespace()).collect();
                file.array(kind, numbers, Stream::base64(&packed))
            }
            Some("appended") => {
                let offset = number(node, "offset", None)?;
                file.appended(offset).and_then(|stream| file.array(kind, numbers, stream))
            }
            other => Err(format!("has the format \"{}\"", other.unwrap_or(""))),
        };
        Ok(Some(Self { kind, components, numbers: read.map_err(of_array)?, name }))
    }
}

fn kind_of(name: &str) -> Option<Kind> {
    Some(match name {
        "Int8" => Kind::I8,
        "UInt8" => Kind::U8,
        "Int16" => Kind::I16,
        "UInt16" => Kind::U16,
        "Int32" => Kind::I32,
        "UInt32" => Kind::U32,
        "Int64" => Kind::I64,
        "UInt64" => Kind::U64,
        "Float32" => Kind::F32,
        "Float64" => Kind::F64,
        _ => return None,
    })
}
