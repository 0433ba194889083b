//! Saves the state of the liquid as bytes and restores it; a restored liquid continues with the same bytes.
//!
//! Numbers are little-endian and uncompressed, so that saving takes only a fraction of a millisecond: a game may do it every second. Only
//! the columns of active strips are stored, so that a puddle in a large domain is small.
//!
//! | part | bytes |
//! |---|---|
//! | header: [`Header`] | [`HEADER`] |
//! | runs of active strips: the first strip, and their count | 8 each |
//! | upper bound of the depth of each row | 4 each |
//! | liquid that waits for room: its cell, its height, units | 16 each |
//! | packets in the air | [`PACKET_BYTES`] each |
//! | liquid that waits at links to fall, if the liquid has falls | [`WAITING_BYTES`] each |
//! | flow points: kind, 0, units pending, units moved | 24 each |
//! | fluxes of links, then remainders of their transfers | 4 each |
//! | strips of full columns with heads, then their heads | 4 each, then 64 each |
//! | of each run: depths; fluxes to the east and to the south; remainders of both | 5 x 64 a strip |
//! | of each scalar: its part ([`scalars`]) | |
//! | hash of everything above | [`CHECKSUM`] |

mod detail;
mod encoding;
mod header;
mod scalars;

use std::ops::{Range, RangeInclusive};

use super::columns::grid::{BOTTOMLESS, TOP};
use super::columns::runs::runs;
use super::columns::{Columns, STRIP};
use super::free_fall::{PACKET_BYTES, Packet, WAITING_BYTES, Waiting};
use super::pipes::Border;
use super::remap::Parcel;
use super::sources::Kind;
use super::system::Shallow;
use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;
use crate::numeric::cpu::dispatch;
use encoding::{CHECKSUM, SUMS, Writer, get, open, part, parts, refused, require, write_checksum};
use header::{ARRAYS, Counts, FORMAT, HEADER, Header, STRIP_BYTES, heads};
use scalars::Scalars;

/// Maximum magnitude of a flux (units a step): K limits transfers to the donor's depth.
const MAX_FLUX: f32 = 2.0 * TOP as f32;
/// Valid range of the length of the last step (s): the next step scales fluxes by it, and they must stay finite.
const STEP_LENGTH: RangeInclusive<f64> = 1e-20..=1e6;
/// Valid range of the units that a flow point has pending.
const PENDING: RangeInclusive<f64> = -1e18..=1e18;

impl Shallow {
    /// The state between two frames: everything except the terrain, the parameters and the flow points, which the host has, and
    /// [`Shallow::last_steps`]. The same bytes on any number of threads.
    pub fn save(&self) -> Vec<u8> {
        let counts = Counts::of(self);
        let mut out = vec![0; counts.size()];
        self.write(&counts, &mut out);
        out
    }

    /// As [`Shallow::save`], replacing the contents of a vector; nothing is allocated if its capacity suffices.
    pub fn save_into(&self, out: &mut Vec<u8>) {
        let counts = Counts::of(self);
        out.resize(counts.size(), 0);
        self.write(&counts, out);
    }

    /// As [`Shallow::save`], into the beginning of a slice; returns the count of bytes.
    ///
    /// # Errors
    /// `Argument`: the slice is shorter than [`Shallow::save_size`]; nothing is written.
    pub fn save_to(&self, out: &mut [u8]) -> Result<usize> {
        let counts = Counts::of(self);
        let (size, room) = (counts.size(), out.len());
        let Some(out) = out.get_mut(..size) else {
            return Err(Error::argument(format!("a state of {size} bytes does not fit into {room}")));
        };
        self.write(&counts, out);
        Ok(size)
    }

    /// Count of bytes that [`Shallow::save`] would return now.
    pub fn save_size(&self) -> usize {
        Counts::of(self).size()
    }

