//! The scalars of a saved state, one after another:
//!
//! | part | bytes |
//! |---|---|
//! | its law, 0, its range, its half-life, the pending change | 4, 4, 8, 8, 8 |
//! | sums of amounts, by account | 16 each |
//! | amounts of liquid that waits for room, of packets in the air, and of liquid that waits at links to fall | 8 each |
//! | of each run of active strips: amounts | 128 a strip |

use std::ops::Range;

use super::encoding::{Writer, get, part, parts, refused};
use super::header::{Counts, SCALAR, STRIP_BYTES};
use crate::error::Result;
use crate::numeric::bytes::Reader;
use crate::shallow::columns::STRIP;
use crate::shallow::columns::runs::runs;
use crate::shallow::free_fall::{Packet, Waiting};
use crate::shallow::remap::Parcel;
use crate::shallow::scalars::amounts::{ACCOUNTS, Amounts};
use crate::shallow::scalars::shares::{LEVELS, MAX_SCALARS, nearest};
use crate::shallow::scalars::{Law, Scalar};
use crate::shallow::system::Shallow;

/// Valid range of a sum of amounts: the total of all fits 128 bits.
const SUMS: Range<i128> = -(1 << 120)..1 << 120;
/// Valid range of amounts in waiting liquid, whose units are within [`super::SUMS`].
const WAITING: Range<i64> = -(1 << 62)..1 << 62;

/// Writes the scalars of a liquid.
pub(super) fn put(shallow: &Shallow, to: &mut Writer<'_>) {
    let amounts = &shallow.flow.amounts;
    for (at, scalar) in amounts.scalars.iter().enumerate() {
        let (law, half) = code_of_law(scalar.law);
        to.numbers(&[law, 0], u32::to_le_bytes);
        to.numbers(&[scalar.range, half, amounts.due[at]], f64::to_le_bytes);
        to.numbers(&amounts.sums[at], i128::to_le_bytes);
        let parcels = shallow.remap.held.parcels();
        parcels.iter().for_each(|parcel| to.bytes(&parcel.amounts[at].to_le_bytes()));
        let (packets, waiting) = (&shallow.falls.packets, &shallow.falls.waiting);
        packets.iter().for_each(|packet| to.bytes(&packet.amounts[at].to_le_bytes()));
        waiting.iter().for_each(|waiting| to.bytes(&waiting.amounts[at].to_le_bytes()));
        for run in runs(shallow.flow.active()) {
            to.numbers(&amounts.amounts[at][run.start * STRIP..run.end * STRIP], f64::to_le_bytes);
        }
    }
}

/// The part of one scalar.
#[derive(Clone, Copy)]
struct Part<'a> {
    head: &'a [u8; SCALAR],
    parcels: &'a [[u8; 8]],
    packets: &'a [[u8; 8]],
    waiting: &'a [[u8; 8]],
    /// Amounts of columns: two elements for each strip.
    strips: &'a [[u8; STRIP_BYTES]],
}

/// The parts of all scalars.
pub(super) struct Scalars<'a> {
    count: usize,
    parts: [Option<Part<'a>>; MAX_SCALARS],
}

impl<'a> Scalars<'a> {
    /// Reads the parts; scalars beyond those that a liquid may have are only counted.
    pub(super) fn read(from: &mut Reader<'a>, counts: &Counts) -> Result<Self> {
        let mut all = [None; MAX_SCALARS];
        for own in all.iter_mut().take(counts.scalars) {
            let head = &parts(from, 1)?[0];
            let parcels = parts(from, counts.parcels)?;
            let (packets, waiting) = (parts(from, counts.packets)?, parts(from, counts.waiting)?);
            *own = Some(Part { head, parcels, packets, waiting, strips: parts(from, 2 * counts.strips)? });
        }
        Ok(Self { count: counts.scalars, parts: all })
    }

