//! The part of a grain that every sub-step reads and writes, and how tasks that change disjoint grains share it.

use std::marker::PhantomData;
use std::ops::{Add, Mul, Sub};

use crate::numeric::lanes::{LANES, Lanes};

/// Three components.
pub type V = [f32; 3];
/// Three components of eight vectors.
pub type V8 = [Lanes; 3];

/// A grain during a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Row {
    /// Position within its block (diameters), relative to the block's minimum corner.
    pub position: V,
    /// Inverse mass (1, or 0 at rest), plus 2 if a chain of contacts led down to something fixed in the last sub-step.
    pub mass_state: f32,
    /// Velocity (m/s).
    pub velocity: V,
    /// Number of sub-steps since it was at `reference`; a special value if it has just woken.
    pub still: f32,
    /// Displacement (diameters) in this sub-step that removes overlap and never becomes velocity.
    pub push: V,
    /// Set by the contacts of this sub-step: 1 if supported, plus 2 if something wakes it.
    pub marks: f32,
    /// Position (diameters, like `position`) from which displacements are measured: beyond a small one the grain counts
    /// as moving.
    pub reference: V,
    /// Distance (diameters) that meshes may travel from the start of the step before one can touch it.
    pub travel_limit: f32,
}

/// Added to `mass_state`: supported.
pub const SUPPORTED: f32 = 2.0;

impl Row {
    /// Inverse mass: 1, or 0 at rest.
    #[inline(always)]
    pub fn weight(&self) -> f32 {
        if self.is_supported() { self.mass_state - SUPPORTED } else { self.mass_state }
    }

    /// Whether a chain of contacts led down to something fixed in the last sub-step.
    #[inline(always)]
    pub fn is_supported(&self) -> bool {
        self.mass_state >= SUPPORTED
    }

    /// Whether it rests.
    #[inline(always)]
    pub fn rests(&self) -> bool {
        self.weight() == 0.0
    }
}

/// Four consecutive numbers of a row, starting with the position, velocity or push.
#[derive(Clone, Copy)]
pub enum Part {
    /// `position` and `mass_state`.
    Position = 0,
    /// `velocity` and `still`.
    Velocity = 4,
    /// `push` and `marks`.
    Push = 8,
}

/// A slice of which tasks change different elements concurrently.
pub struct Shared<'a, T> {
    first: *mut T,
    count: usize,
    borrowed: PhantomData<&'a mut [T]>,
}

impl<T> Clone for Shared<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Shared<'_, T> {}

// SAFETY: it lends elements of a slice that is borrowed mutably; callers of `get` keep them apart.
unsafe impl<T: Send> Sync for Shared<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    /// Shares a slice.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), count: slice.len(), borrowed: PhantomData }
    }

    /// Mutable access to an element.
    ///
    /// # Safety
    /// No other reference to this element may be in use.
    #[inline(always)]
    #[expect(clippy::mut_from_ref, reason = "callers keep elements apart")]
    pub unsafe fn get(&self, index: usize) -> &mut T {
        assert!(index < self.count);
        // SAFETY: it lies within the borrowed slice, and the caller holds no other reference to it.
        unsafe { &mut *self.first.add(index) }
    }
}

