//! Numbers in messages.

/// Significant digits of a number that a user gave: they hide the rounding errors of a sum or a product.
const DIGITS: usize = 12;
/// Significant digits of a bound of a range, which may have been computed.
const BOUND_DIGITS: usize = 6;

/// A number that a user gave, as the user wrote it.
pub fn given(value: f64) -> String {
    digits(value, DIGITS)
}

/// A bound of a range.
pub fn bound(value: f64) -> String {
    digits(value, BOUND_DIGITS)
}

/// A number with at most this many significant digits, and with an exponent where it would otherwise be all zeroes.
fn digits(value: f64, max_digits: usize) -> String {
    let rounded = format!("{value:.*e}", max_digits - 1).parse().unwrap_or(value);
    // No minus sign on zero.
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    if rounded == 0.0 || !rounded.is_finite() || (1e-10..1e15).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_for_messages() {
        for (value, wanted) in [
            (0.1 + 0.2, "0.3"),
            (-0.0, "0"),
            (1e6, "1000000"),
            (6e7, "60000000"),
            (1e-5, "0.00001"),
            (1e-12, "1e-12"),
            (1e300, "1e300"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
            (1.0 / 24.0, "0.0416666666667"),
        ] {
            assert_eq!(given(value), wanted);
        }
        assert_eq!(
            (bound(0.02 * 0.02), bound(8.0 * 0.02), bound(2.0 / 3.0)),
            ("0.0004".into(), "0.16".into(), "0.666667".into())
        );
    }
}
