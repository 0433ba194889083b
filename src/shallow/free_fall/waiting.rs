//! Liquid that went over a link and is not a packet yet.

use crate::shallow::columns::{Columns, NONE};
use crate::shallow::pipes::Links;
use crate::shallow::pipes::side::Side;
use crate::shallow::scalars::shares::MAX_SCALARS;

/// Bytes of an overflow edge in a saved state.
pub(in crate::shallow) const WAITING_BYTES: usize = 40;

/// Intervals after which liquid of less than a drop is released anyway.
const PATIENCE: u32 = 60;

/// An overflow edge drips if a drop takes longer than this many intervals; otherwise it pours, one packet in each interval.
const DRIPS: i64 = 8;

/// Liquid that went over a link and is not a packet yet.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::shallow) struct Waiting {
    /// Volume (units), 0 and up, and amount of each scalar; saved states store the amounts separately.
    pub units: i64,
    pub amounts: [i64; MAX_SCALARS],
    /// Outward speed (cells/s), times units.
    pub impulse: f64,
    /// Whether the last fall was from the link's second column.
    pub is_back: bool,
    /// Intervals that it has waited.
    pub waits: u32,
    /// Smoothed inflow of an interval (units), and the volume at the end of the last interval.
    pub steady: i64,
    pub before: i64,
    /// How far its packets are ahead within the interval (in 2^-31 of it): a hash of the inflow when the flow last grew.
    pub phase: u32,
    /// Impulse received from other overflow edges; 0 between intervals.
    pub gathered: i64,
}

impl Waiting {
    /// Its serialised form, for a saved state.
    pub fn to_bytes(self) -> [u8; WAITING_BYTES] {
        let last = u64::from(self.waits) | u64::from(self.is_back) << 32 | u64::from(self.phase) << 33;
        let mut bytes = [0; WAITING_BYTES];
        let numbers =
            [self.units as u64, self.impulse.to_bits(), last, self.steady as u64, self.before as u64];
        bytes.as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(to, number)| *to = number.to_le_bytes());
        bytes
    }

    /// Reads what [`Waiting::to_bytes`] wrote; amounts are 0.
    pub fn from_bytes(bytes: &[u8; WAITING_BYTES]) -> Self {
        let [units, impulse, last, steady, before] =
            std::array::from_fn(|at| u64::from_le_bytes(bytes.as_chunks().0[at]));
        Self {
            units: units as i64,
            amounts: [0; MAX_SCALARS],
            impulse: f64::from_bits(impulse),
            is_back: last >> 32 & 1 != 0,
            waits: last as u32,
            steady: steady as i64,
            before: before as i64,
            phase: (last >> 33) as u32,
            gathered: 0,
        }
    }

    /// Whether it is valid for a link.
    pub fn is_valid_in(&self, columns: &Columns, links: &Links, link: usize) -> bool {
        let is_void = links.to[link] == NONE;
        let is_lip = !is_void
            || !self.is_back
                && outward(links, link, false)
                    .cell(columns.cell(links.from[link] as usize), columns.grid.size)
                    .is_some();
        let steady = 0..i64::MAX / 8;
        self.units >= 0
            && (0.0..1e60).contains(&self.impulse)
            && steady.contains(&self.steady)
            && steady.contains(&self.before)
            && (!self.is_awake() || is_lip)
    }

    /// Whether it becomes a packet: it fills a drop of `min_units`, pours, or has waited long enough; or `all` is set.
    pub fn is_due(&self, min_units: f64, all: bool) -> bool {
        let expected = self.units.max(DRIPS * self.steady);
        all || expected as f64 >= min_units || self.waits >= PATIENCE
    }

    /// Whether liquid waits there, or arrived recently.
    pub(super) fn is_awake(&self) -> bool {
        self.units > 0 || self.steady > 0
    }

    /// Resets it after its liquid has left.
    pub(super) fn clear(&mut self) {
        let Self { is_back, steady, phase, .. } = *self;
        *self = Self { is_back, steady, phase, ..Self::default() };
    }
}

/// Adds amounts to others.
pub(super) fn add(to: &mut [i64; MAX_SCALARS], amounts: &[i64; MAX_SCALARS]) {
    to.iter_mut().zip(amounts).for_each(|(to, amount)| *to = to.saturating_add(*amount));
}

/// The side that liquid falls over, seen from the donor.
pub(super) fn outward(links: &Links, link: usize, is_back: bool) -> Side {
    if is_back { links.sides[link].opposite() } else { links.sides[link] }
}
