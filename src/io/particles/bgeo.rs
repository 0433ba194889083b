//! Classic Houdini .bgeo, version 5: what SPlisHSPlasH and Partio write, plain or gzipped. Houdini since version 12 writes another format
//! under the same name, which is refused.
//!
//! All numbers are big-endian: a header of counts, the attributes of points by name, size and type, then for each point x, y, z, w and its
//! attributes, 4 bytes per number. w, the weight of control points of curves, is ignored, as is everything after the points.

use std::io::{ErrorKind, Read, Write};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use super::ParticleColumns;
use crate::error::fail_if;
use crate::geometry::points::{Points, Values};
use crate::io::files::numbers::{Kind, Numbers, Order, max_inflated};
use crate::io::files::source;

/// Message about files in Houdini's own format.
pub(in crate::io) const HOUDINI_JSON: &str = "is Houdini's own format since version 12 (JSON), not classic .bgeo: save it from Houdini as \
                                   .bhclassic (which is classic .bgeo), as .ply, or as .vdb with VDB Points";

/// Maximum number of attributes, and of numbers in one; more means damage.
const MAX_ATTRIBUTES: u32 = 1 << 12;
/// Maximum number of texts in an attribute's list; more means damage.
const MAX_TEXTS: u32 = 1 << 20;
/// Bytes of points that are read at a time.
const PIECE: usize = 1 << 20;
/// Bytes of a number.
const WORD: usize = 4;

/// An attribute of points.
struct Field {
    name: String,
    kind: Kind,
    /// Numbers per point.
    size: usize,
    /// The numbers read; none for texts.
    numbers: Option<Numbers>,
}

/// Reads the points of a file.
pub(in crate::io) fn parse(bytes: &[u8]) -> Result<ParticleColumns, String> {
    let is_packed = bytes.starts_with(&[0x1f, 0x8b]);
    let mut reader: Box<dyn Read + '_> =
        if is_packed { Box::new(GzDecoder::new(bytes)) } else { Box::new(bytes) };
    let head = Head::read(&mut *reader)?;
    let mut fields =
        (0..head.attributes).map(|_| Field::read(&mut *reader)).collect::<Result<Vec<_>, _>>()?;
    let row = WORD * (4 + fields.iter().map(|field| field.size).sum::<usize>());
    // A damaged count must not cause an allocation.
    let room = if is_packed { max_inflated(bytes.len()) } else { bytes.len() as u64 };
    if (head.points as u64).saturating_mul(row as u64) > room {
        let (points, bytes) = (head.points, bytes.len());
        return Err(format!(
            "the file says that it has {points} particles, and is too short for them ({bytes} bytes)"
        ));
    }
    let mut positions = Kind::F32.empty();
    let mut rows = vec![0; (PIECE / row).clamp(1, head.points.max(1)) * row];
    let mut done = 0;
    while done < head.points {
        source::check_every(0, 1)?;
        let count = (rows.len() / row).min(head.points - done);
        let piece = &mut rows[..count * row];
        reader.read_exact(piece).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => format!("the file ends before its {} particles do", head.points),
            _ => damaged(&error),
        })?;
        for point in piece.chunks_exact(row) {
            Kind::F32.decode(&point[..3 * WORD], Order::Big, &mut positions)?;
            let mut at = 4 * WORD;
            for Field { kind, size, numbers, .. } in &mut fields {
                if let Some(numbers) = numbers {
                    kind.decode(&point[at..at + *size * WORD], Order::Big, numbers)?;
                }
                at += *size * WORD;
            }
        }
        done += count;
    }
    if is_packed {
        read_to_the_end(&mut *reader)?;
    }
    let mut found = ParticleColumns::new(positions);
    for Field { name, kind, size, numbers } in fields {
        match numbers {
            Some(numbers) => found.add(&name, kind, size, numbers)?,
            None => found.leave_out(&name),
        }
    }
    Ok(found)
}

/// Reads the rest, because the checksum after the last byte shows whether the file is complete and undamaged.
fn read_to_the_end(reader: &mut dyn Read) -> Result<(), String> {
    let mut rest = vec![0; PIECE];
    loop {
        source::check_every(0, 1)?;
        if reader.read(&mut rest).map_err(|error| damaged(&error))? == 0 {
            return Ok(());
        }
    }
}

fn damaged(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => "the file is cut short".into(),
        _ => "the file is damaged: its gzip data contradicts itself".into(),
    }
}

struct Head {
    points: usize,
    attributes: u32,
}

impl Head {
    fn read(reader: &mut dyn Read) -> Result<Self, String> {
        let magic: [u8; 5] = take(reader)?;
        match &magic {
            [0x7f, b'N', b'S', b'J', b'b'] | [b'[', ..] => return Err(HOUDINI_JSON.into()),
            b"PGEOM" => return Err("is a .geo file (classic, as text): save it as .bhclassic".into()),
            b"BgeoV" => {}
            _ => return Err("is not a classic .bgeo file".into()),
        }
        let version = word(reader)?;
        if version != 5 {
            return Err(format!("is a .bgeo file of version {version}, and only version 5 is read"));
        }
        // Points, primitives, groups of both; attributes of points, vertices, primitives and of the whole.
        let mut counts = [0; 8];
        for count in &mut counts {
            *count = word(reader)?;
        }
        let [points, _, _, _, attributes, ..] = counts;
        fail_if(points > i32::MAX as u32 || attributes > MAX_ATTRIBUTES, || {
            format!("the file is damaged: it has {points} particles with {attributes} attributes")
        })?;
        Ok(Self { points: points as usize, attributes })
    }
}

