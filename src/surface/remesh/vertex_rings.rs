//! A closed mesh that is being improved, with the triangles around its vertices. Splits, collapses and flips keep it a closed 2-manifold by
//! index ([`Fans`]).

use super::improvable::{Improvable, Size, mean};
use crate::geometry::DVec3;
use crate::geometry::fans::{Fans, flipped};
use crate::geometry::mesh::{drop_marked, renumber_kept};
use crate::mesh_repair::Source;

/// An edge with its triangles and corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Edge {
    /// The triangle that runs along it from a to b, and the one that runs from b to a.
    pub triangles: [u32; 2],
    /// Its ends a and b, then the corners opposite: the triangles are a b c and b a d.
    pub corners: [u32; 4],
}

/// A vertex that is merged into a neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Collapse {
    pub from: u32,
    pub to: u32,
    /// The neighbour's new position and size.
    pub position: DVec3,
    /// See `position`.
    pub size: Size,
}

/// A mesh with the triangles around each vertex.
pub(super) struct VertexRings<'m, 'a> {
    mesh: &'m mut Improvable<'a>,
    fans: Fans,
    /// For each vertex, whether it was merged into another.
    is_gone: Vec<bool>,
    /// Triangles changed since the last call of `take_touched`, each once.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
}

impl<'m, 'a> VertexRings<'m, 'a> {
    /// Prepares a mesh, in two passes over all triangles.
    pub fn of(mesh: &'m mut Improvable<'a>) -> Self {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        Self {
            fans: Fans::of(vertices, mesh.triangles, |_| true),
            mesh,
            is_gone: vec![false; vertices],
            touched: Vec::new(),
            is_touched: vec![false; triangles],
        }
    }

    /// Whether a triangle has not been removed by a collapse.
    pub fn exists(&self, triangle: u32) -> bool {
        !self.fans.are_dead()[triangle as usize]
    }

    /// Whether a triangle is unchanged in this frame: the artist's own, or from an earlier frame.
    pub fn is_whole(&self, triangle: u32) -> bool {
        matches!(self.mesh.sources[triangle as usize], Source::Whole(_))
    }

    /// Vertices of a triangle.
    pub fn corners(&self, triangle: u32) -> [u32; 3] {
        self.mesh.triangles[triangle as usize]
    }

    /// Positions of a triangle's vertices.
    pub fn positions(&self, triangle: u32) -> [DVec3; 3] {
        self.corners(triangle).map(|corner| self.position(corner))
    }

    /// The position of a vertex.
    pub fn position(&self, vertex: u32) -> DVec3 {
        self.mesh.positions[vertex as usize]
    }

    /// Moves a vertex.
    pub fn move_vertex(&mut self, vertex: u32, position: DVec3) {
        self.mesh.positions[vertex as usize] = position;
    }

