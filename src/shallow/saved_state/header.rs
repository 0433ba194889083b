//! The header of a state, and the sizes of its parts.

use std::ops::Range;

use super::encoding::{CHECKSUM, Format, Writer};
use crate::error::Result;
use crate::numeric::bytes::Reader;
use crate::shallow::columns::STRIP;
use crate::shallow::columns::runs::runs;
use crate::shallow::free_fall::{PACKET_BYTES, WAITING_BYTES};
use crate::shallow::scalars::amounts::ACCOUNTS;
use crate::shallow::system::Shallow;

pub(super) const FORMAT: Format =
    Format { magic: *b"frz shal", version: 2, length_at: 32, of: "a shallow liquid" };
/// Bytes of the header.
pub(super) const HEADER: usize = 168;
/// Bytes of a strip in an array of 32-bit numbers.
pub(super) const STRIP_BYTES: usize = 4 * STRIP;
/// Count of arrays by column index: depths, two of fluxes, two of remainders.
pub(super) const ARRAYS: usize = 5;

/// Counts of the elements in a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) runs: usize,
    /// Strips in all runs.
    pub(super) strips: usize,
    pub(super) rows: usize,
    pub(super) points: usize,
    pub(super) links: usize,
    /// Strips with heads of full columns.
    pub(super) heads: usize,
    /// Parcels of liquid that wait for room.
    pub(super) parcels: usize,
    /// Packets in the air.
    pub(super) packets: usize,
    /// Links at which liquid may wait to fall.
    pub(super) waiting: usize,
    /// Scalars of the liquid.
    pub(super) scalars: usize,
}

impl Counts {
    pub(super) fn of(shallow: &Shallow) -> Self {
        let flow = &shallow.flow;
        let add = |(count, strips): (usize, usize), run: Range<usize>| (count + 1, strips + run.len());
        let (count, strips) = runs(flow.active()).fold((0, 0), add);
        Self {
            runs: count,
            strips,
            rows: flow.bands.row_depths().len(),
            points: shallow.flow_points.progress().len(),
            links: flow.links.flux.len(),
            heads: heads(shallow).count(),
            parcels: shallow.remap.held.parcels().len(),
            packets: shallow.falls.packets.len(),
            waiting: shallow.falls.waiting.len(),
            scalars: shallow.scalars().len(),
        }
    }

    /// As [`Counts::of`], but as if all columns were wet and full.
    pub(super) fn max_of(shallow: &Shallow) -> Self {
        let strips = shallow.columns.strips().len();
        Self { runs: strips.div_ceil(2), strips, heads: strips, ..Self::of(shallow) }
    }

    /// Bytes of a state.
    pub(super) fn size(&self) -> usize {
        HEADER
            + 8 * self.runs
            + 4 * self.rows
            + 16 * self.parcels
            + PACKET_BYTES * self.packets
            + WAITING_BYTES * self.waiting
            + 24 * self.points
            + 8 * self.links
            + (4 + STRIP_BYTES) * self.heads
            + ARRAYS * STRIP_BYTES * self.strips
            + self.scalars
                * (SCALAR + 8 * (self.parcels + self.packets + self.waiting) + 2 * STRIP_BYTES * self.strips)
            + CHECKSUM
    }
}

/// The header, after magic and version; in the file the total length follows the hash of the terrain.
pub(super) struct Header {
    pub(super) border: u32,
    /// Hash.
    pub(super) terrain: [u8; 16],
    pub(super) counts: Counts,
    /// Simulated time, length of the last step (s).
    pub(super) times: [f64; 2],
    /// Surface of the liquid at rest beyond an absorbing border (units).
    pub(super) still: i32,
    /// Units poured, sourced, drained, absorbed, lost and gained.
    pub(super) sums: [i64; 6],
    /// Seconds since packets were last created.
    pub(super) since: f64,
    /// How many times packets were created.
    pub(super) tick: u64,
}

/// Bytes of a scalar's part before its amounts.
pub(super) const SCALAR: usize = 32 + 16 * ACCOUNTS;

impl Header {
    pub(super) fn put(&self, to: &mut Writer<'_>) {
        let Counts { runs, strips, rows, points, links, heads, parcels, packets, waiting, scalars } =
            self.counts;
        let counts = [runs, strips, rows, points, links, heads, parcels, packets, waiting, scalars]
            .map(|count| count as u32);
        to.bytes(&FORMAT.magic);
        to.numbers(&[FORMAT.version, self.border], u32::to_le_bytes);
        to.bytes(&self.terrain);
        to.bytes(&(self.counts.size() as u64).to_le_bytes());
        to.numbers(&counts, u32::to_le_bytes);
        to.numbers(&self.times, f64::to_le_bytes);
        to.numbers(&[self.still, 0], i32::to_le_bytes);
        to.numbers(&self.sums, i64::to_le_bytes);
        to.numbers(&[self.since], f64::to_le_bytes);
        to.numbers(&[self.tick], u64::to_le_bytes);
    }

    /// Reads a header whose magic, version and length are right.
    pub(super) fn read(bytes: &[u8; HEADER]) -> Result<Self> {
        let mut from = Reader::new(&bytes[12..]);
        let (border, terrain) = (from.u32()?, from.take()?);
        from.take::<8>()?;
        let mut count = || from.u32().map(|count| count as usize);
        let (runs, strips, rows) = (count()?, count()?, count()?);
        let (points, links, heads, parcels) = (count()?, count()?, count()?, count()?);
        let (packets, waiting, scalars) = (count()?, count()?, count()?);
        let times = [from.f64()?, from.f64()?];
        let still = from.u32()? as i32;
        from.take::<4>()?;
        let mut sums = [0; 6];
        for sum in &mut sums {
            *sum = i64::from_le_bytes(from.take()?);
        }
        let (since, tick) = (from.f64()?, u64::from_le_bytes(from.take()?));
        let counts = Counts { runs, strips, rows, points, links, heads, parcels, packets, waiting, scalars };
        Ok(Self { border, terrain, counts, times, still, sums, since, tick })
    }
}

/// Active strips that have the head of a full column.
pub(super) fn heads(shallow: &Shallow) -> impl Iterator<Item = (usize, &[f32; STRIP])> {
    let all = shallow.flow.network.excess_heads().as_chunks::<STRIP>().0;
    let strips = runs(shallow.flow.active()).flatten().map(move |strip| (strip, &all[strip]));
    strips.filter(|(_, heads)| heads.iter().fold(0, |any, head| any | head.to_bits()) != 0)
}
