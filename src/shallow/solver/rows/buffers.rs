//! Buffers of a band: the values of its rows between their fluxes and their new depths.

use std::ops::Range;

use super::positions::PAD;
use crate::shallow::columns::{Columns, STRIP};

/// Rows that have buffers at a time: a power of two, at least the five in use.
pub const RING: usize = 8;
/// Sweeps that find K_max.
pub const SWEEPS: usize = 2;

/// Values of a row between its fluxes and its new depths; indexed as the row's columns, offset by [`PAD`].
#[derive(Debug, Clone)]
pub struct Buffer {
    /// Transfers to the east and to the south (units).
    pub east: Vec<f32>,
    pub south: Vec<f32>,
    /// K_min of each column, if any is not 1.
    pub k_min: Vec<f32>,
    pub has_k_min: bool,
    /// Whether a column may fill up in this step.
    pub may_fill: bool,
    /// K_max of each column, after each sweep, if any is not 1.
    pub k_max: [Vec<f32>; SWEEPS],
    pub has_k_max: bool,
}

impl Buffer {
    /// Sets all factors to 1.
    pub fn clear(&mut self) {
        (self.has_k_min, self.may_fill, self.has_k_max) = (false, false, false);
    }
}

/// Buffers of the rows that a band is working on.
#[derive(Debug, Clone)]
pub struct RowBuffers {
    pub ring: [Buffer; RING],
    /// Stands in for absent neighbours, and for factors that are all 1.
    pub zeros: Vec<f32>,
    pub ones: Vec<f32>,
    /// Sums over links, by column; 0 between steps.
    pub linked: Vec<i64>,
    /// The scalars of the rows.
    pub scalars: ScalarBuffers,
}

impl RowBuffers {
    /// Buffers for rows of these columns, for liquid with `scalars` scalars.
    pub fn new(columns: &Columns, scalars: usize) -> Self {
        let room = room(columns, 0..columns.grid.size[1]);
        let buffer = Buffer {
            east: vec![0.0; room],
            south: vec![0.0; room],
            k_min: vec![1.0; room],
            has_k_min: false,
            may_fill: false,
            k_max: std::array::from_fn(|_| vec![1.0; room]),
            has_k_max: false,
        };
        Self {
            ring: std::array::from_fn(|_| buffer.clone()),
            zeros: vec![0.0; room],
            ones: vec![1.0; room],
            linked: vec![0; room],
            scalars: ScalarBuffers::new(scalars, room),
        }
    }

    /// Makes buffers as wide as the widest of some rows.
    pub(in crate::shallow::solver) fn widen(&mut self, columns: &Columns, rows: Range<usize>) {
        let room = room(columns, rows);
        if room <= self.zeros.len() {
            return;
        }
        for Buffer { east, south, k_min, k_max, .. } in &mut self.ring {
            [east, south].into_iter().for_each(|transfers| transfers.resize(room, 0.0));
            std::iter::once(k_min).chain(k_max).for_each(|factors| factors.resize(room, 1.0));
        }
        self.zeros.resize(room, 0.0);
        self.ones.resize(room, 1.0);
        self.linked.resize(room, 0);
        self.scalars.widen(room);
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let numbers = |buffer: &Buffer| {
            let all = [&buffer.east, &buffer.south, &buffer.k_min, &buffer.k_max[0], &buffer.k_max[1]];
            all.iter().map(|numbers| size_of_val(&numbers[..])).sum::<usize>()
        };
        let none = size_of_val(&self.zeros[..]) + size_of_val(&self.ones[..]) + size_of_val(&self.linked[..]);
        self.ring.iter().map(numbers).sum::<usize>() + none + self.scalars.bytes()
    }
}

/// Length of a buffer for the widest of some rows.
fn room(columns: &Columns, rows: Range<usize>) -> usize {
    rows.map(|row| columns.row(row).len()).max().unwrap_or(0) * STRIP + 2 * PAD
}

/// Values of a scalar in the rows that a band is working on; indexed as in `Buffer`.
#[derive(Debug, Clone)]
pub(in crate::shallow::solver) struct ScalarRows {
    /// Concentrations (levels).
    pub(in crate::shallow::solver) level: [Vec<f64>; RING],
    /// Amounts that move to the south, of a row and the one before.
    pub(in crate::shallow::solver) south: [Vec<f64>; 2],
    /// Amounts that move to the east.
    pub(in crate::shallow::solver) east: Vec<f64>,
}

/// All scalars.
#[derive(Debug, Clone, Default)]
pub struct ScalarBuffers {
    pub(in crate::shallow::solver) list: Vec<ScalarRows>,
    /// Stands in for absent neighbours.
    pub(in crate::shallow::solver) zeros: Vec<f64>,
}
