//! Values of a crate, as arrays of the numbers that they hold.

use super::packing::{FromBytes, Integer, unpacked};
use super::read::{Crate, Cursor, ReadAttribute, cut, inlined_token};
use super::{ARRAY, INLINE, PACKED, Type};
use crate::io::files::source::Parsed;
use crate::io::usd::layer::Value;

/// Bits of a value that hold its offset in the file, or itself.
const PAYLOAD: u64 = (1 << 48) - 1;

impl Crate<'_> {
    /// The value of an attribute, at the first of its times; none without any, or if it is of a type that a [`Value`] cannot hold.
    ///
    /// # Errors
    /// A file that is cut short or damaged.
    pub fn value(&self, attribute: &ReadAttribute) -> Parsed<Option<Value>> {
        Ok(self.first_value(attribute)?.map(|value| self.decoded(value)).transpose()?.flatten())
    }

    /// The numbers of a value that is no array, at the first of its times: of a vector (x, y, z), a quaternion (i, j, k, real), a matrix
    /// (row by row), or one number; none for other types.
    ///
    /// # Errors
    /// As [`Crate::value`].
    pub fn numbers(&self, attribute: &ReadAttribute) -> Parsed<Option<Vec<f64>>> {
        let value = self.first_value(attribute)?.filter(|value| value & ARRAY == 0);
        let Some((value, class)) = value.and_then(|value| Some((value, Type::of(value)?))) else {
            return Ok(None);
        };
        let payload = value & PAYLOAD;
        let stored = |count: usize, size: usize| {
            Cursor::at(self.bytes, payload)?.take((count * size) as u64).map(|bytes| bytes.chunks_exact(size))
        };
        let floats = |count| Ok(stored(count, 4)?.map(|bytes| f32::from_bytes(bytes).into()).collect());
        let doubles = |count| Ok(stored(count, 8)?.map(f64::from_bytes).collect());
        // Small integers stand in for the value.
        let small = |index: usize| f64::from(payload.to_le_bytes()[index] as i8);
        let numbers: Parsed<Vec<f64>> = match (class, value & INLINE != 0) {
            (Type::Float | Type::Double, true) => Ok(vec![f32::from_bits(payload as u32).into()]),
            (Type::Float3 | Type::Double3, true) => Ok((0..3).map(small).collect()),
            (Type::Matrix4, true) => {
                Ok((0..16).map(|index| if index % 5 == 0 { small(index / 5) } else { 0.0 }).collect())
            }
            (Type::Double, false) => doubles(1),
            (Type::Float3, false) => floats(3),
            (Type::Double3, false) => doubles(3),
            (Type::QuaternionFloat, false) => floats(4),
            (Type::QuaternionDouble, false) => doubles(4),
            (Type::Matrix4, false) => doubles(16),
            _ => return Ok(None),
        };
        numbers.map(Some)
    }

    /// An array of words; none if it has another type.
    ///
    /// # Errors
    /// As [`Crate::value`].
    pub fn words(&self, attribute: &ReadAttribute) -> Parsed<Vec<String>> {
        let is_words = |value: &u64| value & ARRAY != 0 && Type::of(*value) == Some(Type::Token);
        let Some(value) = attribute.value.filter(is_words) else { return Ok(Vec::new()) };
        self.plain::<u32>(value)?.into_iter().map(|token| self.word(token)).collect()
    }

    fn word(&self, token: u32) -> Parsed<String> {
        self.tokens.get(token as usize).cloned().ok_or_else(cut)
    }

    /// The value of an attribute, at the first of its times, as the file stores it.
    fn first_value(&self, attribute: &ReadAttribute) -> Parsed<Option<u64>> {
        match attribute.value {
            Some(value) if Type::of(value) == Some(Type::TimeSamples) => self.first_sample(value),
            value => Ok(value),
        }
    }

    /// A number of the layer's metadata.
    ///
    /// # Errors
    /// As [`Crate::value`].
    pub fn metadata_number(&self, key: &str) -> Parsed<Option<f64>> {
        Ok(match self.metadata(key).map(|value| self.decoded(value)).transpose()?.flatten() {
            Some(Value::Double(number)) => Some(number),
            Some(Value::Float(number)) => Some(number.into()),
            _ => None,
        })
    }

    /// A word of the layer's metadata.
    pub fn metadata_token(&self, key: &str) -> Option<String> {
        inlined_token(self.metadata(key), &self.tokens)
    }

    fn first_sample(&self, value: u64) -> Parsed<Option<u64>> {
        // Distances from where they stand to the value of the times and to the samples' values.
        let follow = |offset: u64| -> Parsed<u64> {
            let distance = Cursor::at(self.bytes, offset)?.u64()?;
            offset.checked_add(distance).ok_or_else(cut)
        };
        let times = follow(value & PAYLOAD)?;
        let mut values = Cursor::at(self.bytes, follow(times.checked_add(8).ok_or_else(cut)?)?)?;
        Ok(if values.u64()? == 0 { None } else { Some(values.u64()?) })
    }

    fn decoded(&self, value: u64) -> Parsed<Option<Value>> {
        let Some(class) = Type::of(value) else { return Ok(None) };
        if value & ARRAY != 0 {
            return self.array(class, value);
        }
        let (is_inline, payload) = (value & INLINE != 0, value & PAYLOAD);
        let stored = || Cursor::at(self.bytes, payload);
        let float = f32::from_bits(payload as u32);
        Ok(Some(match (class, is_inline) {
            (Type::Float, true) => Value::Float(float),
            // As a float, if that is exact.
            (Type::Double, true) => Value::Double(float.into()),
            (Type::Double, false) => Value::Double(f64::from_bits(stored()?.u64()?)),
            (Type::Token, true) => Value::Token(self.word(payload as u32)?),
            (Type::Text, true) => {
                let token = self.strings.get(payload as u32 as usize).ok_or_else(cut)?;
                Value::Text(self.word(*token)?)
            }
            _ => return Ok(None),
        }))
    }

    fn array(&self, class: Type, value: u64) -> Parsed<Option<Value>> {
        Ok(Some(match class {
            Type::Bool => {
                let bytes: Vec<u8> = self.plain(value)?;
                Value::Bools(bytes.into_iter().map(|byte| byte != 0).collect())
            }
            Type::Int => Value::Ints(self.integers(value)?),
            Type::Uint => Value::Uints(self.integers(value)?),
            Type::Int64 => Value::Longs(self.integers(value)?),
            Type::Float => Value::Floats(self.floats(value)?),
            Type::Double if value & PACKED == 0 => Value::Doubles(self.plain(value)?),
            Type::Float2 => Value::Pairs(self.plain(value)?),
            Type::Double2 => Value::DoublePairs(self.plain(value)?),
            Type::Float3 => Value::Vectors(self.plain(value)?),
            Type::Double3 => Value::DoubleVectors(self.plain(value)?),
            Type::Int3 => Value::IntVectors(self.plain(value)?),
            _ => return Ok(None),
        }))
    }

    /// Position and length of an array; none if it is empty.
    fn counted(&self, value: u64) -> Parsed<Option<(Cursor<'_>, usize)>> {
        if value & PAYLOAD == 0 {
            return Ok(None);
        }
        let mut cursor = Cursor::at(self.bytes, value & PAYLOAD)?;
        let count = cursor.count()?;
        Ok(Some((cursor, count)))
    }

    fn plain<T: FromBytes>(&self, value: u64) -> Parsed<Vec<T>> {
        let Some((mut cursor, count)) = self.counted(value)? else { return Ok(Vec::new()) };
        let bytes = cursor.take(count.saturating_mul(T::SIZE) as u64)?;
        Ok(bytes.chunks_exact(T::SIZE).map(T::from_bytes).collect())
    }

    fn integers<T: Integer + FromBytes>(&self, value: u64) -> Parsed<Vec<T>> {
        if value & PACKED == 0 {
            return self.plain(value);
        }
        match self.counted(value)? {
            Some((mut cursor, count)) => unpacked(cursor.counted()?, count),
            None => Ok(Vec::new()),
        }
    }

    /// Floats: one by one, as integers, or as a table of values and an index for each.
    fn floats(&self, value: u64) -> Parsed<Vec<f32>> {
        if value & PACKED == 0 {
            return self.plain(value);
        }
        let Some((mut cursor, count)) = self.counted(value)? else { return Ok(Vec::new()) };
        match cursor.take(1)?[0] {
            b'i' => {
                let integers: Vec<i32> = unpacked(cursor.counted()?, count)?;
                Ok(integers.into_iter().map(|integer| integer as f32).collect())
            }
            b't' => {
                let length = cursor.u32()?;
                let table = cursor.take(u64::from(length) * 4)?;
                let table: Vec<f32> = table.chunks_exact(4).map(f32::from_bytes).collect();
                let indices: Vec<u32> = unpacked(cursor.counted()?, count)?;
                let known = |index: u32| table.get(index as usize).copied();
                indices.into_iter().map(known).collect::<Option<_>>().ok_or_else(cut)
            }
            _ => Err("the file is damaged: an array of floats is packed in an unknown way".into()),
        }
    }
}
