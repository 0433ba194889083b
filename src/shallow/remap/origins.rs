//! Maps columns to the columns that they were before a change.

use super::band::Band;
use crate::numeric::lists::reset;
use crate::shallow::columns::{NONE, STRIP};

/// The columns of a band, and those around it whose indices shift.
#[derive(Debug, Clone)]
pub(super) struct Origins {
    /// First strip of the band, and its counts of strips before and after the change.
    first: usize,
    counts: [usize; 2],
    /// For each strip, the former strip of the same layer (its index in the band), or [`NONE`]; and the bits of the columns that were
    /// columns there.
    strips: Vec<(u32, u16)>,
    /// Columns that were in other layers: their indices, and their former indices in the band.
    pub relayered: Vec<[u32; 2]>,
}

impl Default for Origins {
    fn default() -> Self {
        Self { first: 0, counts: [0; 2], strips: Vec::new(), relayered: Vec::with_capacity(1024) }
    }
}

impl Origins {
    /// Begins a band that will have `count` strips.
    pub fn begin(&mut self, band: &Band, count: usize) {
        self.first = band.first;
        self.counts = [band.strips.len(), count];
        reset(&mut self.strips, count, (NONE, 0));
        self.relayered.clear();
    }

    /// Records that some columns of a strip were in a strip of the band.
    pub fn keep(&mut self, strip: usize, old: u32, positions: u16) {
        self.strips[strip - self.first] = (old, positions);
    }

    /// Records which column of the band a column was, or [`NONE`].
    pub fn set(&mut self, index: u32, old: u32) {
        let (strip, position) = (index as usize / STRIP, index as usize % STRIP);
        let (from, positions) = &mut self.strips[strip - self.first];
        if old == NONE {
            return;
        }
        if old / STRIP as u32 == *from {
            *positions |= 1 << position;
        } else {
            self.relayered.push([index, old]);
        }
    }

    /// Finishes a band.
    pub fn finish(&mut self) {
        self.relayered.sort_unstable();
    }

    /// How much the indices of strips after the band grow, modulo 2^32.
    pub fn shift(&self) -> u32 {
        self.counts[1].wrapping_sub(self.counts[0]) as u32
    }

    /// The former strip of a strip (its index among all strips), and the bits of the columns that were columns there.
    #[inline]
    pub fn strip(&self, strip: usize) -> (usize, u16) {
        if strip < self.first {
            (strip, u16::MAX)
        } else if strip >= self.first + self.counts[1] {
            (strip - self.counts[1] + self.counts[0], u16::MAX)
        } else {
            let (old, positions) = self.strips[strip - self.first];
            (self.first.wrapping_add(old as usize), positions)
        }
    }

    /// The former index of a column, among those of all columns.
    pub fn column(&self, index: u32) -> Option<u32> {
        let position = index as usize % STRIP;
        let (strip, positions) = self.strip(index as usize / STRIP);
        if positions >> position & 1 == 1 {
            return Some((strip * STRIP + position) as u32);
        }
        let at = self.relayered.binary_search_by_key(&index, |[index, _]| *index).ok()?;
        Some(self.relayered[at][1] + (self.first * STRIP) as u32)
    }
}
