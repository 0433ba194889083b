//! The arrays of .vtu files: text, base64 or raw bytes, preceded by their lengths, compressed or not.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::error::fail_if;
use crate::io::files::numbers::{Kind, Numbers, Order, max_inflated};
use crate::io::files::source;

/// Words between two checks of the stop flag.
const PIECE: usize = 1 << 16;

/// Decompresses bytes to exactly the given size.
pub(in crate::io) type Inflate = fn(&[u8], usize) -> Option<Vec<u8>>;

/// How all arrays of a file are encoded.
pub(in crate::io) struct Codec {
    pub order: Order,
    /// Type of the lengths.
    pub head: Kind,
    pub inflate: Option<Inflate>,
}

/// A file whose XML has been read.
pub(in crate::io) struct File<'a> {
    pub codec: Codec,
    /// The appended data, and whether they are base64.
    pub appended: Option<(bool, &'a [u8])>,
    /// Length of the whole file (bytes).
    pub length: usize,
}

/// Decompresses zlib data.
pub(in crate::io) fn zlib(bytes: &[u8], size: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    // Reading one byte more than wanted detects excess data.
    ZlibDecoder::new(bytes).take(size as u64 + 1).read_to_end(&mut out).ok()?;
    (out.len() == size).then_some(out)
}

/// Decompresses an LZ4 block.
pub(in crate::io) fn lz4(bytes: &[u8], size: usize) -> Option<Vec<u8>> {
    lz4_flex::block::decompress(bytes, size).ok().filter(|out| out.len() == size)
}

impl<'a> File<'a> {
    /// Reads an array of `count` numbers written as text.
    pub fn words<'w>(
        &self,
        kind: Kind,
        count: usize,
        words: impl Iterator<Item = &'w str>,
    ) -> Result<Numbers, String> {
        let mut out = kind.empty();
        for (n, word) in words.enumerate() {
            source::check_every(n, PIECE)?;
            kind.read_word(word.as_bytes(), &mut out)?;
        }
        if out.count() == count { Ok(out) } else { Err(other_size(out.count(), "numbers", count)) }
    }

    /// The appended data from an offset onward.
    pub fn appended(&self, offset: usize) -> Result<Stream<'a>, String> {
        let (is_base64, data) = self.appended.ok_or("is appended, and the file has no appended data")?;
        let data = data.get(offset..).ok_or("begins beyond the end of the file")?;
        Ok(if is_base64 { Stream::base64(data) } else { Stream::raw(data) })
    }

    /// Reads an array of `count` numbers that is preceded by its length.
    pub fn array(&self, kind: Kind, count: usize, mut stream: Stream<'_>) -> Result<Numbers, String> {
        let size = count.checked_mul(kind.size()).filter(|&size| size as u64 <= max_inflated(self.length));
        let size = size.ok_or_else(|| format!("is too large for the file: it says {count} numbers"))?;
        let mut out = kind.empty();
        if size == 0 {
            // Some writers give empty arrays no length.
            return Ok(out);
        }
        let Codec { order, inflate, .. } = self.codec;
        match inflate {
            None => {
                let stated = self.head(&mut stream)?;
                fail_if(stated != size, || other_size(stated, "bytes", size))?;
                kind.decode(&stream.take(size)?, order, &mut out)?;
            }
            Some(inflate) => kind.decode(&self.inflated(inflate, size, &mut stream)?, order, &mut out)?,
        }
        Ok(out)
    }

    /// The decompressed bytes of all blocks.
    fn inflated(&self, inflate: Inflate, size: usize, stream: &mut Stream<'_>) -> Result<Vec<u8>, String> {
        let [blocks, whole, last] = [self.head(stream)?, self.head(stream)?, self.head(stream)?];
        // The last block is shorter, unless its size is given as zero.
        let of_block = |block: usize| if block + 1 == blocks && last > 0 { last } else { whole };
        let stated = blocks
            .checked_sub(1)
            .map_or(Some(0), |before| before.checked_mul(whole)?.checked_add(of_block(before)));
        fail_if(stated != Some(size), || other_size(stated.unwrap_or(usize::MAX), "bytes", size))?;
        fail_if(blocks > stream.max_bytes(), truncated)?;
        let packed = (0..blocks).map(|_| self.head(stream)).collect::<Result<Vec<_>, _>>()?;
        let mut out = Vec::new();
        for (block, packed) in packed.into_iter().enumerate() {
            source::check_every(0, 1)?;
            let (packed, size) = (stream.take(packed)?, of_block(block));
            // A size that the bytes cannot decompress to must not cause an allocation.
            let inflated = Some(size).filter(|&size| size as u64 <= max_inflated(packed.len()));
            let inflated = inflated.and_then(|size| inflate(&packed, size));
            out.extend(inflated.ok_or_else(|| format!("is damaged in its compressed block {}", block + 1))?);
        }
        Ok(out)
    }

    /// A length.
    fn head(&self, stream: &mut Stream<'_>) -> Result<usize, String> {
        let mut out = self.codec.head.empty();
        self.codec.head.decode(&stream.take(self.codec.head.size())?, self.codec.order, &mut out)?;
        match out {
            Numbers::Integers(numbers) => usize::try_from(numbers[0]).map_err(|error| error.to_string()),
            Numbers::Floats(_) => unreachable!("lengths are integers"),
        }
    }
}

fn truncated() -> String {
    "ends before its numbers do".into()
}

fn other_size(stated: usize, what: &str, size: usize) -> String {
    format!("has {stated} {what}, not {size}")
}

/// Bytes that are taken in order.
pub(in crate::io) struct Stream<'a> {
    rest: &'a [u8],
    /// Bytes decoded but not yet taken; none for raw bytes.
    ready: Option<Vec<u8>>,
}

impl<'a> Stream<'a> {
    /// From base64: one piece, or several with their own padding.
    pub fn base64(text: &'a [u8]) -> Self {
        Self { rest: text, ready: Some(Vec::new()) }
    }

    /// From raw bytes.
    pub fn raw(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, ready: None }
    }

    /// Upper bound on the bytes that can be taken.
    fn max_bytes(&self) -> usize {
        self.rest.len() + self.ready.as_ref().map_or(0, Vec::len)
    }

    /// The next bytes.
    fn take(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let Some(ready) = &mut self.ready else {
            let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(truncated)?;
            self.rest = rest;
            return Ok(taken.to_vec());
        };
        while ready.len() < count {
            // Three bytes are four characters.
            let characters = (count - ready.len()).div_ceil(3).checked_mul(4);
            let text = characters.and_then(|characters| self.rest.get(..characters)).ok_or_else(truncated)?;
            // Lengths may be encoded as a piece of their own, which ends with its padding.
            let padding = text.iter().position(|&character| character == b'=');
            let end = padding.map_or(text.len(), |at| (at / 4 + 1) * 4);
            let bytes = STANDARD.decode(&text[..end]).ok().filter(|bytes| !bytes.is_empty());
            ready.extend(bytes.ok_or("is damaged: it is not base64")?);
            self.rest = &self.rest[end..];
        }
        let more = ready.split_off(count);
        Ok(std::mem::replace(ready, more))
    }
}
