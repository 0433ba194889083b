//! Which end of a short edge is merged into the other, and whether it may be.

use super::improvable::{between, mean};
use super::shape::{is_upright, quality};
use super::vertex_rings::{Collapse, VertexRings};
use crate::geometry::DVec3;
use crate::geometry::shape::normal;

/// Minimum spread of normals on a ridge or in a corner: that of two planes of the same area that meet at 30 degrees.
const SPREAD: f64 = 0.0625;
/// Minimum quality of triangles after a collapse, unless it was lower before.
const MIN_QUALITY: f64 = 0.05;
/// Below this quality a triangle's normal is meaningless.
const SLIVER: f64 = 1e-4;
/// Maximum length of edges after a collapse (targets): shorter than an edge that is split, which would undo it.
const LONGEST: f64 = 1.4;
/// The same where a fold is removed, which is worse than a long edge.
const LONGEST_OF_FOLD: f64 = 2.0;
/// Maximum cosine between the normals of triangles that are folded onto each other: they meet at more than 160 degrees.
const FOLDED: f64 = -0.9397;

impl VertexRings<'_, '_> {
    /// Number of independent normal directions around a vertex: 1 where the surface is smooth, 2 on a ridge, 3 in a corner. The rank of the
    /// area-weighted sum of the outer products of its normals (the medial quadric of Jiao 2007, "Face offsetting"), from its invariants.
    pub fn rank(&self, vertex: u32) -> u8 {
        let mut rows = [DVec3::zeros(); 3];
        for &triangle in self.around(vertex) {
            let normal = normal(&self.positions(triangle));
            let length = normal.norm();
            if length > 0.0 {
                for axis in 0..3 {
                    rows[axis] += normal * (normal[axis] / length);
                }
            }
        }
        let [x, y, z] = rows;
        let trace = x.x + y.y + z.z;
        let minors = 0.5 * (trace * trace - x.norm_squared() - y.norm_squared() - z.norm_squared());
        if minors <= SPREAD * trace * trace {
            1
        } else if x.dot(&y.cross(&z)) <= SPREAD * minors * trace {
            2
        } else {
            3
        }
    }

    /// The possible collapses of an edge, the best first: the end with more of a ridge or corner stays, then the one that was there before
    /// this frame, then the lower index. Two new vertices on a smooth surface meet in the middle.
    pub fn collapses(&self, [a, b]: [u32; 2]) -> Vec<Collapse> {
        let (a, b) = (a.min(b), a.max(b));
        let into =
            |to: u32, from: u32| Collapse { from, to, position: self.position(to), size: self.size(to) };
        let [worth_a, worth_b] = [a, b].map(|end| (self.rank(end), self.has_origin(end)));
        if worth_a > worth_b {
            return vec![into(a, b)];
        }
        if worth_a < worth_b {
            return vec![into(b, a)];
        }
        let mut collapses = vec![into(a, b), into(b, a)];
        if worth_a == (1, false) {
            let (position, size) = (self.middle([a, b]), mean(self.size(a), self.size(b)));
            collapses.insert(0, Collapse { from: b, to: a, position, size });
        }
        collapses
    }

    /// Whether a collapse preserves a closed 2-manifold and leaves valid triangles; the triangles of a fold that is to be removed may turn
    /// over.
    pub fn is_allowed(&self, collapse: &Collapse, folded: &[u32]) -> bool {
        let mut moving = self.moving(collapse).into_iter();
        moving.all(|triangle| self.is_valid_after(triangle, collapse, folded))
            && self.may_join(collapse.from, collapse.to)
    }

