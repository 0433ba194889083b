//! The invariant part of a moving mesh: closed triangles, and the edges between them.
//!
//! The boundary of any set of oriented triangles is a set of cycles. Each cycle is closed by a cone to the (moving) centroid of its
//! vertices, so that open meshes, non-manifold meshes and triangle soups all become closed chains.

use std::collections::BTreeMap;

use crate::geometry::DVec3;
use crate::geometry::check::topology::Sets;
use crate::geometry::lists::Lists;
use crate::geometry::shape::normal;

/// A triangle with its vertices in ascending order: this order determines how prisms are split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Simplex {
    /// Vertex indices, v0 < v1 < v2.
    pub v: [u32; 3],
    /// +1 if (v0, v1, v2) is counter-clockwise seen from outside, else -1.
    pub sign: i8,
}

impl Simplex {
    /// Its vertices, counter-clockwise seen from outside.
    pub fn triangle(&self) -> [u32; 3] {
        let [a, b, c] = self.v;
        if self.sign > 0 { [a, b, c] } else { [a, c, b] }
    }

    /// Twice its area (m2) at a pose.
    pub fn doubled_area(&self, pose: &[DVec3]) -> f64 {
        normal(&self.v.map(|vertex| pose[vertex as usize])).norm()
    }

    /// A counter-clockwise triangle; none if two corners are the same.
    pub fn new([a, b, c]: [u32; 3]) -> Option<Self> {
        if a == b || b == c || c == a {
            return None;
        }
        let mut v = [a, b, c];
        let mut sign = 1;
        for (i, j) in [(0, 1), (1, 2), (0, 1)] {
            if v[i] > v[j] {
                v.swap(i, j);
                sign = -sign;
            }
        }
        Some(Self { v, sign })
    }
}

/// One triangle beside an edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Incidence {
    /// Index of the triangle.
    pub triangle: u32,
    /// Which of its edges: 0 = (v0, v1), 1 = (v1, v2), 2 = (v0, v2).
    pub side: u8,
}

/// A vertex that is computed from others at each pose.
#[derive(Debug, Clone, PartialEq)]
pub enum Derived {
    /// Mean of the vertices of an open loop.
    Centroid(Vec<u32>),
    /// On the edge from one vertex to another, at this fraction of its length.
    Along(u32, u32, f64),
}

impl Derived {
    /// Its position, given a pose of the vertices before it.
    pub fn position(&self, pose: &[DVec3]) -> DVec3 {
        match self {
            Self::Centroid(vertices) => {
                let sum: DVec3 = vertices.iter().map(|&vertex| pose[vertex as usize]).sum();
                sum / vertices.len() as f64
            }
            Self::Along(i, j, part) => pose[*i as usize].lerp(&pose[*j as usize], *part),
        }
    }
}

/// Closed triangles, their unique edges, and the vertices that are added to the mesh's own.
#[derive(Debug, Clone, Default)]
pub struct Topology {
    /// Number of vertices of the mesh itself.
    pub own_vertices: usize,
    /// Vertices computed at each pose; the first has index `own_vertices`.
    pub derived: Vec<Derived>,
    /// The triangles, caps included, without degenerate ones.
    pub simplices: Vec<Simplex>,
    /// Unique edges (i < j).
    pub edges: Vec<[u32; 2]>,
    /// `incidences[edge_start[e]..edge_start[e + 1]]` are the triangles beside edge e.
    pub edge_start: Vec<u32>,
    /// Triangles beside edges.
    pub incidences: Vec<Incidence>,
}

impl Topology {
    /// Topology of a mesh's triangles; `welded_to[v]` is the vertex that v is welded to, or v itself.
    ///
    /// With `close`, open loops are capped.
    pub fn new(triangles: &[[u32; 3]], vertex_count: usize, welded_to: &[u32], close: bool) -> Self {
        let mut topology = Self { own_vertices: vertex_count, ..Self::default() };
        topology.simplices.reserve(triangles.len());
        for triangle in triangles {
            topology.push_triangle(triangle.map(|vertex| welded_to[vertex as usize]));
        }
        topology.index_edges();
        if close {
            topology.close();
        }
        topology
    }

    /// Caps its open loops.
    pub fn close(&mut self) {
        if self.cap_open_loops() {
            self.index_edges();
        }
    }

    /// The caps of open loops: the triangles with a derived vertex.
    pub fn caps(&self) -> impl Iterator<Item = &Simplex> {
        // The highest vertex comes last.
        self.simplices.iter().filter(|simplex| simplex.v[2] as usize >= self.own_vertices)
    }

    /// A topology from its triangles and derived vertices.
    pub fn from_parts(own_vertices: usize, derived: Vec<Derived>, simplices: Vec<Simplex>) -> Self {
        let mut topology = Self { own_vertices, derived, simplices, ..Self::default() };
        topology.index_edges();
        topology
    }

    /// Number of own and derived vertices.
    pub fn vertex_count(&self) -> usize {
        self.own_vertices + self.derived.len()
    }

