//! Which columns of neighbouring cells are linked (thesis 4.2.1), one pair at a time.

use std::ops::Range;

use crate::numeric::lists::refill;
use crate::shallow::columns::{Columns, NONE, STRIP, Strip};

/// The eight cells around one, from the east through the north: steps along x and z.
pub(in crate::shallow::surface) const RING: [[i32; 2]; 8] =
    [[1, 0], [1, -1], [0, -1], [-1, -1], [-1, 0], [-1, 1], [0, 1], [1, 1]];

/// Whether two cells of the ring are neighbours of each other.
pub(in crate::shallow::surface) fn are_near(a: usize, b: usize) -> bool {
    a != b && RING[a][0].abs_diff(RING[b][0]) <= 1 && RING[a][1].abs_diff(RING[b][1]) <= 1
}

/// Columns, and the depth of the liquid in each.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::surface) struct LiquidColumns<'a> {
    pub columns: &'a Columns,
    /// Depth of each index (units).
    pub depth: &'a [i32],
    /// For each strip, a guess of the index of the strip in the layer above, or of the index at which it would be inserted; may be empty.
    pub above: &'a [u32],
}

impl<'a> LiquidColumns<'a> {
    pub fn is_wet(self, index: usize) -> bool {
        self.depth[index] > 0
    }

    /// Height (units). Depths beyond the ceiling may wrap around: the caller's error, but never a panic.
    pub fn height(self, index: usize) -> i32 {
        self.columns.bases()[index].wrapping_add(self.depth[index].max(0))
    }

    /// Whether a column's room holds a height; an index without a column holds none.
    pub fn holds(self, index: usize, height: i32) -> bool {
        self.columns.unders()[index] <= height && height < self.columns.ceilings()[index]
    }

    /// Whether two columns of neighbouring cells are linked, if one of them is wet.
    pub fn are_linked(self, a: usize, b: usize) -> bool {
        self.holds(a, self.height(b)) && self.holds(b, self.height(a))
    }

    /// The column whose room holds a height, in the cell at a step of -1, 0 or 1 along x and z from another column's.
    pub fn beside(self, index: usize, [dx, dz]: [i32; 2], height: i32) -> Option<usize> {
        let columns = self.columns;
        let (strip, position) = (index / STRIP, index % STRIP);
        let row = match dz {
            -1 => columns.north(strip),
            1 => columns.south(strip),
            _ => strip as u32,
        };
        // Usually the one of the same layer.
        if row != NONE {
            let (row, position) = (row as usize, position as i32 + dx);
            let strip = match position {
                -1 => columns.west(row),
                16 => columns.east(row),
                _ => Some(row),
            };
            let same = strip.map(|strip| strip * STRIP + (position & 15) as usize);
            if let Some(same) = same.filter(|&same| self.holds(same, height)) {
                return Some(same);
            }
        }
        self.of_cell(cell_at(columns.cell(index), [dx, dz])).find(|&other| self.holds(other, height))
    }

    /// The columns of a cell, from the lowest; none outside the grid.
    pub fn of_cell(self, [x, z]: [usize; 2]) -> impl Iterator<Item = usize> + 'a {
        let columns = self.columns;
        let [nx, nz] = columns.grid.size;
        let lowest = if x < nx && z < nz { self.lowest([z, x / STRIP]) } else { None };
        let stack = std::iter::successors(lowest, move |&strip| self.above(strip));
        stack.map(move |strip| strip * STRIP + x % STRIP).take_while(move |&index| columns.is_column(index))
    }

    /// The wet column that a column is linked with in the cell at a step of -1, 0 or 1 along x and z.
    pub fn wet_beside(self, index: usize, step: [i32; 2]) -> Option<usize> {
        let height = self.height(index);
        let other = self.beside(index, step, height)?;
        (self.is_wet(other) && self.holds(index, self.height(other))).then_some(other)
    }

    /// The strip of the lowest layer at a row and a position along x / 16.
    pub fn lowest(self, [row, at]: [usize; 2]) -> Option<usize> {
        let range = self.columns.row(row);
        let wanted = Strip { row: row as u32, layer: 0, at: at as u32 };
        self.find(wanted, range.start + at, range.start..range.end.min(range.start + at + 1))
    }

    /// The strip of the layer above at the same position.
    pub fn above(self, strip: usize) -> Option<usize> {
        let own = self.columns.strips()[strip];
        let across = self.columns.grid.size[0].div_ceil(STRIP);
        let end = self.columns.row(own.row as usize).end;
        let guess = self.above.get(strip).map_or(strip + across, |above| *above as usize);
        self.find(Strip { layer: own.layer + 1, ..own }, guess, strip + 1..end.min(strip + across + 1))
    }

    /// Finds a strip within a range; `guess` (its index, or where it would be inserted) is usually right.
    #[inline]
    fn find(self, wanted: Strip, guess: usize, range: Range<usize>) -> Option<usize> {
        let strips = self.columns.strips();
        let found = strips.get(guess);
        if found == Some(&wanted) {
            return Some(guess);
        }
        if found.is_none_or(|following| *following > wanted)
            && guess
                .checked_sub(1)
                .and_then(|before| strips.get(before))
                .is_some_and(|before| *before < wanted)
        {
            return None;
        }
        strips[range.clone()].binary_search(&wanted).ok().map(|found| range.start + found)
    }

    /// Whether the surface of a wet column ends at the solid of an adjacent column, whose room holds its height.
    pub fn ends_at(self, wet: usize, wall: usize) -> bool {
        let ceiling = self.columns.ceilings()[wet];
        self.height(wet) < ceiling && ceiling <= self.columns.bases()[wall]
    }
}

