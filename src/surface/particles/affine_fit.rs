//! Weighted least-squares fit of an affine map to the displacements of the particles around a position.

use nalgebra::{Matrix3, Vector3};

use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::{LANES, Lanes};

/// Fraction of the total variance of positions: in directions with less variance the map is constant.
const FLAT: f64 = 0.004;

/// Positions of particles relative to a common corner, and their displacements (spacings), padded to whole lanes.
#[derive(Default)]
pub struct Near {
    position: [Vec<[f32; LANES]>; 3],
    displacement: [Vec<[f32; LANES]>; 3],
    count: usize,
}

impl Near {
    pub fn clear(&mut self) {
        self.position.iter_mut().chain(&mut self.displacement).for_each(Vec::clear);
        self.count = 0;
    }

    #[inline(always)]
    pub fn push(&mut self, position: [f32; 3], displacement: [f32; 3]) {
        let lane = self.count % LANES;
        if lane == 0 {
            // Padding lies too far away to count.
            self.position.iter_mut().for_each(|lanes| lanes.push([1.0e6; LANES]));
            self.displacement.iter_mut().for_each(|lanes| lanes.push([0.0; LANES]));
        }
        let last = self.count / LANES;
        for axis in 0..3 {
            self.position[axis][last][lane] = position[axis];
            self.displacement[axis][last][lane] = displacement[axis];
        }
        self.count += 1;
    }
}

/// Weighted sums over the particles around a position, d being the vector to a particle and u its displacement: 1, d, d d, u, and u d.
pub struct Sums {
    weight: f64,
    d: Vector3<f64>,
    dd: Matrix3<f64>,
    u: Vector3<f64>,
    ud: Matrix3<f64>,
}

/// Sums over the particles within a radius (spacings) of a position, with the weights (1 - (d / radius)^2)^3 (poly6: Müller, Charypar and
/// Gross 2003); none if there are no particles. `in_radius` is scratch: it receives these particles, relative to the position.
pub fn sums(near: &Near, in_radius: &mut Near, at: [f32; 3], radius: f32) -> Option<Sums> {
    dispatch!(sums_body(near: &Near, in_radius: &mut Near, at: [f32; 3], radius: f32) -> Option<Sums>)
}

#[inline(always)]
fn sums_body(near: &Near, in_radius: &mut Near, at: [f32; 3], radius: f32) -> Option<Sums> {
    let zero = Lanes::all(0.0);
    let centre = [Lanes::all(at[0]), Lanes::all(at[1]), Lanes::all(at[2])];
    let max_square = Lanes::all(radius * radius);
    in_radius.clear();
    for chunk in 0..near.position[0].len() {
        let d = [
            Lanes(near.position[0][chunk]) - centre[0],
            Lanes(near.position[1][chunk]) - centre[1],
            Lanes(near.position[2][chunk]) - centre[2],
        ];
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let mut bits = square.is_less(max_square).bits();
        if bits == 0 {
            continue;
        }
        let displacement =
            [near.displacement[0][chunk], near.displacement[1][chunk], near.displacement[2][chunk]];
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & (LANES - 1);
            bits &= bits - 1;
            in_radius.push(
                [d[0].0[lane], d[1].0[lane], d[2].0[lane]],
                [displacement[0][lane], displacement[1][lane], displacement[2][lane]],
            );
        }
    }
    let (one, inverse) = (Lanes::all(1.0), Lanes::all(1.0 / (radius * radius)));
    let mut all = zero;
    let (mut sum_d, mut sum_u) = ([zero; 3], [zero; 3]);
    let (mut sum_dd, mut sum_ud) = ([[zero; 3]; 3], [[zero; 3]; 3]);
    for chunk in 0..in_radius.position[0].len() {
        let d = [
            Lanes(in_radius.position[0][chunk]),
            Lanes(in_radius.position[1][chunk]),
            Lanes(in_radius.position[2][chunk]),
        ];
        let u = [
            Lanes(in_radius.displacement[0][chunk]),
            Lanes(in_radius.displacement[1][chunk]),
            Lanes(in_radius.displacement[2][chunk]),
        ];
        let q = (one - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * inverse).max(zero);
        let weight = q * q * q;
        all = all + weight;
        for a in 0..3 {
            let (wd, wu) = (weight * d[a], weight * u[a]);
            sum_d[a] = sum_d[a] + wd;
            sum_u[a] = sum_u[a] + wu;
            for b in 0..3 {
                sum_ud[a][b] = sum_ud[a][b] + wu * d[b];
                if b >= a {
                    sum_dd[a][b] = sum_dd[a][b] + wd * d[b];
                }
            }
        }
    }
    let total = |lanes: Lanes| lanes.0.iter().map(|value| f64::from(*value)).sum::<f64>();
    let weight = total(all);
    (weight > 0.0).then(|| Sums {
        weight,
        d: Vector3::from(sum_d.map(total)),
        dd: Matrix3::from_fn(|a, b| total(sum_dd[a.min(b)][a.max(b)])),
        u: Vector3::from(sum_u.map(total)),
        ud: Matrix3::from_fn(|a, b| total(sum_ud[a][b])),
    })
}

/// An affine map from positions relative to where it was fitted (spacings) to displacements (spacings).
#[derive(Debug, Clone, Copy)]
pub struct AffineMap {
    /// Sum of the weights of the particles that it was fitted to.
    pub weight: f64,
    /// The displacement at the fitted position itself.
    displacement: Vector3<f64>,
    /// Gradient of the displacement.
    gradient: Matrix3<f64>,
}

impl AffineMap {
    /// The displacement at a position relative to where the map was fitted.
    pub fn at(&self, position: Vector3<f64>) -> Vector3<f64> {
        self.displacement + self.gradient * position
    }
}

impl Sums {
    /// The mean displacement.
    pub fn mean(&self) -> Vector3<f64> {
        self.u / self.weight
    }

    /// The best-fitting affine map.
    pub fn map(&self) -> AffineMap {
        let (d, u) = (self.d / self.weight, self.u / self.weight);
        let spread = self.dd / self.weight - d * d.transpose();
        let joint = self.ud / self.weight - u * d.transpose();
        // The map is u + joint spread^-1 (x - d). The damped inverse makes it constant in directions with little spread.
        let min_spread = FLAT * spread.trace();
        let damped = spread * spread + Matrix3::from_diagonal_element(min_spread * min_spread);
        let gradient = damped.try_inverse().map_or_else(Matrix3::zeros, |inverse| joint * spread * inverse);
        AffineMap { weight: self.weight, displacement: u - gradient * d, gradient }
    }
}