impl Shared<'_, Row> {
    /// Address of a part of a row.
    ///
    /// # Safety
    /// The row exists.
    #[inline(always)]
    unsafe fn part(&self, row: u32, part: Part) -> *mut f32 {
        // SAFETY: a row has sixteen numbers, and a part is four of them.
        unsafe { self.first.cast::<f32>().add(row as usize * 16 + part as usize) }
    }

    /// Prefetches eight rows: a sweep would otherwise spend most of its time waiting for them.
    #[inline(always)]
    pub fn prefetch(&self, rows: &[u32; LANES]) {
        #[cfg(target_arch = "x86_64")]
        for row in rows {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: a prefetch reads nothing, wherever it points; SSE is part of x86-64.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(self.first.wrapping_add(*row as usize).cast()) };
        }
    }

    /// One part of eight rows, by component.
    ///
    /// # Safety
    /// The rows exist, and nothing else changes them meanwhile.
    #[inline(always)]
    pub unsafe fn gather(&self, rows: &[u32; LANES], part: Part) -> [Lanes; 4] {
        let mut out = [Lanes::default(); 4];
        #[cfg(target_arch = "x86_64")]
        for half in [0, 4] {
            use std::arch::x86_64::{_MM_TRANSPOSE4_PS, _mm_load_ps, _mm_storeu_ps};
            // SAFETY: rows lie on cache lines, and their parts on quarters of them; SSE2 is part of x86-64.
            unsafe {
                let mut a = _mm_load_ps(self.part(rows[half], part));
                let mut b = _mm_load_ps(self.part(rows[half + 1], part));
                let mut c = _mm_load_ps(self.part(rows[half + 2], part));
                let mut d = _mm_load_ps(self.part(rows[half + 3], part));
                _MM_TRANSPOSE4_PS(&mut a, &mut b, &mut c, &mut d);
                _mm_storeu_ps(out[0].0.as_mut_ptr().add(half), a);
                _mm_storeu_ps(out[1].0.as_mut_ptr().add(half), b);
                _mm_storeu_ps(out[2].0.as_mut_ptr().add(half), c);
                _mm_storeu_ps(out[3].0.as_mut_ptr().add(half), d);
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        for lane in 0..LANES {
            for (component, out) in out.iter_mut().enumerate() {
                // SAFETY: as above.
                out.0[lane] = unsafe { *self.part(rows[lane], part).add(component) };
            }
        }
        out
    }

    /// Writes back what [`Shared::gather`] read. Lanes with the same row must hold the same values.
    ///
    /// # Safety
    /// The rows exist, and nothing else uses them meanwhile.
    #[inline(always)]
    pub unsafe fn scatter(&self, rows: &[u32; LANES], part: Part, values: &[Lanes; 4]) {
        #[cfg(target_arch = "x86_64")]
        for half in [0, 4] {
            use std::arch::x86_64::{_MM_TRANSPOSE4_PS, _mm_loadu_ps, _mm_store_ps};
            // SAFETY: as for `gather`.
            unsafe {
                let mut a = _mm_loadu_ps(values[0].0.as_ptr().add(half));
                let mut b = _mm_loadu_ps(values[1].0.as_ptr().add(half));
                let mut c = _mm_loadu_ps(values[2].0.as_ptr().add(half));
                let mut d = _mm_loadu_ps(values[3].0.as_ptr().add(half));
                _MM_TRANSPOSE4_PS(&mut a, &mut b, &mut c, &mut d);
                _mm_store_ps(self.part(rows[half], part), a);
                _mm_store_ps(self.part(rows[half + 1], part), b);
                _mm_store_ps(self.part(rows[half + 2], part), c);
                _mm_store_ps(self.part(rows[half + 3], part), d);
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        for lane in 0..LANES {
            for (component, values) in values.iter().enumerate() {
                // SAFETY: as above.
                unsafe { *self.part(rows[lane], part).add(component) = values.0[lane] };
            }
        }
    }
}

/// a + b.
#[inline(always)]
pub fn add<T: Add<Output = T>>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [a + x, b + y, c + z]
}

/// a - b.
#[inline(always)]
pub fn sub<T: Sub<Output = T>>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [T; 3] {
    [a - x, b - y, c - z]
}

/// s a.
#[inline(always)]
pub fn scaled<T: Copy + Mul<Output = T>>([a, b, c]: [T; 3], s: T) -> [T; 3] {
    [a * s, b * s, c * s]
}

/// a . b.
#[inline(always)]
pub fn dot<T: Add<Output = T> + Mul<Output = T>>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> T {
    a * x + b * y + c * z
}

/// |a|.
#[inline(always)]
pub fn norm(a: V) -> f32 {
    dot(a, a).sqrt()
}
