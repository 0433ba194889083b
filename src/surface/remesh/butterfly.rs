//! Position of a vertex that splits an edge: modified butterfly subdivision (Zorin, Schroeder and Sweldens 1996, "Interpolating subdivision
//! for meshes with arbitrary topology"). The new vertex lies on a smooth surface through the vertices around the edge.

use std::f64::consts::TAU;

use super::shape::is_upright;
use super::vertex_rings::{Edge, VertexRings};
use crate::geometry::DVec3;

/// Maximum number of neighbours of a vertex for the rule.
const MAX_NEIGHBOURS: usize = 24;
/// Maximum distance from the edge's midpoint, in edge lengths: where the surface is folded the rule is meaningless.
const FAR: f64 = 0.25;

impl VertexRings<'_, '_> {
    /// Where an edge is split: at `middle`, or at its midpoint where a triangle would turn over.
    pub fn split_position(&self, edge: &Edge) -> DVec3 {
        let [a, b, c, d] = edge.corners.map(|corner| self.position(corner));
        let middle = self.middle([edge.corners[0], edge.corners[1]]);
        let halves = [
            ([a, b, c], [a, middle, c]),
            ([a, b, c], [middle, b, c]),
            ([b, a, d], [b, middle, d]),
            ([b, a, d], [middle, a, d]),
        ];
        if halves.iter().all(|(old, new)| is_upright(old, new)) { middle } else { 0.5 * (a + b) }
    }

    /// The position on a smooth surface that corresponds to the middle of an edge; the midpoint if neighbours are missing or out of place
    /// (flagged), or if the position is far from the midpoint.
    pub fn middle(&self, ends: [u32; 2]) -> DVec3 {
        let [p, q] = ends.map(|end| self.position(end));
        let midpoint = 0.5 * (p + q);
        let position = self.butterfly(ends).unwrap_or(midpoint);
        if (position - midpoint).norm() <= FAR * (q - p).norm() { position } else { midpoint }
    }

    fn butterfly(&self, [a, b]: [u32; 2]) -> Option<DVec3> {
        let rings = [self.ring_from(a, b, MAX_NEIGHBOURS)?, self.ring_from(b, a, MAX_NEIGHBOURS)?];
        if rings.iter().flatten().any(|&vertex| self.is_flagged(vertex)) {
            return None;
        }
        if rings.iter().all(|ring| ring.len() == 6) {
            let at = |side: usize, n: usize| self.position(rings[side][n]);
            let opposite = at(0, 1) + at(0, 5);
            let wings = at(0, 2) + at(0, 4) + at(1, 2) + at(1, 4);
            return Some(0.5 * (self.position(a) + self.position(b)) + 0.125 * opposite - 0.0625 * wings);
        }
        // The end whose number of neighbours is not 6 decides; if both are such, their mean is taken.
        let (mut sum, mut count) = (DVec3::zeros(), 0.0);
        for (end, ring) in [a, b].into_iter().zip(&rings).filter(|(_, ring)| ring.len() != 6) {
            sum += 0.75 * self.position(end);
            for (n, &vertex) in ring.iter().enumerate() {
                sum += weight(n, ring.len()) * self.position(vertex);
            }
            count += 1.0;
        }
        Some(sum / count)
    }
}

/// The weight of neighbour `n`, counted from the edge's other end around a vertex, out of `of` neighbours, not 6. The sum of all weights is
/// 1/4.
fn weight(n: usize, of: usize) -> f64 {
    match (of, n) {
        (3, 0) => 5.0 / 12.0,
        (3, _) => -1.0 / 12.0,
        (4, 0) => 0.375,
        (4, 2) => -0.125,
        (4, _) => 0.0,
        _ => {
            let turn = TAU * n as f64 / of as f64;
            (0.25 + libm::cos(turn) + 0.5 * libm::cos(2.0 * turn)) / of as f64
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Body, sphere};
    use super::*;

    /// A regular grid of positions in a plane, `count` by `count`.
    fn grid(count: u32) -> Body {
        let position =
            |n: u32| DVec3::new(f64::from(n / count), f64::from(n % count), f64::from(n / count + n % count));
        let quad = |n: u32| {
            let [a, b, c, d] = [n, n + count, n + count + 1, n + 1];
            [[a, b, c], [a, c, d]]
        };
        let quads = (0..count * (count - 1)).filter(|n| n % count != count - 1);
        Body::of((0..count * count).map(position).collect(), quads.flat_map(quad).collect())
    }

    #[test]
    fn weights_of_a_ring_are_a_quarter_together() {
        for of in [3, 4, 5, 7, 8, 12, 24] {
            let sum: f64 = (0..of).map(|n| weight(n, of)).sum();
            assert!((sum - 0.25).abs() < 1e-14, "{of}: {sum}");
            assert!((1..of).all(|n| weight(n, of) < weight(0, of)), "{of}");
        }
    }

    #[test]
    fn a_flat_grid_stays_as_it_is_exactly() {
        let mut body = grid(7);
        let mut mesh = body.improvable();
        let rings = VertexRings::of(&mut mesh);
        let middle = 3 * 7 + 3;
        for other in [middle + 1, middle + 7, middle + 8, middle - 1] {
            let expected = 0.5 * (rings.position(middle) + rings.position(other));
            assert!(rings.butterfly([middle, other]).is_some());
            assert_eq!(rings.middle([middle, other]), expected);
            assert_eq!(rings.split_position(&rings.edge([middle, other]).unwrap()), expected);
        }
        // Vertices at the border do not have all neighbours.
        assert!(rings.butterfly([0, 1]).is_none());
        assert_eq!(rings.middle([0, 1]), 0.5 * (rings.position(0) + rings.position(1)));
    }

    #[test]
    fn a_vertex_lies_nearer_to_a_sphere_than_the_midpoint() {
        for level in [2, 3] {
            let mut body = sphere(level);
            let mut mesh = body.improvable();
            let rings = VertexRings::of(&mut mesh);
            let (mut sum, mut count) = (0.0, 0.0);
            for triangle in 0..8 * 4u32.pow(level) {
                let [a, b, c] = rings.corners(triangle);
                for ends in [[a, b], [b, c], [c, a]] {
                    let [p, q] = ends.map(|end| rings.position(end));
                    let far = |position: DVec3| (position.norm() - 1.0).abs();
                    let ratio = far(rings.middle(ends)) / far(0.5 * (p + q));
                    assert!(ratio < 0.7, "{ends:?}: {ratio}");
                    sum += ratio;
                    count += 1.0;
                }
            }
            assert!(sum / count < 0.2, "{}", sum / count);
        }
    }

    #[test]
    fn what_is_flagged_or_far_says_nothing() {
        let ends = [0u32, 1].map(|n| n + 3 * 7 + 3);
        let half = |body: &Body| 0.5 * (body.positions[ends[0] as usize] + body.positions[ends[1] as usize]);
        let middle = |body: &mut Body| VertexRings::of(&mut body.improvable()).middle(ends);
        let mut body = grid(7);
        body.positions[2 * 7 + 3].z += 0.5;
        assert!(middle(&mut body) != half(&body));
        body.flags[2 * 7 + 3] = true;
        assert_eq!(middle(&mut body), half(&body));
        body.flags[2 * 7 + 3] = false;
        body.positions[2 * 7 + 3].z += 50.0;
        assert_eq!(middle(&mut body), half(&body));
    }
}
