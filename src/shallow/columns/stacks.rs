//! The vertically stacked strips of a row.

use std::ops::Range;

use super::grid::BOTTOMLESS;
use super::{Columns, NONE, STRIP, Strip, strip_of};
use crate::numeric::lists::{refill, reset};

/// The strips of a row by block: 16 cells along x, with the strips of all layers above each other.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Stacks {
    /// Maximum number of layers in a block.
    layers: usize,
    /// Count of layers of each block.
    counts: Vec<u32>,
    /// Strips, by block x layers + layer.
    strips: Vec<u32>,
    /// For each of these strips, the lowest base and the highest ceiling.
    extents: Vec<[i32; 2]>,
    /// Whether all cells of the row have ground without a lower end.
    pub is_grounded: bool,
    /// If not, for each cell the height below which it is void: `i32::MIN` if it is nowhere void, `i32::MAX` if it is void everywhere.
    pub sills: Vec<i32>,
}

impl Stacks {
    /// Finds the stacks of strips of one row, which are in order; `blocks` is the count of blocks in a row.
    pub fn find(&mut self, strips: &[Strip], range: Range<usize>, blocks: usize) {
        let strips = strips[range.clone()].iter();
        self.layers = strips.clone().next_back().map_or(0, |last| last.layer as usize + 1);
        reset(&mut self.counts, blocks, 0);
        reset(&mut self.strips, blocks * self.layers, NONE);
        for (strip, position) in range.zip(strips) {
            self.counts[position.at as usize] = position.layer + 1;
            self.strips[position.at as usize * self.layers + position.layer as usize] = strip as u32;
        }
    }

    /// Finds the stacks of a row of columns, and where it has no ground.
    pub fn find_row(&mut self, columns: &Columns, row: usize) {
        let nx = columns.grid.size[0];
        self.find(columns.strips(), columns.row(row), nx.div_ceil(STRIP));
        refill(&mut self.extents, self.strips.iter().map(|&strip| extent(columns, strip)));
        let is_grounded = |at: usize| {
            let cells = (nx - at * STRIP).min(STRIP);
            self.of(at).first().is_some_and(|&strip| {
                columns.present(strip as usize).count_ones() as usize == cells
                    && strip_of(columns.unders(), strip as usize)[..cells]
                        .iter()
                        .all(|&under| under == BOTTOMLESS)
            })
        };
        self.is_grounded = (0..self.counts.len()).all(is_grounded);
        self.sills.clear();
        if self.is_grounded {
            return;
        }
        for at in 0..self.counts.len() {
            let lowest = self.of(at).first().map(|&strip| strip as usize);
            let sill = |position: usize| match lowest {
                Some(strip) if columns.present(strip) >> position & 1 == 1 => {
                    columns.unders()[strip * STRIP + position]
                }
                _ => i32::MAX,
            };
            self.sills.extend((0..STRIP).map(sill));
        }
    }

    /// The strips of a block from the lowest layer up.
    #[inline]
    pub fn of(&self, block: usize) -> &[u32] {
        let first = block * self.layers;
        &self.strips[first..first + self.counts[block] as usize]
    }

    /// Lowest bases and highest ceilings of the strips of a block; an empty range for a strip without a column.
    #[inline]
    pub fn extents(&self, block: usize) -> &[[i32; 2]] {
        let first = block * self.layers;
        &self.extents[first..first + self.counts[block] as usize]
    }

    /// The columns of a cell from the lowest up.
    #[inline]
    pub fn columns<'a>(&'a self, columns: &'a Columns, x: usize) -> impl Iterator<Item = usize> + 'a {
        let indices = self.of(x / STRIP).iter().map(move |&strip| strip as usize * STRIP + x % STRIP);
        indices.take_while(|&index| columns.is_column(index))
    }
}

/// The lowest base and the highest ceiling of a strip's columns. Where there is no column, the ceiling is 0.
fn extent(columns: &Columns, strip: u32) -> [i32; 2] {
    let mut extent = [i32::MAX, 0];
    if strip != NONE {
        let base = strip_of(columns.bases(), strip as usize);
        let ceiling = strip_of(columns.ceilings(), strip as usize);
        for x in 0..STRIP {
            let base = if ceiling[x] > 0 { base[x] } else { i32::MAX };
            extent = [extent[0].min(base), extent[1].max(ceiling[x])];
        }
    }
    extent
}
