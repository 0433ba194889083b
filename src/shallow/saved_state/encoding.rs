//! The bytes of a saved state: numbers one after another, little-endian.

use std::fmt::Display;
use std::ops::RangeInclusive;

use xxhash_rust::xxh3::xxh3_128;

use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;

/// Writes into the rest of a slice.
pub(super) struct Writer<'a>(pub(super) &'a mut [u8]);

impl Writer<'_> {
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.next(bytes.len()).copy_from_slice(bytes);
    }

    pub fn numbers<T: Copy, const N: usize>(&mut self, numbers: &[T], bytes: impl Fn(T) -> [u8; N]) {
        let to = self.next(N * numbers.len()).as_chunks_mut().0;
        to.iter_mut().zip(numbers).for_each(|(to, number)| *to = bytes(*number));
    }

    /// Skips the next bytes and returns them.
    pub fn next(&mut self, count: usize) -> &mut [u8] {
        let (next, rest) = std::mem::take(&mut self.0).split_at_mut(count);
        self.0 = rest;
        next
    }
}

/// Converts bytes to numbers.
pub(super) fn get<T, const N: usize>(bytes: &[u8], to: &mut [T], number: impl Fn([u8; N]) -> T) {
    to.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, bytes)| *to = number(*bytes));
}

/// Reads `count` elements of N bytes.
pub(super) fn parts<'a, const N: usize>(from: &mut Reader<'a>, count: usize) -> Result<&'a [[u8; N]]> {
    Ok(from.bytes(count * N)?.as_chunks().0)
}

/// N bytes of an element.
pub(super) fn part<const N: usize>(element: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| element[at + byte])
}

/// Bytes of the hash at the end of a state.
pub(super) const CHECKSUM: usize = 16;

/// What identifies a kind of state.
pub(super) struct Format {
    pub magic: [u8; 8],
    pub version: u32,
    /// Position of the state's length in the header.
    pub length_at: usize,
    /// What is saved, for errors.
    pub of: &'static str,
}

/// Checks the format, the length and the hash of a state; returns its header, and all of it without the hash.
pub(super) fn open<'a, const HEADER: usize>(
    bytes: &'a [u8],
    kind: &Format,
) -> Result<(&'a [u8; HEADER], &'a [u8])> {
    let Format { magic, version: wanted, length_at, of } = kind;
    let Some(header) = bytes.first_chunk::<HEADER>().filter(|header| header.starts_with(magic)) else {
        let is_begun = bytes.len() < HEADER && bytes.starts_with(magic);
        return Err(if is_begun { refused("is cut short") } else { refused(&format!("is not of {of}")) });
    };
    let version = Reader::new(&header[8..]).u32()?;
    require(version == *wanted, format_args!("has format {version}, and this library reads {wanted}"))?;
    let length = u64::from_le_bytes(part(header, *length_at));
    require(length <= bytes.len() as u64, "is cut short")?;
    let (body, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
    require(length >= bytes.len() as u64 && xxh3_128(body).to_le_bytes() == *checksum, "is damaged")?;
    Ok((header, body))
}

/// Writes the hash of a state at its end.
pub(super) fn write_checksum(state: &mut [u8]) {
    let (body, checksum) = state.split_at_mut(state.len() - CHECKSUM);
    checksum.copy_from_slice(&xxh3_128(body).to_le_bytes());
}

pub(super) fn refused(what: &str) -> Error {
    Error::Bytes(format!("the saved state {what}"))
}

/// Checks that something holds of a state; `wrong` says what is wrong otherwise.
pub(super) fn require(holds: bool, wrong: impl Display) -> Result<()> {
    if holds { Ok(()) } else { Err(refused(&wrong.to_string())) }
}

/// Valid range of sums of units: the total of three fits 64 bits.
pub(super) const SUMS: RangeInclusive<i64> = -(1 << 61)..=1 << 61;
