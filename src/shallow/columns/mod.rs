//! Columns: the room for liquid above each solid of a cell, stored in strips (thesis 4.1.1, Fig. 4.2).
//!
//! A strip is 16 cells along x on one layer; a column's layer is its position from the bottom of its cell. Strips exist only where they
//! have a column, and are sorted by row, then layer, then x: the numbers of successive strips are contiguous, and so is all that a row
//! needs.

pub mod grid;
pub(super) mod per_column;
pub(super) mod runs;
pub(super) mod stacks;

use std::ops::Range;

use super::terrain::Solids;
use grid::{BOTTOMLESS, Grid, Heights, TOP};
use per_column::{Array, PerColumn};

/// Cells in a strip.
pub const STRIP: usize = 16;
/// No strip, or no column.
pub const NONE: u32 = u32::MAX;

/// Where a strip lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Strip {
    /// Row (z).
    pub row: u32,
    /// Position of its columns from the bottom of their cells.
    pub layer: u32,
    /// Index of its block of 16 cells along x.
    pub at: u32,
}

/// The columns of a terrain, by index: strip x 16 + position in the strip. An index without a column has its base and ceiling at 0.
#[derive(Debug, PartialEq)]
pub struct Columns {
    /// Cells.
    pub grid: Grid,
    /// Heights.
    pub heights: Heights,
    strips: Vec<Strip>,
    /// First strip of each row, and the end of the last.
    rows: Vec<u32>,
    /// The strips at the same layer and x in the previous and next rows, or [`NONE`].
    north: Vec<u32>,
    south: Vec<u32>,
    /// For each strip, a bit for each position that has a column.
    present: Vec<u16>,
    /// b (units): the ground below the liquid.
    base: PerColumn<i32>,
    /// max (units): the underside of the next solid, or [`TOP`].
    ceiling: PerColumn<i32>,
    /// min (units): the underside of the solid below, or [`BOTTOMLESS`].
    under: PerColumn<i32>,
}

/// A strip that is being rewritten.
pub(super) struct StripMut<'a> {
    /// b.
    pub base: &'a mut [i32; STRIP],
    /// max.
    pub ceiling: &'a mut [i32; STRIP],
    /// min.
    pub under: &'a mut [i32; STRIP],
}

impl Clone for Columns {
    fn clone(&self) -> Self {
        let (strips, rows, present) = (self.strips.clone(), self.rows.clone(), self.present.clone());
        let (north, south) = (self.north.clone(), self.south.clone());
        let (base, ceiling, under) = (self.base.clone(), self.ceiling.clone(), self.under.clone());
        let (grid, heights) = (self.grid, self.heights);
        Self { grid, heights, strips, rows, north, south, present, base, ceiling, under }
    }

    /// Reuses the allocations.
    fn clone_from(&mut self, other: &Self) {
        let Self { grid, heights, strips, rows, north, south, present, base, ceiling, under } = self;
        (*grid, *heights) = (other.grid, other.heights);
        strips.clone_from(&other.strips);
        rows.clone_from(&other.rows);
        north.clone_from(&other.north);
        south.clone_from(&other.south);
        present.clone_from(&other.present);
        base.clone_from(&other.base);
        ceiling.clone_from(&other.ceiling);
        under.clone_from(&other.under);
    }
}

impl Columns {
    /// The columns above the solids of each cell. A cell without a solid has none: liquid that gets there falls out of the domain.
    pub fn new(solids: &Solids) -> Self {
        let mut columns = Self {
            grid: solids.grid,
            heights: solids.heights,
            strips: Vec::new(),
            rows: vec![0],
            north: Vec::new(),
            south: Vec::new(),
            present: Vec::new(),
            base: PerColumn::new(Array::Base, 0, 0),
            ceiling: PerColumn::new(Array::Ceiling, 0, 0),
            under: PerColumn::new(Array::Under, 0, 0),
        };
        let [nx, nz] = columns.grid.size;
        for row in 0..nz {
            columns.add_row(solids, row, nx);
        }
        for numbers in [&mut columns.base, &mut columns.ceiling, &mut columns.under] {
            numbers.resize(columns.strips.len() * STRIP + STRIP, 0);
            // Without excess capacity.
            *numbers = numbers.clone();
        }
        let count = columns.strips.len();
        columns.north = vec![NONE; count];
        columns.south = vec![NONE; count];
        columns.connect(0..nz);
        columns
    }