    /// Replaces the liquid's state by a saved one: with the same parameters it continues as the saved liquid did, to the same bytes.
    ///
    /// If the saved liquid had flow points, set the same ones first ([`Shallow::set_flows`]): the units that each has pending, and those
    /// that it has moved, are restored by the index of the point. Positions and rates of flow points are not compared; the border and a
    /// hash of the terrain are. Set the same scalars first, too; the concentrations of sources and pours are not restored.
    /// [`Shallow::last_steps`] is empty afterwards. Nothing is allocated.
    ///
    /// # Errors
    /// `Bytes`, and the liquid is as it was: not a state of a shallow liquid; another version; truncated or damaged; another terrain or
    /// border, or other falls; another count of flow points, or other kinds; other scalars (names are not compared).
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let saved = Saved::read(bytes)?;
        saved.check(self)?;
        saved.apply(self);
        Ok(())
    }

    /// Upper bound of the bytes that [`Shallow::save`] could return within the next frame.
    pub(super) fn max_save_size(&self) -> usize {
        Counts::max_of(self).size()
    }

    /// Restores a state that was saved from this liquid, on the same columns.
    pub(super) fn put_back(&mut self, bytes: &[u8]) {
        let saved = Saved::read(bytes);
        debug_assert!(saved.is_ok());
        saved.into_iter().for_each(|saved| saved.apply(self));
    }

    fn write(&self, counts: &Counts, out: &mut [u8]) {
        let mut to = Writer(&mut out[..counts.size() - CHECKSUM]);
        self.header(counts).put(&mut to);
        let flow = &self.flow;
        for run in runs(flow.active()) {
            to.numbers(&[run.start as u32, run.len() as u32], u32::to_le_bytes);
        }
        to.numbers(flow.bands.row_depths(), i32::to_le_bytes);
        self.remap.held.parcels().iter().for_each(|parcel| to.bytes(&parcel.to_bytes()));
        self.falls.packets.iter().for_each(|packet| to.bytes(&packet.to_bytes()));
        self.falls.waiting.iter().for_each(|waiting| to.bytes(&waiting.to_bytes()));
        for (kind, pending, moved) in self.flow_points.progress() {
            to.numbers(&[code_of_kind(kind), 0], u32::to_le_bytes);
            to.bytes(&pending.to_le_bytes());
            to.bytes(&moved.to_le_bytes());
        }
        to.numbers(&flow.links.flux, f32::to_le_bytes);
        to.numbers(&flow.links.remainder, f32::to_le_bytes);
        heads(self).for_each(|(strip, _)| to.bytes(&(strip as u32).to_le_bytes()));
        heads(self).for_each(|(_, heads)| to.numbers(heads, f32::to_le_bytes));
        for run in runs(flow.active()) {
            let run = run.start * STRIP..run.end * STRIP;
            to.numbers(&flow.depth[run.clone()], i32::to_le_bytes);
            for numbers in flow.numbers() {
                to.numbers(&numbers[run.clone()], f32::to_le_bytes);
            }
        }
        scalars::put(self, &mut to);
        debug_assert!(to.0.is_empty());
        write_checksum(&mut out[..counts.size()]);
    }

    fn header(&self, counts: &Counts) -> Header {
        let (flow_points, links) = (&self.flow_points, &self.flow.links);
        Header {
            border: code_of_border(self.params.border),
            terrain: self.identity.hash(&self.columns),
            counts: *counts,
            times: [self.time, self.flow.last],
            still: self.still_level,
            sums: [
                self.poured,
                flow_points.sourced,
                flow_points.drained,
                flow_points.absorbed,
                links.lost,
                links.gained,
            ],
            since: self.falls.since,
            tick: self.falls.tick,
        }
    }
}

/// A complete state, in its parts.
struct Saved<'a> {
    header: Header,
    runs: &'a [[u8; 8]],
    row_depths: &'a [[u8; 4]],
    parcels: &'a [[u8; 16]],
    packets: &'a [[u8; PACKET_BYTES]],
    waiting: &'a [[u8; WAITING_BYTES]],
    points: &'a [[u8; 24]],
    /// Fluxes, then remainders.
    links: &'a [[u8; 4]],
    head_strips: &'a [[u8; 4]],
    heads: &'a [[u8; STRIP_BYTES]],
    /// Strips of all arrays, run by run.
    strips: &'a [[u8; STRIP_BYTES]],
    /// The parts of scalars.
    scalars: Scalars<'a>,
}

