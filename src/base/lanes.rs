//! Eight numbers side by side. Each operation is a loop of its own over plain arrays: inside a kernel that
//! `cpu::dispatch` compiles, the compiler makes one vector instruction of it. (It did not of one long loop over lanes.)

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// How many.
pub const LANES: usize = 8;

/// Eight numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lanes(pub [f32; LANES]);

/// A mask: for each of eight numbers all bits set or none.
#[derive(Debug, Clone, Copy)]
pub struct LaneMask([u32; LANES]);

impl Lanes {
    /// The same number eight times.
    #[inline(always)]
    pub fn all(value: f32) -> Self {
        Self([value; LANES])
    }

    /// The lesser of each pair.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }

    /// The greater of each pair.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }

    /// Where this is less than the other.
    #[inline(always)]
    pub fn is_less(self, other: Self) -> LaneMask {
        let mut out = [0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            *out = if self.0[lane] < other.0[lane] { u32::MAX } else { 0 };
        }
        LaneMask(out)
    }

    /// The square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        let mut out = self.0;
        for out in &mut out {
            *out = out.sqrt();
        }
        Self(out)
    }

    #[inline(always)]
    fn each(self, other: Self, operation: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            *out = operation(self.0[lane], other.0[lane]);
        }
        Self(out)
    }
}

impl LaneMask {
    /// The first number where the mask is set, the second elsewhere.
    #[inline(always)]
    pub fn choose(self, set: Lanes, clear: Lanes) -> Lanes {
        let mut out = [0.0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            let (set, clear) = (set.0[lane].to_bits(), clear.0[lane].to_bits());
            *out = f32::from_bits(set & self.0[lane] | clear & !self.0[lane]);
        }
        Lanes(out)
    }

    /// As [`LaneMask::choose`], of whole numbers.
    #[inline(always)]
    pub fn choose_number(self, set: u32, clear: [u32; LANES]) -> [u32; LANES] {
        let mut out = [0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            *out = set & self.0[lane] | clear[lane] & !self.0[lane];
        }
        out
    }
}

impl LaneMask {
    /// Bit i says whether lane i is set.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{_mm_loadu_ps, _mm_movemask_ps};
            let first = self.0.as_ptr().cast::<f32>();
            // SAFETY: both halves lie within the array; SSE2 is part of x86-64.
            unsafe {
                let (low, high) = (_mm_loadu_ps(first), _mm_loadu_ps(first.add(4)));
                (_mm_movemask_ps(low) | _mm_movemask_ps(high) << 4) as u32
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        self.0.iter().enumerate().map(|(lane, mask)| (mask & 1) << lane).sum()
    }

    #[inline(always)]
    fn each(self, other: Self, operation: impl Fn(u32, u32) -> u32) -> Self {
        let mut out = [0; LANES];
        for (lane, out) in out.iter_mut().enumerate() {
            *out = operation(self.0[lane], other.0[lane]);
        }
        Self(out)
    }
}

impl BitAnd for LaneMask {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        self.each(other, |a, b| a & b)
    }
}

impl BitOr for LaneMask {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.each(other, |a, b| a | b)
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
}

impl Div for Lanes {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.each(other, |a, b| a / b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_are_lane_by_lane() {
        let (a, b) = (Lanes([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]), Lanes::all(3.0));
        assert_eq!((a + b - b) * a, Lanes([0.0, 1.0, 4.0, 9.0, 16.0, 25.0, 36.0, 49.0]));
        assert_eq!(a.min(b), Lanes([0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0]));
        assert_eq!(a.is_less(b).choose(b, a), a.max(b));
        assert_eq!(a.is_less(b).bits(), 0b111);
        assert_eq!((a.is_less(b) & Lanes::all(0.0).is_less(a)).bits(), 0b110);
        assert_eq!((a.is_less(b) | b.is_less(a)).bits(), 0b1111_0111);
        assert_eq!((a / b * b + (b * b).sqrt()).0[6], 9.0);
        assert_eq!(a.is_less(b).choose_number(9, [1; LANES]), [9, 9, 9, 1, 1, 1, 1, 1]);
    }
}