    fn add_row(&mut self, solids: &Solids, row: usize, nx: usize) {
        let cell = |x: usize| solids.cell(row * nx + x);
        let layers = (0..nx).map(|x| cell(x).len()).max().unwrap_or(0);
        for layer in 0..layers {
            for at in 0..nx.div_ceil(STRIP) {
                let cells = at * STRIP..(at * STRIP + STRIP).min(nx);
                if cells.clone().all(|x| cell(x).len() <= layer) {
                    continue;
                }
                let first = self.base.len();
                let room = first + STRIP;
                self.base.resize(room, 0);
                self.ceiling.resize(room, 0);
                self.under.resize(room, 0);
                let mut present = 0;
                for (position, x) in cells.enumerate().filter(|(_, x)| cell(*x).len() > layer) {
                    let solids = cell(x);
                    present |= 1 << position;
                    self.base[first + position] = solids[layer][1];
                    self.under[first + position] = solids[layer][0];
                    self.ceiling[first + position] = solids.get(layer + 1).map_or(TOP, |above| above[0]);
                }
                self.present.push(present);
                self.strips.push(Strip { row: row as u32, layer: layer as u32, at: at as u32 });
            }
        }
        self.rows.push(self.strips.len() as u32);
    }

    /// Finds the neighbouring strips, both within the rows given and between these and the rows around them.
    pub(super) fn connect(&mut self, rows: Range<usize>) {
        self.north[self.rows[rows.start] as usize..self.rows[rows.end] as usize].fill(NONE);
        self.south[self.rows[rows.start] as usize..self.rows[rows.end] as usize].fill(NONE);
        if rows.start > 0 {
            let before = self.row(rows.start - 1);
            self.south[before].fill(NONE);
        }
        if rows.end < self.grid.size[1] {
            let after = self.row(rows.end);
            self.north[after].fill(NONE);
        }
        for row in rows.start.saturating_sub(1)..rows.end.min(self.grid.size[1] - 1) {
            let mut below = self.row(row + 1).peekable();
            for strip in self.row(row) {
                let position = |strip: usize| (self.strips[strip].layer, self.strips[strip].at);
                while below.next_if(|other| position(*other) < position(strip)).is_some() {}
                if let Some(other) = below.next_if(|other| position(*other) == position(strip)) {
                    self.south[strip] = other as u32;
                    self.north[other] = strip as u32;
                }
            }
        }
    }

    /// Changes the counts of strips of some rows; the strips of later rows move. The caller must then place and set each strip of the
    /// changed rows, and connect the rows.
    pub(super) fn resize_rows(&mut self, rows: Range<usize>, counts: impl Iterator<Item = u32>) {
        let old = self.rows[rows.start] as usize..self.rows[rows.end] as usize;
        let mut end = self.rows[rows.start];
        for (row, count) in rows.clone().zip(counts) {
            end += count;
            self.rows[row + 1] = end;
        }
        let len = end as usize - old.start;
        if len == old.len() {
            return;
        }
        let shift = end.wrapping_sub(old.end as u32);
        self.rows[rows.end + 1..].iter_mut().for_each(|first| *first = first.wrapping_add(shift));
        resize_part(&mut self.strips, old.clone(), len, Strip { row: 0, layer: 0, at: 0 });
        resize_part(&mut self.present, old.clone(), len, 0);
        let indices = old.start * STRIP..old.end * STRIP;
        for numbers in [&mut self.base, &mut self.ceiling, &mut self.under] {
            numbers.resize_part(indices.clone(), len * STRIP, 0);
        }
        for neighbours in [&mut self.north, &mut self.south] {
            resize_part(neighbours, old.clone(), len, NONE);
            let behind = neighbours[end as usize..].iter_mut().filter(|strip| **strip != NONE);
            behind.for_each(|strip| *strip = strip.wrapping_add(shift));
        }
    }

    /// Sets where a strip lies.
    pub(super) fn place_strip(&mut self, strip: usize, position: Strip) {
        self.strips[strip] = position;
    }

