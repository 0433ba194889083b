//! Finds the pipes of rows of columns: the openness of regular pipes, and the links.
//!
//! Few cells have links. Candidates are found first, 16 cells at a time.

use std::ops::Range;

use super::cliffs::index_beyond;
use super::pipe_rules::Rules;
use super::side::Side;
use super::slopes::{self, Rises};
use super::{Border, Links};
use crate::shallow::columns::stacks::Stacks;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_of};

/// Data of the rows around the one whose pipes are found; kept to avoid repeated allocation.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Finder {
    /// For the row and the next one, by row modulo 2.
    rises: [Rises; 2],
    /// For the row and those beside it, by row modulo 3.
    stacks: [Stacks; 3],
}

impl Finder {
    /// Finds the pipes of some rows: sets the openness of regular ones, by column index, and adds the links in order.
    pub fn find(
        &mut self,
        columns: &Columns,
        rules: &Rules,
        rows: Range<usize>,
        [east, south]: [&mut [f32]; 2],
        links: &mut Links,
    ) {
        let (count, Rules { cliffs, wall_rise, .. }) = (columns.grid.size[1], rules);
        for row in rows.start.saturating_sub(1)..(rows.start + 1).min(count) {
            self.stacks[row % 3].find_row(columns, row);
        }
        self.rises[rows.start % 2].find(columns, rows.start, *wall_rise);
        for row in rows {
            if row + 1 < count {
                self.stacks[(row + 1) % 3].find_row(columns, row + 1);
                self.rises[(row + 1) % 2].find(columns, row + 1, *wall_rise);
            }
            let rises = [&self.rises[row % 2], &self.rises[(row + 1) % 2]];
            slopes::open_row(columns, row, rises, east, south);
            cliffs.close(columns, row, east, south);
            Joiner::new(self, columns, row, rules).join_row(links);
            links.rows.push(links.len() as u32);
        }
    }
}

/// Finds the links of a row.
struct Joiner<'a> {
    columns: &'a Columns,
    row: usize,
    rules: &'a Rules,
    /// For the row and the next one.
    rises: [&'a Rises; 2],
    own: &'a Stacks,
    /// None at the edge of the domain.
    north: Option<&'a Stacks>,
    south: Option<&'a Stacks>,
    /// First index of the row and of the next one.
    starts: [usize; 2],
    scale: f64,
}

impl<'a> Joiner<'a> {
    fn new(finder: &'a Finder, columns: &'a Columns, row: usize, rules: &'a Rules) -> Self {
        let count = columns.grid.size[1];
        let strips = columns.row(row);
        Self {
            columns,
            row,
            rules,
            rises: [&finder.rises[row % 2], &finder.rises[(row + 1) % 2]],
            own: &finder.stacks[row % 3],
            north: (row > 0).then(|| &finder.stacks[(row + 2) % 3]),
            south: (row + 1 < count).then(|| &finder.stacks[(row + 1) % 3]),
            starts: [strips.start * STRIP, strips.end * STRIP],
            scale: slopes::scale(columns),
        }
    }

    fn join_row(&self, links: &mut Links) {
        let nx = self.columns.grid.size[0];
        let is_outer = self.rules.border != Border::Closed && (self.north.is_none() || self.south.is_none());
        let is_grounded =
            [Some(self.own), self.north, self.south].into_iter().flatten().all(|stacks| stacks.is_grounded);
        for block in 0..nx.div_ceil(STRIP) {
            let mut cells = self.across_layers(block) | self.over_cliffs(block);
            if !is_grounded {
                cells |= self.over_void(block);
            }
            if self.rules.border != Border::Closed {
                cells |= if is_outer { u16::MAX } else { 0 };
                cells |= u16::from(block == 0);
                cells |= if block == (nx - 1) / STRIP { 1 << ((nx - 1) % STRIP) } else { 0 };
            }
            while cells != 0 {
                let x = block * STRIP + cells.trailing_zeros() as usize;
                cells &= cells - 1;
                for (layer, i) in self.own.columns(self.columns, x).enumerate() {
                    for side in Side::ALL {
                        self.join(links, [x, self.row], layer, i, side);
                    }
                }
            }
        }
    }

    /// Bits of the cells of a block whose columns may be linked to columns of other layers to the east or south.
    fn across_layers(&self, block: usize) -> u16 {
        let is_last = (block + 1) * STRIP >= self.columns.grid.size[0];
        let own = (self.own.of(block), self.own.extents(block));
        let none = (&[][..], &[][..]);
        let east = if is_last { none } else { (self.own.of(block + 1), self.own.extents(block + 1)) };
        let south = self.south.map_or(none, |stacks| (stacks.of(block), stacks.extents(block)));
        if own.0.len().max(east.0.len()).max(south.0.len()) < 2 {
            return 0;
        }
        let mut cells = 0;
        for (layer, (&strip, extent)) in own.0.iter().zip(own.1).enumerate() {
            // Strips of other layers that may have a column that meets one of this strip: their height ranges overlap.
            let others = |(strips, extents): (&'a [u32], &'a [[i32; 2]])| {
                let all = strips.iter().zip(extents).enumerate();
                all.filter(move |(other, (_, range))| {
                    *other != layer && extent[0].max(range[0]) < extent[1].min(range[1])
                })
                .map(|(_, (&strip, _))| strip as usize)
            };
            let strip = strip as usize;
            others(own).for_each(|other| cells |= self.meeting(strip, other, 1) & !(1 << (STRIP - 1)));
            others(south).for_each(|other| cells |= self.meeting(strip, other, 0));
            let last = strip * STRIP + STRIP - 1;
            if others(east).any(|other| self.columns.overlap(last, other * STRIP)) {
                cells |= 1 << (STRIP - 1);
            }
        }
        cells
    }

