//! What scalars are, and how they change.

use super::shares::LEVELS;
use crate::error::{Error, Result};
use crate::numeric::checks::ensure;

/// A quantity that the liquid carries along.
#[derive(Debug, Clone, PartialEq)]
pub struct Scalar {
    /// Its name: not empty, and not that of another scalar.
    pub name: String,
    /// How it changes.
    pub law: Law,
    /// The maximum absolute concentration, in the scalar's own unit, 1e-9 to 1e9: for example 1 for a dye, 100 K for a temperature relative
    /// to the room's, 3600 s for an age. Concentrations are stored in steps of 2^-20 of this.
    pub range: f64,
}

impl Scalar {
    /// A dye, of concentrations from 0 to 1.
    pub fn dye(name: &str) -> Self {
        Self { name: name.into(), law: Law::Dye, range: 1.0 }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        ensure(!self.name.is_empty(), "name is empty")?;
        if !(1e-9..=1e9).contains(&self.range) {
            return Err(Error::argument(format!("range = {} is not within 1e-9 to 1e9", self.range)));
        }
        match self.law {
            Law::Decays(half) if !(1e-6..=1e12).contains(&half) => {
                Err(Error::argument(format!("a half-life of {half} s is not within 1e-6 to 1e12")))
            }
            _ => Ok(()),
        }
    }

    /// Converts a concentration to levels.
    pub fn level(&self, concentration: f64) -> Result<i32> {
        let (Self { name, range, .. }, min) = (self, -self.range);
        ensure(
            concentration.abs() <= *range,
            format_args!("a concentration of {concentration} of {name:?} is not within {min} to {range}"),
        )?;
        Ok((concentration / range * LEVELS).round() as i32)
    }
}

/// How a scalar changes besides being carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// It does not change, as dye, salt, or heat that is not lost.
    Dye,
    /// It halves in each half-life (s), 1e-6 to 1e12, as heat that is lost to a room.
    Decays(f64),
    /// The time (s) since the liquid came in, averaged over the liquid of a column, clamped to `range`. The concentration set for liquid
    /// that comes in is its age at that moment.
    Ages,
}

pub(in crate::shallow) fn check_scalar(scalar: usize, count: usize) -> Result<()> {
    ensure(scalar < count, format_args!("there is no scalar {scalar} among {count}"))
}
