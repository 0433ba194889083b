//! The exact state of grains as bytes, from which a run resumes.

use std::collections::BTreeMap;

use xxhash_rust::xxh3::xxh3_128;

use super::Grains;
use super::contacts::{Held, MOST};
use super::heap::Heap;
use super::layout::{EDGE, holds};
use super::rows::Row;
use super::touch::Touch;
use crate::base::DVec3;
use crate::error::{Error, Result};

/// Magic bytes, including the version.
const MAGIC: &[u8; 8] = b"frzgrn06";

/// Writes little-endian numbers.
#[derive(Default)]
struct Writer(Vec<u8>);

impl Writer {
    fn count(&mut self, count: usize) {
        self.0.extend((count as u64).to_le_bytes());
    }

    fn u32(&mut self, number: u32) {
        self.0.extend(number.to_le_bytes());
    }

    fn i32s(&mut self, numbers: &[i32]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    fn f32s(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
    }

    fn f64(&mut self, number: f64) {
        self.0.extend(number.to_le_bytes());
    }
}

/// Reads bytes that [`Writer`] wrote.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk().ok_or_else(|| wrong("the state is cut short"))?;
        self.0 = rest;
        Ok(*first)
    }

    /// A count of elements of at least `bytes` bytes each.
    fn count(&mut self, bytes: usize) -> Result<usize> {
        let count = u64::from_le_bytes(self.take()?) as usize;
        if count > self.0.len() / bytes {
            return Err(wrong("the state is cut short"));
        }
        Ok(count)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn i32s<const N: usize>(&mut self) -> Result<[i32; N]> {
        let mut out = [0; N];
        for number in &mut out {
            *number = i32::from_le_bytes(self.take()?);
        }
        Ok(out)
    }

    fn f32s<const N: usize>(&mut self) -> Result<[f32; N]> {
        let mut out = [0.0; N];
        for number in &mut out {
            *number = f32::from_le_bytes(self.take()?);
            if !number.is_finite() {
                return Err(wrong("the state has a number that is not finite"));
            }
        }
        Ok(out)
    }

    fn f64(&mut self) -> Result<f64> {
        let number = f64::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(wrong("the state has a number that is not finite")) }
    }
}

/// The state as bytes, the same for any number of threads.
pub fn save(grains: &Grains) -> Vec<u8> {
    let heap = &grains.heap;
    let mut to = Writer::default();
    to.f64(heap.diameter);
    grains.ties.iter().for_each(|number| to.f64(*number));
    to.count(grains.boxes.len());
    grains.boxes.iter().flatten().flat_map(|corner| corner.iter()).for_each(|number| to.f64(*number));
    to.u32(grains.next_id);
    to.count(heap.rows.len());
    for ((row, id), at) in heap.rows.iter().zip(&heap.ids).zip(&heap.at) {
        to.u32(*id);
        to.i32s(at);
        to.f32s(&row.place);
        to.f32s(&row.velocity);
        to.f32s(&row.since);
        to.f32s(&[row.hold, row.still]);
        let birth = &grains.births[*id as usize];
        to.f32s(&birth.rest);
        to.i32s(&[birth.frame]);
    }
    to.count(heap.held.len());
    for held in &heap.held {
        held.grains.iter().for_each(|grain| to.u32(*grain));
        to.f32s(&held.impulse);
    }
    to.count(heap.touches.len());
    for touch in &heap.touches {
        to.u32(touch.grain);
        to.u32(touch.collider);
        to.f32s(&[touch.impulse]);
        to.f32s(&touch.across);
    }
    to.count(heap.trapped.len());
    heap.trapped.iter().for_each(|id| to.u32(*id));
    to.count(grains.owed.len());
    for (origin, owed) in &grains.owed {
        to.i32s(origin);
        to.f64(*owed);
    }
    pack(&to.0)
}

