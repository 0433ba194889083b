//! Legacy .vtk, versions 1.0 to 5.1, as text or (big-endian) binary: the points of POLYDATA and UNSTRUCTURED_GRID with their data. Cells
//! are skipped.
//!
//! The file is a sequence of keyword lines; some are followed by arrays of numbers.

use std::borrow::Cow;

use super::ParticleColumns;
use crate::io::files::numbers::{Kind, Numbers, Order};
use crate::io::files::{source, text};

/// Maximum length (bytes) of a keyword line: a longer line is not one.
const MAX_LINE: usize = 1 << 12;
/// Words between two checks of the stop flag.
const PIECE: usize = 1 << 16;

/// The type of an array.
#[derive(Clone, Copy, PartialEq)]
enum Type {
    Number(Kind),
    /// Packed eight to a byte in binary files.
    Bit,
    Text,
}

/// Owner of an array.
#[derive(Clone, Copy, PartialEq)]
enum Owner {
    File,
    Points,
    Cells,
}

/// Reads the points of a file.
pub(in crate::io) fn parse(bytes: &[u8]) -> Result<ParticleColumns, String> {
    let bytes = with_line_feeds(text::without_mark(bytes)?)?;
    let mut reader = Reader::open(&bytes)?;
    let mut found: Option<ParticleColumns> = None;
    let (mut owner, mut count) = (Owner::File, 0);
    while let Some(line) = reader.line()? {
        let words: Vec<&str> = line.split_whitespace().collect();
        let keyword = words[0].to_lowercase();
        let wrong = || format!("\"{}\" is not a line of a .vtk file that is understood", shown(&line));
        match (keyword.as_str(), &words[1..]) {
            ("dataset", [kind]) => check_dataset(kind)?,
            ("points", [points, kind]) if found.is_none() => {
                let Some(Type::Number(kind)) = type_of(kind) else { return Err(wrong()) };
                reader.components = 3;
                let numbers = points.parse::<usize>().ok().and_then(|points| points.checked_mul(3));
                found = Some(ParticleColumns::new(
                    reader.numbers(Type::Number(kind), numbers.ok_or_else(wrong)?)?,
                ));
            }
            ("vertices" | "lines" | "polygons" | "triangle_strips" | "cells", [cells, size]) => {
                let [cells, size] = [cells, size].map(|word| word.parse().map_err(|_| wrong()));
                reader.skip_cells(cells?, size?)?;
            }
            ("cell_types", [cells]) => {
                reader.skip(Type::Number(Kind::I32), cells.parse().map_err(|_| wrong())?)?;
            }
            ("metadata", []) => reader.skip_metadata(),
            ("point_data" | "cell_data", [values]) => {
                owner = if keyword == "point_data" { Owner::Points } else { Owner::Cells };
                count = values.parse().map_err(|_| wrong())?;
                let points = found.as_ref().map_or(0, ParticleColumns::count);
                if owner == Owner::Points && count != points {
                    return Err(format!("there are data for {count} points, but {points} points"));
                }
            }
            ("field", [_, arrays]) => {
                let arrays = arrays.parse().map_err(|_| wrong())?;
                reader.field(arrays, found.as_mut().filter(|_| owner == Owner::Points))?;
            }
            // A colour table; the line of the same name that refers to one comes after SCALARS.
            ("lookup_table", [_, colours]) => {
                let bytes = colours.parse::<usize>().ok().and_then(|colours| colours.checked_mul(4));
                reader.skip(reader.colours(), bytes.ok_or_else(wrong)?)?;
            }
            (_, rest) => {
                let array = Array::of_line(&keyword, rest).ok_or_else(wrong)?;
                let array = Array {
                    kind: if keyword == "color_scalars" { reader.colours() } else { array.kind },
                    ..array
                };
                if keyword == "scalars" {
                    reader.skip_table_name();
                }
                reader.array(&array, count, found.as_mut().filter(|_| owner == Owner::Points))?;
            }
        }
    }
    found.ok_or_else(|| "the file has no points: it is cut short, or of another kind".into())
}

