//! The implicit function of Solenthaler, Schläfli and Pajarola (2007; thesis 2.3.1) at single nodes: phi(x) = |x - a(x)| - r f, where a is
//! the weighted mean of the positions of the particles around x and r their spacing. f is 1, and less where the mean moves too fast with x:
//! between particles far apart, where there is no liquid. Where liquid is thinner than 2 r, r f is at most half of its thickness
//! (`level_set/thickness.rs`).

use nalgebra::{Matrix3, Vector3};

use super::SUPPORT;
use super::thickness::Spread;
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::{LANES, Lanes};

/// Rates at which the mean moves with the position: up to the first f is 1, from the second on f is 0 and nothing is inside (Solenthaler et
/// al., 2007).
const RATES: [f64; 2] = [0.4, 3.5];

/// Particles around some nodes, in cells from a common corner.
#[derive(Debug, Default)]
pub struct Near {
    pub positions: Vec<[f32; 3]>,
}

/// Sums over the particles around eight nodes, d being the displacement from a node to a particle and q = 1 - (d / R)^2:
/// q^3, q^3 d, q^2 d, and the six products of q^2 d d.
#[derive(Clone, Copy)]
struct Sums {
    weight: Lanes,
    mean: [Lanes; 3],
    slope: [Lanes; 3],
    square: [Lanes; 6],
}

/// Axes of the six different products of two components.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

fn sums(positions: &[[f32; 3]], nodes: &[[f32; LANES]; 3], inverse: f32) -> Sums {
    // Eight lanes fill 256 bits: with AVX-512 the compiler joins halves, which takes a fifth longer.
    dispatch!(at most avx2: sums_body(positions: &[[f32; 3]], nodes: &[[f32; LANES]; 3], inverse: f32) -> Sums)
}

#[inline(always)]
fn sums_body(positions: &[[f32; 3]], nodes: &[[f32; LANES]; 3], inverse: f32) -> Sums {
    let zero = Lanes::all(0.0);
    let (one, inverse) = (Lanes::all(1.0), Lanes::all(inverse));
    let nodes = [Lanes(nodes[0]), Lanes(nodes[1]), Lanes(nodes[2])];
    let mut out = Sums { weight: zero, mean: [zero; 3], slope: [zero; 3], square: [zero; 6] };
    for position in positions {
        let d = [
            Lanes::all(position[0]) - nodes[0],
            Lanes::all(position[1]) - nodes[1],
            Lanes::all(position[2]) - nodes[2],
        ];
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let q = (one - square * inverse).max(zero);
        let q2 = q * q;
        let q3 = q2 * q;
        out.weight = out.weight + q3;
        let t = [q2 * d[0], q2 * d[1], q2 * d[2]];
        for axis in 0..3 {
            out.mean[axis] = out.mean[axis] + q3 * d[axis];
            out.slope[axis] = out.slope[axis] + t[axis];
        }
        for (sum, [a, b]) in out.square.iter_mut().zip(PAIRS) {
            *sum = *sum + t[a] * d[b];
        }
    }
    out
}

/// The function at eight nodes, in cells; `spacing` is r in cells. If no particle is near, it is [`SUPPORT`] spacings.
pub fn values(near: &Near, nodes: &[[f32; LANES]; 3], spacing: f32) -> [f32; LANES] {
    let radius = SUPPORT as f32 * spacing;
    let sums = sums(&near.positions, nodes, 1.0 / (radius * radius));
    std::array::from_fn(|lane| value(&sums, lane, f64::from(spacing)) as f32)
}