    /// Bits of the cells of a block with a column beside a cliff to the east or south.
    fn over_cliffs(&self, block: usize) -> u16 {
        let all = self.own.of(block).iter().flat_map(|&strip| {
            [Side::East, Side::South]
                .map(|side| self.rules.cliffs.of_strip(self.columns, strip as usize, side))
        });
        all.fold(0, |cells, more| cells | more)
    }

    /// Bits of the columns of a strip from which liquid can pass to those of another strip, `positions` further on.
    fn meeting(&self, strip: usize, other: usize, positions: usize) -> u16 {
        let (bases, ceilings) = (self.columns.bases(), self.columns.ceilings());
        let (base, ceiling) = (strip_of(bases, strip), strip_of(ceilings, strip));
        let first = other * STRIP + positions;
        let (other_base, other_ceiling) = (&bases[first..first + STRIP], &ceilings[first..first + STRIP]);
        let (mut open, mut any) = ([0; STRIP], 0);
        for x in 0..STRIP {
            open[x] = i32::from(base[x].max(other_base[x]) < ceiling[x].min(other_ceiling[x]));
            any |= open[x];
        }
        if any == 0 {
            return 0;
        }
        open.iter().enumerate().fold(0, |bits, (x, open)| bits | (*open as u16) << x)
    }

    /// Bits of the cells of a block with a column beside a void.
    fn over_void(&self, block: usize) -> u16 {
        let nx = self.columns.grid.size[0];
        let mut cells = 0;
        for &strip in self.own.of(block) {
            let present = self.columns.present(strip as usize);
            let base = strip_of(self.columns.bases(), strip as usize);
            for (position, base) in
                base.iter().enumerate().filter(|(position, _)| present >> position & 1 == 1)
            {
                let at = [block * STRIP + position, self.row];
                let falls = Side::ALL.into_iter().any(|side| {
                    let cell = side.cell(at, [nx, self.columns.grid.size[1]]);
                    cell.is_some_and(|cell| self.is_void(side, cell, *base))
                });
                cells |= u16::from(falls) << position;
            }
        }
        cells
    }

    /// The stacks of the row beyond a side.
    fn beyond(&self, side: Side) -> Option<&'a Stacks> {
        match side {
            Side::East | Side::West => Some(self.own),
            Side::South => self.south,
            Side::North => self.north,
        }
    }

    /// Whether the cell beyond a side is void at a height: it has no ground, or only ground that hangs above.
    fn is_void(&self, side: Side, cell: [usize; 2], height: i32) -> bool {
        self.beyond(side).is_some_and(|stacks| !stacks.is_grounded && height < stacks.sills[cell[0]])
            && !self.rules.excluded.as_ref().is_some_and(|excluded| excluded.has(cell))
    }

    /// Adds the links of a column over a side: those to columns of other layers or over cliffs, which the cell to the west or north owns,
    /// and the one to the outside.
    fn join(&self, links: &mut Links, at: [usize; 2], layer: usize, i: usize, side: Side) {
        let columns = self.columns;
        let cell = side.cell(at, columns.grid.size);
        let is_owner = matches!(side, Side::East | Side::South);
        let beyond = self.beyond(side);
        if let (Some([x, _]), Some(stacks)) = (cell.filter(|_| is_owner), beyond) {
            for (other, j) in stacks.columns(columns, x).enumerate() {
                if columns.overlap(i, j) && (other != layer || self.rules.cliffs.has(columns, i, j)) {
                    let along = 4 * (i64::from(columns.bases()[j]) - i64::from(columns.bases()[i]));
                    let across = self.across(i, side) + self.across(j, side);
                    links.add(i, j as u32, side, self.openness(along, across), 0);
                }
            }
        }
        let falls = cell.is_some_and(|cell| self.is_void(side, cell, columns.bases()[i]));
        if falls || (cell.is_none() && self.rules.border != Border::Closed) {
            let base = i64::from(columns.bases()[i]);
            let fall = if falls {
                (columns.grid.cell / columns.heights.unit).min(f64::from(i32::MAX / 2)) as i64
            } else {
                // The slope of the ground continues outside, but never rises.
                let inner = index_beyond(columns, i, side.opposite()).filter(|&j| columns.overlap(i, j));
                inner.map_or(0, |j| (i64::from(columns.bases()[j]) - base).max(0))
            };
            let open = self.openness(4 * fall, 2 * self.across(i, side));
            links.add(i, NONE, side, open, (base - fall).max(i64::from(i32::MIN / 2)) as i32);
        }
    }

    fn openness(&self, along: i64, across: i64) -> f32 {
        slopes::openness(along as f64, across as f64, self.scale)
    }

    /// Twice the rise (units) across a side's axis, at a column of this row or the next one.
    fn across(&self, i: usize, side: Side) -> i64 {
        let row = usize::from(i >= self.starts[1]);
        let rises = if side.is_along_x() { &self.rises[row].z } else { &self.rises[row].x };
        i64::from(rises[i - self.starts[row]])
    }
}