    fn iter(&self) -> impl Iterator<Item = &Part<'a>> {
        self.parts.iter().flatten()
    }

    /// Checks that the liquid carries the same scalars.
    pub(super) fn check_laws(&self, shallow: &Shallow) -> Result<()> {
        let own = shallow.scalars();
        if self.count != own.len() {
            let (saved, own) = (self.count, own.len());
            return Err(refused(&format!(
                "has {saved} scalars, and the liquid {own}: set the same ones first"
            )));
        }
        for (at, (saved, Scalar { law, range, .. })) in self.iter().zip(own).enumerate() {
            let (law, half) = code_of_law(*law);
            let saved_law = (u32::from_le_bytes(part(saved.head, 0)), saved.number(16).to_bits());
            if saved_law != (law, half.to_bits()) {
                return Err(refused(&format!("has another law for scalar {at} than the liquid")));
            }
            if saved.number(8).to_bits() != range.to_bits() {
                return Err(refused(&format!("has another range for scalar {at} than the liquid")));
            }
        }
        Ok(())
    }

    /// Whether all numbers are valid for a liquid.
    pub(super) fn has_good_numbers<'b>(
        &self,
        waiting: impl Iterator<Item = Waiting> + Clone,
        depths: impl Iterator<Item = &'b [u8; 4]> + Clone,
    ) -> bool {
        self.iter().all(|part| {
            let due = part.number(24);
            (0.0..1e30).contains(&due)
                && part.sums().iter().all(|sum| SUMS.contains(sum))
                && [part.parcels, part.packets, part.waiting]
                    .into_iter()
                    .flatten()
                    .all(|amount| WAITING.contains(&i64::from_le_bytes(*amount)))
                && part
                    .waiting
                    .iter()
                    .zip(waiting.clone())
                    .all(|(amount, at)| at.units > 0 || *amount == [0; 8])
                && part.has_good_amounts(depths.clone())
        })
    }

    /// A parcel with its amounts.
    pub(super) fn with_amounts(&self, at: usize, parcel: Parcel) -> Parcel {
        Parcel { amounts: self.amounts(|part| part.parcels, at), ..parcel }
    }

    /// A packet with its amounts.
    pub(super) fn in_packet(&self, at: usize, packet: Packet) -> Packet {
        Packet { amounts: self.amounts(|part| part.packets, at), ..packet }
    }

    /// Waiting liquid at a link, with its amounts.
    pub(super) fn at_link(&self, at: usize, waiting: Waiting) -> Waiting {
        Waiting { amounts: self.amounts(|part| part.waiting, at), ..waiting }
    }

    fn amounts(&self, of: impl Fn(&Part<'a>) -> &'a [[u8; 8]], at: usize) -> [i64; MAX_SCALARS] {
        let mut amounts = [0; MAX_SCALARS];
        for (amount, part) in amounts.iter_mut().zip(self.iter()) {
            *amount = i64::from_le_bytes(of(part)[at]);
        }
        amounts
    }

    /// Restores the amounts of columns, the sums and the pending changes.
    pub(super) fn apply(&self, runs: impl Iterator<Item = Range<usize>> + Clone, amounts: &mut Amounts) {
        for (at, part) in self.iter().enumerate() {
            amounts.due[at] = part.number(24);
            amounts.sums[at] = part.sums();
            let mut rest = part.strips;
            for run in runs.clone() {
                let (own, others) = rest.split_at(2 * run.len());
                rest = others;
                let to = &mut amounts.amounts[at][run.start * STRIP..run.end * STRIP];
                get(own.as_flattened(), to, f64::from_le_bytes);
            }
        }
    }
}

impl Part<'_> {
    fn number(&self, at: usize) -> f64 {
        f64::from_le_bytes(part(self.head, at))
    }

    fn sums(&self) -> [i128; ACCOUNTS] {
        std::array::from_fn(|account| i128::from_le_bytes(part(self.head, 32 + 16 * account)))
    }

    /// Whether amounts are integers within the range that the saved depths allow, plus a tolerance for rounding, and 0 without liquid.
    fn has_good_amounts<'b>(&self, depths: impl Iterator<Item = &'b [u8; 4]>) -> bool {
        let amounts = self.strips.as_flattened().as_chunks::<8>().0;
        depths.zip(amounts).fold(true, |good, (depth, amount)| {
            let (depth, amount) = (i32::from_le_bytes(*depth), f64::from_le_bytes(*amount));
            let max = if depth > 0 { LEVELS * (f64::from(depth) + 1.0) } else { 0.0 };
            // Also false for NaN.
            good & (amount.abs() <= max) & (nearest(amount) == amount)
        })
    }
}

/// The code of a law, and its half-life (s).
fn code_of_law(law: Law) -> (u32, f64) {
    match law {
        Law::Dye => (0, 0.0),
        Law::Decays(half) => (1, half),
        Law::Ages => (2, 0.0),
    }
}
