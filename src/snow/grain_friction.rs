//! The friction between grains that gives a poured pile its slope.

/// Angles of poured piles of 10,000 grains (degrees) and the friction that gives them, as `make gates ONLY=snow.grains.pile`
/// measures them. Grains do not turn, so that a little friction holds steep piles.
const PILES: [(f64, f64); 8] = [
    (0.0, 0.0),
    (9.6, 0.08),
    (15.2, 0.12),
    (19.4, 0.15),
    (26.8, 0.209),
    (34.4, 0.293),
    (40.4, 0.372),
    (STEEPEST, 0.393),
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