/// Reads a state into grains that have none yet.
///
/// # Errors
/// Bytes that are not a valid state, or a state of grains of another size.
pub fn load(grains: &mut Grains, bytes: &[u8]) -> Result<()> {
    let bytes = unpack(bytes)?;
    let mut from = Reader(&bytes);
    let diameter = from.f64()?;
    if diameter != grains.heap.diameter {
        return Err(wrong(format!("has grains of {diameter} m, not {}", grains.heap.diameter)));
    }
    let mut heap = Heap::new(diameter);
    for tie in &mut grains.ties {
        *tie = from.f64()?;
    }
    for _ in 0..from.count(48)? {
        let mut corner = || Ok(DVec3::new(from.f64()?, from.f64()?, from.f64()?));
        grains.boxes.push([corner()?, corner()?]);
    }
    grains.next_id = from.u32()?;
    let count = from.count(ROW)?;
    if count > MOST || grains.next_id as usize > MOST {
        return Err(wrong("has more grains than there may be"));
    }
    grains.births = vec![Default::default(); grains.next_id as usize];
    for _ in 0..count {
        let id = from.u32()?;
        heap.ids.push(id);
        heap.at.push(from.i32s()?);
        if !heap.at.last().is_some_and(|at| holds(*at)) {
            return Err(wrong("has a grain that is too far from the origin"));
        }
        let (place, velocity, since) = (from.f32s()?, from.f32s()?, from.f32s()?);
        let [hold, still] = from.f32s()?;
        if ![0.0, 1.0, 2.0, 3.0].contains(&hold) || place.iter().any(|x| !(0.0..=EDGE).contains(x)) {
            return Err(wrong("has a grain that lies in no block"));
        }
        heap.rows.push(Row { place, hold, velocity, still, since, ..Row::default() });
        let birth = grains.births.get_mut(id as usize).ok_or_else(|| wrong("has a grain without birth"))?;
        (birth.rest, [birth.frame]) = (from.f32s()?, from.i32s()?);
    }
    for _ in 0..from.count(20)? {
        let grains = [from.u32()?, from.u32()?];
        if grains.iter().any(|grain| *grain as usize >= count) || grains[0] == grains[1] {
            return Err(wrong("has a contact of a grain that is not there"));
        }
        heap.held.push(Held { grains, impulse: from.f32s()? });
    }
    for _ in 0..from.count(24)? {
        let (grain, collider) = (from.u32()?, from.u32()?);
        if grain as usize >= count {
            return Err(wrong("has a contact of a grain that is not there"));
        }
        let ([impulse], across) = (from.f32s()?, from.f32s()?);
        heap.touches.push(Touch { grain, collider, impulse, across, ..Touch::default() });
    }
    for _ in 0..from.count(4)? {
        heap.trapped.push(from.u32()?);
    }
    if !heap.trapped.is_sorted_by(|a, b| a < b) {
        return Err(wrong("has trapped grains out of order"));
    }
    grains.owed = BTreeMap::new();
    for _ in 0..from.count(20)? {
        grains.owed.insert(from.i32s()?, from.f64()?);
    }
    if !from.0.is_empty() {
        return Err(wrong("has bytes behind its end"));
    }
    grains.heap = heap;
    Ok(())
}

/// Size of a part before compression (bytes).
const PART: usize = 1 << 24;
/// Size of the checksum (bytes).
const SEAL: usize = 16;

/// Packs bytes: magic, checksum, then compressed parts, each after its length.
fn pack(bytes: &[u8]) -> Vec<u8> {
    let parts: Vec<Vec<u8>> = bytes.chunks(PART).map(lz4_flex::compress_prepend_size).collect();
    let mut out = MAGIC.to_vec();
    out.resize(MAGIC.len() + SEAL, 0);
    for part in parts {
        out.extend((part.len() as u32).to_le_bytes());
        out.extend(part);
    }
    let seal = xxh3_128(&out[MAGIC.len() + SEAL..]).to_le_bytes();
    out[MAGIC.len()..][..SEAL].copy_from_slice(&seal);
    out
}

/// Count of bytes that [`unpack`] would return; 0 if it would fail.
pub fn unpacked(packed: &[u8]) -> u64 {
    let size = |part: &&[u8]| part.first_chunk().map_or(0, |size| u64::from(u32::from_le_bytes(*size)));
    parts(packed).map_or(0, |parts| parts.iter().map(size).sum())
}

/// Reverses [`pack`].
fn unpack(packed: &[u8]) -> Result<Vec<u8>> {
    let whole = |part| lz4_flex::decompress_size_prepended(part).map_err(|error| wrong(error.to_string()));
    let parts: Vec<Vec<u8>> = parts(packed)?.into_iter().map(whole).collect::<Result<_>>()?;
    Ok(parts.concat())
}

/// The compressed parts, after a check of the magic bytes and of the checksum.
fn parts(packed: &[u8]) -> Result<Vec<&[u8]>> {
    let mut from = Reader(packed);
    if &from.take::<8>()? != MAGIC {
        return Err(wrong("is not a state of grains, or one of another version"));
    }
    if from.take::<SEAL>()? != xxh3_128(from.0).to_le_bytes() {
        return Err(wrong("is a damaged state of grains"));
    }
    let mut parts = Vec::new();
    while !from.0.is_empty() {
        let length = from.u32()? as usize;
        let part = from.0.get(..length).ok_or_else(|| wrong("the state is cut short"))?;
        let whole = part.first_chunk().map_or(0, |size| u32::from_le_bytes(*size) as usize);
        if whole > PART {
            return Err(wrong("has a part that is too large"));
        }
        parts.push(part);
        from.0 = &from.0[length..];
    }
    Ok(parts)
}

fn wrong(what: impl Into<String>) -> Error {
    Error::Bytes(what.into())
}

/// Size of a grain (bytes).
const ROW: usize = 4 + 12 + 3 * 12 + 8 + 16;
