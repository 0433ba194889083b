//! Numbers as bytes, packed integers, and LZ4.

use crate::io::files::source::Parsed;

/// Maximum number of bytes that LZ4 expands a byte to.
const MAX_EXPANSION: usize = 255;

/// The bytes that [`put_compressed`] has compressed, without their length: no more than `max`.
pub(super) fn decompressed(bytes: &[u8], max: usize) -> Parsed<Vec<u8>> {
    let damaged = || "the file is damaged: compressed data are not valid".to_string();
    let (&chunks, mut rest) = bytes.split_first().ok_or_else(damaged)?;
    // A damaged count must not allocate more than the file could fill.
    let expanded = |chunk: &[u8], max: usize| {
        let max = max.min(chunk.len().saturating_mul(MAX_EXPANSION));
        lz4_flex::block::decompress(chunk, max).map_err(|_| damaged())
    };
    if chunks == 0 {
        return expanded(rest, max);
    }
    let mut out = Vec::new();
    for _ in 0..chunks {
        let (size, chunk) = rest.split_first_chunk().ok_or_else(damaged)?;
        let size = usize::try_from(i32::from_le_bytes(*size)).map_err(|_| damaged())?;
        let (chunk, after) = chunk.split_at_checked(size).ok_or_else(damaged)?;
        out.extend(expanded(chunk, max - out.len())?);
        rest = after;
    }
    Ok(out)
}

/// The integers that [`put_packed`] has packed.
pub(super) fn unpacked<T: Integer>(bytes: &[u8], count: usize) -> Parsed<Vec<T>> {
    let damaged = || "the file is damaged: packed integers are not valid".to_string();
    let (width, codes) = (T::WIDTHS[2], count.div_ceil(4));
    let bytes = decompressed(bytes, count.saturating_mul(width).saturating_add(width + codes))?;
    let (frequent, rest) = bytes.split_at_checked(width).ok_or_else(damaged)?;
    let (codes, mut rest) = rest.split_at_checked(codes).ok_or_else(damaged)?;
    let signed = |bytes: &[u8]| {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let unused = 64 - 8 * bytes.len() as u32;
        i64::from_le_bytes(wide) << unused >> unused
    };
    let frequent = signed(frequent);
    let mut value = 0i64;
    let mut out = Vec::with_capacity(count);
    for number in 0..count {
        let code = codes[number / 4] >> (2 * (number % 4)) & 3;
        let difference = match code {
            0 => frequent,
            code => {
                let (bytes, after) =
                    rest.split_at_checked(T::WIDTHS[code as usize - 1]).ok_or_else(damaged)?;
                rest = after;
                signed(bytes)
            }
        };
        let next = T::of_wide(value.wrapping_add(difference));
        value = next.wide();
        out.push(next);
    }
    Ok(out)
}

/// Writes the length of some bytes compressed by LZ4, and these.
pub(super) fn put_compressed(out: &mut Vec<u8>, bytes: &[u8]) {
    let compressed = lz4_flex::block::compress(bytes);
    (compressed.len() as u64 + 1).put(out);
    // Number of chunks of a buffer that is too long for LZ4.
    out.push(0);
    out.extend_from_slice(&compressed);
}

/// Writes integers packed as differences: the most frequent one, then two bits for each, then those that differ from it, in as few bytes
/// as possible; all compressed.
pub(super) fn put_packed<T: Integer>(out: &mut Vec<u8>, values: &[T]) {
    let mut before = 0;
    let differences: Vec<i64> = values
        .iter()
        .map(|value| {
            let difference = T::wrapped(value.wide().wrapping_sub(before));
            before = value.wide();
            difference
        })
        .collect();
    let frequent = most_frequent(&differences);
    let mut packed = T::narrow(frequent);
    let codes = packed.len();
    packed.resize(codes + values.len().div_ceil(4), 0);
    for (number, difference) in differences.into_iter().enumerate().filter(|(_, one)| *one != frequent) {
        let fits = |bytes: &usize| difference << (64 - 8 * bytes) >> (64 - 8 * bytes) == difference;
        let code = T::WIDTHS.iter().position(fits).unwrap_or(T::WIDTHS.len() - 1);
        packed[codes + number / 4] |= (code as u8 + 1) << (2 * (number % 4));
        packed.extend_from_slice(&difference.to_le_bytes()[..T::WIDTHS[code]]);
    }
    put_compressed(out, &packed);
}

/// The most frequent number, the smallest if there are several; 0 without any.
fn most_frequent(numbers: &[i64]) -> i64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a == b).map(|run| (run.len(), std::cmp::Reverse(run[0])));
    runs.max().map_or(0, |(_, std::cmp::Reverse(number))| number)
}

/// Elements of arrays.
pub(super) trait ToBytes {
    fn put(&self, out: &mut Vec<u8>);
}

/// Integers that are packed.
pub(super) trait Integer: ToBytes + Sized {
    /// Bytes of differences with the codes 1, 2 and 3.
    const WIDTHS: [usize; 3];
    fn wide(&self) -> i64;
    /// The number with these lowest bits.
    fn of_wide(wide: i64) -> Self;
    /// A difference, wrapped around as in this type.
    fn wrapped(difference: i64) -> i64;
    /// The bytes of a difference in this type.
    fn narrow(difference: i64) -> Vec<u8>;
}

/// Elements of arrays that are read.
pub(super) trait FromBytes: Sized {
    const SIZE: usize;
    /// The element that these bytes, [`FromBytes::SIZE`] of them, hold.
    fn from_bytes(bytes: &[u8]) -> Self;
}

macro_rules! numbers {
    ($($number:ty),*) => { $(impl ToBytes for $number {
        fn put(&self, out: &mut Vec<u8>) {
            out.extend_from_slice(&self.to_le_bytes());
        }
    }

    impl FromBytes for $number {
        const SIZE: usize = size_of::<$number>();

        fn from_bytes(bytes: &[u8]) -> Self {
            Self::from_le_bytes(*bytes.first_chunk().expect("a number's bytes"))
        }
    })* };
}

numbers!(u8, f32, f64, i32, u32, i64, u64);

impl ToBytes for bool {
    fn put(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }
}

impl<T: ToBytes, const N: usize> ToBytes for [T; N] {
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|part| part.put(out));
    }
}

impl<T: FromBytes, const N: usize> FromBytes for [T; N] {
    const SIZE: usize = N * T::SIZE;

    fn from_bytes(bytes: &[u8]) -> Self {
        std::array::from_fn(|part| T::from_bytes(&bytes[part * T::SIZE..]))
    }
}

macro_rules! integers {
    ($($number:ty as $signed:ty: $widths:expr),*) => { $(impl Integer for $number {
        const WIDTHS: [usize; 3] = $widths;

        fn wide(&self) -> i64 {
            i64::from(*self)
        }

        fn of_wide(wide: i64) -> Self {
            wide as $number
        }

        fn wrapped(difference: i64) -> i64 {
            i64::from(difference as $signed)
        }

        fn narrow(difference: i64) -> Vec<u8> {
            (difference as $signed).to_le_bytes().to_vec()
        }
    })* };
}

integers!(i32 as i32: [1, 2, 4], u32 as i32: [1, 2, 4], i64 as i64: [2, 4, 8]);
