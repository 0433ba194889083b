//! User parameters of mist.

use crate::error::Result;
use crate::numeric::checks::{check_within, ensure};

/// Maximum wind speed (m/s) along an axis.
pub const FASTEST_WIND: f64 = 1000.0;

/// Parameters of mist (thesis section 3.4).
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// Edge of a cell (m).
    pub cell: f64,
    /// Minimum speed (m/s) of grains that raise mist: the thesis' v_mist.
    pub from_speed: f64,
    /// Whether falling grains raise mist too.
    pub falling: bool,
    /// Acceleration (m/s2) of the air where there is mist, negative downward: the thesis' g_mist.
    pub gravity: f64,
    /// Time (s) in which half of the mist dissipates; infinite: it stays.
    pub half_life: f64,
    /// Velocity (m/s) of the surrounding air.
    pub wind: [f64; 3],
    /// Acceleration (m/s2, root mean square) of the air by eddies; 0: none.
    pub turbulence: f64,
    /// Size (m) of the eddies, at least 8 cells.
    pub turbulence_size: f64,
    /// Strength (1/s) with which small eddies are sustained; 0: not at all.
    pub confinement: f64,
    /// Maximum share 0..=1 of the new density that noise removes.
    pub noise: f64,
    /// Size (m) of that noise.
    pub noise_size: f64,
    /// Seed of the noise.
    pub seed: i32,
    /// Tiles of air (8 cells wide) that are computed around the mist.
    pub padding: u32,
    /// Maximum divergence, times the cell, that a projection leaves, relative to the largest speed.
    pub tolerance: f64,
}

impl Params {
    /// The thesis' values, for cells with the edge `cell` (m).
    pub fn for_cell(cell: f64) -> Self {
        Self {
            cell,
            from_speed: 2.0,
            falling: false,
            gravity: -2.0,
            half_life: 1.0,
            wind: [0.0; 3],
            turbulence: 0.0,
            turbulence_size: 24.0 * cell,
            confinement: 0.0,
            noise: 0.3,
            noise_size: 4.0 * cell,
            seed: 0,
            padding: 1,
            tolerance: 5.0e-6,
        }
    }

    /// Checks each field.
    ///
    /// # Errors
    /// Names the field and its range.
    pub fn validate(&self) -> Result<()> {
        let within = |name, value, range| check_within(name, value, "", range);
        within("cell", self.cell, 1.0e-5..=100.0)?;
        within("from_speed", self.from_speed, 0.0..=1000.0)?;
        within("gravity", self.gravity, -1000.0..=1000.0)?;
        ensure(self.half_life > 0.0, format_args!("half_life = {} is not over 0", self.half_life))?;
        for wind in self.wind {
            within("wind", wind, -FASTEST_WIND..=FASTEST_WIND)?;
        }
        within("turbulence", self.turbulence, 0.0..=1000.0)?;
        within("turbulence_size", self.turbulence_size, 8.0 * self.cell..=1.0e6 * self.cell)?;
        within("confinement", self.confinement, 0.0..=100.0)?;
        within("noise", self.noise, 0.0..=1.0)?;
        within("noise_size", self.noise_size, self.cell..=1.0e6 * self.cell)?;
        within("padding", f64::from(self.padding), 1.0..=64.0)?;
        within("tolerance", self.tolerance, 1.0e-6..=0.1)
    }
}
