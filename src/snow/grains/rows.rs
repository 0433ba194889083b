//! The part of a grain that every sub-step reads and writes, and how tasks that touch disjoint grains share it.

use std::marker::PhantomData;

/// Three components.
pub type V = [f32; 3];

/// A grain while it is stepped.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Row {
    /// Place within its block (diameters), from the block's least corner.
    pub place: V,
    /// Inverse mass: 1, or 0 while it rests.
    pub weight: f32,
    /// Velocity (m/s).
    pub velocity: V,
    /// 1 where a chain of contacts led down to something fixed in the last sub-step, else 0.
    pub supported: f32,
    /// Displacement (diameters) of this sub-step that removes overlap and never becomes velocity.
    pub push: V,
    /// As `supported`, for the running sub-step.
    pub supports: f32,
    /// Sum of the impulses of its pairs in the last sub-step (m/s), with which the next one begins.
    pub carried: V,
    /// Fills the row up to a cache line.
    pub unused: f32,
}

/// A slice whose elements tasks change at the same time, each its own.
pub struct Shared<'a, T> {
    first: *mut T,
    count: usize,
    borrowed: PhantomData<&'a mut [T]>,
}

// SAFETY: it lends elements of a slice that is borrowed mutably; whoever calls `get` keeps them apart.
unsafe impl<T: Send> Sync for Shared<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    /// Shares a slice.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), count: slice.len(), borrowed: PhantomData }
    }

    /// An element to change.
    ///
    /// # Safety
    /// No other reference to this element may be in use.
    #[expect(clippy::mut_from_ref, reason = "callers keep elements apart")]
    pub unsafe fn get(&self, index: usize) -> &mut T {
        assert!(index < self.count);
        // SAFETY: it lies within the borrowed slice, and the caller holds no other reference to it.
        unsafe { &mut *self.first.add(index) }
    }
}

/// a + b.
#[inline(always)]
pub fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[inline(always)]
pub fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a.
#[inline(always)]
pub fn scaled(a: V, s: f32) -> V {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a . b.
#[inline(always)]
pub fn dot(a: V, b: V) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|.
#[inline(always)]
pub fn norm(a: V) -> f32 {
    dot(a, a).sqrt()
}