/// Replaces carriage returns by line feeds, if the file is text and its lines end with carriage returns alone.
fn with_line_feeds(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(0);
    if bytes.get(end) != Some(&b'\r') || bytes.get(end + 1) == Some(&b'\n') {
        return Ok(Cow::Borrowed(bytes));
    }
    let encoding = text::lines(bytes).nth(2).map_or(&b""[..], |(_, line)| line.trim_ascii());
    if encoding.eq_ignore_ascii_case(b"binary") {
        return Err(
            "the lines of the .vtk file end with carriage returns alone: they must end with line feeds"
                .into(),
        );
    }
    Ok(Cow::Owned(bytes.iter().map(|&byte| if byte == b'\r' { b'\n' } else { byte }).collect()))
}

fn check_dataset(kind: &str) -> Result<(), String> {
    match kind.to_lowercase().as_str() {
        "polydata" | "unstructured_grid" => Ok(()),
        _ => Err(format!(
            "the file holds {}: only points of POLYDATA and UNSTRUCTURED_GRID are read",
            shown(kind)
        )),
    }
}

/// An array announced by a line.
struct Array {
    name: String,
    kind: Type,
    components: usize,
}

impl Array {
    /// From a line other than those of FIELD; `rest` is what follows the keyword.
    fn of_line(keyword: &str, rest: &[&str]) -> Option<Self> {
        let (name, kind, components) = match (keyword, rest) {
            ("scalars", [name, kind]) => (name, type_of(kind)?, 1),
            ("scalars", [name, kind, components]) | ("texture_coordinates", [name, components, kind]) => {
                (name, type_of(kind)?, components.parse().ok()?)
            }
            ("color_scalars", [name, components]) => (name, Type::Number(Kind::U8), components.parse().ok()?),
            ("vectors" | "normals", [name, kind]) => (name, type_of(kind)?, 3),
            ("tensors", [name, kind]) => (name, type_of(kind)?, 9),
            ("tensors6", [name, kind]) => (name, type_of(kind)?, 6),
            ("global_ids" | "pedigree_ids" | "edge_flags", [name, kind]) => (name, type_of(kind)?, 1),
            _ => return None,
        };
        Some(Self { name: decoded(name), kind, components })
    }
}

fn type_of(word: &str) -> Option<Type> {
    Some(Type::Number(match word.to_lowercase().as_str() {
        "bit" => return Some(Type::Bit),
        "string" | "utf8_string" => return Some(Type::Text),
        "char" | "signed_char" | "vtktypeint8" => Kind::I8,
        "unsigned_char" | "vtktypeuint8" => Kind::U8,
        "short" | "vtktypeint16" => Kind::I16,
        "unsigned_short" | "vtktypeuint16" => Kind::U16,
        // In files VTK's own identity type has 32 bits, whatever its size in memory.
        "int" | "vtkidtype" | "vtktypeint32" => Kind::I32,
        "unsigned_int" | "vtktypeuint32" => Kind::U32,
        "long" | "long_long" | "vtktypeint64" => Kind::I64,
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Kind::U64,
        "float" => Kind::F32,
        "double" => Kind::F64,
        _ => return None,
    }))
}