    /// Sets which positions of a strip have a column; the caller writes the strip's numbers, with 0 where there is no column.
    pub(super) fn set_strip(&mut self, strip: usize, present: u16) -> StripMut<'_> {
        self.present[strip] = present;
        StripMut {
            base: strip_mut(&mut self.base, strip),
            ceiling: strip_mut(&mut self.ceiling, strip),
            under: strip_mut(&mut self.under, strip),
        }
    }

    /// Count of indices: 16 for each strip.
    pub fn len(&self) -> usize {
        self.strips.len() * STRIP
    }

    /// Whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.strips.is_empty()
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let strips =
            size_of_val(&self.strips[..]) + size_of_val(&self.rows[..]) + size_of_val(&self.present[..]);
        let beside = size_of_val(&self.north[..]) + size_of_val(&self.south[..]);
        let heights = [&self.base, &self.ceiling, &self.under];
        strips + beside + heights.into_iter().map(PerColumn::bytes).sum::<usize>()
    }

    /// Count of columns.
    pub fn count(&self) -> usize {
        self.present.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// All strips, in order.
    pub fn strips(&self) -> &[Strip] {
        &self.strips
    }

    /// Indices of the strips of a row.
    pub fn row(&self, row: usize) -> Range<usize> {
        self.rows[row] as usize..self.rows[row + 1] as usize
    }

    /// The strip of the same layer and x in the previous row, or [`NONE`].
    pub fn north(&self, strip: usize) -> u32 {
        self.north[strip]
    }

    /// One more than the highest layer of a strip; 0 without strips.
    pub(super) fn layers(&self) -> usize {
        self.strips.iter().map(|strip| strip.layer as usize + 1).max().unwrap_or(0)
    }

    /// The strip of the same layer and x in the next row, or [`NONE`].
    pub fn south(&self, strip: usize) -> u32 {
        self.south[strip]
    }

    /// The next strip along x, if it exists: it has the next index.
    pub fn east(&self, strip: usize) -> Option<usize> {
        let (own, next) = (self.strips[strip], self.strips.get(strip + 1)?);
        (*next == Strip { at: own.at + 1, ..own }).then_some(strip + 1)
    }

    /// The previous strip along x, if it exists: it has the previous index.
    pub fn west(&self, strip: usize) -> Option<usize> {
        strip.checked_sub(1).filter(|&before| self.east(before) == Some(strip))
    }

    /// A bit for each position of a strip that has a column.
    pub fn present(&self, strip: usize) -> u16 {
        self.present[strip]
    }

    /// Whether an index is a column.
    pub fn is_column(&self, index: usize) -> bool {
        self.present[index / STRIP] >> (index % STRIP) & 1 == 1
    }

    /// Indices of all columns, in order.
    pub fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len()).filter(|&index| self.is_column(index))
    }

    /// Cell (x, z) of an index.
    pub fn cell(&self, index: usize) -> [usize; 2] {
        let strip = self.strips[index / STRIP];
        [strip.at as usize * STRIP + index % STRIP, strip.row as usize]
    }

    /// Layer of an index.
    pub fn layer(&self, index: usize) -> usize {
        self.strips[index / STRIP].layer as usize
    }

    /// The column of a cell and layer.
    pub fn column(&self, [x, z]: [usize; 2], layer: usize) -> Option<usize> {
        let [nx, nz] = self.grid.size;
        if x >= nx || z >= nz {
            return None;
        }
        let wanted = Strip { row: z as u32, layer: layer as u32, at: (x / STRIP) as u32 };
        let row = self.row(z);
        // Right if all lower layers exist along the whole row, and the layer itself up to here.
        let guess = row.start + layer * nx.div_ceil(STRIP) + x / STRIP;
        let strip = match self.strips[row.clone()].last() {
            Some(last) if wanted <= *last => match self.strips.get(guess) {
                Some(strip) if *strip == wanted => guess,
                _ => row.start + self.strips[row].binary_search(&wanted).ok()?,
            },
            _ => return None,
        };
        Some(strip * STRIP + x % STRIP).filter(|&index| self.is_column(index))
    }

    /// The columns of a cell, from the lowest.
    pub fn of_cell(&self, cell: [usize; 2]) -> impl Iterator<Item = usize> + '_ {
        (0..).map_while(move |layer| self.column(cell, layer))
    }

    /// The column of a cell that contains a height (m) or is nearest to it, and its distance from this height (m).
    pub fn nearest(&self, cell: [usize; 2], height: f64) -> Option<(usize, f64)> {
        let off = |index: usize| {
            let [base, ceiling] =
                [self.bases()[index], self.ceilings()[index]].map(|height| self.heights.metres(height));
            (base - height).max(height - ceiling).max(0.0)
        };
        let all = self.of_cell(cell).map(|index| (index, off(index)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// b of every index (units), padded by 16 more numbers, so that SIMD loads may read past the last index.
    pub fn bases(&self) -> &[i32] {
        &self.base
    }

    /// max of every index (units): the underside of the next solid above, or [`TOP`]; as long as [`Columns::bases`].
    pub fn ceilings(&self) -> &[i32] {
        &self.ceiling
    }

    /// min of every index (units): the underside of the solid below, or [`BOTTOMLESS`]; as long as [`Columns::bases`].
    pub fn unders(&self) -> &[i32] {
        &self.under
    }

    /// Whether liquid can pass between two columns: their [b, max] overlap.
    pub fn overlap(&self, i: usize, j: usize) -> bool {
        self.base[i].max(self.base[j]) < self.ceiling[i].min(self.ceiling[j])
    }

    /// Whether the solid below a column has no lower end.
    pub fn is_bottomless(&self, index: usize) -> bool {
        self.under[index] == BOTTOMLESS
    }
}

/// The numbers of a strip.
#[inline(always)]
pub(super) fn strip_of<T>(numbers: &[T], strip: usize) -> &[T; STRIP] {
    &numbers.as_chunks().0[strip]
}

/// The 16 numbers from a position on.
#[inline(always)]
pub(super) fn strip_from<T>(numbers: &[T], at: usize) -> &[T; STRIP] {
    numbers[at..].first_chunk().expect("a strip")
}

/// The numbers of a strip, to change.
#[inline(always)]
pub(super) fn strip_mut<T>(numbers: &mut [T], strip: usize) -> &mut [T; STRIP] {
    &mut numbers.as_chunks_mut().0[strip]
}

/// Changes the length of a part of a list; the part then holds leftover values.
pub(super) fn resize_part<T: Copy>(list: &mut Vec<T>, part: Range<usize>, len: usize, fill: T) {
    let (count, end) = (list.len(), part.start + len);
    if end > part.end {
        list.resize(count + (end - part.end), fill);
    }
    list.copy_within(part.end..count, end);
    list.truncate(count - part.len() + len);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ground everywhere, and a bridge along x in row 1 of a domain of 20 x 3 cells.
    fn bridge() -> Columns {
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [20, 3] };
        let cell = |index: usize| {
            let ground = [BOTTOMLESS, 10];
            if index / 20 == 1 { vec![ground, [50, 60]] } else { vec![ground] }
        };
        Columns::new(&Solids::new(grid, Heights::between(0.0, 1.0).unwrap(), (0..60).map(cell)))
    }

    #[test]
    fn layers_are_counted_from_the_bottom() {
        let columns = bridge();
        assert_eq!((columns.count(), columns.len()), (80, 8 * STRIP));
        let under = columns.column([17, 1], 0).unwrap();
        let above = columns.column([17, 1], 1).unwrap();
        assert_eq!((columns.bases()[under], columns.ceilings()[under]), (10, 50));
        assert_eq!(
            (columns.bases()[above], columns.ceilings()[above], columns.unders()[above]),
            (60, TOP, 50)
        );
        assert_eq!((columns.cell(above), columns.layer(above)), ([17, 1], 1));
        assert_eq!(columns.of_cell([17, 1]).collect::<Vec<_>>(), [under, above]);
        assert_eq!((columns.column([17, 0], 1), columns.column([20, 0], 0)), (None, None));
    }

    #[test]
    fn strips_know_their_neighbours() {
        let columns = bridge();
        let strip = |x: usize, z: usize, layer: usize| columns.column([x, z], layer).unwrap() / STRIP;
        assert_eq!(columns.east(strip(3, 1, 0)), Some(strip(16, 1, 0)));
        assert_eq!(columns.west(strip(16, 1, 0)), Some(strip(3, 1, 0)));
        // The next index belongs to another layer.
        assert_eq!(columns.east(strip(16, 1, 0)), None);
        assert_eq!(columns.south(strip(16, 0, 0)), strip(16, 1, 0) as u32);
        assert_eq!(columns.north(strip(16, 1, 0)), strip(16, 0, 0) as u32);
        assert_eq!((columns.south(strip(16, 1, 1)), columns.north(strip(0, 0, 0))), (NONE, NONE));
    }

    #[test]
    fn liquid_passes_where_openings_overlap() {
        let columns = bridge();
        let at = |z: usize, layer: usize| columns.column([4, z], layer).unwrap();
        assert!(columns.overlap(at(0, 0), at(1, 0)));
        assert!(columns.overlap(at(0, 0), at(1, 1)), "it falls from the bridge");
        assert!(!columns.overlap(at(1, 0), at(1, 1)));
    }
}
