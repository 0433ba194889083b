//! Exact states as packed bytes: magic, checksum, then compressed parts, each preceded by its length.

use xxhash_rust::xxh3::xxh3_128;

use super::bytes::{Reader, require};
use crate::error::{Error, Result};

/// Identifies the kind of a state and its version.
pub type Magic = [u8; 8];

/// Size of a part before compression (bytes).
const PART: usize = 1 << 24;
/// Size of the checksum (bytes).
const CHECKSUM: usize = 16;

/// Packs bytes.
pub fn pack(bytes: &[u8], magic: &Magic) -> Vec<u8> {
    let parts: Vec<Vec<u8>> = bytes.chunks(PART).map(lz4_flex::compress_prepend_size).collect();
    let mut out = magic.to_vec();
    out.resize(magic.len() + CHECKSUM, 0);
    for part in parts {
        out.extend((part.len() as u32).to_le_bytes());
        out.extend(part);
    }
    let checksum = xxh3_128(&out[magic.len() + CHECKSUM..]).to_le_bytes();
    out[magic.len()..][..CHECKSUM].copy_from_slice(&checksum);
    out
}

/// Count of bytes that [`unpack`] would return; 0 if it would fail.
pub fn unpacked_size(packed: &[u8], magic: &Magic, noun: &str) -> u64 {
    let size = |part: &&[u8]| part.first_chunk().map_or(0, |size| u64::from(u32::from_le_bytes(*size)));
    parts(packed, magic, noun).map_or(0, |parts| parts.iter().map(size).sum())
}

/// Reverses [`pack`]; messages name the owner of the state by `noun`.
///
/// # Errors
/// The bytes are damaged, truncated, or not a state of `noun`.
pub fn unpack(packed: &[u8], magic: &Magic, noun: &str) -> Result<Vec<u8>> {
    let unpacked_part =
        |part| lz4_flex::decompress_size_prepended(part).map_err(|error| wrong(error.to_string()));
    let parts: Vec<Vec<u8>> =
        parts(packed, magic, noun)?.into_iter().map(unpacked_part).collect::<Result<_>>()?;
    Ok(parts.concat())
}

/// The compressed parts, after a check of the magic bytes and of the checksum.
fn parts<'a>(packed: &'a [u8], magic: &Magic, noun: &str) -> Result<Vec<&'a [u8]>> {
    let mut from = Reader::new(packed);
    if &from.take::<8>()? != magic {
        return Err(wrong(format!("is not a state of {noun}, or one of another version")));
    }
    if from.take::<CHECKSUM>()? != xxh3_128(from.rest()).to_le_bytes() {
        return Err(wrong(format!("is a damaged state of {noun}")));
    }
    let mut parts = Vec::new();
    while !from.rest().is_empty() {
        let length = from.u32()? as usize;
        let part = from.bytes(length)?;
        let size = part.first_chunk().map_or(0, |size| u32::from_le_bytes(*size) as usize);
        require(size <= PART, "has a part that is too large")?;
        parts.push(part);
    }
    Ok(parts)
}

fn wrong(what: impl Into<String>) -> Error {
    Error::Bytes(what.into())
}
