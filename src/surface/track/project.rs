//! Projection that keeps detail (thesis 2.3.2): a vertex is moved to the surface, then along the same line to its kept distance.
//!
//! The thesis' formulas are interpreted as follows: phi and its gradient are those at the current x*, and delta has the sign of phi, which
//! the last formula needs on the inside.

use crate::geometry::DVec3;
use crate::surface::level_set::sampler::Sampler;

/// Fractions of the distance to phi = 0 covered by a step, each with its number of steps: a large one for as many steps as are usually
/// needed, then the thesis' own (2.3.2), which converges where splines bend.
const STEPS: [(f64, usize); 2] = [(0.8, 6), (0.35, 64)];
/// Distance from phi = 0 at which a vertex has converged (cells; thesis 2.3.2).
const ARRIVED: f32 = 0.005;
/// A vertex nearer to its foot than this (cells) is moved along the gradient there: the line between them has no reliable direction.
const TINY: f64 = 0.1;

/// Where a vertex projects onto the surface.
#[derive(Debug, Clone, Copy)]
pub struct Foot {
    /// The position on phi = 0 (cells).
    pub position: DVec3,
    /// Unit vector along the line through the foot and the vertex, pointing outward.
    pub outward: DVec3,
    /// Distance of the vertex (cells), negative inside.
    pub distance: f64,
}

/// The foot of a vertex at a position (cells); none if the steps do not converge.
pub fn foot(sampler: &mut Sampler<'_>, position: DVec3) -> Option<Foot> {
    let mut at = position;
    let (first, mut slope) = sampler.at(at)?;
    let mut phi = first;
    let shares = STEPS.into_iter().flat_map(|(share, count)| std::iter::repeat_n(share, count));
    for share in shares {
        let gradient = DVec3::from(slope.map(f64::from));
        let unit = gradient.try_normalize(1e-3)?;
        if phi.abs() < ARRIVED {
            let offset = position - at;
            let length = offset.norm();
            // Signed as phi: the vector to the vertex points outward from outside, and inward from inside.
            let sign = if first < 0.0 { -1.0 } else { 1.0 };
            return Some(if length < TINY {
                // The vertex' own foot in that direction.
                let distance = offset.dot(&unit);
                Foot { position: position - unit * distance, outward: unit, distance }
            } else {
                Foot { position: at, outward: offset * (sign / length), distance: sign * length }
            });
        }
        at -= unit * (share * f64::from(phi));
        (phi, slope) = sampler.at(at)?;
    }
    None
}

impl Foot {
    /// The position (cells) at a distance (cells), negative inside.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.position + self.outward * distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::level_set::band::Distances;
    use crate::surface::level_set::implicit::Implicit;
    use crate::surface::level_set::isosurface::Isosurface;
    use crate::surface::test_particles::context;

    #[test]
    fn feet_are_outward_and_distances_negative_inside() {
        let ctx = context(1);
        let grid = (0..17 * 17 * 17).map(|n| [n / 289, n / 17 % 17, n % 17].map(|x| f64::from(x) - 8.0));
        let positions: Vec<DVec3> = grid.map(DVec3::from).filter(|position| position.norm() < 7.0).collect();
        let phi = Implicit::new(&ctx, &positions, 1.0, 0.5).unwrap();
        let distances = Distances::new(&ctx, &phi, &Isosurface::new(&phi), 6.0).unwrap();
        let mut sampler = Sampler::new(&distances);
        let direction = DVec3::new(2.0, 1.0, 3.0).normalize();
        // Cells are half as long as spacings.
        let surface = foot(&mut sampler, direction * 14.0).unwrap();
        let height = surface.position.dot(&direction);
        for above in [-3.0, -0.5, -0.05, 0.05, 0.5, 3.0] {
            let position = direction * (height + above);
            let foot = foot(&mut sampler, position).unwrap();
            assert!((foot.distance - above).abs() < 0.15, "{above}: {foot:?}");
            assert!(foot.outward.dot(&direction) > 0.9, "{above}: {foot:?}");
            assert!((foot.at(foot.distance) - position).norm() < 1e-6, "{above}: {foot:?}");
            // A vertex that drifted through the surface comes back to its own side.
            assert!((foot.at(-above) - direction * (height - above)).norm() < 1.0, "{above}: {foot:?}");
        }
        assert!(super::foot(&mut sampler, direction * 100.0).is_none());
    }
}
