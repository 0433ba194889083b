//! The pairs of grains that touch, eight at a time, and the impulses that they keep.

use super::blocks::EDGE;
use super::rows::V;
use crate::numeric::lanes::{LANES, Lanes};

/// Maximum gap (diameters) between the anchors of a pair: pairs are found again once a grain is half as far from its anchor. Less than the
/// edge of a cell minus a diameter.
pub const SKIN: f32 = 0.25;

/// The same in blocks with a fast grain, whose pairs last only a sub-step or two: slightly more than the gap at which grains
/// wake each other.
pub const THIN_SKIN: f32 = 0.12;

/// Bits of the slot in a code; the bits above are the step to the block of the other grain, two bits per axis.
pub(super) const SLOT_BITS: u32 = 26;

/// Eight pairs that share no grain. Unused lanes repeat the first one.
#[derive(Clone, Copy)]
pub struct Batch {
    /// Slots of the owners: for each pair the grain in the later block (by y, x, z) or, within one block, the later member.
    pub owners: [u32; LANES],
    /// Slots of the other grains; the bits above the slot hold the step to the grain's block.
    pub codes: [u32; LANES],
    /// Impulses on the owners (m/s, for a grain of unit mass).
    pub impulse: [Lanes; 3],
}

impl Batch {
    /// Slots of the other grains.
    #[inline(always)]
    pub fn others(&self) -> [u32; LANES] {
        let mut others = self.codes;
        for code in &mut others {
            *code = slot_of(*code);
        }
        others
    }

    /// From the owner's block to the other grain's (diameters).
    #[inline(always)]
    pub fn shift(&self) -> [Lanes; 3] {
        let mut shift = [Lanes::default(); 3];
        for (axis, shift) in shift.iter_mut().enumerate() {
            for (lane, shift) in shift.0.iter_mut().enumerate() {
                *shift = ((self.codes[lane] >> (SLOT_BITS + 2 * axis as u32) & 3) as i32 - 1) as f32 * EDGE;
            }
        }
        shift
    }

    /// Visits the pairs that carry an impulse: their slots, the index of the other grain's block in [`Block::near`], and the
    /// impulse. Unused lanes repeat the first pair.
    #[inline(always)]
    pub fn for_each_impulse(&self, mut visit: impl FnMut([u32; 2], usize, V)) {
        for lane in 0..LANES {
            let impulse = [self.impulse[0].0[lane], self.impulse[1].0[lane], self.impulse[2].0[lane]];
            if impulse != [0.0; 3] {
                let bits = self.codes[lane] >> SLOT_BITS;
                let code = 9 * (bits & 3) + 3 * (bits >> 2 & 3) + (bits >> 4);
                visit([self.owners[lane], slot_of(self.codes[lane])], code as usize, impulse);
            }
        }
    }

    /// The pairs that carry an impulse, each once.
    pub fn held(&self) -> impl Iterator<Item = PairImpulse> + '_ {
        let held = |lane: usize| PairImpulse {
            grains: [self.owners[lane], slot_of(self.codes[lane])],
            impulse: [0, 1, 2].map(|axis: usize| self.impulse[axis].0[lane]),
        };
        self.lanes().map(held).filter(|held| held.impulse != [0.0; 3])
    }

    /// The lanes in use.
    pub fn lanes(&self) -> impl Iterator<Item = usize> + '_ {
        let repeats = |lane: usize| self.owners[lane] == self.owners[0] && self.codes[lane] == self.codes[0];
        (0..LANES).filter(move |&lane| lane == 0 || !repeats(lane))
    }
}

/// The impulse of a pair between two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairImpulse {
    /// Slots of the grains.
    pub grains: [u32; 2],
    /// On the first grain (m/s).
    pub impulse: V,
}

impl PairImpulse {
    /// With the grains swapped.
    pub fn swapped(self) -> Self {
        let [a, b] = self.grains;
        Self { grains: [b, a], impulse: self.impulse.map(|x| -x) }
    }

    /// With the lower slot first.
    pub fn in_order(self) -> Self {
        if self.grains[0] < self.grains[1] { self } else { self.swapped() }
    }
}

/// The slot in a code.
#[inline(always)]
pub(super) fn slot_of(code: u32) -> u32 {
    code & ((1 << SLOT_BITS) - 1)
}
