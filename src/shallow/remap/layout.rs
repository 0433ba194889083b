//! The new columns of rows, and the liquid that stays in them.

use super::band::Band;
use super::cells::{Cell, Leftover, OldColumn, dry};
use super::dirty::Dirty;
use super::held::Held;
use super::origins::Origins;
use crate::shallow::columns::grid::{BOTTOMLESS, TOP};
use crate::shallow::columns::stacks::Stacks;
use crate::shallow::columns::{Columns, NONE, STRIP, Strip, strip_mut, strip_of};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::terrain::solids::Solid;

/// If a cell has several columns, one whose base moves by more than this many cells counts as a new one.
const REACH: f64 = 4.0;

/// Buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    /// Count of layers of each new block, row by row.
    layers: Vec<u32>,
    /// Count of strips of each new row.
    pub counts: Vec<u32>,
    /// Strips of a row before and after the change.
    old: Stacks,
    new: Stacks,
    cell: Cell,
}

/// The rows that are rebuilt.
pub(super) struct RebuiltRows<'a, Cast> {
    pub dirty: &'a Dirty,
    pub band: &'a Band,
    /// New solids of the dirty cells, by their rank, row by row along x.
    pub cast: Cast,
}

/// The liquid in the columns.
pub(super) struct Liquid<'a> {
    /// H (units).
    pub depth: &'a mut [i32],
    /// Amounts of scalars; empty without them.
    pub amounts: [&'a mut [f64]; MAX_SCALARS],
}

impl Layout {
    /// Counts the strips of the new rows.
    pub fn plan<'s>(&mut self, rows: &RebuiltRows<impl Fn(usize) -> &'s [Solid]>) {
        let RebuiltRows { dirty, band, cast } = rows;
        self.layers.clear();
        self.counts.clear();
        let mut next = 0;
        for row in band.rows.clone() {
            self.old.find(&band.strips, band.row(row), dirty.blocks);
            let first = self.layers.len();
            for block in 0..dirty.blocks {
                let (cells, old) = (dirty.of(row, block), self.old.of(block));
                let stays = |strip: u32| band.present[strip as usize] & !cells != 0;
                let mut layers = old.iter().rposition(|&strip| stays(strip)).map_or(0, |last| last + 1);
                for _ in 0..cells.count_ones() {
                    layers = cast(next).len().max(layers);
                    next += 1;
                }
                self.layers.push(layers as u32);
            }
            self.counts.push(self.layers[first..].iter().sum());
        }
    }

    /// Creates the new columns, whose indices must exist already, and gives them the liquid that finds room in its cell; the rest goes to
    /// `held`. Returns how much did not stay in its column (units).
    pub fn build<'s>(
        &mut self,
        rows: &RebuiltRows<impl Fn(usize) -> &'s [Solid]>,
        columns: &mut Columns,
        liquid: &mut Liquid,
        origins: &mut Origins,
        held: &mut Held,
    ) -> i64 {
        let RebuiltRows { dirty, band, cast } = rows;
        let blocks = dirty.blocks;
        self.cell.reach = (REACH * columns.grid.cell / columns.heights.unit).min(f64::from(TOP)) as i64;
        let grid = columns.grid;
        origins.begin(band, self.counts.iter().sum::<u32>() as usize);
        let (mut next, mut displaced) = (0, 0);
        for (number, row) in band.rows.clone().enumerate() {
            let layers = &self.layers[number * blocks..(number + 1) * blocks];
            place_strips(columns, row, layers);
            self.old.find(&band.strips, band.row(row), blocks);
            self.new.find(columns.strips(), columns.row(row), blocks);
            for block in 0..blocks {
                let cells = dirty.of(row, block);
                let mut block = Block {
                    cells,
                    old: self.old.of(block),
                    new: self.new.of(block),
                    band,
                    origins: &mut *origins,
                };
                if cells == 0 {
                    block.copy(columns, liquid);
                    continue;
                }
                block.build(columns, |rank| cast(next + rank));
                next += cells.count_ones() as usize;
                let mut moves = block.keep(columns, liquid, self.cell.reach as i32);
                while moves != 0 {
                    let position = moves.trailing_zeros() as usize;
                    moves &= moves - 1;
                    block.remap(columns, liquid, position, &mut self.cell, |cell, leftover| {
                        displaced += leftover.displaced;
                        held.add(grid.index(cell), leftover.height, leftover.units, leftover.amounts);
                    });
                }
            }
        }
        displaced
    }
}

