//! Pipes that are not regular: between layers, to the outside, and over cliffs.

use std::ops::Range;

use super::side::Side;
use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE, STRIP};

/// The pipes that are not regular, by the row of their owner.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Links {
    /// The column that is the donor where the flux is positive.
    pub from: Vec<u32>,
    /// The other column, or [`NONE`]: the outside.
    pub to: Vec<u32>,
    /// The side of `from` that each link crosses.
    pub(in crate::shallow) sides: Vec<Side>,
    /// As [`Pipes::east`](super::Pipes::east).
    pub open: Vec<f32>,
    /// Surface outside (units), where `to` is [`NONE`].
    pub level: Vec<i32>,
    /// First link of each row, and the end of the last.
    pub rows: Vec<u32>,
    /// Columns with links, row by row.
    pub columns: Vec<u32>,
    /// First of those columns of each row, and the end of the last.
    pub column_rows: Vec<u32>,
    /// Maximum count of pipes of a column.
    pub max_pipes: usize,
}

impl Links {
    pub(in crate::shallow) fn add(&mut self, from: usize, to: u32, side: Side, open: f32, level: i32) {
        self.from.push(from as u32);
        self.to.push(to);
        self.sides.push(side);
        self.open.push(open);
        self.level.push(level);
    }

    /// Lists the columns with links.
    pub(in crate::shallow) fn list_columns(&mut self, columns: &Columns, ends: &mut Ends) {
        let all = || self.from.iter().chain(self.to.iter().filter(|&&to| to != NONE)).copied();
        reset(&mut ends.marks, columns.strips().len(), 0);
        all().for_each(|end| ends.marks[end as usize / STRIP] |= 1 << (end as usize % STRIP));
        self.columns.clear();
        self.column_rows.clear();
        self.column_rows.push(0);
        ends.firsts.clear();
        for row in 0..columns.grid.size[1] {
            for strip in columns.row(row) {
                ends.firsts.push(self.columns.len() as u32);
                let mut marks = ends.marks[strip];
                while marks != 0 {
                    self.columns.push((strip * STRIP) as u32 + marks.trailing_zeros());
                    marks &= marks - 1;
                }
            }
            self.column_rows.push(self.columns.len() as u32);
        }
        reset(&mut ends.counts, self.columns.len(), 0);
        for end in all() {
            let rank = ends.rank(end);
            ends.counts[rank] += 1;
        }
        self.max_pipes = 4 + ends.counts.iter().copied().max().unwrap_or(0) as usize;
    }

    /// Replaces the links of some rows. Column indices in later rows grow by `shift`, modulo 2^32.
    pub(in crate::shallow) fn replace_rows(&mut self, rows: Range<usize>, new: &Self, shift: u32) {
        let old = self.rows[rows.start] as usize..self.rows[rows.end] as usize;
        self.from.splice(old.clone(), new.from.iter().copied());
        self.to.splice(old.clone(), new.to.iter().copied());
        self.sides.splice(old.clone(), new.sides.iter().copied());
        self.open.splice(old.clone(), new.open.iter().copied());
        self.level.splice(old.clone(), new.level.iter().copied());
        let (first, end) = (old.start, old.start + new.len());
        if shift != 0 {
            let behind = [&mut self.from[end..], &mut self.to[end..]];
            let ends = behind.into_iter().flatten().filter(|end| **end != NONE);
            ends.for_each(|end| *end = end.wrapping_add(shift));
        }
        for (row, end) in rows.clone().zip(&new.rows[1..]) {
            self.rows[row + 1] = first as u32 + end;
        }
        let grows = (end as u32).wrapping_sub(old.end as u32);
        self.rows[rows.end + 1..].iter_mut().for_each(|end| *end = end.wrapping_add(grows));
    }

    /// Removes all links; rows are then counted from the first one added.
    pub(in crate::shallow) fn clear(&mut self) {
        self.from.clear();
        self.to.clear();
        self.sides.clear();
        self.open.clear();
        self.level.clear();
        self.rows.clear();
        self.rows.push(0);
    }

    /// Count of links.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// Whether there is no link.
    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }

    /// The surface (units) outside at a link that leads there, and whether it is that of the liquid at rest, `still_level`.
    #[inline]
    pub fn outside(&self, columns: &Columns, link: usize, still_level: i32) -> (i32, bool) {
        let from = self.from[link] as usize;
        let is_still = still_level > columns.bases()[from]
            && self.sides[link].cell(columns.cell(from), columns.grid.size).is_none();
        if is_still { (still_level, true) } else { (self.level[link], false) }
    }

    /// The links that a row owns: from its columns to others of the row, to the next row, or to the outside.
    pub fn row(&self, row: usize) -> Range<usize> {
        self.rows[row] as usize..self.rows[row + 1] as usize
    }

    /// The columns of a row that have links.
    pub fn columns_of(&self, row: usize) -> &[u32] {
        &self.columns[self.column_rows[row] as usize..self.column_rows[row + 1] as usize]
    }
}

/// Ends of links by column; kept to avoid repeated allocation.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Ends {
    /// Bits of the positions in each strip that have links.
    pub marks: Vec<u16>,
    /// Rank of the first column of each strip among those that have links.
    pub firsts: Vec<u32>,
    /// Count of links of each of these columns.
    pub counts: Vec<u32>,
}

impl Ends {
    /// The rank of a column among all columns with links.
    pub fn rank(&self, column: u32) -> usize {
        let (strip, position) = (column as usize / STRIP, column as usize % STRIP);
        let before = self.marks[strip] & ((1 << position) - 1);
        self.firsts[strip] as usize + before.count_ones() as usize
    }
}
