//! Cliffs: where liquid may fall freely, even pipes between columns of one layer are links.

use super::side::Side;
use crate::shallow::columns::{Columns, NONE, STRIP};

/// Pipes between bases that differ by more than this (units) may be free falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::shallow) struct Cliffs(pub i32);

impl Cliffs {
    /// No pipe is a cliff.
    pub const NONE: Self = Self(i32::MAX);

    /// Whether the pipe between two columns may be a free fall.
    pub fn has(self, columns: &Columns, i: usize, j: usize) -> bool {
        // Bases are within 0 to 2^30.
        (columns.bases()[i] - columns.bases()[j]).abs() > self.0 && columns.overlap(i, j)
    }

    /// Closes the regular pipes of a row that are links instead.
    pub fn close(self, columns: &Columns, row: usize, east: &mut [f32], south: &mut [f32]) {
        if self == Self::NONE {
            return;
        }
        for strip in columns.row(row) {
            for (side, open) in [(Side::East, &mut *east), (Side::South, &mut *south)] {
                let mut cells = self.of_strip(columns, strip, side);
                while cells != 0 {
                    open[strip * STRIP + cells.trailing_zeros() as usize] = 0.0;
                    cells &= cells - 1;
                }
            }
        }
    }

    /// Bits of the columns of a strip whose pipe over a side, to the east or to the south, is a link although it joins columns of one
    /// layer.
    pub fn of_strip(self, columns: &Columns, strip: usize, side: Side) -> u16 {
        let mut bits = 0;
        if self == Self::NONE {
            return bits;
        }
        for position in 0..STRIP {
            let i = strip * STRIP + position;
            let is_cliff = |j: usize| columns.is_column(i) && columns.is_column(j) && self.has(columns, i, j);
            bits |= u16::from(index_beyond(columns, i, side).is_some_and(is_cliff)) << position;
        }
        bits
    }
}

/// The index beyond a side, in the same layer.
pub(in crate::shallow) fn index_beyond(columns: &Columns, i: usize, side: Side) -> Option<usize> {
    let (strip, position) = (i / STRIP, i % STRIP);
    let at = |strip: u32| (strip != NONE).then(|| strip as usize * STRIP + position);
    match side {
        Side::East if position + 1 < STRIP => Some(i + 1),
        Side::East => columns.east(strip).map(|next| next * STRIP),
        Side::West if position > 0 => Some(i - 1),
        Side::West => columns.west(strip).map(|before| before * STRIP + STRIP - 1),
        Side::South => at(columns.south(strip)),
        Side::North => at(columns.north(strip)),
    }
}
