//! The friction between grains that determines the slope of a poured pile.
//!
//! Grains do not rotate, so a little friction holds steep piles. Grains without attraction act as if they were lighter the higher they
//! lie, so they need less friction ([`grains`](crate::snow::grains)).

/// Angles of poured piles (degrees) and the friction that gives them, on snow: midway between the slopes of piles of 10,000 and of 30,000
/// grains, as poured by `make gates ONLY=snow.grains.pile`. Larger piles are steeper. From a friction of 0.03 on, each grain lies in a
/// hollow between others; with less, piles flatten.
const LOOSE: [[f64; 2]; 11] = [
    [0.0, 0.0],
    [12.1, 0.02],
    [20.2, 0.03],
    [22.0, 0.045],
    [24.2, 0.07],
    [27.0, 0.095],
    [29.7, 0.12],
    [33.0, 0.15],
    [36.4, 0.18],
    [39.5, 0.21],
    [MAX_REPOSE, 0.235],
];

/// The same for grains with the weakest attraction.
const COHESIVE: [[f64; 2]; 11] = [
    [0.0, 0.0],
    [5.5, 0.06],
    [9.1, 0.09],
    [13.5, 0.12],
    [18.5, 0.15],
    [22.3, 0.18],
    [26.7, 0.21],
    [31.3, 0.25],
    [35.2, 0.29],
    [38.9, 0.33],
    [MAX_REPOSE, 0.367],
];

/// Maximum angle of repose (degrees): the end of the measured piles.
pub const MAX_REPOSE: f64 = 42.0;

/// Interpolates in the table: `given` is the column of the known value `x` (0: angle, 1: friction), the result is of the other column.
fn interpolate(x: f64, given: usize, attracts: bool) -> f64 {
    let piles = if attracts { &COHESIVE } else { &LOOSE };
    let above = piles.iter().position(|pile| pile[given] >= x).unwrap_or(piles.len() - 1).max(1);
    let [low, high] = [piles[above - 1], piles[above]];
    let (from, to) = (low[1 - given], high[1 - given]);
    from + (to - from) * ((x - low[given]) / (high[given] - low[given])).clamp(0.0, 1.0)
}

/// The angle of repose (degrees) of piles with a given friction, with or without attraction between grains; the inverse of [`of_repose`].
pub fn repose_of(friction: f64, attracts: bool) -> f64 {
    interpolate(friction, 1, attracts)
}

/// The friction with which a poured pile, with or without attraction between grains, has an angle of repose (degrees),
/// 0..=[`MAX_REPOSE`].
pub fn of_repose(repose: f64, attracts: bool) -> f64 {
    interpolate(repose, 0, attracts)
}
