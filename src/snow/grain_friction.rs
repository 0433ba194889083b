//! The friction between grains that gives a poured pile its slope.

/// Angles of poured piles of 10,000 grains (degrees) and the friction that gives them, as `make gates ONLY=snow.grains.pile`
/// measures them. Grains do not turn, so that a little friction holds steep piles.
const PILES: [(f64, f64); 10] = [
    (0.0, 0.0),
    (8.9, 0.08),
    (14.1, 0.12),
    (18.0, 0.15),
    (21.8, 0.18),
    (25.1, 0.21),
    (29.3, 0.25),
    (32.4, 0.30),
    (36.4, 0.35),
    (STEEPEST, 0.40),
];

/// Steepest angle of repose (degrees) that [`of_repose`] knows.
pub const STEEPEST: f64 = 40.1;

/// The friction whose poured pile has an angle of repose (degrees), 0..=[`STEEPEST`].
pub fn of_repose(repose: f64) -> f64 {
    let above = PILES.iter().position(|(angle, _)| *angle >= repose).unwrap_or(PILES.len() - 1).max(1);
    let [(low, least), (high, most)] = [PILES[above - 1], PILES[above]];
    least + (most - least) * ((repose - low) / (high - low)).clamp(0.0, 1.0)
}
