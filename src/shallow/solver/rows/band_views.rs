//! The arrays of a liquid, as seen by the threads that work on bands of its rows: each changes its own rows, and has copies of the rows
//! before and after, as they were at the start of the step.

use std::ops::Range;

use crate::numeric::lists::split_each;
use crate::shallow::columns::{Columns, STRIP};
use crate::shallow::pipes::Links;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::solver::link_flow::LinkFlow;

/// Rows that a band sees beyond its own on each side: the transfers of three are found, of the fourth only depths are read.
pub const BEYOND: usize = 4;

/// A run of rows of all arrays; columns and links are counted from the start of the run.
pub struct Part<'a> {
    /// First column index.
    pub start: usize,
    /// H (units).
    pub depth: &'a mut [i32],
    /// Flux to the east and to the south (units per step).
    pub flux: [&'a mut [f32]; 2],
    /// Remainders of transfers, to the east and to the south (units).
    pub remainder: [&'a mut [f32]; 2],
    /// Fluxes, remainders and transfers of links.
    pub links: LinkPart<'a>,
    /// Amounts of scalars; empty without them.
    pub amounts: [&'a mut [f64]; MAX_SCALARS],
}

/// Links of a run of rows.
pub struct LinkPart<'a> {
    /// First link.
    pub first: usize,
    /// Flux (units per step).
    pub flux: &'a mut [f32],
    /// Remainder of the transfer (units).
    pub remainder: &'a mut [f32],
    /// Transfer in this step (units).
    pub transfer: &'a mut [f32],
    /// Amounts that fell freely over each link; empty without scalars.
    pub fallen: [&'a mut [f64]; MAX_SCALARS],
}

/// Copies of the rows beside a band.
#[derive(Debug, Clone, Default)]
pub struct RowCopies {
    /// The rows that are copied.
    pub rows: Range<usize>,
    depth: Vec<i32>,
    flux: [Vec<f32>; 2],
    remainder: [Vec<f32>; 2],
    links: LinkFlow,
    amounts: [Vec<f64>; MAX_SCALARS],
}

/// The rows that a band sees, in three parts: copies before it, its own, copies after it.
pub struct BandView<'a> {
    /// The band's own rows.
    pub rows: Range<usize>,
    /// The first row that it sees.
    pub first: usize,
    parts: [Part<'a>; 3],
}

impl RowCopies {
    /// Copies some rows of a liquid.
    pub fn take(&mut self, columns: &Columns, links: &Links, rows: Range<usize>, liquid: &Part) {
        let (columns, links) = (indices(columns, &rows), link_range(links, &rows));
        self.rows = rows;
        // Padded by one strip, so that the column to the east of the last one can be read.
        liquid.depth[columns.start..columns.end + STRIP].clone_into(&mut self.depth);
        for axis in 0..2 {
            liquid.flux[axis][columns.clone()].clone_into(&mut self.flux[axis]);
            liquid.remainder[axis][columns.clone()].clone_into(&mut self.remainder[axis]);
        }
        for (own, amounts) in self.amounts.iter_mut().zip(&liquid.amounts) {
            amounts.get(columns.clone()).unwrap_or_default().clone_into(own);
        }
        liquid.links.flux[links.clone()].clone_into(&mut self.links.flux);
        liquid.links.remainder[links.clone()].clone_into(&mut self.links.remainder);
        liquid.links.transfer[links.clone()].clone_into(&mut self.links.transfer);
        for (own, fallen) in self.links.fallen.iter_mut().zip(&liquid.links.fallen) {
            fallen.get(links.clone()).unwrap_or_default().clone_into(own);
        }
    }

    /// The copies, as a part.
    pub fn part(&mut self, columns: &Columns, links: &Links) -> Part<'_> {
        let mut part = Part::new(
            &mut self.depth,
            self.flux.each_mut().map(Vec::as_mut_slice),
            self.remainder.each_mut().map(Vec::as_mut_slice),
            &mut self.links,
            self.amounts.each_mut().map(Vec::as_mut_slice),
        );
        part.start = indices(columns, &self.rows).start;
        part.links.first = link_range(links, &self.rows).start;
        part
    }
}

impl<'a> Part<'a> {
    /// The whole liquid.
    pub fn new(
        depth: &'a mut [i32],
        flux: [&'a mut [f32]; 2],
        remainder: [&'a mut [f32]; 2],
        links: &'a mut LinkFlow,
        amounts: [&'a mut [f64]; MAX_SCALARS],
    ) -> Self {
        Self {
            start: 0,
            depth,
            flux,
            remainder,
            links: LinkPart {
                first: 0,
                flux: &mut links.flux,
                remainder: &mut links.remainder,
                transfer: &mut links.transfer,
                fallen: links.fallen.each_mut().map(Vec::as_mut_slice),
            },
            amounts,
        }
    }

    /// Splits the part before a row.
    pub fn split(self, columns: &Columns, links: &Links, row: usize) -> [Self; 2] {
        let index = indices(columns, &(row..row)).start;
        let link = link_range(links, &(row..row)).start;
        let Self { start, .. } = self;
        let at = index - start;
        let [[depth], [depth_behind]] = split_each([self.depth], at);
        let [flux, flux_behind] = split_each(self.flux, at);
        let [remainder, remainder_behind] = split_each(self.remainder, at);
        let [links, links_behind] = self.links.split(link);
        let [amounts, amounts_behind] = split_each(self.amounts, at);
        let before = Self { start, depth, flux, remainder, links, amounts };
        let behind = Self {
            start: index,
            depth: depth_behind,
            flux: flux_behind,
            remainder: remainder_behind,
            links: links_behind,
            amounts: amounts_behind,
        };
        [before, behind]
    }
}

impl<'a> LinkPart<'a> {
    /// Splits the part before a link.
    fn split(self, link: usize) -> [Self; 2] {
        let Self { first, flux, remainder, transfer, fallen } = self;
        let [before, behind] = split_each([flux, remainder, transfer], link - first);
        let [fallen, fallen_behind] = split_each(fallen, link - first);
        let part = |first, [flux, remainder, transfer]: [&'a mut [f32]; 3], fallen| Self {
            first,
            flux,
            remainder,
            transfer,
            fallen,
        };
        [part(first, before, fallen), part(link, behind, fallen_behind)]
    }
}

impl<'a> BandView<'a> {
    /// A band's rows, and copies of those before and after.
    pub fn new(rows: Range<usize>, before: Part<'a>, own: Part<'a>, behind: Part<'a>) -> Self {
        Self { first: rows.start.saturating_sub(BEYOND), rows, parts: [before, own, behind] }
    }

    /// The part that a row is in.
    #[inline(always)]
    pub fn part_mut(&mut self, row: usize) -> &mut Part<'a> {
        let part = self.position(row);
        &mut self.parts[part]
    }

    /// The part that a row is in, read-only.
    #[inline(always)]
    pub fn part(&self, row: usize) -> &Part<'a> {
        &self.parts[self.position(row)]
    }

    /// The parts of a row and of the next one, if these differ.
    #[inline(always)]
    pub fn part_and_next(&mut self, row: usize) -> (&mut Part<'a>, Option<&mut Part<'a>>) {
        let (own, next) = (self.position(row), self.position(row + 1));
        if own == next {
            (&mut self.parts[own], None)
        } else {
            let (low, high) = self.parts.split_at_mut(next);
            (&mut low[own], Some(&mut high[0]))
        }
    }

    #[inline(always)]
    fn position(&self, row: usize) -> usize {
        if row < self.rows.start {
            0
        } else if row < self.rows.end {
            1
        } else {
            2
        }
    }
}

/// Column indices of some rows.
pub fn indices(columns: &Columns, rows: &Range<usize>) -> Range<usize> {
    let count = columns.grid.size[1];
    let start = |row: usize| if row < count { columns.row(row).start * STRIP } else { columns.len() };
    start(rows.start)..start(rows.end)
}

/// Links that some rows own.
pub fn link_range(links: &Links, rows: &Range<usize>) -> Range<usize> {
    links.rows[rows.start] as usize..links.rows[rows.end] as usize
}
