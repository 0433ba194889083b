//! Cells seen from above, and heights as integers.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::numeric::checks::ensure;

/// The maximum integer height. Heights are from 0 to this: the sum of any two that are below it fits in 32 bits.
pub const TOP: i32 = 1 << 30;
/// The bottom of a solid that has no lower end.
pub const BOTTOMLESS: i32 = i32::MIN;
/// Maximum number of cells along an axis.
pub const MAX_CELLS: usize = 1 << 16;

/// Square cells on the ground: x to the east, z to the south.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Edge of a cell (m), 1e-9 to 1e9.
    pub cell: f64,
    /// The corner of cell (0, 0) with the minimum x and z (m).
    pub origin: [f64; 2],
    /// Count of cells along x and along z.
    pub size: [usize; 2],
}

impl Grid {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`: a cell not within 1e-9 to 1e9 m, an origin that is not finite, 0 cells or over 65,536 along an axis.
    pub fn validate(&self) -> Result<()> {
        let [nx, nz] = self.size;
        let [x, z] = self.origin;
        // Beyond these, single precision would not hold the fluxes.
        if !(1e-9..=1e9).contains(&self.cell) {
            return Err(Error::argument(format!("a cell of {} m is not within 1e-9 to 1e9 m", self.cell)));
        }
        ensure(x.is_finite() && z.is_finite(), format_args!("the origin ({x}, {z}) is not finite"))?;
        ensure(
            (1..=MAX_CELLS).contains(&nx) && (1..=MAX_CELLS).contains(&nz),
            format_args!("{nx} x {nz} cells are not within 1 x 1 to {MAX_CELLS} x {MAX_CELLS}"),
        )?;
        Ok(())
    }

    /// Count of cells.
    pub fn cells(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Index of a cell: rows along x, from the minimum z.
    pub fn index(&self, [x, z]: [usize; 2]) -> usize {
        z * self.size[0] + x
    }

    /// The cell (x, z) with this index.
    pub fn position(&self, index: usize) -> [usize; 2] {
        [index % self.size[0], index / self.size[0]]
    }

    /// Centre of a cell (m).
    pub fn centre(&self, [x, z]: [usize; 2]) -> [f64; 2] {
        [self.origin[0] + (x as f64 + 0.5) * self.cell, self.origin[1] + (z as f64 + 0.5) * self.cell]
    }

    /// The cells whose centres lie in a circle (m), row by row.
    pub fn in_circle(&self, [x, z]: [f64; 2], radius: f64) -> impl Iterator<Item = [usize; 2]> {
        let grid = *self;
        let reach = radius / grid.cell + 1.0;
        let range = |axis: usize, at: f64| {
            let centre = (at - grid.origin[axis]) / grid.cell;
            let last = grid.size[axis] as f64 - 1.0;
            let [low, high] = [centre - reach, centre + reach].map(|at| at.floor().clamp(0.0, last) as usize);
            low..=high
        };
        let (columns, rows) = (range(0, x), range(1, z));
        let cells = rows.flat_map(move |row| columns.clone().map(move |column| [column, row]));
        cells.filter(move |cell| {
            let [cx, cz] = grid.centre(*cell);
            (cx - x).powi(2) + (cz - z).powi(2) <= radius * radius
        })
    }

    /// The cell at a position (m), if it is inside the grid.
    pub fn cell_at(&self, [x, z]: [f64; 2]) -> Option<[usize; 2]> {
        let at = [(x - self.origin[0]) / self.cell, (z - self.origin[1]) / self.cell].map(f64::floor);
        let within =
            at[0] >= 0.0 && at[1] >= 0.0 && at[0] < self.size[0] as f64 && at[1] < self.size[1] as f64;
        within.then_some(at.map(|index| index as usize))
    }
}

/// Heights as integers: `low + n unit`, n from 0 to [`TOP`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heights {
    /// Height of 0 (m).
    pub low: f64,
    /// One unit (m): the range / 2^30.
    pub unit: f64,
}

impl Heights {
    /// Heights from `low` to `high` (m).
    ///
    /// # Errors
    /// `Argument` unless both are finite and `high` is above `low`.
    pub fn between(low: f64, high: f64) -> Result<Self> {
        let unit = (high - low) / f64::from(TOP);
        if !(low.is_finite() && unit.is_finite() && unit > 0.0) {
            return Err(Error::argument(format!("heights from {low} to {high} m are not a range")));
        }
        Ok(Self { low, unit })
    }

    /// The nearest integer height, clamped to the range.
    pub fn round(&self, height: f64) -> i32 {
        ((height - self.low) / self.unit).round().clamp(0.0, f64::from(TOP)) as i32
    }

    /// Converts an integer height to metres.
    pub fn metres(&self, height: i32) -> f64 {
        self.low + f64::from(height) * self.unit
    }

    /// Converts a difference of heights from units to metres.
    pub fn length(&self, units: f64) -> f64 {
        units * self.unit
    }
}

/// A box of cells: ranges of x and of z.
pub type Cells = [Range<usize>; 2];

/// Checks that a box lies within nx x nz cells.
pub(in crate::shallow) fn check_cells([x, z]: &Cells, [nx, nz]: [usize; 2]) -> Result<()> {
    if x.start > x.end || z.start > z.end || x.end > nx || z.end > nz {
        return Err(Error::argument(format!("cells {x:?} x {z:?} are not a box within {nx} x {nz} cells")));
    }
    Ok(())
}
