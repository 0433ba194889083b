//! Shapes of triangles.

use crate::geometry::DVec3;
use crate::geometry::shape::{altitude, normal};

/// Minimum cosine between the normals of a triangle before and after a change: below it the triangle turns over.
const UPRIGHT: f64 = 0.2;

/// Altitude of a triangle on its longest edge, divided by that edge's length.
pub(super) fn quality(corners: &[DVec3; 3]) -> f64 {
    altitude(corners, 0.0)
}

/// Smallest angle of a triangle (degrees): that between its two longest edges. 0 if one of these has no length.
pub(super) fn min_angle(corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let mut lengths = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
    lengths.sort_unstable_by(f64::total_cmp);
    let product = lengths[1] * lengths[2];
    if product > 0.0 { libm::asin((normal(corners).norm() / product).min(1.0)).to_degrees() } else { 0.0 }
}

/// Whether a triangle keeps roughly the same orientation after a change of its corners.
pub(super) fn is_upright(old: &[DVec3; 3], new: &[DVec3; 3]) -> bool {
    let [before, after] = [old, new].map(normal);
    before.dot(&after) > UPRIGHT * before.norm() * after.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_those_of_the_book() {
        let triangle = |tip: [f64; 3]| [DVec3::zeros(), DVec3::x() * 2.0, DVec3::from(tip)];
        let even = triangle([1.0, libm::sqrt(3.0), 0.0]);
        assert!((min_angle(&even) - 60.0).abs() < 1e-6 && (quality(&even) - 0.75f64.sqrt()).abs() < 1e-12);
        let half = triangle([0.0, 2.0, 0.0]);
        assert!((min_angle(&half) - 45.0).abs() < 1e-9 && (quality(&half) - 0.5).abs() < 1e-12);
        let flat = triangle([1.0, 0.0, 0.0]);
        assert_eq!((min_angle(&flat), quality(&flat)), (0.0, 0.0));
        let nothing = [DVec3::x(); 3];
        assert_eq!((min_angle(&nothing), quality(&nothing)), (0.0, 0.0));
        let leaning = |degrees: f64| {
            let (up, out) = (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
            triangle([1.0, out, up])
        };
        assert!(is_upright(&leaning(0.0), &leaning(78.0)) && !is_upright(&leaning(0.0), &leaning(79.0)));
        assert!(!is_upright(&leaning(0.0), &leaning(180.0)) && !is_upright(&even, &flat));
    }
}
