//! Vectors of eight numbers, as two halves of four: the width that every x86-64 processor has, and in which rows of four
//! numbers are loaded and stored. (Auto-vectorised loops over eight mixed halves, whole vectors and scalars, and kernels spent
//! most of their time combining them.)

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

use half::Half;

/// Count of lanes.
pub const LANES: usize = 8;

/// Eight numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Lanes(pub [f32; LANES]);

/// A mask: in each of eight lanes, all bits are set or none.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub struct LaneMask([f32; LANES]);

/// Loads both halves.
#[inline(always)]
fn load(numbers: &[f32; LANES]) -> [Half; 2] {
    let [a, b, c, d, e, f, g, h] = *numbers;
    [half::load([a, b, c, d]), half::load([e, f, g, h])]
}

/// Stores both halves.
#[inline(always)]
fn store(halves: [Half; 2]) -> [f32; LANES] {
    let ([a, b, c, d], [e, f, g, h]) = (half::store(halves[0]), half::store(halves[1]));
    [a, b, c, d, e, f, g, h]
}

/// Applies an operation to both halves of two vectors.
#[inline(always)]
fn each(a: &[f32; LANES], b: &[f32; LANES], operation: impl Fn(Half, Half) -> Half) -> [f32; LANES] {
    let ([a, c], [b, d]) = (load(a), load(b));
    store([operation(a, b), operation(c, d)])
}

impl Lanes {
    /// The same number eight times.
    #[inline(always)]
    pub fn all(value: f32) -> Self {
        Self(store([half::all(value); 2]))
    }

    /// The first and the second numbers of eight pairs.
    #[inline(always)]
    pub fn pairs(pairs: [&[f32; 2]; LANES]) -> [Self; 2] {
        let [a, b, c, d, e, f, g, h] = pairs;
        let ([x, y], [z, w]) = (half::pairs(a, b, c, d), half::pairs(e, f, g, h));
        [Self(store([x, z])), Self(store([y, w]))]
    }

    /// Moves the numbers up by a lane; the first lane gets `first`.
    #[inline(always)]
    pub fn shift_up(self, first: f32) -> Self {
        let [low, high] = load(&self.0);
        Self(store([half::shift_up(low, half::all(first)), half::shift_up(high, half::last(low))]))
    }

    /// Moves the numbers down by a lane; the last lane gets `last`.
    #[inline(always)]
    pub fn shift_down(self, last: f32) -> Self {
        let [low, high] = load(&self.0);
        Self(store([half::shift_down(low, high), half::shift_down(high, half::all(last))]))
    }

    /// The smaller number in each lane.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(each(&self.0, &other.0, half::min))
    }

    /// The larger number in each lane.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(each(&self.0, &other.0, half::max))
    }

    /// The lanes where this is less than `other`.
    #[inline(always)]
    pub fn is_less(self, other: Self) -> LaneMask {
        LaneMask(each(&self.0, &other.0, half::is_less))
    }

    /// Square root of each lane.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(store(load(&self.0).map(half::sqrt)))
    }
}

impl LaneMask {
    /// `set` in lanes where the mask is set, `clear` elsewhere.
    #[inline(always)]
    pub fn choose(self, set: Lanes, clear: Lanes) -> Lanes {
        let (mask, set, clear) = (load(&self.0), load(&set.0), load(&clear.0));
        Lanes(store([half::choose(mask[0], set[0], clear[0]), half::choose(mask[1], set[1], clear[1])]))
    }

    /// As [`LaneMask::choose`], for integers.
    #[inline(always)]
    pub fn choose_number(self, set: u32, clear: [u32; LANES]) -> [u32; LANES] {
        self.choose(Lanes::all(f32::from_bits(set)), Lanes(clear.map(f32::from_bits))).0.map(f32::to_bits)
    }

    /// Bit i is set if lane i is.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        let [low, high] = load(&self.0);
        half::bits(low) | half::bits(high) << 4
    }
}

/// Declares operators that act lane by lane.
macro_rules! operators {
    ($($kind:ident: $operator:ident, $name:ident = $operation:ident;)+) => {$(
        impl $operator for $kind {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(each(&self.0, &other.0, half::$operation))
            }
        }
    )+};
}

operators! {
    LaneMask: BitAnd, bitand = and;
    LaneMask: BitOr, bitor = or;
    Lanes: Add, add = add;
    Lanes: Sub, sub = sub;
    Lanes: Mul, mul = mul;
    Lanes: Div, div = div;
}

/// Four numbers in an SSE register.
#[cfg(target_arch = "x86_64")]
mod half {
    use std::arch::x86_64::*;

    pub type Half = __m128;

    /// Declares operations of SSE2.
    macro_rules! operations {
        ($($name:ident($($operand:ident),+) = $operation:expr;)+) => {$(
            #[inline(always)]
            pub fn $name($($operand: Half),+) -> Half {
                // SAFETY: SSE2 is part of x86-64.
                #[allow(unused_unsafe)]
                unsafe { $operation }
            }
        )+};
    }

    operations! {
        add(a, b) = _mm_add_ps(a, b);
        sub(a, b) = _mm_sub_ps(a, b);
        mul(a, b) = _mm_mul_ps(a, b);
        div(a, b) = _mm_div_ps(a, b);
        min(a, b) = _mm_min_ps(a, b);
        max(a, b) = _mm_max_ps(a, b);
        sqrt(a) = _mm_sqrt_ps(a);
        is_less(a, b) = _mm_cmplt_ps(a, b);
        and(a, b) = _mm_and_ps(a, b);
        or(a, b) = _mm_or_ps(a, b);
        choose(mask, set, clear) = _mm_or_ps(_mm_and_ps(mask, set), _mm_andnot_ps(mask, clear));
        last(a) = _mm_shuffle_ps::<0b11_11_11_11>(a, a);
        shift_up(a, first) = _mm_move_ss(_mm_shuffle_ps::<0b10_01_00_00>(a, a), first);
        shift_down(a, next) = {
            let replaced = _mm_move_ss(a, next);
            _mm_shuffle_ps::<0b00_11_10_01>(replaced, replaced)
        };
    }

