//! What lateral friction keeps from step to step.

use crate::numeric::lists::reset;
use crate::shallow::columns::STRIP;

/// Lateral friction of pipes.
#[derive(Debug, Clone, Default)]
pub struct LateralFriction {
    /// Whether it is enabled.
    pub(super) is_on: bool,
    /// Count of column indices that the lists hold.
    pub(super) len: usize,
    /// Steps since the frame began.
    pub(super) age: u32,
    /// Whether each row may have pipes with friction; found again every few steps.
    pub(super) rows: Vec<bool>,
    /// The active strips of these rows.
    pub(super) strips: Vec<u32>,
    /// Whether the surroundings of each strip's columns were found.
    pub(super) has_surroundings: Vec<bool>,
    /// Whether each strip has ceilings, or positions without a column.
    pub(super) roofed: Vec<bool>,
    /// Positions of each strip from which links lead to the east, south, west and north.
    pub(super) linked: Vec<[u16; 4]>,
    pub(super) has_links: bool,
    /// For pipes to the east, then for pipes to the south: total contact and walls of each column (`surroundings.rs`), contact before it,
    /// and contact behind it.
    pub(super) surroundings: [[Numbers; 3]; 2],
    pub(super) lines: Lines,
}

/// Lines of pipes to the east, which lie along z, and of pipes to the south, along x.
#[derive(Debug, Clone, Default)]
pub struct Lines {
    /// r, a, b of all pipes in both directions, and those of the next reduction.
    pub(super) now: [[Numbers; 3]; 2],
    pub(super) next: [[Numbers; 3]; 2],
    /// Fluxes (units in this step).
    pub(super) solved: [Numbers; 2],
    /// The strips at the present distance (rows) before and behind, or [`NONE`]; and those of the next reduction.
    pub(super) far: [[Vec<u32>; 2]; 2],
}

/// Numbers by column index, with padding before the first and after the last. Each list has a different offset within a page
/// (`columns/per_column.rs`).
#[derive(Debug, Clone, Default)]
pub(super) struct Numbers {
    pub(super) before: usize,
    pub(super) list: Vec<f32>,
}

impl Numbers {
    pub fn fit(&mut self, position: usize, len: usize) {
        self.before = STRIP + 48 * position;
        reset(&mut self.list, self.before + len + 2 * STRIP, 0.0);
    }

    /// The numbers from the first column on.
    pub fn all(&self) -> &[f32] {
        &self.list[self.before..]
    }

    pub fn all_mut(&mut self) -> &mut [f32] {
        &mut self.list[self.before..]
    }

    /// 16 numbers, the first of them this many positions before a strip.
    #[inline(always)]
    pub fn before(&self, strip: usize, positions: usize) -> &[f32; STRIP] {
        let at = self.before + strip * STRIP - positions;
        self.list[at..].first_chunk().expect("a strip")
    }
}
