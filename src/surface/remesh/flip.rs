//! Which edges should be flipped.

use super::improvable::TOO_LONG;
use super::shape::{is_upright, min_angle};
use super::vertex_rings::{Edge, VertexRings};
use crate::geometry::fans::flipped;
use crate::geometry::shape::normal;

/// Triangles whose smallest angle (degrees) is at least this are left alone.
const MIN_ANGLE: f64 = 20.0;
/// Minimum increase (degrees) of the smallest angle of the two triangles by a flip.
const GAIN: f64 = 5.0;
/// Minimum cosine between the normals of the two triangles: they meet at up to 30 degrees.
const FLAT: f64 = 0.866;

impl VertexRings<'_, '_> {
    /// The edge of a triangle whose flip is best. None if its angles are not small, or no flip is clearly better; edges of unchanged
    /// triangles and those at flagged vertices are not flipped.
    pub fn best_flip(&self, triangle: u32) -> Option<Edge> {
        let is_allowed = self.exists(triangle) && !self.is_whole(triangle);
        if !is_allowed || min_angle(&self.positions(triangle)) >= MIN_ANGLE {
            return None;
        }
        let [a, b, c] = self.corners(triangle);
        let mut best: Option<(f64, Edge)> = None;
        for ends in [[a, b], [b, c], [c, a]] {
            if let Some(edge) = self.edge(ends)
                && let Some(gain) = self.gain(&edge)
                && best.is_none_or(|(best, _)| gain > best)
            {
                best = Some((gain, edge));
            }
        }
        best.map(|(_, edge)| edge)
    }

    /// Increase (degrees) of the smallest angle by a flip; none if it is not allowed.
    fn gain(&self, edge: &Edge) -> Option<f64> {
        let [_, _, c, d] = edge.corners;
        let is_fixed = edge.corners.iter().any(|&corner| self.is_flagged(corner))
            || edge.triangles.iter().any(|&triangle| self.is_whole(triangle));
        if is_fixed || self.stretch([c, d]) > TOO_LONG * TOO_LONG || self.are_neighbours(c, d) {
            return None;
        }
        let old = edge.triangles.map(|triangle| self.positions(triangle));
        let [one, two] = old.each_ref().map(normal);
        if one.dot(&two) < FLAT * one.norm() * two.norm() {
            return None;
        }
        let new = flipped(edge.corners).map(|corners| corners.map(|corner| self.position(corner)));
        // The larger of the two has the better normal.
        let side = if one.norm_squared() >= two.norm_squared() { &old[0] } else { &old[1] };
        if !new.iter().all(|corners| is_upright(side, corners)) {
            return None;
        }
        let [before, after] = [&old, &new].map(|[one, two]| min_angle(one).min(min_angle(two)));
        Some(after - before).filter(|gain| *gain >= GAIN)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Body;
    use super::*;
    use crate::geometry::DVec3;
    use crate::mesh_repair::Source;

    /// Two triangles along an edge, the second of which is rotated about it (degrees).
    fn kite(height: f64, turn: f64) -> Body {
        let turn = turn.to_radians();
        let low = DVec3::new(0.0, -height * libm::cos(turn), height * libm::sin(turn));
        let positions = vec![DVec3::x() * -2.0, DVec3::x() * 2.0, DVec3::y() * height, low];
        let mut body = Body::of(positions, vec![[0, 1, 2], [1, 0, 3]]);
        body.sizes = vec![[2.0; 2]; 4];
        body.sources = vec![Source::Part(7); 2];
        body
    }

    fn best_flip(body: &mut Body) -> Option<Edge> {
        let mut mesh = body.improvable();
        let rings = VertexRings::of(&mut mesh);
        let [one, two] = [0, 1].map(|triangle| rings.best_flip(triangle));
        assert_eq!(one.is_some(), two.is_some());
        one
    }

    #[test]
    fn an_edge_flips_where_that_is_clearly_better() {
        let flip = Edge { triangles: [0, 1], corners: [0, 1, 2, 3] };
        assert_eq!(best_flip(&mut kite(0.5, 0.0)), Some(flip));
        assert_eq!(best_flip(&mut kite(0.5, 25.0)), Some(flip));
        // Not flat, too little gain, already good.
        assert_eq!(best_flip(&mut kite(0.5, 35.0)), None);
        assert_eq!(best_flip(&mut kite(0.1, 0.0)), None);
        assert_eq!(best_flip(&mut kite(0.8, 0.0)), None);
        for source in [Source::Whole(3), Source::New] {
            let mut body = kite(0.5, 0.0);
            body.sources[1] = source;
            let mut mesh = body.improvable();
            assert_eq!(VertexRings::of(&mut mesh).best_flip(0), (source == Source::New).then_some(flip));
        }
        let mut body = kite(0.5, 0.0);
        body.flags[3] = true;
        assert_eq!(best_flip(&mut body), None);
        // The new edge exists already, or would be too long.
        let mut body = kite(0.5, 0.0);
        body.triangles.push([2, 3, 0]);
        body.sources.push(Source::New);
        let mut mesh = body.improvable();
        assert_eq!(VertexRings::of(&mut mesh).gain(&flip), None);
        let mut body = kite(0.5, 0.0);
        body.sizes = vec![[0.5; 2]; 4];
        assert_eq!(best_flip(&mut body), None);
        // Triangles that do not make a convex quadrangle would turn over.
        let mut body = kite(0.5, 0.0);
        body.positions[2].x = 4.0;
        body.positions[3].x = 4.0;
        assert_eq!(best_flip(&mut body), None);
    }

    #[test]
    fn parts_of_two_triangles_are_parts_of_none_after_a_flip() {
        for (other, expected) in [(Source::Part(7), Source::Part(7)), (Source::Part(8), Source::New)] {
            let mut body = kite(0.5, 0.0);
            body.sources[1] = other;
            let mut mesh = body.improvable();
            let mut rings = VertexRings::of(&mut mesh);
            let edge = rings.best_flip(0).unwrap();
            rings.flip(&edge);
            assert_eq!((rings.take_touched(), rings.best_flip(0)), (vec![0, 1], None));
            rings.finish();
            assert_eq!(body.triangles, [[2, 0, 3], [3, 1, 2]]);
            assert_eq!(body.sources, [expected; 2]);
        }
    }
}
