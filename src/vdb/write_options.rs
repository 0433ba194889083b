//! Options for writing .vdb files.

use super::grid::MetaValue;
use crate::io::files::hash::Hasher;

/// Compression of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// Uncompressed.
    None,
    /// Zip: small, slow.
    Zip,
    /// Blosc: fast.
    #[default]
    Blosc,
}

/// Options for writing a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WriteOptions {
    /// Codec.
    pub compression: Compression,
    /// 16-bit values: for caches that are only rendered.
    pub half: bool,
    /// Metadata of the file itself.
    pub metadata: Vec<(String, MetaValue)>,
}

/// The number of a codec on the C++ side.
pub(in crate::vdb) fn codec_number(compression: Compression) -> i32 {
    match compression {
        Compression::None => 0,
        Compression::Zip => 1,
        Compression::Blosc => 2,
    }
}

/// Position of the random identifier in a file: 36 characters.
const UUID: std::ops::Range<usize> = 21..57;

/// The bytes of a file, with the random identifier replaced by one derived from the rest.
pub(in crate::vdb) fn named_by_content(bytes: &cxx::CxxString) -> Vec<u8> {
    let mut bytes = bytes.as_bytes().to_vec();
    if bytes.len() < UUID.end {
        return bytes;
    }
    let digits = Hasher::default().add(&bytes[..UUID.start]).add(&bytes[UUID.end..]).finish();
    let name = [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..]].join("-");
    bytes[UUID].copy_from_slice(name.as_bytes());
    bytes
}
