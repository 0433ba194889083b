//! Amounts: how much of a scalar a column holds, as an integer, so that none of it is lost or created.
//!
//! An amount is a concentration in *levels* ([`LEVELS`] of which are a scalar's range), times a depth in units: at most 2^50. It is stored
//! as an f64, which is exact for integers up to 2^53, and for which all processors have vector instructions.

/// Maximum count of scalars that a liquid carries.
pub const MAX_SCALARS: usize = 4;

/// Levels in the range of a scalar.
pub const LEVELS: f64 = (1 << 20) as f64;

/// Concentrations of all scalars, in levels.
pub(in crate::shallow) type Levels = [i32; MAX_SCALARS];

/// Adding this to a number below 2^51 leaves no bits for a fraction: the sum is rounded to the nearest integer, ties to even.
const ROUND: f64 = 1.5 * (1u64 << 52) as f64;

/// The nearest integer to a number below 2^51; ties to even.
#[inline(always)]
pub(in crate::shallow) fn nearest(number: f64) -> f64 {
    (number + ROUND) - ROUND
}

/// Converts an integral number below 2^51.
#[inline(always)]
pub(in crate::shallow) fn integer(number: f64) -> i64 {
    (number + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i64
}

/// The concentration (levels) of a column; for a dry one, its amount.
#[inline(always)]
pub(in crate::shallow) fn level(amount: f64, depth: i32) -> f64 {
    amount / f64::from(depth.max(1))
}

/// The amount in this many units at a concentration. Rounding is monotonic here and in [`level`]: if a concentration is at most some
/// integer, the amount is at most that integer times the units. The share of all of a column's units is its whole amount.
#[inline(always)]
pub(in crate::shallow) fn share(level: f64, units: f64) -> f64 {
    nearest(level * units)
}

/// The part of amounts that belongs to `units` out of `all`, rounded toward 0.
pub(in crate::shallow) fn part(amounts: &[i64; MAX_SCALARS], units: i64, all: i64) -> [i64; MAX_SCALARS] {
    amounts.map(|amount| (i128::from(amount) * i128::from(units) / i128::from(all.max(1))) as i64)
}

/// Moves the part of amounts that belongs to `units` out of `all` to the amounts `to`.
pub(in crate::shallow) fn take(
    from: &mut [i64; MAX_SCALARS],
    units: i64,
    all: i64,
    to: &mut [i64; MAX_SCALARS],
) {
    let part = part(from, units, all);
    for ((from, to), part) in from.iter_mut().zip(to).zip(part) {
        *from -= part;
        *to += part;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_units_take_all_and_integer_bounds_hold() {
        let mut seed = 1_u64;
        let mut draw = |end: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 20) % end
        };
        for _ in 0..100_000 {
            let depth = 1 + (draw(1 << 30) >> draw(30)) as i32;
            let bound = draw(1 << 20) as f64 + 1.0;
            let amount = bound * f64::from(depth) - (draw(1 << 44) >> draw(44)) as f64;
            let level = level(amount, depth);
            assert_eq!(share(level, f64::from(depth)), amount, "{amount} of {depth}");
            let units = f64::from(1 + draw(depth as u64) as i32);
            let moved = share(level, units);
            assert!(moved <= bound * units, "{moved} of {amount} in {units} of {depth}");
            assert_eq!((integer(moved) as f64, integer(-moved) as f64), (moved, -moved));
            // The remainder keeps the bound, except for half an amount of rounding.
            assert!(amount - moved <= bound * (f64::from(depth) - units) + 0.75);
        }
    }

    #[test]
    fn parts_add_up() {
        let (mut from, mut to) = ([1001, -7, 0, i64::MAX], [0; MAX_SCALARS]);
        for all in (1..=9).rev() {
            take(&mut from, 1, all, &mut to);
        }
        assert_eq!((from, to), ([0; MAX_SCALARS], [1001, -7, 0, i64::MAX]));
    }
}