/// Sets the positions of the strips of a row, in order.
fn place_strips(columns: &mut Columns, row: usize, layers: &[u32]) {
    let mut strips = columns.row(row);
    let layer_count = layers.iter().copied().max().unwrap_or(0);
    for layer in 0..layer_count {
        for (at, _) in layers.iter().enumerate().filter(|(_, count)| **count > layer) {
            let Some(strip) = strips.next() else { return };
            columns.place_strip(strip, Strip { row: row as u32, layer, at: at as u32 });
        }
    }
}

/// Bits of the positions for which something holds.
fn bits(holds: impl Fn(usize) -> bool) -> u16 {
    (0..STRIP).fold(0, |bits, x| bits | u16::from(holds(x)) << x)
}

/// Copies the numbers of a strip from its former strip: only those in `kept` if any cell moves, otherwise all.
#[inline(always)]
fn keep_strip<T: Copy + Default>(
    now: &mut [T; STRIP],
    old: Option<u32>,
    before: &[T],
    kept: u16,
    moves: u16,
) {
    let Some(old) = old else { return now.fill(T::default()) };
    *now = *strip_of(before, old as usize);
    if moves != 0 {
        (0..STRIP).filter(|x| kept >> x & 1 == 0).for_each(|x| now[x] = T::default());
    }
}

/// The strips of a block, above each other, before and after the change.
struct Block<'a> {
    /// Bits of the cells whose solids change.
    cells: u16,
    /// Strips of the band.
    old: &'a [u32],
    /// New strips.
    new: &'a [u32],
    band: &'a Band,
    origins: &'a mut Origins,
}

