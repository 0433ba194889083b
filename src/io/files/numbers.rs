//! Arrays of numbers in particle files: of any type, in either byte order or as text.

use super::{source, text};

/// Maximum number of bytes that deflate expands a byte to.
const MAX_INFLATION: u64 = 1032;
/// Numbers between two checks of the stop flag.
const PIECE: usize = 1 << 20;

/// Maximum number of bytes that this many deflated bytes can expand to.
pub(in crate::io) fn max_inflated(bytes: usize) -> u64 {
    (bytes as u64).saturating_mul(MAX_INFLATION)
}

/// Byte order of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::io) enum Order {
    Little,
    Big,
}

/// The type of numbers in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::io) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Numbers of one type; integers keep all their 64 bits.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::io) enum Numbers {
    Integers(Vec<i64>),
    Floats(Vec<f64>),
}

impl Kind {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Whether its numbers are floats.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Whether 32-bit signed integers can hold all of its values.
    pub fn fits_int(self) -> bool {
        matches!(self, Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::I32)
    }

    /// An empty array of this type.
    pub fn empty(self) -> Numbers {
        if self.is_float() { Numbers::Floats(Vec::new()) } else { Numbers::Integers(Vec::new()) }
    }

    /// Appends the numbers in these bytes; an incomplete last one is ignored.
    ///
    /// # Errors
    /// An unsigned integer over 2^63 - 1; the stop flag.
    pub fn decode(self, bytes: &[u8], order: Order, out: &mut Numbers) -> Result<(), String> {
        for piece in bytes.chunks(PIECE * self.size()) {
            source::check_every(0, 1)?;
            self.decode_piece(piece, order, out)?;
        }
        Ok(())
    }

    fn decode_piece(self, bytes: &[u8], order: Order, out: &mut Numbers) -> Result<(), String> {
        macro_rules! extend {
            ($values:expr, $wide:ty, $type:ty) => {{
                let exact = |raw: &[u8]| raw.try_into().expect("chunks have the size of the type");
                let chunks = bytes.chunks_exact(size_of::<$type>());
                $values.extend(chunks.map(|raw| match order {
                    Order::Little => <$wide>::from(<$type>::from_le_bytes(exact(raw))),
                    Order::Big => <$wide>::from(<$type>::from_be_bytes(exact(raw))),
                }));
            }};
        }
        match (self, out) {
            (Self::F32, Numbers::Floats(values)) => extend!(values, f64, f32),
            (Self::F64, Numbers::Floats(values)) => extend!(values, f64, f64),
            (Self::I8, Numbers::Integers(values)) => extend!(values, i64, i8),
            (Self::U8, Numbers::Integers(values)) => extend!(values, i64, u8),
            (Self::I16, Numbers::Integers(values)) => extend!(values, i64, i16),
            (Self::U16, Numbers::Integers(values)) => extend!(values, i64, u16),
            (Self::I32, Numbers::Integers(values)) => extend!(values, i64, i32),
            (Self::U32, Numbers::Integers(values)) => extend!(values, i64, u32),
            (Self::I64, Numbers::Integers(values)) => extend!(values, i64, i64),
            (Self::U64, Numbers::Integers(values)) => {
                let before = values.len();
                extend!(values, i64, i64);
                if let Some(value) = values[before..].iter().find(|value| **value < 0) {
                    return Err(format!("the integer {} is over 2^63 - 1", *value as u64));
                }
            }
            _ => unreachable!("numbers are made by the kind that fills them"),
        }
        Ok(())
    }

    /// Appends a number written as text.
    ///
    /// # Errors
    /// A word that is not a number of this type.
    pub fn read_word(self, word: &[u8], out: &mut Numbers) -> Result<(), String> {
        let text = std::str::from_utf8(word).unwrap_or("");
        let read = match (self, out) {
            // Parsing via 64 bits would round some numbers twice.
            (Self::F32, Numbers::Floats(values)) => {
                text::number::<f32>(word).map(|value| values.push(value.into()))
            }
            (_, Numbers::Floats(values)) => text::number(word).map(|value| values.push(value)),
            (_, Numbers::Integers(values)) => text.parse().map(|value| values.push(value)).ok(),
        };
        read.ok_or_else(|| match self.is_float() {
            true => text::not_a_number(word),
            false => format!("\"{}\" is not an integer", text::shown(word)),
        })
    }
}

impl Numbers {
    /// Number of values.
    pub fn count(&self) -> usize {
        match self {
            Self::Integers(values) => values.len(),
            Self::Floats(values) => values.len(),
        }
    }

    /// All values as floats.
    pub fn into_floats(self) -> Vec<f64> {
        match self {
            Self::Integers(values) => values.into_iter().map(|value| value as f64).collect(),
            Self::Floats(values) => values,
        }
    }

    /// Appends the values of another array of the same type.
    pub fn append(&mut self, other: Self) {
        match (self, other) {
            (Self::Integers(values), Self::Integers(more)) => values.extend(more),
            (Self::Floats(values), Self::Floats(more)) => values.extend(more),
            _ => unreachable!("arrays of one type are added"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_read_in_both_orders_and_as_text() {
        let read = |kind: Kind, big: &[u8], word: &str| {
            let little: Vec<u8> = big.iter().rev().copied().collect();
            let (mut a, mut b, mut c) = (kind.empty(), kind.empty(), kind.empty());
            kind.decode(big, Order::Big, &mut a).unwrap();
            kind.decode(&little, Order::Little, &mut b).unwrap();
            kind.read_word(word.as_bytes(), &mut c).unwrap();
            assert!(
                a == b && a == c && a.count() == 1 && big.len() == kind.size(),
                "{kind:?} {a:?} {b:?} {c:?}"
            );
        };
        read(Kind::I8, &[0xff], "-1");
        read(Kind::U8, &[0xff], "255");
        read(Kind::I16, &[0xff, 0xfe], "-2");
        read(Kind::U16, &[0xff, 0xfe], "65534");
        read(Kind::I32, &(-7i32).to_be_bytes(), "-7");
        read(Kind::U32, &u32::MAX.to_be_bytes(), "4294967295");
        read(Kind::I64, &i64::MIN.to_be_bytes(), "-9223372036854775808");
        read(Kind::U64, &(i64::MAX as u64).to_be_bytes(), "9223372036854775807");
        read(Kind::F32, &0.1f32.to_be_bytes(), "0.1");
        read(Kind::F64, &(-1.0e300f64).to_be_bytes(), "-1e300");
        let mut empty = Kind::U64.empty();
        assert!(Kind::U64.decode(&[0xff; 8], Order::Big, &mut empty).is_err());
        assert!(Kind::I32.read_word(b"1.5", &mut Kind::I32.empty()).unwrap_err().contains("1.5"));
        assert!(Kind::F32.read_word(b"\xff", &mut Kind::F32.empty()).is_err());
    }
}