    /// Appends the derived vertices to a pose of the own ones.
    pub fn complete(&self, pose: &mut Vec<DVec3>) {
        pose.truncate(self.own_vertices);
        for derived in &self.derived {
            let position = derived.position(pose);
            pose.push(position);
        }
    }

    /// Whether every edge is balanced, so that the triangles bound a solid.
    pub fn is_closed(&self) -> bool {
        (0..self.edges.len()).all(|edge| self.imbalance(edge) == 0)
    }

    /// Whether some edge has only one triangle.
    pub fn has_lone_triangles(&self) -> bool {
        (0..self.edges.len()).any(|edge| self.beside(edge).len() == 1)
    }

    /// Count of edges along which two or more triangles run in one direction without a counterpart.
    pub fn contradictions(&self) -> usize {
        (0..self.edges.len()).filter(|&edge| self.imbalance(edge).abs() > 1).count()
    }

    /// Triangles beside an edge.
    pub fn beside(&self, edge: usize) -> &[Incidence] {
        &self.incidences[self.edge_start[edge] as usize..self.edge_start[edge + 1] as usize]
    }

    fn push_triangle(&mut self, triangle: [u32; 3]) {
        self.simplices.extend(Simplex::new(triangle));
    }

    fn index_edges(&mut self) {
        const SIDES: [(usize, usize, u8); 3] = [(0, 1, 0), (1, 2, 1), (0, 2, 2)];
        // Listed by the lower vertex; each list is then sorted by the other, and is short, as vertices have few neighbours.
        let of_triangle = |(simplex, triangle): (&Simplex, u32)| {
            let v = simplex.v;
            SIDES.map(|(i, j, side)| (v[i], (v[j], Incidence { triangle, side })))
        };
        let mut sorted =
            Lists::new(self.vertex_count(), self.simplices.iter().zip(0..).flat_map(of_triangle));
        sorted.each_mut(|beside| beside.sort_unstable_by_key(|(other, at)| (*other, at.triangle)));
        self.edges.clear();
        self.edge_start.clear();
        self.incidences.clear();
        for vertex in 0..self.vertex_count() {
            let mut last = None;
            for &(other, at) in sorted.get(vertex) {
                if last != Some(other) {
                    self.edges.push([vertex as u32, other]);
                    self.edge_start.push(self.incidences.len() as u32);
                    last = Some(other);
                }
                self.incidences.push(at);
            }
        }
        self.edge_start.push(self.incidences.len() as u32);
    }

    /// The number of triangles that run along edge (i, j) from i to j, minus those from j to i.
    fn imbalance(&self, edge: usize) -> i32 {
        let along = |at: &Incidence| {
            let sign = i32::from(self.simplices[at.triangle as usize].sign);
            if at.side == 2 { -sign } else { sign }
        };
        self.beside(edge).iter().map(along).sum()
    }

    /// Closes every boundary cycle with a cone to its centroid; returns whether there was one.
    fn cap_open_loops(&mut self) -> bool {
        let open: Vec<([u32; 2], i32)> = (0..self.edges.len())
            .map(|edge| (self.edges[edge], self.imbalance(edge)))
            .filter(|(_, imbalance)| *imbalance != 0)
            .collect();
        if open.is_empty() {
            return false;
        }
        let mut groups = Sets::new(self.vertex_count());
        open.iter().for_each(|([i, j], _)| groups.join(*i, *j));
        let mut loops: BTreeMap<u32, Vec<([u32; 2], i32)>> = BTreeMap::new();
        for (edge, imbalance) in &open {
            loops.entry(groups.root(edge[0])).or_default().push((*edge, *imbalance));
        }
        for edges in loops.into_values() {
            let mut rim: Vec<u32> = edges.iter().flat_map(|(edge, _)| *edge).collect();
            rim.sort_unstable();
            rim.dedup();
            let apex = self.vertex_count() as u32;
            self.derived.push(Derived::Centroid(rim));
            for ([i, j], imbalance) in edges {
                // The cap runs j -> i along an edge along which the mesh runs i -> j.
                for _ in 0..imbalance.abs() {
                    self.push_triangle(if imbalance > 0 { [j, i, apex] } else { [i, j, apex] });
                }
            }
        }
        !open.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(count: usize) -> Vec<u32> {
        (0..count as u32).collect()
    }

    #[test]
    fn a_tetrahedron_is_closed_and_a_face_less_is_capped_to_closed() {
        let all = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        assert!(Topology::new(&all, 4, &identity(4), true).derived.is_empty());
        let open = Topology::new(&all[..3], 4, &identity(4), false);
        assert!(!open.is_closed());
        let capped = Topology::new(&all[..3], 4, &identity(4), true);
        assert!(capped.is_closed());
        assert_eq!(capped.simplices.len(), 6);
    }

    #[test]
    fn three_sheets_on_one_edge_close() {
        let book = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        assert!(Topology::new(&book, 5, &identity(5), true).is_closed());
    }
}
