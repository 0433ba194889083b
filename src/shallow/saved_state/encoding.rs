//! The bytes of a saved state: numbers one after another, little-endian.

use std::ops::RangeInclusive;

use xxhash_rust::xxh3::xxh3_128;

use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;

/// The bytes still to be written.
pub(in crate::shallow::saved_state) struct Put<'a>(pub(super) &'a mut [u8]);

impl Put<'_> {
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.next(bytes.len()).copy_from_slice(bytes);
    }

    pub fn numbers<T: Copy, const N: usize>(&mut self, numbers: &[T], bytes: impl Fn(T) -> [u8; N]) {
        let to = self.next(N * numbers.len()).as_chunks_mut().0;
        to.iter_mut().zip(numbers).for_each(|(to, number)| *to = bytes(*number));
    }

    pub fn next(&mut self, count: usize) -> &mut [u8] {
        let (next, rest) = std::mem::take(&mut self.0).split_at_mut(count);
        self.0 = rest;
        next
    }
}

pub(in crate::shallow::saved_state) fn get<T, const N: usize>(
    bytes: &[u8],
    to: &mut [T],
    number: impl Fn([u8; N]) -> T,
) {
    to.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, bytes)| *to = number(*bytes));
}

/// The next elements of N bytes.
pub(in crate::shallow::saved_state) fn parts<'a, const N: usize>(
    from: &mut Reader<'a>,
    count: usize,
) -> Result<&'a [[u8; N]]> {
    Ok(from.bytes(count * N)?.as_chunks().0)
}

/// Some bytes of an element.
pub(in crate::shallow::saved_state) fn part<const N: usize>(element: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|byte| element[at + byte])
}

/// Bytes of the hash at the end of a state.
pub(in crate::shallow::saved_state) const SEAL: usize = 16;

/// How a kind of state begins.
pub(in crate::shallow::saved_state) struct Beginning {
    pub magic: [u8; 8],
    pub version: u32,
    /// Where the header has the length of the state.
    pub length_at: usize,
    /// What states of this kind are of.
    pub of: &'static str,
}

/// Checks the beginning, the length and the hash of a state; returns its header, and all of it without the hash.
pub(in crate::shallow::saved_state) fn open<'a, const HEADER: usize>(
    bytes: &'a [u8],
    kind: &Beginning,
) -> Result<(&'a [u8; HEADER], &'a [u8])> {
    let Beginning { magic, version: wanted, length_at, of } = kind;
    let Some(header) = bytes.first_chunk::<HEADER>().filter(|header| header.starts_with(magic)) else {
        let is_begun = bytes.len() < HEADER && bytes.starts_with(magic);
        return Err(if is_begun { refused("is cut short") } else { refused(&format!("is not of {of}")) });
    };
    let version = Reader::new(&header[8..]).u32()?;
    if version != *wanted {
        return Err(refused(&format!("has format {version}, and this library reads {wanted}")));
    }
    let length = u64::from_le_bytes(part(header, *length_at));
    if length > bytes.len() as u64 {
        return Err(refused("is cut short"));
    }
    let (body, seal) = bytes.split_at(bytes.len() - SEAL);
    if length < bytes.len() as u64 || xxh3_128(body).to_le_bytes() != *seal {
        return Err(refused("is damaged"));
    }
    Ok((header, body))
}

/// Writes the hash of a state at its end.
pub(in crate::shallow::saved_state) fn seal(state: &mut [u8]) {
    let (body, seal) = state.split_at_mut(state.len() - SEAL);
    seal.copy_from_slice(&xxh3_128(body).to_le_bytes());
}

pub(in crate::shallow::saved_state) fn refused(what: &str) -> Error {
    Error::Bytes(format!("the saved state {what}"))
}

/// Valid sums of units, three of which fit 64 bits; and units that a flow point has pending.
pub(in crate::shallow::saved_state) const SUMS: RangeInclusive<i64> = -(1 << 61)..=1 << 61;
