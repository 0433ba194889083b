//! Parameters of the ragged edges of imprints.

use std::ops::RangeInclusive;

use crate::error::{Error, Result};
use crate::numeric::checks::ensure;

/// Irregularity of an imprint's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseParams {
    /// Maximum outward displacement (m). 0 switches the noise off.
    pub amplitude: f64,
    /// Size of the largest clumps (m).
    pub size: f64,
    /// Octaves, each of half the size and a quarter of the strength of the one before, 1..=8.
    pub octaves: u32,
    /// Seed of the pattern.
    pub seed: i32,
}

/// Steepest slope of one octave of unit size and strength (a test samples it).
pub(super) const MAX_SLOPE: f64 = 2.95;

impl NoiseParams {
    /// Two cells of amplitude, clumps of eight cells, three octaves.
    pub fn for_cell(cell: f64) -> Self {
        Self { amplitude: 2.0 * cell, size: 8.0 * cell, octaves: 3, seed: 0 }
    }

    /// Checks every field for a given cell size (m).
    ///
    /// # Errors
    /// Names the field and its range, or noise so steep that it would leave islands.
    pub fn validate(&self, cell: f64) -> Result<()> {
        let within = |name: &str, value: f64, range: RangeInclusive<f64>| {
            let (low, high) = (range.start(), range.end());
            let holds = range.contains(&value);
            ensure(holds, format_args!("noise {name} = {value} m is not within {low} to {high} m"))
        };
        within("amplitude", self.amplitude, Self::amplitudes(cell))?;
        within("size", self.size, Self::sizes(cell))?;
        if !(1..=8).contains(&self.octaves) {
            return Err(Error::argument(format!("noise octaves = {} is not within 1 to 8", self.octaves)));
        }
        let max = self.max_amplitude();
        if self.amplitude > max {
            return Err(Error::argument(format!(
                "noise amplitude = {} m is too steep for size = {} m and would leave islands: at most {max:.4} m",
                self.amplitude, self.size
            )));
        }
        Ok(())
    }

    /// Allowed amplitudes (m) for a cell size (m).
    pub fn amplitudes(cell: f64) -> RangeInclusive<f64> {
        0.0..=32.0 * cell
    }

    /// Allowed sizes (m) for a cell size (m): below two cells the grid cannot represent the noise.
    pub fn sizes(cell: f64) -> RangeInclusive<f64> {
        2.0 * cell..=10_000.0 * cell
    }

    /// The maximum amplitude (m) that leaves no islands at this size: the displacement's slope stays below 1.
    ///
    /// Octave o has strength 4^-o and slope 2^-o, within a sum scaled to 1.
    pub fn max_amplitude(&self) -> f64 {
        let sum = |ratio: f64| (0..self.octaves).map(|octave| ratio.powi(octave as i32)).sum::<f64>();
        self.size * sum(0.25) / (MAX_SLOPE * sum(0.5))
    }
}
