//! A layer as a binary crate (.usdc), USD's own format: a third of the text's size or less, and read without parsing.
//!
//! A crate is a heap of values and six sections. *Tokens* are all words, each once. *Strings* are those that are text. A *field* is a name
//! with a value, a *field set* the fields of a prim or attribute, a *path* its position in the tree, and a *spec* puts a path and a field
//! set together. Values are 64-bit numbers that hold the type and either the value itself or its offset in the file. Integers are packed as
//! differences in 8, 16 or 32 bits, and then by LZ4.
//!
//! The format is that of OpenUSD's `pxr/usd/sdf/crateFile.h`, version 0.8, and not a newer one, so that programs with an older USD read
//! it. (The crate `openusd` 0.6 writes children as arrays and packs arrays of 4 to 15 integers, both of which USD refuses.)

mod packing;
mod read;
mod values;
mod write;

pub(in crate::io) use read::{Crate, ReadPrim};
pub(in crate::io) use write::bytes;

/// Bytes of the header: identification, version, position of the table of contents, and room for more.
const HEADER: usize = 88;
const IDENTIFICATION: &[u8; 8] = b"PXR-USDC";
/// Ends a field set.
const END: u32 = u32::MAX;

/// Kinds of specs, as USD numbers them.
#[derive(Clone, Copy)]
enum SpecType {
    Attribute = 1,
    Prim = 6,
    PseudoRoot = 7,
}

/// Types of values, as USD numbers them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Type {
    Bool = 1,
    Int = 3,
    Uint = 4,
    Int64 = 5,
    Float = 8,
    Double = 9,
    Text = 10,
    Token = 11,
    Asset = 12,
    Matrix4 = 15,
    QuaternionDouble = 16,
    QuaternionFloat = 17,
    Double2 = 19,
    Float2 = 20,
    Double3 = 23,
    Float3 = 24,
    Int3 = 26,
    TokenVector = 41,
    Specifier = 42,
    Variability = 44,
    TimeSamples = 46,
}

impl SpecType {
    /// The kind with this number, if it is one of these.
    fn of(number: u32) -> Option<Self> {
        [Self::Attribute, Self::Prim, Self::PseudoRoot].into_iter().find(|kind| *kind as u32 == number)
    }
}

impl Type {
    const ALL: [Self; 21] = [
        Self::Bool,
        Self::Int,
        Self::Uint,
        Self::Int64,
        Self::Float,
        Self::Double,
        Self::Text,
        Self::Token,
        Self::Asset,
        Self::Matrix4,
        Self::QuaternionDouble,
        Self::QuaternionFloat,
        Self::Double2,
        Self::Float2,
        Self::Double3,
        Self::Float3,
        Self::Int3,
        Self::TokenVector,
        Self::Specifier,
        Self::Variability,
        Self::TimeSamples,
    ];

    /// The type of a value, if it is one of these.
    fn of(value: u64) -> Option<Self> {
        let number = value >> 48 & 0xFF;
        Self::ALL.into_iter().find(|class| *class as u64 == number)
    }
}

/// Flags of a value: an array, the value itself instead of its offset, packed.
const ARRAY: u64 = 1 << 63;
const INLINE: u64 = 1 << 62;
const PACKED: u64 = 1 << 61;
