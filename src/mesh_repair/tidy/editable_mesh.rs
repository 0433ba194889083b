//! A closed mesh that is changed by edge collapses and flips, with the triangles around its vertices ([`Fans`]). Vertices and triangles of
//! the input mesh are not touched.

use crate::geometry::DVec3;
use crate::geometry::fans::{Fans, flipped};
use crate::geometry::mesh::{drop_marked, renumber_kept};
use crate::mesh_repair::{Draft, Source};

/// A change of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mesh_repair) enum Change {
    /// A new vertex is merged into a neighbour, which is moved to a position (cells).
    Collapse { from: u32, to: u32, position: DVec3 },
    /// Triangles a, b, c and b, a, d become c, a, d and d, b, c.
    Flip { triangles: [u32; 2], corners: [u32; 4] },
}

/// A mesh with the vertex rings of all vertices that a created triangle uses: all triangles around them, whole ones too.
pub(in crate::mesh_repair) struct VertexRings<'a> {
    draft: &'a mut Draft,
    fans: Fans,
}

impl<'a> VertexRings<'a> {
    /// Takes three passes over all triangles, and memory for those near created ones.
    pub fn of(draft: &'a mut Draft) -> Self {
        let mut is_used = vec![false; draft.positions.len()];
        let created = draft.triangles.iter().zip(&draft.sources);
        for (corners, _) in created.filter(|(_, source)| !matches!(source, Source::Whole(_))) {
            corners.iter().for_each(|corner| is_used[*corner as usize] = true);
        }
        let fans = Fans::of(is_used.len(), &draft.triangles, |vertex| is_used[vertex as usize]);
        Self { draft, fans }
    }

    /// Whether a triangle exists, and was made or changed by the repair; whole ones stay as they are.
    pub fn is_created(&self, triangle: u32) -> bool {
        !self.fans.are_dead()[triangle as usize] && !matches!(self.source(triangle), Source::Whole(_))
    }

