//! Shapes of triangles.

use std::borrow::Borrow;

use super::DVec3;

/// Minimum and maximum corner of the box around positions; without any, infinity and -infinity.
pub fn bounds(positions: impl IntoIterator<Item = impl Borrow<DVec3>>) -> (DVec3, DVec3) {
    let empty = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
    positions.into_iter().fold(empty, |(low, high), p| (low.inf(p.borrow()), high.sup(p.borrow())))
}

/// A normal of a triangle, as long as twice its area.
pub fn normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(&(c - a))
}

/// Six times the volume of the tetrahedron between a triangle and a position; positive if the position is behind the triangle.
pub fn six_volumes(corners: &[DVec3; 3], from: &DVec3) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - from);
    a.dot(&b.cross(&c))
}

/// The corners of a triangle, rotated so that its longest edge is the first.
pub fn longest_first([a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    match [(a - b).norm_squared(), (b - c).norm_squared(), (c - a).norm_squared()] {
        [ab, bc, ca] if ab >= bc && ab >= ca => [a, b, c],
        [_, bc, ca] if bc >= ca => [b, c, a],
        _ => [c, a, b],
    }
}

/// Altitude of a triangle on its longest edge, divided by that edge's length, which counts as at least `min_edge`: 0.87 at most, 0 where
/// all corners are at one position.
pub fn altitude(corners: &[DVec3; 3], min_edge: f64) -> f64 {
    let [a, b, c] = corners;
    let square = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    if square > 0.0 { normal(corners).norm() / square.max(min_edge * min_edge) } else { 0.0 }
}