/// The cell at a step from another. Before the first cell, indices wrap around to huge ones outside the grid.
pub(in crate::shallow::surface) fn cell_at([x, z]: [usize; 2], [dx, dz]: [i32; 2]) -> [usize; 2] {
    [x.wrapping_add_signed(dx as isize), z.wrapping_add_signed(dz as isize)]
}

/// Finds, for each strip, the index of the one above, or where it would be inserted.
pub(in crate::shallow::surface) fn find_above(columns: &Columns, out: &mut Vec<u32>) {
    let strips = columns.strips();
    let across = columns.grid.size[0].div_ceil(STRIP);
    refill(
        out,
        strips.iter().enumerate().map(|(strip, own)| {
            let wanted = Strip { layer: own.layer + 1, ..*own };
            let following = &strips[strip + 1..strips.len().min(strip + across + 2)];
            (strip + 1 + following.partition_point(|other| *other < wanted)) as u32
        }),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
    use crate::shallow::terrain::Solids;

    #[test]
    fn cells_of_the_ring_are_near_their_neighbours() {
        let near = |ring: usize| (0..8).filter(|other| are_near(ring, *other)).collect::<Vec<_>>();
        assert_eq!(near(0), [1, 2, 6, 7], "the east: corners beside it, north and south");
        assert_eq!(near(3), [2, 4], "a corner");
    }

    #[test]
    fn columns_of_a_cell_are_found_whatever_the_guess() {
        // Layers only in some strips: 1 to 3 of them.
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [80, 2] };
        let solids =
            |cell: usize| (0..=[0, 2, 1, 2, 0][cell % 80 / 16]).map(|n| [n * 10, n * 10 + 5]).collect();
        let columns =
            Columns::new(&Solids::new(grid, Heights::between(0.0, 1.0).unwrap(), (0..160).map(solids)));
        let mut above = Vec::new();
        find_above(&columns, &mut above);
        let wrong: Vec<u32> = above.iter().rev().copied().collect();
        for above in [&above[..], &wrong, &[]] {
            let liquid = LiquidColumns { columns: &columns, depth: &[], above };
            for cell in (0..80).flat_map(|x| [[x, 0], [x, 1]]) {
                assert!(liquid.of_cell(cell).eq(columns.of_cell(cell)), "{cell:?}");
            }
            assert_eq!(liquid.of_cell([80, 0]).chain(liquid.of_cell([0, 2])).count(), 0);
            assert_eq!(liquid.of_cell(cell_at([0, 0], [-1, 0])).count(), 0);
        }
    }

    #[test]
    fn rooms_are_half_open() {
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [2, 1] };
        let solids = [vec![[BOTTOMLESS, 10], [20, 30]], vec![[BOTTOMLESS, 15]]];
        let columns = Columns::new(&Solids::new(grid, Heights::between(0.0, 1.0).unwrap(), solids));
        let [low, high, beside] =
            [columns.column([0, 0], 0), columns.column([0, 0], 1), columns.column([1, 0], 0)];
        let [low, high, beside] = [low, high, beside].map(Option::unwrap);
        let mut depth = vec![0; columns.len()];
        for (level, linked) in [(19, low), (20, high), (31, high)] {
            depth[beside] = level - 15;
            depth[high] = 1;
            let liquid = LiquidColumns { columns: &columns, depth: &depth, above: &[] };
            assert_eq!(liquid.beside(beside, [-1, 0], level), Some(linked), "{level}");
        }
    }
}
