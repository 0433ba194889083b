//! Buffers that persist from one move of the near cells to the next.

use super::rests::Load;
use crate::shallow::columns::grid::Cells;
use crate::shallow::remap::Parcel;

/// Fluxes through sides of fine cells (fine units a step): for each cell of some boxes the sides to the east and south, layer by layer.
#[derive(Debug, Clone, Default)]
pub(super) struct Momentum {
    pub(super) boxes: Vec<Cells>,
    pub(super) layers: usize,
    pub(super) fluxes: Vec<f32>,
}

/// Scratch buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Shift {
    /// Liquid that goes into coarse columns, and liquid that goes into fine ones.
    pub(super) leaving: Vec<Moving>,
    pub(super) entering: Vec<Moving>,
    /// Held liquid in fine cells and in coarse ones, which waits for room.
    pub(super) held: [Vec<Parcel>; 2],
}

/// Liquid of a coarse column whose cells change.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    /// Coarse cell.
    pub(super) cell: [usize; 2],
    pub(super) layer: usize,
    /// In fine units.
    pub(super) load: Load,
    /// Surface (units), and eight times its rise from the middle of the coarse cell to that of a fine one, along x and along z.
    pub(super) eta: i64,
    pub(super) rises: [i64; 2],
}