fn value(sums: &Sums, lane: usize, spacing: f64) -> f64 {
    let radius = SUPPORT * spacing;
    let of = |lanes: &Lanes| f64::from(lanes.0[lane]);
    let weight = of(&sums.weight);
    if weight <= 0.0 {
        return radius;
    }
    // The displacement to the mean, and the derivative of the mean's position. The weight's derivative is 6 q^2 d / R^2.
    let mean = sums.mean.each_ref().map(|sum| of(sum) / weight);
    let slope = sums.slope.each_ref().map(of);
    let scale = 6.0 / (radius * radius * weight);
    let mut rate = Matrix3::zeros();
    for (sum, [a, b]) in sums.square.iter().zip(PAIRS) {
        // Its symmetric part: a rotation of the mean with the position is no spreading.
        let entry = scale * (of(sum) - 0.5 * (mean[a] * slope[b] + mean[b] * slope[a]));
        (rate[(a, b)], rate[(b, a)]) = (entry, entry);
    }
    let (offset, away) = spread(sums, lane, radius).offset(mean.into(), spacing);
    away - offset.min(spacing * damping(&rate))
}

/// The spread of the particles around a node.
fn spread(sums: &Sums, lane: usize, radius: f64) -> Spread {
    let of = |lanes: &Lanes| f64::from(lanes.0[lane]);
    let mut square = Matrix3::zeros();
    for (sum, [a, b]) in sums.square.iter().zip(PAIRS) {
        (square[(a, b)], square[(b, a)]) = (of(sum), of(sum));
    }
    // q^3 is q^2 minus q^2 d^2 / R^2.
    let weight = of(&sums.weight) + square.trace() / (radius * radius);
    let mean = Vector3::from(sums.slope.each_ref().map(of)) / weight;
    Spread { weight, covariance: square / weight - mean * mean.transpose() }
}

/// The factor f, given the derivative of the mean.
fn damping(rate: &Matrix3<f64>) -> f64 {
    let [low, high] = RATES;
    // This norm bounds all eigenvalues.
    if rate.norm_squared() < low * low {
        return 1.0;
    }
    let max_rate = max_eigenvalue(rate);
    if max_rate < low {
        return 1.0;
    }
    let g = ((high - max_rate) / (high - low)).clamp(0.0, 1.0);
    g * (3.0 + g * (g - 3.0))
}

/// Largest eigenvalue of a symmetric matrix, in closed form (Smith 1961).
fn max_eigenvalue(m: &Matrix3<f64>) -> f64 {
    let mean = m.trace() / 3.0;
    let rest = m - Matrix3::from_diagonal_element(mean);
    let size = (rest.norm_squared() / 6.0).sqrt();
    if size <= 0.0 {
        return mean;
    }
    let cosine = ((rest / size).determinant() / 2.0).clamp(-1.0, 1.0);
    mean + 2.0 * size * libm::cos(libm::acos(cosine) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_eigenvalue_is_that_of_a_general_solver() {
        for seed in 0..50u32 {
            let entry = |n: u32| f64::from((seed * 7919 + n * 104_729) % 1000) / 500.0 - 1.0;
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(entry);
            let m = Matrix3::new(a, b, c, b, d, e, c, e, f);
            let expected = m.symmetric_eigenvalues().max();
            assert!((max_eigenvalue(&m) - expected).abs() < 1e-9);
        }
        assert_eq!(max_eigenvalue(&Matrix3::identity()), 1.0);
    }

    #[test]
    fn a_single_particle_is_a_sphere_of_about_its_volume() {
        let near = Near { positions: vec![[0.5, 0.25, 0.0]] };
        let mut nodes = [[0.0; LANES]; 3];
        nodes[0] = [0.5, 1.0, 1.6, 2.1, 2.5, 8.0, 9.0, 20.0];
        nodes[1] = [0.25; LANES];
        let phi = values(&near, &nodes, 2.0);
        assert!((0..4).all(|at| phi[at] < phi[at + 1]), "{phi:?}");
        // A ball of 8 cells^3 has a radius of 1.24.
        assert!(phi[2] < 0.0 && phi[3] > 0.0, "{phi:?}");
        assert_eq!(phi[7], 8.0);
    }
}
