//! Exact orientation of points with 32-bit coordinates: signs of determinants, never decided by rounding.
//!
//! After J. R. Shewchuk, *Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates* (Discrete & Computational
//! Geometry 18, 1997): 64-bit arithmetic decides where the determinant exceeds its error bound (bounds A of sections 4.2 and 4.3); else its
//! terms are summed without error as an expansion (theorem 10). Products of two coordinates have 48 bits and those of three 72, within the
//! range of exponents: nothing overflows or underflows.

use crate::geometry::{DVec3, Vec3};

/// Largest relative error of one rounded operation.
const EPSILON: f64 = f64::EPSILON / 2.0;
const BOUND_2D: f64 = (3.0 + 16.0 * EPSILON) * EPSILON;
const BOUND_3D: f64 = (7.0 + 56.0 * EPSILON) * EPSILON;

/// 1 when a, b, c turn counter-clockwise, -1 when clockwise, 0 when they lie on one line: exact for all finite coordinates.
pub fn orient2d(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> i32 {
    let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    decided(left - right, BOUND_2D * (left.abs() + right.abs())).unwrap_or_else(|| exact_2d(a, b, c))
}

/// The sign of (b - a) x (c - a) . (d - a): 1 if d lies on the side of triangle abc from which its corners appear counter-clockwise, -1 on
/// the other, 0 in its plane: exact for all finite coordinates.
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i32 {
    let [a, b, c, d] = [a, b, c, d].map(|p| p.cast::<f64>());
    let (u, v, w) = (b - a, c - a, d - a);
    let minors = [(u.z, v.x * w.y, w.x * v.y), (v.z, w.x * u.y, u.x * w.y), (w.z, u.x * v.y, v.x * u.y)];
    let value: f64 = minors.iter().map(|(z, p, q)| z * (p - q)).sum();
    let size: f64 = minors.iter().map(|(z, p, q)| z.abs() * (p.abs() + q.abs())).sum();
    decided(value, BOUND_3D * size).unwrap_or_else(|| exact_3d(a, b, c, d))
}

/// Whether a triangle has no area: its corners lie on one line, exactly.
pub fn is_flat(corners: &[Vec3; 3]) -> bool {
    let along = |x: usize, y: usize| {
        let [a, b, c] = corners.map(|p| [p[x], p[y]]);
        orient2d(a, b, c) == 0
    };
    along(0, 1) && along(1, 2) && along(2, 0)
}

/// The sign of a value with an error of at most `bound`, if that decides it. A bound of 0 means that all terms vanish.
fn decided(value: f64, bound: f64) -> Option<i32> {
    (value.abs() > bound || bound == 0.0).then(|| sign(value))
}

fn sign(value: f64) -> i32 {
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

#[cold]
fn exact_2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i32 {
    let cross = |[p, q]: [[f64; 2]; 2]| [p[0] * q[1], -(p[1] * q[0])];
    sign_of_sum([[a, b], [b, c], [c, a]].into_iter().flat_map(cross))
}

#[cold]
fn exact_3d(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i32 {
    // The determinant of the differences, multiplied out.
    let minors = [[b, c, d], [a, d, c], [a, b, d], [a, c, b]];
    sign_of_sum(minors.into_iter().flat_map(triple_product))
}

/// Twelve numbers that sum to p . (q x r), each exact.
fn triple_product([p, q, r]: [DVec3; 3]) -> impl Iterator<Item = f64> {
    (0..3).flat_map(move |x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        let ([a, b], [c, d]) = (halves(q[y] * r[z]), halves(-(q[z] * r[y])));
        [p[x] * a, p[x] * b, p[x] * c, p[x] * d]
    })
}

/// Two numbers of at most 27 bits with this sum: each can be multiplied by a 24-bit number without rounding.
fn halves(value: f64) -> [f64; 2] {
    let high = f64::from_bits(value.to_bits() & (u64::MAX << 27));
    [high, value - high]
}

/// The sign of an exact sum.
fn sign_of_sum(terms: impl Iterator<Item = f64>) -> i32 {
    // An expansion: components that do not overlap, ascending, so that the last has the sign of the sum.
    let mut parts: Vec<f64> = Vec::with_capacity(48);
    for term in terms {
        let mut carried = term;
        parts.retain_mut(|part| {
            let sum = carried + *part;
            let gained = sum - carried;
            let lost = (carried - (sum - gained)) + (*part - gained);
            carried = sum;
            *part = lost;
            lost != 0.0
        });
        if carried != 0.0 {
            parts.push(carried);
        }
    }
    parts.last().map_or(0, |&part| sign(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integers from -range to range.
    fn random(range: i64) -> impl FnMut() -> i64 {
        let mut state = 7u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as i64 % (2 * range + 1) - range
        }
    }

    fn by_integers([a, b, c, d]: [[i64; 3]; 4]) -> i32 {
        let from_a = |p: [i64; 3]| [0, 1, 2].map(|axis| i128::from(p[axis] - a[axis]));
        let [u, v, w] = [b, c, d].map(from_a);
        let minor = |y: usize, z: usize| v[y] * w[z] - v[z] * w[y];
        (u[0] * minor(1, 2) + u[1] * minor(2, 0) + u[2] * minor(0, 1)).signum() as i32
    }

    fn by_floats(points: [[i64; 3]; 4]) -> [i32; 2] {
        let [a, b, c, d] = points.map(|p| Vec3::from(p.map(|x| x as f32)));
        let exact = points.map(|p| DVec3::from(p.map(|x| x as f64)));
        [orient3d(a, b, c, d), exact_3d(exact[0], exact[1], exact[2], exact[3])]
    }

    #[test]
    fn signs_are_those_of_integers() {
        let (mut far, mut near) = (random(1 << 20), random(500));
        for _ in 0..2_000 {
            let mut point = || [far(), far(), far()];
            let points = [point(), point(), point(), point()];
            assert_eq!(by_floats(points), [by_integers(points); 2], "{points:?}");
        }
        for round in 0..2_000 {
            let mut point = || [near(), near(), near()];
            let [a, b, c] = [point(), point(), point()];
            // In the plane of the others, and off it by less than rounding resolves for larger numbers.
            let (s, t) = (round % 7 - 3, round % 5 - 2);
            let mut d = [0, 1, 2].map(|x| a[x] + s * (b[x] - a[x]) + t * (c[x] - a[x]));
            assert_eq!(by_floats([a, b, c, d]), [0; 2], "{a:?} {b:?} {c:?} {d:?}");
            d[round as usize % 3] += 1;
            assert_eq!(by_floats([a, b, c, d]), [by_integers([a, b, c, d]); 2], "{a:?} {b:?} {c:?} {d:?}");
        }
    }

    #[test]
    fn one_step_of_a_coordinate_leaves_a_plane_on_its_side() {
        let [a, b, c] = [Vec3::x(), Vec3::y(), Vec3::z()];
        let beside = |z: f32| orient3d(a, b, c, Vec3::new(0.25, 0.25, z));
        assert_eq!([beside(0.5f32.next_down()), beside(0.5), beside(0.5f32.next_up())], [-1, 0, 1]);
        let left = |y: f32| orient2d([0.0, 0.0], [3.0, 3.0], [0.1, y]);
        assert_eq!([left(0.1f32.next_down()), left(0.1), left(0.1f32.next_up())], [-1, 0, 1]);
    }

    #[test]
    fn coordinates_of_very_different_sizes_are_no_obstacle() {
        // Differences from 1 are lost in 64 bits.
        let far = (1u64 << 60) as f32;
        let left = |y: f32| orient2d([-far, -far], [far, far], [1.0, y]);
        assert_eq!([left(1f32.next_down()), left(1.0), left(1f32.next_up())], [-1, 0, 1]);
        let [a, b, c] = [Vec3::new(far, far, 0.0), Vec3::new(far, far, 1.0), Vec3::new(-far, -far, 0.0)];
        let beside = |y: f32| orient3d(a, b, c, Vec3::new(1.0, y, 0.0));
        assert_eq!([beside(1f32.next_down()), beside(1.0), beside(1f32.next_up())], [1, 0, -1]);
        // The smallest and the largest numbers.
        let (least, greatest) = (f32::from_bits(1), f32::MAX);
        let [a, b, c] = [Vec3::zeros(), Vec3::new(greatest, 0.0, greatest), Vec3::new(0.0, greatest, 0.0)];
        let beside = |z: f32| orient3d(a, b, c, Vec3::new(least, greatest, z));
        assert_eq!([beside(0.0), beside(least), beside(2.0 * least)], [-1, 0, 1]);
        assert!(is_flat(&[a, b, b]) && !is_flat(&[a, b, Vec3::new(greatest, least, greatest)]));
    }
}
