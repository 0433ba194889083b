//! Numbers as bytes, packed integers, and LZ4.

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
pub(super) trait Integer: ToBytes {
    /// Bytes of differences with the codes 1, 2 and 3.
    const WIDTHS: [usize; 3];
    fn wide(&self) -> i64;
    /// A difference, wrapped around as in this type.
    fn wrapped(difference: i64) -> i64;
    /// The bytes of a difference in this type.
    fn narrow(difference: i64) -> Vec<u8>;
}

macro_rules! numbers {
    ($($number:ty),*) => { $(impl ToBytes for $number {
        fn put(&self, out: &mut Vec<u8>) {
            out.extend_from_slice(&self.to_le_bytes());
        }
    })* };
}

numbers!(f32, f64, i32, u32, i64, u64);

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

macro_rules! integers {
    ($($number:ty as $signed:ty: $widths:expr),*) => { $(impl Integer for $number {
        const WIDTHS: [usize; 3] = $widths;

        fn wide(&self) -> i64 {
            i64::from(*self)
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
