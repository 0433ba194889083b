//! The exact state of mist as bytes, from which a run resumes.

use super::Mist;
use crate::error::Result;
use crate::numeric::bytes::{Reader, Writer, require};
use crate::numeric::packed::{self, Magic};

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzmst01";
/// Name in messages.
const NOUN: &str = "mist";

/// The state as bytes, the same for any number of threads.
pub fn save(mist: &Mist) -> Vec<u8> {
    let mut to = Writer::default();
    to.f64(mist.params.cell);
    mist.params.wind.iter().for_each(|speed| to.f64(*speed));
    mist.flow.save(&mut to);
    packed::pack(&to.0, MAGIC)
}

/// Unpacked size (bytes); 0 if the bytes are not a state.
pub fn unpacked_size(bytes: &[u8]) -> u64 {
    packed::unpacked_size(bytes, MAGIC, NOUN)
}

/// Loads a state into mist that has none yet.
///
/// # Errors
/// Bytes that are not a valid state, or a state with other cells or another wind.
pub fn load(mist: &mut Mist, bytes: &[u8]) -> Result<()> {
    let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
    let mut from = Reader::new(&bytes);
    let cell = from.f64()?;
    require(cell == mist.params.cell, format_args!("has cells of {cell} m, not {}", mist.params.cell))?;
    let wind = [from.f64()?, from.f64()?, from.f64()?];
    let own = mist.params.wind;
    require(wind == own, format_args!("has a wind of {wind:?} m/s, not {own:?}"))?;
    mist.flow.load(&mut from)?;
    from.end()
}