impl<'a> Saved<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self> {
        let (header, body) = open::<HEADER>(bytes, &FORMAT)?;
        let header = Header::read(header)?;
        let counts = header.counts;
        require(counts.size() == bytes.len(), "is damaged")?;
        let mut from = Reader::new(&body[HEADER..]);
        Ok(Self {
            runs: parts(&mut from, counts.runs)?,
            row_depths: parts(&mut from, counts.rows)?,
            parcels: parts(&mut from, counts.parcels)?,
            packets: parts(&mut from, counts.packets)?,
            waiting: parts(&mut from, counts.waiting)?,
            points: parts(&mut from, counts.points)?,
            links: parts(&mut from, 2 * counts.links)?,
            head_strips: parts(&mut from, counts.heads)?,
            heads: parts(&mut from, counts.heads)?,
            strips: parts(&mut from, ARRAYS * counts.strips)?,
            scalars: Scalars::read(&mut from, &counts)?,
            header,
        })
    }

    /// Checks that it belongs to this liquid, and that all numbers are valid.
    fn check(&self, shallow: &Shallow) -> Result<()> {
        let (header, counts) = (&self.header, &self.header.counts);
        require(header.terrain == shallow.identity.hash(&shallow.columns), "belongs to another terrain")?;
        if header.border != code_of_border(shallow.params.border) {
            return Err(refused("belongs to a liquid with another border"));
        }
        // On the same terrain, links differ only because of cliffs.
        let (links, max_packets) =
            (shallow.flow.links.flux.len(), shallow.params.falls.map_or(0, |falls| falls.max_packets));
        if (counts.links, counts.waiting) != (links, shallow.falls.waiting.len())
            || counts.packets > max_packets
        {
            return Err(refused("belongs to a liquid with other falls"));
        }
        let own = shallow.flow_points.progress();
        if own.len() != self.points.len() {
            let (saved, own) = (self.points.len(), own.len());
            return Err(refused(&format!(
                "has {saved} flow points, and the liquid {own}: set the same ones first"
            )));
        }
        for (at, (saved, (kind, ..))) in self.points.iter().zip(own).enumerate() {
            if u32::from_le_bytes(part(saved, 0)) != code_of_kind(kind) {
                return Err(refused(&format!("has flow point {at} of another kind than the liquid")));
            }
        }
        self.scalars.check_laws(shallow)?;
        let strips = shallow.columns.strips().len();
        let fits = counts.rows == shallow.flow.bands.row_depths().len()
            && is_in_order(self.runs().map(|run| run.start..run.end), strips)
            && self.runs().map(|run| run.len()).sum::<usize>() == counts.strips
            && is_in_order(self.head_strips().map(|strip| strip..strip + 1), strips);
        let is_good = fits && self.has_good_numbers(&shallow.columns) && self.has_good_falls(shallow);
        require(is_good, "is damaged")
    }

    fn has_good_numbers(&self, columns: &Columns) -> bool {
        let [_, last] = self.header.times;
        let (fluxes, left) = self.links.split_at(self.header.counts.links);
        let heads = self.heads.as_flattened().as_chunks().0;
        let within = |depths: &[u8; 4]| (0..=TOP).contains(&i32::from_le_bytes(*depths));
        STEP_LENGTH.contains(&last)
            && (self.header.still == BOTTOMLESS || self.header.still >= 0)
            && self.header.sums.iter().all(|sum| SUMS.contains(sum))
            && self.points.iter().all(|point| PENDING.contains(&f64::from_le_bytes(part(point, 8))))
            && self.points.iter().all(|point| SUMS.contains(&i64::from_le_bytes(part(point, 16))))
            && self.row_depths.iter().all(within)
            && self.parcels().all(|parcel| parcel.is_valid_in(columns) && SUMS.contains(&parcel.units))
            && self.parcels().is_sorted_by(|a, b| a.cell < b.cell)
            && !is_over(fluxes, MAX_FLUX)
            && !is_over(left, 1.0)
            && !is_over(heads, f32::MAX)
            && !self.has_bad_columns(columns)
            && self.scalars.has_good_numbers(self.waiting(), self.depths())
    }

    fn has_good_falls(&self, shallow: &Shallow) -> bool {
        let (columns, links) = (&shallow.columns, &shallow.pipes.links);
        (0.0..=1e6).contains(&self.header.since)
            && self.packets().all(|packet| packet.is_valid_in(columns) && SUMS.contains(&packet.units))
            && self.waiting().enumerate().all(|(link, waiting)| {
                waiting.is_valid_in(columns, links, link) && SUMS.contains(&waiting.units)
            })
    }

    fn has_bad_columns(&self, columns: &Columns) -> bool {
        let saved = self;
        dispatch!(has_bad_columns(saved: &Saved<'_>, columns: &Columns) -> bool)
    }

    fn runs(&self) -> impl Iterator<Item = Range<usize>> + Clone {
        let numbers = |run: &[u8; 8]| [part(run, 0), part(run, 4)].map(|n| u32::from_le_bytes(n) as usize);
        self.runs.iter().map(numbers).map(|[first, count]| first..first + count)
    }

    fn parcels(&self) -> impl Iterator<Item = Parcel> {
        self.parcels.iter().map(Parcel::from_bytes)
    }

    fn packets(&self) -> impl Iterator<Item = Packet> {
        self.packets.iter().map(Packet::from_bytes)
    }

    fn waiting(&self) -> impl Iterator<Item = Waiting> + Clone {
        self.waiting.iter().map(Waiting::from_bytes)
    }

    fn head_strips(&self) -> impl Iterator<Item = usize> {
        self.head_strips.iter().map(|strip| u32::from_le_bytes(*strip) as usize)
    }

    /// The five arrays of each run, strip by strip.
    fn arrays(&self) -> impl Iterator<Item = (Range<usize>, [&'a [[u8; STRIP_BYTES]]; ARRAYS])> + Clone {
        let mut rest = self.strips;
        self.runs().map(move |run| {
            let arrays = std::array::from_fn(|_| {
                let (own, others) = rest.split_at(run.len());
                rest = others;
                own
            });
            (run, arrays)
        })
    }

    /// Depths of all columns.
    fn depths(&self) -> impl Iterator<Item = &'a [u8; 4]> + Clone {
        self.arrays().flat_map(|(_, [depth, ..])| depth.as_flattened().as_chunks::<4>().0)
    }

    /// Applies the state.
    fn apply(&self, shallow: &mut Shallow) {
        let Shallow { flow, flow_points, columns, remap, falls, .. } = &mut *shallow;
        remap.held.set(self.parcels().enumerate().map(|(at, parcel)| self.scalars.with_amounts(at, parcel)));
        let packets = self.packets().enumerate().map(|(at, packet)| self.scalars.in_packet(at, packet));
        falls.set(packets, self.waiting().enumerate().map(|(at, waiting)| self.scalars.at_link(at, waiting)));
        (falls.since, falls.tick) = (self.header.since, self.header.tick);
        let [poured, sourced, drained, absorbed, lost, gained] = self.header.sums;
        let mut stored = flow.stored();
        let mut end = 0;
        for (run, [depth, numbers @ ..]) in self.arrays() {
            stored.clear(end..run.start);
            end = run.end;
            let run = run.start * STRIP..run.end * STRIP;
            get(depth.as_flattened(), &mut stored.depth[run.clone()], i32::from_le_bytes);
            for (from, to) in numbers.into_iter().zip(&mut stored.numbers) {
                get(from.as_flattened(), &mut to[run.clone()], f32::from_le_bytes);
            }
            stored.heads[run].fill(0.0);
        }
        stored.clear(end..columns.strips().len());
        self.scalars.apply(self.runs(), stored.amounts);
        for (strip, heads) in self.head_strips().zip(self.heads) {
            get(heads, &mut stored.heads[strip * STRIP..(strip + 1) * STRIP], f32::from_le_bytes);
        }
        get(self.row_depths.as_flattened(), stored.bands.row_depths_mut(), i32::from_le_bytes);
        let (fluxes, left) = self.links.split_at(self.header.counts.links);
        get(fluxes.as_flattened(), &mut stored.links.flux, f32::from_le_bytes);
        get(left.as_flattened(), &mut stored.links.remainder, f32::from_le_bytes);
        (stored.links.lost, stored.links.gained) = (lost, gained);
        *stored.last = self.header.times[1];
        flow.wake(columns, self.runs());
        for (at, point) in self.points.iter().enumerate() {
            flow_points.set_progress(
                at,
                f64::from_le_bytes(part(point, 8)),
                i64::from_le_bytes(part(point, 16)),
            );
        }
        (flow_points.sourced, flow_points.drained, flow_points.absorbed) = (sourced, drained, absorbed);
        (shallow.poured, shallow.time, shallow.still_level) =
            (poured, self.header.times[0], self.header.still);
        shallow.steps.clear();
    }
}

/// Whether an array by column index has an invalid number. Tests all of them, without branches.
#[inline(always)]
fn has_bad_columns(saved: &Saved<'_>, columns: &Columns) -> bool {
    let [bases, ceilings] =
        [columns.bases(), columns.ceilings()].map(|numbers| numbers.as_chunks::<STRIP>().0);
    let (mut bad, mut is_over_any) = (0, false);
    for (run, [depth, east, south, remainder_east, remainder_south]) in saved.arrays() {
        for (strip, depths) in run.zip(depth) {
            let row_depth = i32::from_le_bytes(saved.row_depths[columns.strips()[strip].row as usize]);
            let (base, ceiling) = (&bases[strip], &ceilings[strip]);
            for (position, depth) in depths.as_chunks().0.iter().enumerate() {
                let depth = i32::from_le_bytes(*depth);
                let room = ceiling[position] - base[position];
                bad |= depth | room.wrapping_sub(depth) | row_depth.wrapping_sub(depth);
            }
        }
        for (numbers, max) in
            [(east, MAX_FLUX), (south, MAX_FLUX), (remainder_east, 1.0), (remainder_south, 1.0)]
        {
            is_over_any |= is_over(numbers.as_flattened().as_chunks().0, max);
        }
    }
    bad < 0 || is_over_any
}

/// Whether the magnitude of a number is over `max`, or a number is NaN.
#[inline(always)]
fn is_over(numbers: &[[u8; 4]], max: f32) -> bool {
    let max = max.to_bits() as i32;
    let magnitude = |number: &[u8; 4]| (u32::from_le_bytes(*number) & !(1 << 31)) as i32;
    numbers.iter().fold(0, |bad, number| bad | (max - magnitude(number))) < 0
}

/// Whether ranges are non-empty, in order and disjoint, and the last ends at `count` or before.
fn is_in_order(mut ranges: impl Iterator<Item = Range<usize>>, count: usize) -> bool {
    let mut end = 0;
    ranges.all(|range| {
        let fits = end <= range.start && range.start < range.end && range.end <= count;
        end = range.end;
        fits
    })
}

fn code_of_border(border: Border) -> u32 {
    match border {
        Border::Closed => 0,
        Border::Open => 1,
        Border::Absorbing => 2,
    }
}

fn code_of_kind(kind: Kind) -> u32 {
    match kind {
        Kind::Source => 0,
        Kind::Drain => 1,
        Kind::Absorber(_) => 2,
        Kind::Orifice(_) => 3,
    }
}