    /// Length of an edge.
    pub fn length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.position(a) - self.position(b)).norm()
    }

    /// Lengths of the edges of a vertex at its birth.
    pub fn size(&self, vertex: u32) -> Size {
        self.mesh.sizes[vertex as usize]
    }

    /// Whether a vertex was there before this frame.
    pub fn has_origin(&self, vertex: u32) -> bool {
        self.mesh.origins[vertex as usize].is_some()
    }

    /// Whether the triangles around a vertex must not be changed.
    pub fn is_flagged(&self, vertex: u32) -> bool {
        self.mesh.flags[vertex as usize]
    }

    /// See [`Improvable::stretch`].
    pub fn stretch(&self, ends: [u32; 2]) -> f64 {
        self.mesh.stretch(ends)
    }

    /// See [`Improvable::needs_change`].
    pub fn needs_change(&self, ends: [u32; 2], is_out: fn(f64) -> bool) -> bool {
        self.mesh.needs_change(ends, is_out)
    }

    /// The triangles around a vertex; none if it was merged into another.
    pub fn around(&self, vertex: u32) -> &[u32] {
        self.fans.around(vertex)
    }

    /// The triangle with the directed edge from a vertex to a neighbour, and its third corner. None if they are not neighbours.
    fn beside(&self, from: u32, to: u32) -> Option<(u32, u32)> {
        self.around(from).iter().find_map(|&triangle| {
            let corners = self.corners(triangle);
            let at = corners.iter().position(|&corner| corner == from)?;
            (corners[(at + 1) % 3] == to).then_some((triangle, corners[(at + 2) % 3]))
        })
    }

    /// The edge between two vertices; none if they are not neighbours.
    pub fn edge(&self, [a, b]: [u32; 2]) -> Option<Edge> {
        let ((one, c), (two, d)) = (self.beside(a, b)?, self.beside(b, a)?);
        Some(Edge { triangles: [one, two], corners: [a, b, c, d] })
    }

    /// The neighbours of a vertex, counter-clockwise seen from outside, starting with `first`. None if there are fewer than 3, or more than
    /// `max_neighbours`.
    pub fn ring_from(&self, vertex: u32, first: u32, max_neighbours: usize) -> Option<Vec<u32>> {
        let count = self.around(vertex).len();
        if !(3..=max_neighbours).contains(&count) {
            return None;
        }
        let mut ring = Vec::with_capacity(count);
        let mut last = first;
        for _ in 0..count {
            ring.push(last);
            last = self.beside(vertex, last)?.1;
        }
        (last == first).then_some(ring)
    }

    /// See [`Fans::may_join`].
    pub fn may_join(&self, a: u32, b: u32) -> bool {
        self.fans.may_join(self.mesh.triangles, a, b)
    }

    /// Whether two vertices are neighbours.
    pub fn are_neighbours(&self, a: u32, b: u32) -> bool {
        self.fans.are_neighbours(self.mesh.triangles, a, b)
    }

    /// Triangles with a corner that a collapse moves or replaces, including those that it removes.
    pub fn moving(&self, collapse: &Collapse) -> Vec<u32> {
        let &Collapse { from, to, position, .. } = collapse;
        self.fans.moving(self.mesh.triangles, [from, to], position != self.position(to)).collect()
    }

    /// The triangles changed since the last call, ascending; collapses may have removed some.
    pub fn take_touched(&mut self) -> Vec<u32> {
        let mut touched = std::mem::take(&mut self.touched);
        touched.iter().for_each(|&triangle| self.is_touched[triangle as usize] = false);
        touched.sort_unstable();
        touched
    }

    /// Splits an edge by a vertex at a position.
    pub fn split(&mut self, edge: &Edge, position: DVec3) {
        let Edge { triangles: [one, two], corners: [a, b, c, d] } = *edge;
        let made = self.mesh.positions.len() as u32;
        let [three, four] = [0, 1].map(|n| self.mesh.triangles.len() as u32 + n);
        let size = mean(self.size(a), self.size(b));
        self.mesh.positions.push(position);
        self.mesh.sizes.push(size);
        let drift = self.mean_drift(a, b);
        self.mesh.drifts.push(drift);
        self.mesh.origins.push(None);
        self.mesh.flags.push(false);
        self.is_gone.push(false);
        for (triangle, near, far) in [(one, [a, made, c], [made, b, c]), (two, [b, made, d], [made, a, d])] {
            self.mark_as_part(triangle);
            self.mesh.triangles[triangle as usize] = near;
            self.mesh.triangles.push(far);
            let source = self.mesh.sources[triangle as usize];
            self.mesh.sources.push(source);
            self.is_touched.push(false);
        }
        self.fans.split([one, two], [three, four], edge.corners);
        [one, two, three, four].into_iter().for_each(|triangle| self.touch(triangle));
    }

    /// Performs a collapse of two vertices that may be merged.
    pub fn collapse(&mut self, collapse: &Collapse) {
        let &Collapse { from, to, position, size } = collapse;
        self.moving(collapse).into_iter().for_each(|triangle| self.mark_as_part(triangle));
        if position != self.position(to) {
            self.mesh.drifts[to as usize] = self.mean_drift(from, to);
        }
        self.mesh.positions[to as usize] = position;
        self.mesh.sizes[to as usize] = size;
        self.is_gone[from as usize] = true;
        self.fans.collapse(self.mesh.triangles, [from, to]);
        self.around(to).to_vec().into_iter().for_each(|triangle| self.touch(triangle));
    }

    /// Replaces an edge by the other diagonal of its two triangles. If these are parts of one triangle, they remain parts.
    pub fn flip(&mut self, edge: &Edge) {
        let sources = edge.triangles.map(|triangle| self.mesh.sources[triangle as usize]);
        let source = if sources[0] == sources[1] { sources[0] } else { Source::New };
        for (triangle, corners) in edge.triangles.into_iter().zip(flipped(edge.corners)) {
            self.mesh.triangles[triangle as usize] = corners;
            self.mesh.sources[triangle as usize] = source;
            self.touch(triangle);
        }
        self.fans.flip(edge.triangles, edge.corners);
    }

    /// The drift of a vertex between two others.
    fn mean_drift(&self, a: u32, b: u32) -> [f32; 3] {
        let [one, two] = [a, b].map(|vertex| self.mesh.drifts[vertex as usize]);
        [0, 1, 2].map(|axis| 0.5 * (one[axis] + two[axis]))
    }

    fn mark_as_part(&mut self, triangle: u32) {
        let source = &mut self.mesh.sources[triangle as usize];
        if let Source::Whole(of) = *source {
            *source = Source::Part(of);
        }
    }

    fn touch(&mut self, triangle: u32) {
        if !std::mem::replace(&mut self.is_touched[triangle as usize], true) {
            self.touched.push(triangle);
        }
    }

    /// Drops the triangles and vertices that collapses removed. All others keep their order.
    pub fn finish(self) {
        let Self { mesh, fans, is_gone, .. } = self;
        if !is_gone.contains(&true) {
            return;
        }
        drop_marked(mesh.triangles, fans.are_dead());
        drop_marked(mesh.sources, fans.are_dead());
        drop_marked(mesh.positions, &is_gone);
        drop_marked(mesh.sizes, &is_gone);
        drop_marked(mesh.drifts, &is_gone);
        drop_marked(mesh.origins, &is_gone);
        drop_marked(mesh.flags, &is_gone);
        renumber_kept(mesh.triangles.as_flattened_mut(), &is_gone);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Body;
    use super::*;
    use crate::geometry::TriMesh;

    /// A cube of 8 vertices and 12 triangles.
    fn cube() -> Body {
        let TriMesh { positions, triangles } = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        Body::of(positions.iter().map(|position| position.cast()).collect(), triangles)
    }

    #[test]
    fn changes_keep_a_closed_manifold_and_the_fans_of_its_triangles() {
        let mut body = cube();
        let mut mesh = body.improvable();
        let mut rings = VertexRings::of(&mut mesh);
        let ends = |rings: &VertexRings<'_, '_>, triangle: u32| {
            let [a, b, _] = rings.corners(triangle);
            [a, b]
        };
        // The stored triangles around a vertex are those that use it.
        let check = |rings: &VertexRings<'_, '_>| {
            for vertex in 0..rings.mesh.positions.len() as u32 {
                let names =
                    |&triangle: &u32| rings.exists(triangle) && rings.corners(triangle).contains(&vertex);
                let expected: Vec<u32> = (0..rings.mesh.triangles.len() as u32).filter(names).collect();
                let mut around = rings.around(vertex).to_vec();
                around.sort_unstable();
                assert_eq!(around, expected, "around {vertex}");
            }
        };
        check(&rings);
        for triangle in [0, 5, 12, 3, 7] {
            let edge = rings.edge(ends(&rings, triangle)).unwrap();
            assert_eq!(edge.triangles[0], triangle);
            let [a, b, ..] = edge.corners;
            rings.split(&edge, 0.5 * (rings.position(a) + rings.position(b)));
            check(&rings);
        }
        assert_eq!((rings.mesh.positions.len(), rings.mesh.triangles.len()), (13, 22));
        let touched = rings.take_touched();
        assert!(touched.is_sorted() && touched.contains(&13) && rings.take_touched().is_empty());
        let mut flips = 0;
        for triangle in 0..22 {
            let edge = rings.edge(ends(&rings, triangle)).unwrap();
            if !rings.are_neighbours(edge.corners[2], edge.corners[3]) {
                rings.flip(&edge);
                assert_eq!(
                    [rings.corners(triangle), rings.corners(edge.triangles[1])],
                    flipped(edge.corners)
                );
                flips += 1;
            }
            check(&rings);
        }
        let mut joined = 0;
        for triangle in 0..22 {
            let [to, from] = ends(&rings, triangle);
            if rings.exists(triangle) && rings.may_join(from, to) {
                let (position, size) = (rings.position(to), rings.size(to));
                rings.collapse(&Collapse { from, to, position, size });
                joined += 1;
                assert!(rings.edge([from, to]).is_none());
            }
            check(&rings);
        }
        rings.finish();
        assert!(flips > 3 && joined > 3, "{flips} {joined}");
        body.check();
        assert_eq!((body.positions.len(), body.triangles.len()), (13 - joined, 22 - 2 * joined));
    }

    #[test]
    fn rings_go_around_and_sources_follow() {
        let mut body = cube();
        let mut mesh = body.improvable();
        let mut rings = VertexRings::of(&mut mesh);
        let (count, first) = (rings.around(0).len(), rings.fans.ring(rings.mesh.triangles, 0)[0]);
        let ring = rings.ring_from(0, first, 24).unwrap();
        assert_eq!((ring.len(), ring[0]), (count, first));
        for n in 0..count {
            let edge = rings.edge([0, ring[n]]).unwrap();
            assert_eq!(edge.corners[2], ring[(n + 1) % count]);
            assert_eq!(edge.corners[3], ring[(n + count - 1) % count]);
        }
        assert!(rings.ring_from(0, first, count - 1).is_none());
        let [a, b, _] = rings.corners(0);
        let edge = rings.edge([a, b]).unwrap();
        let other = edge.triangles[1];
        rings.mesh.sources[other as usize] = Source::New;
        rings.split(&edge, 0.5 * (rings.position(a) + rings.position(b)));
        assert_eq!(rings.mesh.sources[12..], [Source::Part(0), Source::New]);
        assert_eq!(rings.mesh.sources[0], Source::Part(0));
        assert_eq!((rings.mesh.origins[8], rings.mesh.flags[8]), (None, false));
        let inner = rings.edge([8, edge.corners[2]]).unwrap();
        rings.flip(&inner);
        assert_eq!(
            inner.triangles.map(|triangle| rings.mesh.sources[triangle as usize]),
            [Source::Part(0); 2]
        );
    }
}