impl Block<'_> {
    /// Copies everything unchanged.
    fn copy(&mut self, columns: &mut Columns, liquid: &mut Liquid) {
        for (&old, &new) in self.old.iter().zip(self.new) {
            let (old, new, band) = (old as usize, new as usize, self.band);
            self.origins.keep(new, old as u32, band.present[old]);
            if band.first + old == new {
                continue;
            }
            let strip = columns.set_strip(new, band.present[old]);
            *strip.base = *strip_of(&band.base, old);
            *strip.ceiling = *strip_of(&band.ceiling, old);
            *strip.under = *strip_of(&band.under, old);
            *strip_mut(liquid.depth, new) = *strip_of(&band.depth, old);
            for (amounts, before) in liquid.amounts.iter_mut().zip(&band.amounts) {
                if !amounts.is_empty() {
                    *strip_mut(amounts, new) = *strip_of(before, old);
                }
            }
        }
    }

    /// Creates the new columns; `cast` gives the solids of the cells that change, by rank.
    fn build<'s>(&self, columns: &mut Columns, cast: impl Fn(usize) -> &'s [Solid]) {
        let mut solids = [&[][..]; STRIP];
        let mut rank = 0;
        for (position, solids) in solids.iter_mut().enumerate() {
            if self.cells >> position & 1 == 1 {
                *solids = cast(rank);
                rank += 1;
            }
        }
        for (layer, &strip) in self.new.iter().enumerate() {
            let (mut base, mut ceiling, mut under) = ([0; STRIP], [0; STRIP], [0; STRIP]);
            let mut present = 0;
            for (position, solids) in solids.iter().enumerate() {
                if let Some(solid) = solids.get(layer) {
                    present |= 1 << position;
                    (under[position], base[position]) = (solid[0], solid[1]);
                    ceiling[position] = solids.get(layer + 1).map_or(TOP, |above| above[0]);
                }
            }
            if let Some(&old) = self.old.get(layer).filter(|_| self.cells != u16::MAX) {
                let stays = self.band.present[old as usize] & !self.cells;
                present |= stays;
                for position in (0..STRIP).filter(|position| stays >> position & 1 == 1) {
                    let index = old as usize * STRIP + position;
                    base[position] = self.band.base[index];
                    ceiling[position] = self.band.ceiling[index];
                    under[position] = self.band.under[index];
                }
            }
            let strip = columns.set_strip(strip as usize, present);
            (*strip.base, *strip.ceiling, *strip.under) = (base, ceiling, under);
        }
    }

    /// Leaves liquid where it is in the cells whose columns are the same and have room for it. Returns the bits of all other cells.
    fn keep(&mut self, columns: &Columns, liquid: &mut Liquid, reach: i32) -> u16 {
        let band = self.band;
        let (mut moves, mut any) = (0, 0);
        for layer in 0..self.old.len().max(self.new.len()) {
            let old = self.old.get(layer).map_or(0, |&strip| band.present[strip as usize]);
            let new = self.new.get(layer).map_or(0, |&strip| columns.present(strip as usize));
            moves |= old ^ new;
            any |= old;
        }
        let several = self.new.get(1).map_or(0, |&strip| columns.present(strip as usize));
        for (&old, &new) in self.old.iter().zip(self.new) {
            let (old, new) = (old as usize, new as usize);
            let (old_base, depth) = (strip_of(&band.base, old), strip_of(&band.depth, old));
            let (base, ceiling) = (strip_of(columns.bases(), new), strip_of(columns.ceilings(), new));
            // Heights are within 0 to 2^30: their differences fit.
            let (mut over, mut far) = (0, 0);
            for x in 0..STRIP {
                over = (depth[x] - (ceiling[x] - base[x])).max(over);
                far = (base[x] - old_base[x]).abs().max(far);
            }
            if over > 0 {
                moves |= bits(|x| depth[x] > ceiling[x] - base[x]);
            }
            if far > reach && several != 0 {
                moves |= several & bits(|x| (base[x] - old_base[x]).abs() > reach);
            }
        }
        for (layer, &new) in self.new.iter().enumerate() {
            let new = new as usize;
            let kept = columns.present(new) & !moves;
            let old = self.old.get(layer).copied();
            keep_strip(strip_mut(liquid.depth, new), old, &band.depth, kept, moves);
            for (amounts, before) in liquid.amounts.iter_mut().zip(&band.amounts) {
                if !amounts.is_empty() {
                    keep_strip(strip_mut(amounts, new), old, before, kept, moves);
                }
            }
            match old {
                Some(old) => self.origins.keep(new, old, kept),
                None => self.origins.keep(new, NONE, 0),
            }
        }
        // Cells that had no column have nothing to remap.
        moves & any
    }

    /// Moves the liquid of a cell to its new columns; `keep` receives the cell and the liquid that finds no column.
    fn remap(
        &mut self,
        columns: &Columns,
        liquid: &mut Liquid,
        position: usize,
        cell: &mut Cell,
        keep: impl FnOnce([usize; 2], Leftover),
    ) {
        let band = self.band;
        cell.old.clear();
        for &strip in self.old.iter().take_while(|&&strip| band.present[strip as usize] >> position & 1 == 1)
        {
            let index = strip as usize * STRIP + position;
            let amount = |of: &Vec<f64>| of.get(index).map_or(0, |&amount| amount as i64);
            let amounts = band.amounts.each_ref().map(amount);
            let (base, depth) = (band.base[index], band.depth[index]);
            cell.old.push(OldColumn { index: index as u32, base, depth, amounts });
        }
        cell.new.clear();
        cell.under = BOTTOMLESS;
        for &strip in
            self.new.iter().take_while(|&&strip| columns.present(strip as usize) >> position & 1 == 1)
        {
            let index = strip as usize * STRIP + position;
            if cell.new.is_empty() {
                cell.under = columns.unders()[index];
            }
            cell.new.push(dry(index, columns.bases()[index], columns.ceilings()[index]));
        }
        let leftover = cell.remap();
        for new in &cell.new {
            liquid.depth[new.index as usize] = new.depth;
            for (amounts, amount) in liquid.amounts.iter_mut().zip(new.amounts) {
                if let Some(own) = amounts.get_mut(new.index as usize) {
                    *own = amount as f64;
                }
            }
            self.origins.set(new.index, new.from);
        }
        let strip = band.strips[self.old[0] as usize];
        keep([strip.at as usize * STRIP + position, strip.row as usize], leftover);
    }
}