/// Names encode spaces and other characters as % and two digits.
fn decoded(name: &str) -> String {
    let (bytes, mut out, mut at) = (name.as_bytes(), Vec::new(), 0);
    while at < bytes.len() {
        let digit = |index: usize| bytes.get(index).and_then(|byte| (*byte as char).to_digit(16));
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                out.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The beginning of a line, for a message.
fn shown(line: &str) -> String {
    line.chars().take(60).collect()
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_binary: bool,
    /// Components of the last array, each of which may have a name.
    components: usize,
}

impl<'a> Reader<'a> {
    /// Reads the first three lines of every file: version, title, encoding.
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        if !bytes.starts_with(b"# vtk DataFile Version") {
            return Err("is not a legacy .vtk file".into());
        }
        let mut reader = Self { bytes, at: 0, is_binary: false, components: 0 };
        reader.raw_line();
        reader.raw_line();
        let encoding = String::from_utf8_lossy(reader.raw_line()).trim().to_lowercase();
        reader.is_binary = match encoding.as_str() {
            "binary" => true,
            "ascii" => false,
            _ => return Err("the .vtk file says neither ASCII nor BINARY in its third line".into()),
        };
        Ok(reader)
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The bytes up to the next line end, which is skipped.
    fn raw_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        &rest[..length]
    }

    /// The next line that is not empty; none at the end.
    fn line(&mut self) -> Result<Option<String>, String> {
        let Some(skip) = self.rest().iter().position(|byte| !byte.is_ascii_whitespace()) else {
            return Ok(None);
        };
        self.at += skip;
        let line = self.raw_line();
        let text = String::from_utf8_lossy(&line[..line.len().min(MAX_LINE)]).trim().to_string();
        // Some Unicode spaces are not ASCII spaces.
        if line.len() > MAX_LINE || text.is_empty() {
            return Err(format!("\"{}\" is not a line of a .vtk file", shown(&text)));
        }
        Ok(Some(text))
    }

    /// As [`Self::line`], if it has the expected form; otherwise nothing is consumed.
    fn line_if(&mut self, is_expected: impl Fn(&[&str]) -> bool) -> Option<String> {
        let before = self.at;
        let line = self.line().ok().flatten();
        let line = line.filter(|line| is_expected(&line.split_whitespace().collect::<Vec<_>>()));
        if line.is_none() {
            self.at = before;
        }
        line
    }

    /// Skips `LOOKUP_TABLE name`, which comes between SCALARS and its values.
    fn skip_table_name(&mut self) {
        self.line_if(|words| words.len() == 2 && words[0].eq_ignore_ascii_case("lookup_table"));
    }

    /// Skips a block that ends with an empty line; component names may be empty too.
    fn skip_metadata(&mut self) {
        loop {
            match self.raw_line().trim_ascii() {
                [] => return,
                // A damaged count must not make it search beyond the end.
                b"COMPONENT_NAMES" => {
                    for _ in 0..self.components.min(self.rest().len()) {
                        self.raw_line();
                    }
                }
                _ => {}
            }
        }
    }

    /// The type of colours: bytes in binary files, floats in text files.
    fn colours(&self) -> Type {
        Type::Number(if self.is_binary { Kind::U8 } else { Kind::F32 })
    }

    /// Skips cells: two arrays with names and types since version 5, a single array in earlier versions.
    fn skip_cells(&mut self, cells: usize, size: usize) -> Result<(), String> {
        let named = |name: &'static str| {
            move |words: &[&str]| words.len() == 2 && words[0] == name && type_of(words[1]).is_some()
        };
        let Some(offsets) = self.line_if(named("OFFSETS")) else {
            return self.skip(Type::Number(Kind::I32), size);
        };
        let kind =
            |line: &str| line.split_whitespace().nth(1).and_then(type_of).expect("line_if looks at it");
        self.skip(kind(&offsets), cells)?;
        let corners =
            self.line_if(named("CONNECTIVITY")).ok_or("the cells of the .vtk file have no corners")?;
        self.skip(kind(&corners), size)
    }

    /// Reads the arrays of a FIELD; those of points go to `found`.
    fn field(&mut self, arrays: usize, mut found: Option<&mut ParticleColumns>) -> Result<(), String> {
        for _ in 0..arrays {
            let line = self.line()?.ok_or("the .vtk file ends in a FIELD")?;
            let words: Vec<&str> = line.split_whitespace().collect();
            let wrong = || format!("\"{}\" is not an array of a FIELD", shown(&line));
            let [name, components, values, kind] = words[..] else { return Err(wrong()) };
            let [components, values] = [components, values].map(|word| word.parse().map_err(|_| wrong()));
            let kind = type_of(kind).ok_or_else(wrong)?;
            let array = Array { name: decoded(name), kind, components: components? };
            self.array(&array, values?, found.as_deref_mut())?;
            if self.line_if(|words| words.len() == 1 && words[0].eq_ignore_ascii_case("metadata")).is_some() {
                self.skip_metadata();
            }
        }
        Ok(())
    }

    /// Reads an array of `values` values into `found`, or skips it.
    fn array(
        &mut self,
        array: &Array,
        values: usize,
        found: Option<&mut ParticleColumns>,
    ) -> Result<(), String> {
        let Array { name, kind, components } = array;
        self.components = *components;
        let too_many =
            || format!("attribute \"{name}\" cannot have {values} values of {components} components");
        let count = values.checked_mul(*components).ok_or_else(too_many)?;
        let of_array = |what: String| format!("attribute \"{name}\": {what}");
        match (found, kind) {
            (None, _) => self.skip(*kind, count).map_err(of_array),
            (Some(found), Type::Text) => {
                found.leave_out(name);
                self.skip(*kind, count).map_err(of_array)
            }
            (Some(found), _) => {
                let numbers = self.numbers(*kind, count).map_err(of_array)?;
                let kind = if let Type::Number(kind) = kind { *kind } else { Kind::U8 };
                found.add(name, kind, *components, numbers)
            }
        }
    }

    /// Reads `count` numbers.
    fn numbers(&mut self, kind: Type, count: usize) -> Result<Numbers, String> {
        let kind = match kind {
            Type::Number(kind) => kind,
            Type::Bit if self.is_binary => return self.bits(count),
            Type::Bit | Type::Text => Kind::U8,
        };
        let mut out = kind.empty();
        if self.is_binary {
            kind.decode(self.take(count.checked_mul(kind.size()))?, Order::Big, &mut out)?;
            return Ok(out);
        }
        for n in 0..count {
            source::check_every(n, PIECE)?;
            kind.read_word(self.word()?, &mut out)?;
        }
        Ok(out)
    }

    fn bits(&mut self, count: usize) -> Result<Numbers, String> {
        let bytes = self.take(Some(count.div_ceil(8)))?;
        Ok(Numbers::Integers((0..count).map(|n| i64::from(bytes[n / 8] >> (7 - n % 8) & 1)).collect()))
    }

    /// Skips `count` numbers or texts.
    fn skip(&mut self, kind: Type, count: usize) -> Result<(), String> {
        match kind {
            Type::Text => (0..count).try_for_each(|_| self.skip_text()),
            Type::Bit if self.is_binary => self.take(Some(count.div_ceil(8))).map(drop),
            Type::Number(kind) if self.is_binary => self.take(count.checked_mul(kind.size())).map(drop),
            _ => (0..count).try_for_each(|_| self.word().map(drop)),
        }
    }

    /// Skips a text: a line or, in binary files, its bytes after a length, whose two highest bits tell how many bytes the length itself
    /// occupies.
    fn skip_text(&mut self) -> Result<(), String> {
        let first = *self.rest().first().ok_or_else(truncated)?;
        if !self.is_binary {
            self.raw_line();
            return Ok(());
        }
        let size = [8, 4, 2, 1][usize::from(first >> 6)];
        let more = self.take(Some(size))?[1..].iter();
        let length = more.fold(u64::from(first & 0x3f), |length, &byte| (length << 8) | u64::from(byte));
        self.take(usize::try_from(length).ok()).map(drop)
    }

    /// The next bytes, if there are enough.
    fn take(&mut self, count: Option<usize>) -> Result<&'a [u8], String> {
        let taken = count.and_then(|count| self.rest().get(..count)).ok_or_else(truncated)?;
        self.at += taken.len();
        Ok(taken)
    }

    /// The next word.
    fn word(&mut self) -> Result<&'a [u8], String> {
        let rest = self.rest();
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or_else(truncated)?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Ok(&rest[start..start + length])
    }
}

fn truncated() -> String {
    "the .vtk file ends before its numbers do".into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_percent_sign_and_two_digits_are_decoded() {
        assert_eq!(decoded("point%20data"), "point data");
        for name in ["50%", "50%2", "%+A", "%zz"] {
            assert_eq!(decoded(name), name);
        }
    }
}