    /// Vertices of a triangle.
    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.draft.triangles[triangle as usize]
    }

    /// The position of a vertex (cells).
    pub fn position(&self, vertex: u32) -> DVec3 {
        self.draft.positions[vertex as usize]
    }

    fn source(&self, triangle: u32) -> Source {
        self.draft.sources[triangle as usize]
    }

    fn is_made(&self, vertex: u32) -> bool {
        self.draft.is_made[vertex as usize]
    }

    /// Collapses and flips of a triangle's edges that keep the mesh a closed 2-manifold, wherever its vertices lie.
    pub fn changes(&self, triangle: u32) -> Vec<Change> {
        let corners = self.corners(triangle);
        let mut out = Vec::with_capacity(12);
        for first in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|n| corners[(first + n) % 3]);
            let [a_is_made, b_is_made] = [a, b].map(|vertex| self.is_made(vertex));
            if (a_is_made || b_is_made) && self.fans.may_join(&self.draft.triangles, a, b) {
                let [at_a, at_b] = [a, b].map(|vertex| self.position(vertex));
                if a_is_made {
                    out.push(Change::Collapse { from: a, to: b, position: at_b });
                }
                if b_is_made {
                    out.push(Change::Collapse { from: b, to: a, position: at_a });
                }
                if a_is_made && b_is_made {
                    out.push(Change::Collapse { from: a, to: b, position: (at_a + at_b) / 2.0 });
                }
            }
            out.extend(self.flip(triangle, [a, b, c]));
        }
        out
    }

    /// The flip of the edge from a triangle's corner a to b; none if the triangle beyond it is whole, or the new edge exists already.
    fn flip(&self, triangle: u32, [a, b, c]: [u32; 3]) -> Option<Change> {
        let mut fan = self.fans.around(a).iter().copied();
        let beyond = fan.find(|&other| other != triangle && self.corners(other).contains(&b))?;
        let d = self.corners(beyond).into_iter().find(|&corner| corner != a && corner != b)?;
        let is_there = self.fans.are_neighbours(&self.draft.triangles, c, d);
        let may_flip = self.is_created(triangle) && self.is_created(beyond) && !is_there;
        may_flip.then_some(Change::Flip { triangles: [triangle, beyond], corners: [a, b, c, d] })
    }

    /// Triangles with a corner that a collapse moves or renames.
    pub fn moving(&self, from: u32, to: u32, position: DVec3) -> impl Iterator<Item = u32> {
        self.fans.moving(&self.draft.triangles, [from, to], position != self.position(to))
    }

    /// Whether triangles are parts of the same triangle.
    fn are_of_one(&self, triangles: &[u32]) -> bool {
        let is_of = |of: u32| triangles.iter().all(|&other| self.source(other) == Source::Part(of));
        matches!(self.source(triangles[0]), Source::Part(of) if is_of(of))
    }

    /// Makes a change: one of [`VertexRings::changes`] that moves only created triangles. Returns the triangles that it touched, and whole
    /// ones around the same vertex.
    pub fn make(&mut self, change: Change) -> Vec<u32> {
        match change {
            Change::Collapse { from, to, position } => self.collapse(from, to, position),
            Change::Flip { triangles, corners } => {
                let source =
                    if self.are_of_one(&triangles) { self.source(triangles[0]) } else { Source::New };
                for (triangle, corners) in triangles.into_iter().zip(flipped(corners)) {
                    self.draft.triangles[triangle as usize] = corners;
                    self.draft.sources[triangle as usize] = source;
                }
                self.fans.flip(triangles, corners);
                triangles.to_vec()
            }
        }
    }

    fn collapse(&mut self, from: u32, to: u32, position: DVec3) -> Vec<u32> {
        let moving: Vec<u32> = self.moving(from, to, position).collect();
        // If nothing moves, or all move within one plane, parts stay parts.
        let stays = position == self.position(from) && position == self.position(to);
        if !stays && !self.are_of_one(&moving) {
            moving.iter().for_each(|&triangle| self.draft.sources[triangle as usize] = Source::New);
        }
        self.draft.positions[to as usize] = position;
        self.fans.collapse(&mut self.draft.triangles, [from, to]);
        self.fans.around(to).to_vec()
    }

    /// Drops removed triangles, and new vertices that no triangle uses. All others keep their order.
    pub fn finish(self) {
        let Self { draft, fans } = self;
        drop_marked(&mut draft.triangles, fans.are_dead());
        drop_marked(&mut draft.sources, fans.are_dead());
        let mut is_gone = draft.is_made.clone();
        draft.triangles.as_flattened().iter().for_each(|&corner| is_gone[corner as usize] = false);
        drop_marked(&mut draft.positions, &is_gone);
        drop_marked(&mut draft.is_made, &is_gone);
        renumber_kept(draft.triangles.as_flattened_mut(), &is_gone);
    }
}

#[cfg(test)]
pub(in crate::mesh_repair) mod tests {
    use super::*;
    use crate::geometry::check::topology::Topology;
    use crate::geometry::test_meshes;

    /// A torus of whole triangles with edges of 0.3 to 0.9 sizes (cells).
    pub fn torus(size: f64) -> Draft {
        let (positions, triangles) = test_meshes::torus();
        Draft {
            is_made: vec![false; positions.len()],
            positions: positions.into_iter().map(|position| position * size).collect(),
            sources: (0..triangles.len() as u32).map(Source::Whole).collect(),
            triangles,
        }
    }

    fn make(draft: &mut Draft, position: DVec3) -> u32 {
        draft.positions.push(position);
        draft.is_made.push(true);
        draft.positions.len() as u32 - 1
    }

    /// Replaces a triangle by parts of it.
    fn replace(draft: &mut Draft, triangle: usize, parts: &[[u32; 3]]) {
        let source = match draft.sources[triangle] {
            Source::Whole(of) => Source::Part(of),
            other => other,
        };
        draft.triangles[triangle] = parts[0];
        draft.sources[triangle] = source;
        draft.triangles.extend_from_slice(&parts[1..]);
        draft.sources.resize(draft.triangles.len(), source);
    }

    /// Adds a vertex in a triangle, at barycentric weights.
    pub fn split(draft: &mut Draft, triangle: usize, weights: [f64; 3]) {
        let [a, b, c] = draft.triangles[triangle];
        let [p, q, r] = [a, b, c].map(|corner| draft.positions[corner as usize]);
        let all = weights[0] + weights[1] + weights[2];
        let made = make(draft, (p * weights[0] + q * weights[1] + r * weights[2]) / all);
        replace(draft, triangle, &[[a, b, made], [b, c, made], [c, a, made]]);
    }

