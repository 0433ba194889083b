//! Solid intervals along the vertical lines of cells.

use crate::shallow::columns::grid::{Grid, Heights};

/// A solid interval (units), bottom to top; a bottom of [`crate::shallow::columns::grid::BOTTOMLESS`] means that it has no lower end.
pub type Solid = [i32; 2];

/// The solid intervals of every cell, from the lowest up; they neither touch nor overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Solids {
    /// The cells.
    pub grid: Grid,
    /// Range and unit of heights.
    pub heights: Heights,
    /// Where each cell's intervals begin, row by row, and the end of the last.
    starts: Vec<u32>,
    solids: Vec<Solid>,
}

impl Solids {
    /// Intervals from a list for each cell, row by row along x (`Grid::index`). They are sorted and united here: those that touch or
    /// overlap become one, and empty ones (top below bottom) are dropped.
    pub fn new(grid: Grid, heights: Heights, cells: impl IntoIterator<Item = Vec<Solid>>) -> Self {
        let mut out = Self::empty(grid, heights);
        for mut cell in cells {
            unite(&mut cell);
            out.push(&cell);
        }
        out
    }

    /// No cells yet; [`Solids::push`] adds them one by one.
    pub fn empty(grid: Grid, heights: Heights) -> Self {
        Self { grid, heights, starts: vec![0], solids: Vec::new() }
    }

    /// Intervals of each cell (`Grid::index`), which are sorted and separate.
    pub(in crate::shallow) fn of_cells<'a>(
        grid: Grid,
        heights: Heights,
        cell: impl Fn(usize) -> &'a [Solid],
    ) -> Self {
        let mut out = Self::empty(grid, heights);
        (0..grid.cells()).for_each(|index| out.push(cell(index)));
        out
    }

    /// Adds the next cell, whose intervals are sorted and separate.
    pub fn push(&mut self, cell: &[Solid]) {
        debug_assert!(cell.windows(2).all(|pair| pair[0][1] < pair[1][0]));
        self.solids.extend_from_slice(cell);
        self.starts.push(self.solids.len() as u32);
    }

    /// The intervals of a cell (`Grid::index`).
    pub fn cell(&self, index: usize) -> &[Solid] {
        &self.solids[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Maximum number of intervals in a cell.
    pub fn layers(&self) -> usize {
        self.starts.windows(2).map(|pair| (pair[1] - pair[0]) as usize).max().unwrap_or(0)
    }
}

/// Sorts intervals and unites those that touch or overlap.
pub fn unite(cell: &mut Vec<Solid>) {
    cell.retain(|[bottom, top]| bottom <= top);
    cell.sort_unstable();
    cell.dedup_by(|next, last| {
        let touches = next[0] <= last[1];
        if touches {
            last[1] = last[1].max(next[1]);
        }
        touches
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::BOTTOMLESS;

    #[test]
    fn intervals_that_touch_become_one() {
        let mut cell = vec![[7, 9], [BOTTOMLESS, 2], [2, 3], [12, 11], [8, 20], [4, 5]];
        unite(&mut cell);
        assert_eq!(cell, [[BOTTOMLESS, 3], [4, 5], [7, 20]]);
    }

    #[test]
    fn cells_keep_their_order() {
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [3, 1] };
        let heights = Heights::between(0.0, 1.0).unwrap();
        let solids = Solids::new(grid, heights, [vec![[3, 4], [0, 1]], vec![], vec![[5, 6]]]);
        assert_eq!(solids.cell(0), [[0, 1], [3, 4]]);
        assert_eq!((solids.cell(1).len(), solids.cell(2)[0], solids.layers()), (0, [5, 6], 2));
    }
}
