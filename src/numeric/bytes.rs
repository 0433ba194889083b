//! Little-endian numbers as bytes: the contents of exact states.

use std::fmt::Display;

use crate::error::{Error, Result};

/// Writes numbers.
#[derive(Default)]
pub struct Writer(pub Vec<u8>);

impl Writer {
    /// A count of elements.
    pub fn count(&mut self, count: usize) {
        self.0.extend((count as u64).to_le_bytes());
    }

    /// An unsigned number.
    pub fn u32(&mut self, number: u32) {
        self.0.extend(number.to_le_bytes());
    }

    /// Integers.
    pub fn i32s(&mut self, numbers: &[i32]) {
        self.0.reserve(4 * numbers.len());
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    /// Floats of 32 bits.
    pub fn f32s(&mut self, numbers: &[f32]) {
        self.0.reserve(4 * numbers.len());
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    /// A float of 64 bits.
    pub fn f64(&mut self, number: f64) {
        self.0.extend(number.to_le_bytes());
    }
}

/// Reads bytes that [`Writer`] wrote. Each function fails if they end too early, or if a float is not finite.
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// Reads from the start of some bytes.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The remaining bytes.
    pub fn rest(&self) -> &'a [u8] {
        self.0
    }

    /// The next `count` bytes.
    ///
    /// # Errors
    /// Fewer are left.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8]> {
        let (first, rest) = self.0.split_at_checked(count).ok_or_else(truncated)?;
        self.0 = rest;
        Ok(first)
    }

    /// The next `N` bytes.
    ///
    /// # Errors
    /// Fewer are left.
    pub fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk().ok_or_else(truncated)?;
        self.0 = rest;
        Ok(*first)
    }

    /// A count of elements of at least `bytes` bytes each.
    ///
    /// # Errors
    /// Too few bytes are left for them.
    pub fn count(&mut self, bytes: usize) -> Result<usize> {
        let count = u64::from_le_bytes(self.take()?) as usize;
        if count > self.0.len() / bytes { Err(truncated()) } else { Ok(count) }
    }

    /// An unsigned number.
    ///
    /// # Errors
    /// The bytes end.
    pub fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    /// Integers.
    ///
    /// # Errors
    /// The bytes end.
    pub fn i32s<const N: usize>(&mut self) -> Result<[i32; N]> {
        let mut out = [0; N];
        for number in &mut out {
            *number = i32::from_le_bytes(self.take()?);
        }
        Ok(out)
    }

    /// Floats of 32 bits.
    ///
    /// # Errors
    /// The bytes end; one is not finite.
    pub fn f32s<const N: usize>(&mut self) -> Result<[f32; N]> {
        let mut out = [0.0; N];
        for number in &mut out {
            *number = f32::from_le_bytes(self.take()?);
            if !number.is_finite() {
                return Err(not_finite());
            }
        }
        Ok(out)
    }

    /// A float of 64 bits.
    ///
    /// # Errors
    /// The bytes end; it is not finite.
    pub fn f64(&mut self) -> Result<f64> {
        let number = f64::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(not_finite()) }
    }

    /// Checks that nothing is left.
    ///
    /// # Errors
    /// Something is left.
    pub fn end(&self) -> Result<()> {
        require(self.0.is_empty(), "has bytes after its end")
    }
}

/// Checks a condition on a state; `wrong` is the error's message.
///
/// # Errors
/// `Bytes`: it does not hold.
pub fn require(holds: bool, wrong: impl Display) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Bytes(wrong.to_string())) }
}

fn truncated() -> Error {
    Error::Bytes("the state is cut short".into())
}

fn not_finite() -> Error {
    Error::Bytes("the state has a number that is not finite".into())
}
