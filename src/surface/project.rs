//! Projection that keeps detail (thesis 2.3.2): a vertex is moved to the surface, then along the same line to the distance that
//! it keeps from it.
//!
//! The thesis' formulas are read so: phi and its gradient are those at the current x*, and delta is signed as phi, which the last
//! formula needs on the inside.

use super::sample::Sampler;
use crate::base::DVec3;

/// Shares of the way to phi = 0 that a step goes: a large one, for as many steps as that mostly takes, then the thesis' own (2.3.2),
/// which arrives where splines bend.
const STEPS: [(f64, usize); 2] = [(0.8, 6), (0.35, 64)];
/// Distance from phi = 0 at which a vertex has arrived (cells; thesis 2.3.2).
const ARRIVED: f32 = 0.005;
/// A vertex nearer to its foot than this (cells) is moved along the gradient there: the line between them says nothing.
const TINY: f64 = 0.1;

/// Where a vertex meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Foot {
    /// The place on phi = 0 (cells).
    pub place: DVec3,
    /// Unit vector outward from it through the vertex.
    pub outward: DVec3,
    /// Distance of the vertex (cells), negative inside.
    pub distance: f64,
}

/// The foot of a vertex at a place (cells); none where the steps do not arrive.
pub fn foot(sampler: &mut Sampler<'_>, place: DVec3) -> Option<Foot> {
    let mut at = place;
    let (first, mut slope) = sampler.at(at)?;
    let mut phi = first;
    let shares = STEPS.into_iter().flat_map(|(share, count)| std::iter::repeat_n(share, count));
    for share in shares {
        let gradient = DVec3::from(slope.map(f64::from));
        let unit = gradient.try_normalize(1e-3)?;
        if phi.abs() < ARRIVED {
            let way = place - at;
            let length = way.norm();
            // Signed as phi: the way leads outward from outside, and inward from inside.
            let sign = if first < 0.0 { -1.0 } else { 1.0 };
            return Some(if length < TINY {
                // The foot that the vertex itself has in that direction.
                let distance = way.dot(&unit);
                Foot { place: place - unit * distance, outward: unit, distance }
            } else {
                Foot { place: at, outward: way * (sign / length), distance: sign * length }
            });
        }
        at -= unit * (share * f64::from(phi));
        (phi, slope) = sampler.at(at)?;
    }
    None
}

impl Foot {
    /// The place (cells) at a distance (cells), negative inside.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.place + self.outward * distance
    }
}
