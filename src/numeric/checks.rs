//! Checks of arguments.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::error::{Error, Result};

/// Checks a condition; `wrong` is the error's message.
///
/// # Errors
/// `Argument`: it does not hold.
pub fn ensure(holds: bool, wrong: impl Display) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::argument(wrong.to_string())) }
}

/// Checks that a number is within a range; `unit` begins with a space, or is empty.
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
    ensure(holds, format_args!("{name} = {value} is negative or not finite"))
}

/// Checks that the `count` of `what` equals `others`, the count of `of`.
///
/// # Errors
/// `Argument`: the counts differ.
pub fn check_each(count: usize, what: &str, others: usize, of: &str) -> Result<()> {
    ensure(count == others, format_args!("{count} {what} for {others} {of}: one each is needed"))
}

/// As [`check_each`], for the length of a caller's output array.
///
/// # Errors
/// `Argument`: the counts differ.
pub fn check_room(room: usize, what: &str, others: usize, of: &str) -> Result<()> {
    ensure(room == others, format_args!("there is room for {room} {what}, but there are {others} {of}"))
}
