//! Numbers by column index, in arrays offset in memory, so that the numbers of one column do not collide in the cache.
//!
//! A step reads and writes a dozen arrays at once. Large allocations from the system begin at about the same offset in a page; the arrays
//! then compete for a few sets of the L1 cache, and a read is mistaken for one of data just written to another array: a step takes up to a
//! quarter longer.

use std::ops::{Deref, DerefMut, Range};

/// Period (bytes) after which addresses share a set of the L1 cache and alias in the check of reads against recent writes.
const PAGE: usize = 4096;
/// Bytes of a cache line.
const LINE: usize = 64;

/// What the numbers are: each array begins at its own offset in a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Array {
    /// b.
    Base,
    /// H.
    Depth,
    /// Openness of pipes.
    OpenEast,
    OpenSouth,
    /// Fluxes.
    FluxEast,
    FluxSouth,
    /// Rounding remainders of transfers.
    RemainderEast,
    RemainderSouth,
    /// Inertia divisors of fast films.
    Light,
    /// Heads of full columns.
    Head,
    /// max.
    Ceiling,
    /// min.
    Under,
}

impl Array {
    /// Offset in a page at which it begins (bytes).
    const fn position(self) -> usize {
        let count = Self::Under as usize + 1;
        self as usize * (PAGE / count / LINE * LINE)
    }
}

/// One number for each column index; dereferences to a slice.
#[derive(Debug)]
pub struct PerColumn<T> {
    array: Array,
    /// Unused numbers before the first one, which give the array its offset.
    before: usize,
    /// Capacity: arrays of one liquid grow in the same frame, and then not again for a long time.
    room: usize,
    list: Vec<T>,
}

impl<T: Copy> PerColumn<T> {
    /// `len` copies of `fill`.
    pub fn new(array: Array, len: usize, fill: T) -> Self {
        let mut new = Self { array, before: 0, room: 0, list: Vec::new() };
        new.resize(len, fill);
        new
    }

    /// Changes the length.
    pub fn resize(&mut self, len: usize, fill: T) {
        self.make_room(len, fill);
        self.list.resize(self.before + len, fill);
    }

    /// Changes the length of a part; the part then holds leftover values.
    pub fn resize_part(&mut self, part: Range<usize>, len: usize, fill: T) {
        let (count, end) = (self.len(), part.start + len);
        if end > part.end {
            self.resize(count + (end - part.end), fill);
        }
        self.copy_within(part.end..count, end);
        self.list.truncate(self.before + count - part.len() + len);
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.list.capacity() * size_of::<T>()
    }

    /// Reallocates if the capacity is less than `len`, with the right offset.
    fn make_room(&mut self, len: usize, fill: T) {
        if len <= self.room {
            return;
        }
        // At least doubles, as `Vec` does.
        self.room = len.max(2 * self.room);
        let mut list = Vec::with_capacity(self.room + PAGE / size_of::<T>());
        let at = <*const T>::addr(list.as_ptr());
        let before = self.array.position().wrapping_sub(at) % PAGE / size_of::<T>();
        list.resize(before, fill);
        list.extend_from_slice(self);
        (self.before, self.list) = (before, list);
    }
}

impl<T> Deref for PerColumn<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.list[self.before..]
    }
}

impl<T> DerefMut for PerColumn<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.list[self.before..]
    }
}

impl<T: Copy> Clone for PerColumn<T> {
    fn clone(&self) -> Self {
        let mut new = Self { array: self.array, before: 0, room: 0, list: Vec::new() };
        new.clone_from(self);
        new
    }

    /// Reuses the allocation.
    fn clone_from(&mut self, other: &Self) {
        let Some(&any) = other.first() else { return self.list.truncate(self.before) };
        self.make_room(other.len(), any);
        self.list.truncate(self.before);
        self.list.extend_from_slice(other);
    }
}

impl<T: PartialEq> PartialEq for PerColumn<T> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position<T>(numbers: &PerColumn<T>) -> usize {
        numbers.as_ptr().addr() % PAGE
    }

    #[test]
    fn arrays_keep_their_offsets_as_they_grow() {
        for array in [Array::Base, Array::FluxSouth, Array::Under] {
            let mut numbers = PerColumn::new(array, 100, 1.0_f32);
            for len in [101, 5000, 3, 100_000] {
                numbers.resize(len, 2.0);
                assert_eq!((numbers.len(), position(&numbers)), (len, array.position()));
            }
            assert_eq!((numbers[2], numbers[3]), (1.0, 2.0));
            let copy = numbers.clone();
            assert_eq!((position(&copy), copy == numbers), (array.position(), true));
        }
        let positions = [Array::Base.position(), Array::Depth.position(), Array::Under.position()];
        assert_eq!(positions, [0, 320, 11 * 320]);
    }

    #[test]
    fn a_part_gets_another_length() {
        let mut numbers = PerColumn::new(Array::Depth, 6, 0);
        numbers.copy_from_slice(&[0, 1, 2, 3, 4, 5]);
        numbers.resize_part(2..4, 3, 9);
        assert_eq!((numbers[..2].to_vec(), numbers[5..].to_vec()), (vec![0, 1], vec![4, 5]));
        numbers.resize_part(2..5, 0, 9);
        assert_eq!(numbers[..], [0, 1, 4, 5]);
        let mut other = PerColumn::new(Array::Head, 1000, 7);
        let room = other.bytes();
        other.clone_from(&numbers);
        assert_eq!((&other[..], other.bytes()), (&numbers[..], room));
        other.clone_from(&PerColumn::new(Array::Head, 0, 0));
        assert!(other.is_empty());
    }
}
