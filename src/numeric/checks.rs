//! Checks of what a caller gives.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::error::{Error, Result};

/// Checks that something holds.
///
/// # Errors
/// `Argument`: it does not; `wrong` says what is wrong then.
pub fn ensure(holds: bool, wrong: impl Display) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::argument(wrong.to_string())) }
}

/// Checks that a number in a unit, given with a space before it, is within a range.
///
/// # Errors
/// `Argument`: it is not.
pub fn check_within(name: &str, value: f64, unit: &str, range: RangeInclusive<f64>) -> Result<()> {
    let (low, high) = (range.start(), range.end());
    ensure(range.contains(&value), format_args!("{name} = {value}{unit} is not within {low} to {high}"))
}

/// Checks that a number is finite and not negative.
///
/// # Errors
/// `Argument`: it is not.
pub fn check_not_negative(name: &str, value: f64) -> Result<()> {
    let holds = value >= 0.0 && value.is_finite();
    ensure(holds, format_args!("{name} = {value} is not finite and 0 or more"))
}

/// Checks that there is one of something for each of some others.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_each(count: usize, what: &str, others: usize, of: &str) -> Result<()> {
    ensure(count == others, format_args!("{count} {what} are not one for each of {others} {of}"))
}

/// As [`check_each`], for room that the caller gives for results.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_room(room: usize, what: &str, others: usize, of: &str) -> Result<()> {
    ensure(room == others, format_args!("room for {room} {what} is not that of {others} {of}"))
}
