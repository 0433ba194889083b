//! The rows that change, in their state before the change.

use std::ops::Range;

use crate::numeric::lists::refill;
use crate::shallow::columns::{Columns, STRIP, Strip};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::solver::Flow;

/// The columns of some rows and their liquid. Strips and indices are counted from the first of these rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Band {
    /// The rows.
    pub rows: Range<usize>,
    /// Index of their first strip among all rows.
    pub first: usize,
    pub strips: Vec<Strip>,
    /// First strip of each row, and the end of the last.
    starts: Vec<u32>,
    pub present: Vec<u16>,
    pub base: Vec<i32>,
    pub ceiling: Vec<i32>,
    pub under: Vec<i32>,
    pub depth: Vec<i32>,
    /// Flux to the east and to the south, and the remainders of transfers.
    pub flux: [Vec<f32>; 2],
    pub remainder: [Vec<f32>; 2],
    /// Heads above the surface.
    pub excess_heads: Vec<f32>,
    /// Amounts of scalars; empty without them.
    pub amounts: [Vec<f64>; MAX_SCALARS],
}

impl Band {
    /// Copies the present state of some rows.
    pub fn save(&mut self, columns: &Columns, flow: &Flow, rows: Range<usize>) {
        let strips = columns.row(rows.start).start..columns.row(rows.end - 1).end;
        self.first = strips.start;
        refill(&mut self.starts, rows.clone().map(|row| (columns.row(row).start - strips.start) as u32));
        self.starts.push(strips.len() as u32);
        columns.strips()[strips.clone()].clone_into(&mut self.strips);
        refill(&mut self.present, strips.clone().map(|strip| columns.present(strip)));
        let indices = strips.start * STRIP..strips.end * STRIP;
        columns.bases()[indices.clone()].clone_into(&mut self.base);
        columns.ceilings()[indices.clone()].clone_into(&mut self.ceiling);
        columns.unders()[indices.clone()].clone_into(&mut self.under);
        flow.depths()[indices.clone()].clone_into(&mut self.depth);
        for axis in [0, 1] {
            flow.flux[axis][indices.clone()].clone_into(&mut self.flux[axis]);
            flow.remainder[axis][indices.clone()].clone_into(&mut self.remainder[axis]);
        }
        flow.network.excess_heads()[indices.clone()].clone_into(&mut self.excess_heads);
        for (own, amounts) in self.amounts.iter_mut().zip(&flow.amounts.amounts) {
            amounts.get(indices.clone()).unwrap_or_default().clone_into(own);
        }
        self.rows = rows;
    }

    /// The strips of a row.
    pub fn row(&self, row: usize) -> Range<usize> {
        let at = row - self.rows.start;
        self.starts[at] as usize..self.starts[at + 1] as usize
    }

    /// The range of its strips among those of all rows, before the change.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.strips.len()
    }
}
