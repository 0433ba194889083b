//! .xyz: places and nothing else, as text or in binary.
//!
//! A file in which every byte is a tab, a line end or printable ASCII is text; any other is binary. Text has a particle a line: three
//! numbers, between spaces, tabs or commas, and any further columns, which are left out; lines that are empty or begin with `#` are
//! skipped. Binary, as splashsurf has it, is three little-endian 32-bit floats a particle.

use std::io::Write;

use super::numbers::{Kind, Numbers, Order};
use super::particles::Found;
use super::source;
use crate::base::points::Points;

/// Bytes of a particle in binary.
const ROW: usize = 12;
/// Lines between two looks at whether to stop.
const PIECE: usize = 1 << 14;

/// Reads the particles of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Found, String> {
    let is_of_text = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | b' '..=b'~');
    if let Some(text) = std::str::from_utf8(bytes).ok().filter(|_| bytes.iter().all(is_of_text)) {
        return parse_text(text);
    }
    if !bytes.len().is_multiple_of(ROW) {
        let length = bytes.len();
        return Err(format!(
            "is cut short, or no .xyz file: {length} bytes are not a multiple of {ROW}, and not text"
        ));
    }
    let mut numbers = Kind::F32.none();
    Kind::F32.decode(bytes, Order::Little, &mut numbers)?;
    Ok(Found::new(numbers))
}

fn parse_text(text: &str) -> Result<Found, String> {
    let mut numbers = Vec::new();
    for (n, line) in text.lines().enumerate() {
        if n.is_multiple_of(PIECE) && source::is_stopped() {
            return Err("stopped".into());
        }
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut columns = line.split([' ', '\t', ',']).filter(|column| !column.is_empty());
        for _ in 0..3 {
            let column =
                columns.next().ok_or_else(|| format!("line {}: there are no three numbers", n + 1))?;
            let number = column.parse::<f64>();
            numbers.push(number.map_err(|_| {
                let shown: String = column.chars().take(40).collect();
                format!("line {}: \"{shown}\" is not a number", n + 1)
            })?);
        }
    }
    Ok(Found::new(Numbers::Real(numbers)))
}

/// Writes the places of points in binary.
pub(super) fn write(out: &mut dyn Write, points: &Points) -> std::io::Result<()> {
    if points.count() == 0 {
        // A file without a byte is one that was cut.
        return out.write_all(b"# 0 particles\n");
    }
    for point in 0..points.count() {
        for part in points.position(point).iter() {
            out.write_all(&(*part as f32).to_le_bytes())?;
        }
    }
    Ok(())
}
