//! The friction between grains that gives a poured pile its slope.

/// Angles of poured piles of 10,000 grains (degrees) and the friction that gives them, as `make gates ONLY=snow.grains.pile`
/// measures them. Grains do not turn, so that a little friction holds steep piles.
const PILES: [(f64, f64); 11] = [
    (0.0, 0.0),
    (5.5, 0.06),
    (9.1, 0.09),
    (13.5, 0.12),
    (18.5, 0.15),
    (22.3, 0.18),
    (26.7, 0.21),
    (31.3, 0.25),
    (35.2, 0.29),
    (38.9, 0.33),
    (STEEPEST, 0.367),
];

/// Steepest angle of repose (degrees) that [`of_repose`] knows.
pub const STEEPEST: f64 = 42.0;

/// The angle of repose (degrees) of piles with a friction; the reverse of [`of_repose`].
pub fn repose_of(friction: f64) -> f64 {
    let above = PILES.iter().position(|(_, most)| *most >= friction).unwrap_or(PILES.len() - 1).max(1);
    let [(low, least), (high, most)] = [PILES[above - 1], PILES[above]];
    low + (high - low) * ((friction - least) / (most - least)).clamp(0.0, 1.0)
}

/// The friction whose poured pile has an angle of repose (degrees), 0..=[`STEEPEST`].
pub fn of_repose(repose: f64) -> f64 {
    let above = PILES.iter().position(|(angle, _)| *angle >= repose).unwrap_or(PILES.len() - 1).max(1);
    let [(low, least), (high, most)] = [PILES[above - 1], PILES[above]];
    least + (most - least) * ((repose - low) / (high - low)).clamp(0.0, 1.0)
}
