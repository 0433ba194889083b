//! The bytes of a saved state: numbers one after another, little-endian.

use std::ops::RangeInclusive;

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

pub(in crate::shallow::saved_state) fn refused(what: &str) -> Error {
    Error::Bytes(format!("the saved state {what}"))
}

/// Valid sums of units, three of which fit 64 bits; and units that a flow point has pending.
pub(in crate::shallow::saved_state) const SUMS: RangeInclusive<i64> = -(1 << 61)..=1 << 61;
