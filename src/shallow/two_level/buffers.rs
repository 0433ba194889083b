//! Buffers that persist from one move of the near cells to the next.

use super::remainders::Contents;
use crate::shallow::columns::grid::Cells;
use crate::shallow::remap::Parcel;

/// Fluxes through sides of fine cells (fine units a step): for each cell of some boxes, layer by layer, the sides to the east and south.
#[derive(Debug, Clone, Default)]
pub(super) struct Momentum {
    pub(super) boxes: Vec<Cells>,
    pub(super) layers: usize,
    pub(super) fluxes: Vec<f32>,
}

/// Scratch buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Shift {
    /// Liquid that goes from fine columns into coarse ones.
    pub(super) leaving: Vec<Moving>,
    /// Liquid that goes from coarse columns into fine ones.
    pub(super) entering: Vec<Moving>,
    /// Liquid that waits for room, in fine cells and in coarse ones.
    pub(super) held: [Vec<Parcel>; 2],
}

/// Liquid of one layer of a coarse cell that changes its size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    /// Coarse cell.
    pub(super) cell: [usize; 2],
    pub(super) layer: usize,
    /// In fine units.
    pub(super) contents: Contents,
    /// Surface (units) of a coarse column.
    pub(super) eta: i64,
    /// Eight times the rise of that surface (units) from the middle of the coarse cell to that of a fine one, along x and along z.
    pub(super) rises: [i64; 2],
}
