//! Vectors as arrays of `f64`, `f32` or eight-lane `f32`; always inlined, so that the kernels of each instruction set get their own copy.

use std::ops::{Add, Mul, Sub};

use super::lattice::Fixed;

/// a - b.
#[inline(always)]
pub fn sub<T: Copy + Sub<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Dot product.
#[inline(always)]
pub fn dot<T: Copy + Add<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[inline(always)]
pub fn cross<T: Copy + Sub<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Distance between two points.
#[inline(always)]
pub fn gap(p: [f32; 3], q: [f32; 3]) -> f32 {
    let d = sub(p, q);
    dot(d, d).sqrt()
}

/// The exact difference of two fixed-point positions.
#[inline(always)]
pub fn difference(a: Fixed, b: Fixed) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(a[axis] - b[axis]))
}
