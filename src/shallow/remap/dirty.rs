//! The cells that must be rebuilt.

use std::ops::Range;

use crate::shallow::columns::STRIP;
use crate::shallow::columns::grid::Cells;

/// Cells whose solids change.
#[derive(Debug, Clone, Default)]
pub(super) struct Dirty {
    /// Count of blocks of 16 cells in a row.
    pub blocks: usize,
    /// Bits of the dirty cells of each block, row by row.
    cells: Vec<u16>,
    /// The rows from the first to the last dirty cell.
    pub rows: Range<usize>,
}

impl Dirty {
    /// Clears all, for a domain of this size.
    pub fn clear(&mut self, [nx, nz]: [usize; 2]) {
        self.blocks = nx.div_ceil(STRIP);
        self.cells.resize(self.blocks * nz, 0);
        self.cells[self.rows.start * self.blocks..self.rows.end * self.blocks].fill(0);
        self.rows = 0..0;
    }

    /// Adds a box of cells: ranges of x and of z.
    pub fn mark(&mut self, [across, rows]: &Cells) {
        if across.is_empty() || rows.is_empty() {
            return;
        }
        self.rows = match self.rows.is_empty() {
            true => rows.clone(),
            false => self.rows.start.min(rows.start)..self.rows.end.max(rows.end),
        };
        for block in across.start / STRIP..across.end.div_ceil(STRIP) {
            let first = across.start.saturating_sub(block * STRIP).min(STRIP);
            let end = (across.end - block * STRIP).min(STRIP);
            let cells = ((1u32 << end) - (1u32 << first)) as u16;
            for row in rows.clone() {
                self.cells[row * self.blocks + block] |= cells;
            }
        }
    }

    /// Bits of the dirty cells in a block of a row.
    #[inline]
    pub fn of(&self, row: usize, block: usize) -> u16 {
        self.cells[row * self.blocks + block]
    }

    /// Count of dirty cells.
    pub fn count(&self) -> usize {
        let rows = self.rows.start * self.blocks..self.rows.end * self.blocks;
        self.cells[rows].iter().map(|cells| cells.count_ones() as usize).sum()
    }

    /// All dirty cells (x, z), row by row along x.
    pub fn iter(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let blocks = self.rows.clone().flat_map(move |row| (0..self.blocks).map(move |block| [block, row]));
        blocks.flat_map(move |[block, row]| {
            let cells = self.of(row, block);
            let set = (0..STRIP).filter(move |position| cells >> position & 1 == 1);
            set.map(move |position| [block * STRIP + position, row])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_boxes_come_row_by_row() {
        let mut dirty = Dirty::default();
        dirty.clear([40, 5]);
        dirty.mark(&[14..34, 1..3]);
        dirty.mark(&[15..17, 2..4]);
        dirty.mark(&[3..3, 0..5]);
        let mut expected: Vec<[usize; 2]> = (1..3).flat_map(|z| (14..34).map(move |x| [x, z])).collect();
        expected.extend([[15, 3], [16, 3]]);
        assert!(dirty.iter().eq(expected.iter().copied()));
        assert_eq!((dirty.rows.clone(), dirty.count(), dirty.of(2, 1)), (1..4, 42, u16::MAX));
        dirty.clear([40, 5]);
        assert_eq!((dirty.count(), dirty.iter().next()), (0, None));
        dirty.mark(&[0..40, 0..5]);
        assert_eq!(dirty.count(), 200);
    }
}
