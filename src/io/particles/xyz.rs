//! .xyz: positions only, as text or binary.
//!
//! A file is text if every byte outside comments is a tab, a line end or printable ASCII; any other file is binary. Text has one particle
//! per line: three numbers, then optional columns that are ignored; empty lines and lines that begin with `#` are skipped. Columns are
//! separated by blanks, semicolons or commas. A comma within a word is a decimal comma if blanks or semicolons separate three such words;
//! if neither reading is certain, the file is refused. Binary, as splashsurf writes it, has three little-endian 32-bit floats per particle.

use std::io::Write;

use super::ParticleColumns;
use crate::geometry::points::Points;
use crate::io::files::numbers::{Kind, Numbers, Order};
use crate::io::files::{source, text};

/// Bytes per particle in binary files.
const ROW: usize = 12;
/// Lines between two checks of the stop flag.
const PIECE: usize = 1 << 14;

/// Reads the particles of a file.
pub(in crate::io) fn parse(bytes: &[u8]) -> Result<ParticleColumns, String> {
    let unmarked = text::without_mark(bytes);
    let unmarked = if is_utf_16(bytes) { unmarked? } else { unmarked.unwrap_or(bytes) };
    if is_text(unmarked) {
        return parse_text(unmarked);
    }
    if !bytes.len().is_multiple_of(ROW) {
        let length = bytes.len();
        return Err(format!(
            "is cut short, or no .xyz file: {length} bytes are not a multiple of {ROW}, and not text"
        ));
    }
    let mut numbers = Kind::F32.empty();
    Kind::F32.decode(bytes, Order::Little, &mut numbers)?;
    Ok(ParticleColumns::new(numbers))
}

/// Whether every other byte is 0, as in UTF-16, after what may be its mark or the first bytes of a float.
fn is_utf_16(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(64)];
    [2, 3].into_iter().any(|from| head.len() > from && head[from..].iter().step_by(2).all(|&byte| byte == 0))
}

fn is_text(bytes: &[u8]) -> bool {
    let is_letter = |byte: &u8| matches!(byte, b'\t' | b' '..=b'~');
    let is_of_comment = |byte: &u8| *byte == b'\t' || !byte.is_ascii_control();
    text::lines(bytes).all(|(_, line)| match line.first() {
        Some(b'#') => line.iter().all(is_of_comment),
        _ => line.iter().all(is_letter),
    })
}

fn parse_text(bytes: &[u8]) -> Result<ParticleColumns, String> {
    let mut numbers = Vec::new();
    // Most files have no comma, so there is nothing to decide.
    let mut commas = bytes.contains(&b',').then(Commas::default);
    let mut points = Vec::new();
    for (n, line) in text::lines(bytes) {
        source::check_every(n, PIECE)?;
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"#") {
            continue;
        }
        let words: &mut dyn Iterator<Item = &[u8]> = match &mut commas {
            None => &mut columns(line),
            Some(commas) => {
                points.clear();
                commas.read(n, line, &mut points).map_err(|what| format!("line {n}: {what}"))?;
                &mut points.split(|&byte| byte == b' ').filter(|word| !word.is_empty())
            }
        };
        for _ in 0..3 {
            let word = words.next().ok_or_else(|| format!("line {n}: there are not three numbers"))?;
            numbers
                .push(text::number(word).ok_or_else(|| format!("line {n}: {}", text::not_a_number(word)))?);
        }
    }
    Ok(ParticleColumns::new(Numbers::Floats(numbers)))
}

/// The columns of a line, separated by blanks and semicolons.
fn columns(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let is_separator = |byte: &u8| byte.is_ascii_whitespace() || *byte == b';';
    line.split(is_separator).filter(|column| !column.is_empty())
}

/// What the commas of a file have turned out to be: the first line of each kind.
#[derive(Default)]
struct Commas {
    /// With decimal commas.
    decimal: Option<usize>,
    /// With decimal points, or with commas that separate numbers without a blank.
    others: Option<usize>,
}

impl Commas {
    /// Writes the words of a line to `out`, each followed by a blank, and with decimal points.
    fn read(&mut self, n: usize, line: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        let mut words: Vec<&[u8]> = Vec::new();
        for word in columns(line) {
            let word = word.strip_suffix(b",").unwrap_or(word);
            match word.strip_prefix(b",") {
                // Some programs write a half as ",5".
                Some(number) if !number.is_empty() && !number.contains(&b'.') => return Err(unclear(word)),
                Some(number) => words.push(number),
                None => words.push(word),
            }
        }
        words.retain(|word| !word.is_empty());
        let inner = |word: &[u8]| word.iter().filter(|&&byte| byte == b',').count();
        let first = words.get(..3).filter(|first| inner(first[0]) <= 1).unwrap_or_default();
        let has_point = |word: &&[u8]| word.contains(&b'.');
        if first.iter().any(|word| inner(word) > 0) {
            // Such as 1,234.5, whose comma is neither a decimal comma nor between numbers.
            let is_odd = |word: &&&[u8]| inner(word) > 0 && !text::has_decimal_comma(word);
            if let Some(word) = first.iter().find(is_odd) {
                return Err(unclear(word));
            }
            self.decimal.get_or_insert(n);
            first.iter().for_each(|word| {
                out.extend(word.iter().map(|&byte| if byte == b',' { b'.' } else { byte }));
                out.push(b' ');
            });
        } else if !first.is_empty() {
            // Commas in further columns do not matter.
            if first.iter().any(has_point) {
                self.others.get_or_insert(n);
            }
            out.extend_from_slice(&first.join(&b' '));
        } else {
            let split: Vec<&[u8]> = words.iter().flat_map(|word| word.split(|&byte| byte == b',')).collect();
            // Digits that begin with 0 come after a decimal comma.
            let is_fraction =
                |word: &&&[u8]| word.len() > 1 && word.iter().all(u8::is_ascii_digit) && word[0] == b'0';
            if let Some(word) = split.iter().find(is_fraction) {
                return Err(unclear(word));
            }
            self.others.get_or_insert(n);
            out.extend_from_slice(&split.join(&b' '));
        }
        match (self.decimal, self.others) {
            (Some(commas), Some(points)) => Err(format!(
                "numbers have decimal commas in line {commas}, and none in line {points}: write decimal points, and blanks between numbers"
            )),
            _ => Ok(()),
        }
    }
}

/// The message for a comma that may be a decimal comma, or separate numbers or thousands.
fn unclear(word: &[u8]) -> String {
    format!(
        "\"{}\" may have a decimal comma, or commas between numbers or thousands: write decimal points, and blanks between numbers",
        text::shown(word)
    )
}

/// Writes the positions of points in binary.
pub(in crate::io) fn write(out: &mut dyn Write, points: &Points) -> std::io::Result<()> {
    if points.count() == 0 {
        // An empty file would look as if it had been cut short.
        return out.write_all(b"# 0 particles\n");
    }
    for point in 0..points.count() {
        for part in points.position(point).iter() {
            out.write_all(&(*part as f32).to_le_bytes())?;
        }
    }
    Ok(())
}
