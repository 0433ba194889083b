//! Checks of what a caller gives.

use std::ops::RangeInclusive;

use crate::error::{Error, Result};

/// Checks that a number in a unit, given with a space before it, is within a range.
///
/// # Errors
/// `Argument`: it is not.
pub fn check_within(name: &str, value: f64, unit: &str, range: RangeInclusive<f64>) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let (low, high) = range.into_inner();
    Err(Error::argument(format!("{name} = {value}{unit} is not within {low} to {high}")))
}

/// Checks that a number is finite and not negative.
///
/// # Errors
/// `Argument`: it is not.
pub fn check_not_negative(name: &str, value: f64) -> Result<()> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Error::argument(format!("{name} = {value} is not finite and 0 or more")))
}

/// Checks that there is one of something for each of some others.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_each(count: usize, what: &str, others: usize, of: &str) -> Result<()> {
    if count == others {
        return Ok(());
    }
    Err(Error::argument(format!("{count} {what} are not one for each of {others} {of}")))
}

/// As [`check_each`], for room that the caller gives for results.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_room(room: usize, what: &str, others: usize, of: &str) -> Result<()> {
    if room == others {
        return Ok(());
    }
    Err(Error::argument(format!("room for {room} {what} is not that of {others} {of}")))
}