    #[inline(always)]
    pub fn all(value: f32) -> Half {
        // SAFETY: SSE2 is part of x86-64.
        #[allow(unused_unsafe)]
        unsafe {
            _mm_set1_ps(value)
        }
    }

    #[inline(always)]
    pub fn bits(mask: Half) -> u32 {
        // SAFETY: SSE2 is part of x86-64.
        #[allow(unused_unsafe)]
        unsafe {
            _mm_movemask_ps(mask) as u32
        }
    }

    /// The first and the second numbers of four pairs.
    #[inline(always)]
    pub fn pairs(a: &[f32; 2], b: &[f32; 2], c: &[f32; 2], d: &[f32; 2]) -> [Half; 2] {
        // SAFETY: it reads the two numbers of each pair, at any alignment; SSE2 is part of x86-64.
        unsafe {
            let low = _mm_loadh_pd(_mm_load_sd(a.as_ptr().cast()), b.as_ptr().cast());
            let high = _mm_loadh_pd(_mm_load_sd(c.as_ptr().cast()), d.as_ptr().cast());
            let (low, high) = (_mm_castpd_ps(low), _mm_castpd_ps(high));
            [_mm_shuffle_ps::<0b10_00_10_00>(low, high), _mm_shuffle_ps::<0b11_01_11_01>(low, high)]
        }
    }

    #[inline(always)]
    pub fn load(numbers: [f32; 4]) -> Half {
        // SAFETY: it reads the four numbers of the array, at any alignment.
        unsafe { _mm_loadu_ps(numbers.as_ptr()) }
    }

    #[inline(always)]
    pub fn store(half: Half) -> [f32; 4] {
        let mut out = [0.0; 4];
        // SAFETY: it writes the four numbers of the array, at any alignment.
        unsafe { _mm_storeu_ps(out.as_mut_ptr(), half) };
        out
    }
}

/// Four numbers.
#[cfg(not(target_arch = "x86_64"))]
mod half {
    pub type Half = [f32; 4];

    /// Declares lane-wise operations.
    macro_rules! operations {
        ($($name:ident($a:ident, $b:ident) = $operation:expr;)+) => {$(
            #[inline(always)]
            pub fn $name(a: Half, b: Half) -> Half {
                std::array::from_fn(|lane| {
                    let ($a, $b) = (a[lane], b[lane]);
                    $operation
                })
            }
        )+};
    }

    operations! {
        add(a, b) = a + b;
        sub(a, b) = a - b;
        mul(a, b) = a * b;
        div(a, b) = a / b;
        min(a, b) = if a < b { a } else { b };
        max(a, b) = if a > b { a } else { b };
        is_less(a, b) = f32::from_bits(if a < b { u32::MAX } else { 0 });
        and(a, b) = f32::from_bits(a.to_bits() & b.to_bits());
        or(a, b) = f32::from_bits(a.to_bits() | b.to_bits());
    }

    #[inline(always)]
    pub fn choose(mask: Half, set: Half, clear: Half) -> Half {
        std::array::from_fn(|lane| if mask[lane].to_bits() == 0 { clear[lane] } else { set[lane] })
    }

    #[inline(always)]
    pub fn last(a: Half) -> Half {
        [a[3]; 4]
    }

    #[inline(always)]
    pub fn shift_up(a: Half, first: Half) -> Half {
        [first[0], a[0], a[1], a[2]]
    }

    #[inline(always)]
    pub fn shift_down(a: Half, next: Half) -> Half {
        [a[1], a[2], a[3], next[0]]
    }

    #[inline(always)]
    pub fn sqrt(a: Half) -> Half {
        a.map(f32::sqrt)
    }

    #[inline(always)]
    pub fn all(value: f32) -> Half {
        [value; 4]
    }

    #[inline(always)]
    pub fn bits(mask: Half) -> u32 {
        (0..4).map(|lane| (mask[lane].to_bits() & 1) << lane).sum()
    }

    #[inline(always)]
    pub fn pairs(a: &[f32; 2], b: &[f32; 2], c: &[f32; 2], d: &[f32; 2]) -> [Half; 2] {
        [0, 1].map(|at| [a[at], b[at], c[at], d[at]])
    }

    #[inline(always)]
    pub fn load(numbers: [f32; 4]) -> Half {
        numbers
    }

    #[inline(always)]
    pub fn store(half: Half) -> [f32; 4] {
        half
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
        assert_eq!(a.shift_up(9.0).0, [9.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(a.shift_down(9.0).0, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 9.0]);
        let numbers: Vec<f32> = (0..16u8).map(f32::from).collect();
        let [first, second] =
            Lanes::pairs(std::array::from_fn(|lane| numbers[14 - lane..].first_chunk().unwrap()));
        assert_eq!(first, Lanes([14.0, 13.0, 12.0, 11.0, 10.0, 9.0, 8.0, 7.0]));
        assert_eq!(second, first + Lanes::all(1.0));
        assert_eq!((a / b * b + (b * b).sqrt()).0[6], 9.0);
        assert_eq!(a.is_less(b).choose_number(9, [1; LANES]), [9, 9, 9, 1, 1, 1, 1, 1]);
    }
}
