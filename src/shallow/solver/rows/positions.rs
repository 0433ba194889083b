//! Positions of columns in the buffers of their rows.

use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::solver::active::Span;
use crate::shallow::solver::transfers::scale::{Around, Beside};

/// Padding before a row's buffer, for reads to the west of its first column.
pub const PAD: usize = STRIP;

/// Positions of the columns of a row, and of the rows beside it, in their buffers.
pub struct RowPositions {
    /// First index of the previous row, of the row itself and of the next row.
    starts: [usize; 3],
}

impl RowPositions {
    /// Positions for a row.
    #[inline(always)]
    pub fn new(columns: &Columns, row: usize) -> Self {
        let start = |row: usize| columns.row(row.min(columns.grid.size[1] - 1)).start * STRIP;
        Self { starts: [start(row.saturating_sub(1)), start(row), start(row + 1)] }
    }

    /// Position of a column of the row.
    #[inline(always)]
    pub fn of(&self, index: u32) -> usize {
        PAD + index as usize - self.starts[1]
    }

    /// The value of a column of this row or the next one.
    #[inline(always)]
    pub fn pick<T: Copy>(&self, own: &[T], beyond: &[T], index: u32) -> T {
        let index = index as usize;
        if index < self.starts[2] || self.starts[2] == self.starts[1] {
            own[PAD + index - self.starts[1]]
        } else {
            beyond[PAD + index - self.starts[2]]
        }
    }

    /// The transfers around the columns of a span.
    #[inline(always)]
    pub fn around<'a>(
        &self,
        east: &'a [f32],
        south: &'a [f32],
        north: &'a [f32],
        zeros: &'a [f32],
        span: &Span,
    ) -> Around<'a> {
        let at = self.of(span.first);
        Around {
            east: &east[at..],
            west: &east[at - 1..],
            south: &south[at..],
            north: self.north(north, zeros, span),
        }
    }

    /// Values of the columns to the north of a span.
    #[inline(always)]
    pub fn north<'a, T>(&self, numbers: &'a [T], none: &'a [T], span: &Span) -> &'a [T] {
        if span.north == NONE { none } else { &numbers[PAD + span.north as usize - self.starts[0]..] }
    }

    /// A value of the columns of a span, and of those around them.
    #[inline(always)]
    pub fn beside<'a, T>(&self, own: &'a [T], beyond: &'a [T], none: &'a [T], span: &Span) -> Beside<'a, T> {
        let south =
            if span.south == NONE { none } else { &beyond[PAD + span.south as usize - self.starts[2]..] };
        Beside { own: &own[self.of(span.first)..], south }
    }
}