    /// Whether a triangle is valid after a collapse, or removed by it.
    fn is_valid_after(&self, triangle: u32, collapse: &Collapse, folded: &[u32]) -> bool {
        let &Collapse { from, to, position, size } = collapse;
        let corners = self.corners(triangle);
        if corners.iter().any(|&corner| self.is_flagged(corner)) {
            return false;
        }
        if corners.contains(&from) && corners.contains(&to) {
            return true;
        }
        let moves = |corner: u32| corner == from || corner == to;
        let longest = if folded.is_empty() { LONGEST } else { LONGEST_OF_FOLD };
        let is_short = |corner: u32| {
            let [_, target] = between(size, self.size(corner));
            moves(corner) || (self.position(corner) - position).norm() <= longest * target
        };
        let old = self.positions(triangle);
        let new = corners.map(|corner| if moves(corner) { position } else { self.position(corner) });
        let before = quality(&old);
        let keeps_side = folded.contains(&triangle) || before < SLIVER || is_upright(&old, &new);
        keeps_side && quality(&new) >= before.min(MIN_QUALITY) && corners.into_iter().all(is_short)
    }

    /// The collapse that unfolds a triangle, created or changed in this frame, from one that it is folded onto: the shortest of their edges
    /// that may collapse and has an end created in this frame. None if it is not folded, or no edge may collapse.
    pub fn unfolding(&self, triangle: u32) -> Option<Collapse> {
        if !self.exists(triangle) || self.is_whole(triangle) {
            return None;
        }
        let [a, b, c] = self.corners(triangle);
        [[a, b], [b, c], [c, a]].into_iter().find_map(|ends| {
            let edge = self.edge(ends)?;
            let [one, two] = edge.triangles.map(|triangle| normal(&self.positions(triangle)));
            let is_flagged = edge.corners.iter().any(|&corner| self.is_flagged(corner));
            if is_flagged || one.dot(&two) >= FOLDED * one.norm() * two.norm() {
                return None;
            }
            let [a, b, c, d] = edge.corners;
            let mut edges = [[a, b], [b, c], [c, a], [a, d], [d, b]].map(|[a, b]| {
                let ends = [a.min(b), a.max(b)];
                (self.length(ends), ends)
            });
            edges.sort_unstable_by(|one, two| one.0.total_cmp(&two.0).then(one.1.cmp(&two.1)));
            let is_made = |ends: &[u32; 2]| ends.iter().any(|&end| !self.has_origin(end));
            let candidates = edges.into_iter().map(|(_, ends)| ends).filter(is_made);
            candidates
                .flat_map(|ends| self.collapses(ends))
                .find(|collapse| self.is_allowed(collapse, &edge.triangles))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Body, sphere};
    use super::*;
    use crate::geometry::TriMesh;
    use crate::mesh_repair::Source;

    #[test]
    fn ridges_and_corners_are_told_from_smooth_positions() {
        let TriMesh { positions, triangles } = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        let mut body = Body::of(positions.iter().map(|position| position.cast()).collect(), triangles);
        let mut mesh = body.improvable();
        let mut rings = VertexRings::of(&mut mesh);
        assert!((0..8).all(|vertex| rings.rank(vertex) == 3));
        let [mut on_faces, mut on_ridges] = [0; 2];
        for triangle in 0..12 {
            let [a, b, c] = rings.corners(triangle);
            for ends in [[a, b], [b, c], [c, a]] {
                let Some(edge) = rings.edge(ends) else { continue };
                let [one, two] = edge.triangles.map(|triangle| normal(&rings.positions(triangle)));
                let is_flat = one.cross(&two).norm() < 1e-9;
                let made = 8 + on_faces + on_ridges;
                rings.split(&edge, 0.5 * (rings.position(ends[0]) + rings.position(ends[1])));
                assert_eq!(rings.rank(made), if is_flat { 1 } else { 2 });
                *(if is_flat { &mut on_faces } else { &mut on_ridges }) += 1;
            }
        }
        assert!(on_faces > 2 && on_ridges > 2, "{on_faces} {on_ridges}");
        let mut ball = sphere(3);
        let mut mesh = ball.improvable();
        let rings = VertexRings::of(&mut mesh);
        assert!((0..258).all(|vertex| rings.rank(vertex) == 1));
    }

    #[test]
    fn the_artists_vertices_and_ridges_stay() {
        let mut body = sphere(3);
        let [a, b, _] = body.triangles[100];
        let (low, high) = (a.min(b), a.max(b));
        let offers = |body: &mut Body| {
            let mut mesh = body.improvable();
            let rings = VertexRings::of(&mut mesh);
            let collapses = rings.collapses([a, b]);
            (
                collapses.iter().map(|collapse| (collapse.from, collapse.to)).collect::<Vec<_>>(),
                collapses[0].position,
            )
        };
        let position = |body: &Body, vertex: u32| body.positions[vertex as usize];
        assert_eq!(offers(&mut body), (vec![(high, low), (low, high)], position(&body, low)));
        body.origins[low as usize] = None;
        assert_eq!(offers(&mut body), (vec![(low, high)], position(&body, high)));
        body.origins[high as usize] = None;
        let (collapses, middle) = offers(&mut body);
        assert_eq!(collapses, [(high, low), (high, low), (low, high)]);
        assert!((middle - 0.5 * (position(&body, low) + position(&body, high))).norm() < 0.03);
        // A spike is a corner.
        body.positions[low as usize] *= 1.2;
        assert_eq!(offers(&mut body).0, [(high, low)]);
    }

    #[test]
    fn what_would_be_long_flat_turned_over_or_flagged_may_not() {
        let mut body = sphere(3);
        let [a, b, c] = body.triangles[100];
        let is_allowed = |body: &mut Body| {
            let mut mesh = body.improvable();
            let rings = VertexRings::of(&mut mesh);
            rings.collapses([a, b]).iter().any(|collapse| rings.is_allowed(collapse, &[]))
        };
        // With the sizes at birth the resulting edges would be too long.
        assert!(!is_allowed(&mut body));
        body.sizes.iter_mut().flatten().for_each(|size| *size *= 2.0);
        assert!(is_allowed(&mut body));
        body.flags[c as usize] = true;
        assert!(!is_allowed(&mut body));
        body.flags[c as usize] = false;
        // A position beyond the ring turns triangles over.
        body.sizes.iter_mut().flatten().for_each(|size| *size *= 10.0);
        let mut mesh = body.improvable();
        let rings = VertexRings::of(&mut mesh);
        let collapse = rings.collapses([a, b])[0];
        let beyond = 3.5 * rings.position(collapse.from) - 2.5 * rings.position(collapse.to);
        assert!(
            rings.is_allowed(&collapse, &[])
                && !rings.is_allowed(&Collapse { position: beyond, ..collapse }, &[])
        );
    }

    #[test]
    fn a_fold_goes_by_what_was_made() {
        let folded = |made: bool| {
            let mut body = sphere(3);
            let vertex = 100u32;
            let beside = body.triangles.iter().find(|corners| corners.contains(&vertex)).unwrap();
            let other = beside.iter().copied().find(|&corner| corner != vertex).unwrap();
            let [p, q] = [vertex, other].map(|at| body.positions[at as usize]);
            body.positions[vertex as usize] = q + 0.6 * (q - p);
            if made {
                body.origins[vertex as usize] = None;
            }
            let around = body.triangles.iter().map(|corners| corners.contains(&vertex));
            let marks: Vec<bool> = around.collect();
            body.sources.iter_mut().zip(&marks).filter(|(_, is)| **is).for_each(|(at, _)| *at = Source::New);
            let mut mesh = body.improvable();
            let rings = VertexRings::of(&mut mesh);
            (0..512).filter_map(|triangle| rings.unfolding(triangle)).collect::<Vec<_>>()
        };
        let collapses = folded(true);
        assert!(
            !collapses.is_empty()
                && collapses.iter().all(|collapse| collapse.from == 100 || collapse.to == 100),
            "{collapses:?}"
        );
        assert!(folded(false).is_empty());
    }
}
