//! The exact state of grains as bytes, from which a run resumes.

use std::collections::BTreeMap;

use super::Grains;
use super::colliders::touch::Touch;
use super::heap::Heap;
use super::solver::blocks::EDGE;
use super::solver::contacts::MAX_GRAINS;
use super::solver::layout::is_in_range;
use super::solver::pairs::PairImpulse;
use super::solver::rows::Row;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::bytes::{Reader, Writer, require};
use crate::numeric::packed::{self, Magic};

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzgrn06";
/// Name in messages.
const NOUN: &str = "grains";

/// The state as bytes, the same for any number of threads.
pub fn save(grains: &Grains) -> Vec<u8> {
    let heap = &grains.heap;
    let mut to = Writer::default();
    to.f64(heap.diameter);
    grains.wake_settings.iter().for_each(|number| to.f64(*number));
    to.count(grains.boxes.len());
    grains.boxes.iter().flatten().flat_map(|corner| corner.iter()).for_each(|number| to.f64(*number));
    to.u32(grains.next_id);
    to.count(heap.rows.len());
    for ((row, id), at) in heap.rows.iter().zip(&heap.ids).zip(&heap.at) {
        to.u32(*id);
        to.i32s(at);
        to.f32s(&row.position);
        to.f32s(&row.velocity);
        to.f32s(&row.reference);
        to.f32s(&[row.mass_state, row.still]);
        let birth = &grains.births[*id as usize];
        to.f32s(&birth.rest);
        to.i32s(&[birth.frame]);
    }
    to.count(heap.pair_impulses.len());
    for held in &heap.pair_impulses {
        held.grains.iter().for_each(|grain| to.u32(*grain));
        to.f32s(&held.impulse);
    }
    to.count(heap.touches.len());
    for touch in &heap.touches {
        to.u32(touch.grain);
        to.u32(touch.collider);
        to.f32s(&[touch.impulse]);
        to.f32s(&touch.tangential);
    }
    to.count(heap.trapped.len());
    heap.trapped.iter().for_each(|id| to.u32(*id));
    to.count(grains.owed.len());
    for (origin, owed) in &grains.owed {
        to.i32s(origin);
        to.f64(*owed);
    }
    packed::pack(&to.0, MAGIC)
}

/// Reads a state into grains that have none yet.
///
/// # Errors
/// Bytes that are not a valid state, or a state of grains of another size.
pub fn load(grains: &mut Grains, bytes: &[u8]) -> Result<()> {
    let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
    let mut from = Reader::new(&bytes);
    let diameter = from.f64()?;
    if diameter != grains.heap.diameter {
        return Err(wrong(format!("has grains of {diameter} m, not {}", grains.heap.diameter)));
    }
    let mut heap = Heap::new(diameter);
    for setting in &mut grains.wake_settings {
        *setting = from.f64()?;
    }
    for _ in 0..from.count(48)? {
        let mut corner = || Ok(DVec3::new(from.f64()?, from.f64()?, from.f64()?));
        grains.boxes.push([corner()?, corner()?]);
    }
    grains.next_id = from.u32()?;
    let count = from.count(GRAIN_BYTES)?;
    require(
        count <= MAX_GRAINS && grains.next_id as usize <= MAX_GRAINS,
        "has more grains than there may be",
    )?;
    grains.births = vec![Default::default(); grains.next_id as usize];
    for _ in 0..count {
        let id = from.u32()?;
        heap.ids.push(id);
        heap.at.push(from.i32s()?);
        require(
            heap.at.last().is_some_and(|at| is_in_range(*at)),
            "has a grain that is too far from the origin",
        )?;
        let (position, velocity, reference) = (from.f32s()?, from.f32s()?, from.f32s()?);
        let [mass_state, still] = from.f32s()?;
        if ![0.0, 1.0, 2.0, 3.0].contains(&mass_state) || position.iter().any(|x| !(0.0..=EDGE).contains(x)) {
            return Err(wrong("has a grain that lies in no block"));
        }
        heap.rows.push(Row { position, mass_state, velocity, still, reference, ..Row::default() });
        let birth = grains
            .births
            .get_mut(id as usize)
            .ok_or_else(|| wrong("has a grain whose id was never given out"))?;
        (birth.rest, [birth.frame]) = (from.f32s()?, from.i32s()?);
    }
    for _ in 0..from.count(20)? {
        let grains = [from.u32()?, from.u32()?];
        if grains.iter().any(|grain| *grain as usize >= count) || grains[0] == grains[1] {
            return Err(wrong("has a contact of a grain that does not exist"));
        }
        heap.pair_impulses.push(PairImpulse { grains, impulse: from.f32s()? });
    }
    for _ in 0..from.count(24)? {
        let (grain, collider) = (from.u32()?, from.u32()?);
        require((grain as usize) < count, "has a contact of a grain that does not exist")?;
        let ([impulse], tangential) = (from.f32s()?, from.f32s()?);
        heap.touches.push(Touch { grain, collider, impulse, tangential, ..Touch::default() });
    }
    for _ in 0..from.count(4)? {
        heap.trapped.push(from.u32()?);
    }
    require(heap.trapped.is_sorted_by(|a, b| a < b), "has trapped grains out of order")?;
    grains.owed = BTreeMap::new();
    for _ in 0..from.count(20)? {
        grains.owed.insert(from.i32s()?, from.f64()?);
    }
    from.end()?;
    grains.heap = heap;
    Ok(())
}

/// Unpacked size (bytes) of a state; 0 if it is invalid.
pub fn unpacked_size(packed: &[u8]) -> u64 {
    packed::unpacked_size(packed, MAGIC, NOUN)
}

fn wrong(what: impl Into<String>) -> Error {
    Error::Bytes(what.into())
}

/// Bytes of a grain in the state.
const GRAIN_BYTES: usize = 4 + 12 + 3 * 12 + 8 + 16;
