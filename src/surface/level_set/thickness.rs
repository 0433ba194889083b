//! How thick the liquid is around a node, so that sheets and threads thinner than the particle spacing keep their volume.
//!
//! Solenthaler et al. (2007) put the surface one spacing r from the particles' mean. That is right at the surface of a large body, where
//! the mean lies r deep. The mean of a sheet lies in its middle, so that its surface would be r from there however thin the sheet is. So
//! half of the thickness replaces r where it is less than r.
//!
//! The thickness follows from the particles' mass, r^3 each, and from their spread: in a sheet of thickness w the sum of q^2
//! (q = 1 - d^2 / R^2) is w pi R^2 Q^3 / 3 / r^3, Q being q at the sheet's middle, and the variance along the sheet is R^2 Q / 8. Where
//! particles spread less, at rims, in ribbons and threads, they fill less of the sheet's area, and the sheet is thicker by the same factor.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::SUPPORT;

/// Minimum distance of a surface from a sheet's middle (cells). Nodes inside a sheet must be neighbours along edges of the grid, or
/// marching cubes break it up: whatever its orientation, its sides must be at least the diagonal of a cell's face apart.
const MIN_DISTANCE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Sums over the particles around a node, weighted by q^2; lengths are in cells.
#[derive(Debug)]
pub struct Spread {
    /// Sum of weights.
    pub weight: f64,
    /// Variances and covariances of positions (cells^2).
    pub covariance: Matrix3<f64>,
}

impl Spread {
    /// How far from the mean the surface lies, and how far the node is from the mean; `mean` is the displacement from the node to the mean,
    /// `spacing` is r (all in cells). In a sheet the component of the displacement across it counts in full, and the component along it
    /// less: the rim is where the latter is r.
    pub fn offset(&self, mean: Vector3<f64>, spacing: f64) -> (f64, f64) {
        let thick = (spacing, mean.norm());
        // The node is more than a cell from where a surface can be, or there is no sheet.
        if mean.norm() > spacing + 1.0 || self.is_thick(mean, spacing) {
            return thick;
        }
        let SymmetricEigen { eigenvalues: variances, eigenvectors: axes } = self.covariance.symmetric_eigen();
        let thinnest = variances.imin();
        let [a, b] = [1, 2].map(|next| variances[(thinnest + next) % 3]);
        let thickness = self.thickness(mean, spacing, a, b);
        let halves = variances.map(|variance| {
            let width = thickness.max((12.0 * variance.max(0.0)).sqrt());
            (0.5 * width).max(MIN_DISTANCE).min(spacing)
        });
        let half = halves[thinnest];
        if half >= spacing {
            return thick;
        }
        let mean = axes.transpose() * mean;
        let (mut across, mut along) = (0.0, 0.0);
        for axis in 0..3 {
            let square = (mean[axis] / halves[axis]).powi(2);
            let is_along = (halves[axis] - half) / (spacing - half);
            across += (1.0 - is_along) * square;
            along += is_along * square;
        }
        // The thinner the sheet, the blunter its rim. With squares of both components the cross-section would be an ellipse, whose centre
        // moves about where particles are few.
        (half, half * (across + libm::pow(along, spacing / half)).sqrt())
    }

    /// Whether the liquid is clearly thicker than twice the spacing.
    fn is_thick(&self, mean: Vector3<f64>, spacing: f64) -> bool {
        let trace = self.covariance.trace();
        // The smallest variance is the determinant over the product of the others, which is at most (trace / 2)^2. It is NaN for a single
        // particle.
        let smallest = 4.0 * self.covariance.determinant() / (trace * trace);
        12.0 * smallest >= 4.0 * spacing * spacing
            || self.thickness(mean, spacing, 0.5 * trace, 0.5 * trace) >= 2.0 * spacing
    }

    /// The thickness of a sheet (cells) along which the variances are `a` and `b` (cells^2).
    fn thickness(&self, mean: Vector3<f64>, spacing: f64, a: f64, b: f64) -> f64 {
        let square = (SUPPORT * spacing).powi(2);
        let q = 1.0 - mean.norm_squared() / square;
        // At least the variance of one particle's cube.
        let min_variance = spacing * spacing / 12.0;
        let filled = (a.max(min_variance) * b.max(min_variance)).sqrt() / (square * q / 8.0);
        let area = std::f64::consts::PI * square * q.powi(3) / 3.0;
        self.weight * spacing.powi(3) / (area * filled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spread of particles at these displacements from a node, each of volume 1, and the displacement to their mean.
    fn seen(positions: impl Iterator<Item = Vector3<f64>>) -> (Spread, Vector3<f64>) {
        let (mut weight, mut heavy) = (0.0, 0.0);
        let (mut mean, mut middle, mut square) = (Vector3::zeros(), Vector3::zeros(), Matrix3::zeros());
        for d in positions {
            let q = (1.0 - d.norm_squared() / (SUPPORT * SUPPORT)).max(0.0);
            weight += q * q;
            heavy += q * q * q;
            middle += d * q * q;
            mean += d * q * q * q;
            square += d * d.transpose() * (q * q);
        }
        let middle = middle / weight;
        (Spread { weight, covariance: square / weight - middle * middle.transpose() }, mean / heavy)
    }

    /// The result of [`seen`], with lengths in half spacings.
    fn in_half_spacings((spread, mean): (Spread, Vector3<f64>)) -> (Spread, Vector3<f64>) {
        (Spread { weight: spread.weight, covariance: spread.covariance * 4.0 }, mean * 2.0)
    }

    /// Half of the thickness that a node at a distance `height` from the middle of a sheet of this many layers finds, divided by the true
    /// value.
    fn found(thick: f64, layers: i32, height: f64) -> f64 {
        // Stretched until each particle has a volume of 1.
        let apart = (f64::from(layers) / thick).sqrt();
        let layer = move |n: i32| ((f64::from(n) + 0.5) / f64::from(layers) - 0.5) * thick - height;
        let at = move |n: i32, shift: f64| (f64::from(n) + 0.31) * apart + shift;
        let on = || -8..8;
        let positions = (0..layers).flat_map(|y| {
            on().flat_map(move |x| {
                on().map(move |z| {
                    Vector3::new(at(x, 0.4 * f64::from(y)), layer(y), at(z, 0.7 * f64::from(y)))
                })
            })
        });
        let (spread, mean) = in_half_spacings(seen(positions));
        let (offset, _) = spread.offset(mean, 2.0);
        // In cells of half a spacing.
        offset / f64::max(thick, MIN_DISTANCE)
    }

    #[test]
    fn a_sheet_of_any_thickness_is_as_thick_as_its_mass() {
        for thick in [0.5, 0.8, 1.0, 1.3, 1.7] {
            for height in [0.0, 0.2, 0.5, 1.0] {
                // Particles of one layer have no spread across it: their thickness follows from their mass alone.
                for layers in [1, 2, 8] {
                    let ratio = found(thick, layers, height);
                    assert!((ratio - 1.0).abs() < 0.06, "{thick} in {layers} layers at {height}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn a_body_has_the_surface_that_it_would_have_had() {
        for height in [0.0, 0.2, 0.4, 0.6] {
            let on = |from: i32, to: i32| (from..to).map(|n| f64::from(n) + 0.37);
            let positions = on(-6, 6).flat_map(|x| {
                on(-6, 0).flat_map(move |y| on(-6, 6).map(move |z| Vector3::new(x, y + 0.13 - height, z)))
            });
            let (spread, mean) = seen(positions);
            assert_eq!(spread.offset(mean, 1.0), (1.0, mean.norm()), "{height}");
        }
    }
}