impl Field {
    fn read(reader: &mut dyn Read) -> Result<Self, String> {
        let name = text(reader)?;
        let size = u32::from(u16::from_be_bytes(take(reader)?));
        let number = word(reader)?;
        fail_if(size > MAX_ATTRIBUTES, || {
            format!("the file is damaged: attribute \"{name}\" has {size} components")
        })?;
        let kind = match number {
            // Floats, and vectors, which rotate with their owner.
            0 | 5 => Some(Kind::F32),
            1 => Some(Kind::I32),
            // Indices into a list of texts.
            4 => None,
            2 | 3 => {
                return Err(format!(
                    "attribute \"{name}\" holds texts that are not in a list; these are not read"
                ));
            }
            _ => return Err(format!("the file is damaged: attribute \"{name}\" is of type {number}")),
        };
        if kind.is_some() {
            (0..size).try_for_each(|_| word(reader).map(drop))?;
        } else {
            let count = word(reader)?;
            if count > MAX_TEXTS {
                return Err(format!("the file is damaged: attribute \"{name}\" has {count} texts"));
            }
            (0..count).try_for_each(|_| text(reader).map(drop))?;
        }
        Ok(Self {
            name,
            kind: kind.unwrap_or(Kind::I32),
            size: size as usize,
            numbers: kind.map(Kind::empty),
        })
    }
}

fn take<const N: usize>(reader: &mut dyn Read) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes).map_err(|error| damaged(&error))?;
    Ok(bytes)
}

fn word(reader: &mut dyn Read) -> Result<u32, String> {
    take(reader).map(u32::from_be_bytes)
}

fn text(reader: &mut dyn Read) -> Result<String, String> {
    let mut bytes = vec![0; u16::from_be_bytes(take(reader)?).into()];
    reader.read_exact(&mut bytes).map_err(|error| damaged(&error))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Checks that the format can hold these points.
///
/// # Errors
/// 64-bit integers that are too large; too many points or attributes.
pub(in crate::io) fn check(points: &Points) -> Result<(), String> {
    if points.count() > i32::MAX as usize || points.attributes.len() > MAX_ATTRIBUTES as usize {
        return Err("there are more points or attributes than .bgeo can hold".into());
    }
    for attribute in &points.attributes {
        let name = &attribute.name;
        if name.len() > i16::MAX as usize {
            return Err("the name of an attribute is longer than .bgeo can hold".into());
        }
        if let Values::Long(column) = &attribute.values
            && column.stored().iter().any(|&value| i32::try_from(value).is_err())
        {
            return Err(format!("attribute \"{name}\" has integers over 2^31, which .bgeo cannot hold"));
        }
    }
    Ok(())
}

/// Writes points that [`check`] accepts, in gzip.
pub(in crate::io) fn write(out: &mut dyn Write, points: &Points) -> std::io::Result<()> {
    // No time and no name in the gzip header: the same points give the same bytes.
    let mut out = GzEncoder::new(out, Compression::fast());
    let mut head = b"BgeoV".to_vec();
    let [count, attributes] = [points.count(), points.attributes.len()].map(|count| count as u32);
    for number in [5, count, 0, 0, 0, attributes, 0, 0, 0] {
        head.extend(number.to_be_bytes());
    }
    for attribute in &points.attributes {
        let (size, kind) = match attribute.values {
            Values::Float(_) => (1u16, 0u32),
            Values::Int(_) | Values::Long(_) | Values::Bool(_) => (1, 1),
            Values::Vector(_) => (3, 5),
        };
        head.extend((attribute.name.len() as u16).to_be_bytes());
        head.extend(attribute.name.as_bytes());
        head.extend(size.to_be_bytes());
        head.extend(kind.to_be_bytes());
        head.extend(std::iter::repeat_n(0, WORD * usize::from(size)));
    }
    out.write_all(&head)?;
    let mut row = Vec::new();
    for point in 0..points.count() {
        row.clear();
        points.position(point).iter().for_each(|part| row.extend((*part as f32).to_be_bytes()));
        row.extend(1.0f32.to_be_bytes());
        for attribute in &points.attributes {
            match &attribute.values {
                Values::Float(column) => row.extend(column.get(point).to_be_bytes()),
                Values::Int(column) => row.extend(column.get(point).to_be_bytes()),
                Values::Long(column) => row.extend((column.get(point) as i32).to_be_bytes()),
                Values::Bool(column) => row.extend(i32::from(column.get(point)).to_be_bytes()),
                Values::Vector(column) => {
                    column.get(point).iter().for_each(|part| row.extend(part.to_be_bytes()))
                }
            }
        }
        out.write_all(&row)?;
    }
    // An empty block of additional data.
    out.write_all(&[0x00, 0xff])?;
    out.finish().map(drop)
}