    /// Adds a vertex on the first edge of a triangle, at a fraction of its length.
    pub fn split_edge(draft: &mut Draft, triangle: usize, share: f64) {
        let [a, b, c] = draft.triangles[triangle];
        let runs_back = |corners: &[u32; 3]| (0..3).any(|n| corners[n] == b && corners[(n + 1) % 3] == a);
        let beyond = draft.triangles.iter().position(runs_back).unwrap();
        let d = draft.triangles[beyond].into_iter().find(|&corner| corner != a && corner != b).unwrap();
        let [p, q] = [a, b].map(|corner| draft.positions[corner as usize]);
        let made = make(draft, p + (q - p) * share);
        replace(draft, triangle, &[[a, made, c], [made, b, c]]);
        replace(draft, beyond, &[[b, made, d], [made, a, d]]);
    }

    /// A pyramid over a square whose tip, 4, is new, and a separate tetrahedron of vertices 6 to 9.
    fn draft() -> Draft {
        let pyramid = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]];
        let tetrahedron = [[6, 8, 7], [6, 7, 9], [7, 8, 9], [8, 6, 9]];
        let source = |n: u32| if n < 4 { Source::New } else { Source::Whole(n) };
        Draft {
            positions: (0..10).map(|vertex| DVec3::repeat(f64::from(vertex))).collect(),
            is_made: (0..10).map(|vertex| vertex == 4).collect(),
            triangles: pyramid.into_iter().chain(tetrahedron).collect(),
            sources: (0..10).map(source).collect(),
        }
    }

    #[test]
    fn fans_hold_whole_triangles_too_and_exist_only_at_created_triangles() {
        let mut draft = draft();
        let rings = VertexRings::of(&mut draft);
        let ring = |vertex: u32| rings.fans.ring(&rings.draft.triangles, vertex);
        assert_eq!(rings.fans.around(4), [0, 1, 2, 3]);
        assert_eq!(rings.fans.around(0), [0, 3, 4, 5]);
        assert_eq!((ring(0), ring(1)), (vec![1, 2, 3, 4], vec![0, 2, 4]));
        assert!(rings.fans.around(7).is_empty());
    }

    #[test]
    fn only_sound_changes_are_offered() {
        let mut draft = draft();
        let rings = VertexRings::of(&mut draft);
        // Vertices 1 and 3 are adjacent to 0 and 4, but 2 is, too.
        let may_join = |a: u32, b: u32| rings.fans.may_join(&rings.draft.triangles, a, b);
        assert!(!may_join(4, 0) && !may_join(4, 2));
        // Only 0 and 2 are adjacent to 1 and 4.
        assert!(may_join(4, 1) && may_join(4, 3));
        let [a, b, c, d] = [1, 4, 0, 2];
        let into = Change::Collapse { from: 4, to: 1, position: DVec3::repeat(1.0) };
        // The edge 0-2 exists already; that from 1 to 3 does not, but 0-1 has a whole triangle beyond it.
        assert_eq!(rings.flip(0, [a, b, c]), None);
        let flip = Change::Flip { triangles: [0, 3], corners: [4, 0, 1, 3] };
        assert_eq!(rings.changes(0), [into, flip]);
        assert_eq!(flipped([a, b, c, d]), [[0, 1, 2], [2, 4, 0]]);
    }

    #[test]
    fn changes_keep_a_closed_manifold_and_drop_only_what_is_unused() {
        for change in [0, 1] {
            let mut draft = draft();
            let mut rings = VertexRings::of(&mut draft);
            let touched = rings.make(rings.changes(0)[change]);
            assert_eq!(touched.len(), [3, 2][change]);
            rings.finish();
            assert!(Topology::of(draft.positions.len(), &draft.triangles).is_watertight());
            // Vertex 5 stays: it is not new.
            let (vertices, triangles) = [(9, 8), (10, 10)][change];
            assert_eq!((draft.positions.len(), draft.triangles.len()), (vertices, triangles));
            assert_eq!((draft.is_made.len(), draft.sources.len()), (vertices, triangles));
            assert_eq!(draft.positions[vertices - 1], DVec3::repeat(9.0));
            assert_eq!(draft.triangles[triangles - 1].map(|n| n as usize + 10 - vertices), [8, 6, 9]);
        }
    }
}
