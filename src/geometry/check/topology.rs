//! How the triangles of a mesh are connected by their indices: edges, vertex rings, parts.

use rayon::prelude::*;

/// Whether a mesh is a closed 2-manifold by its indices alone, wherever its vertices lie, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topology {
    /// Triangles.
    pub triangles: usize,
    /// Triangles that use a vertex twice; apart from `triangles`, nothing else counts them.
    pub collapsed_triangles: usize,
    /// Triangles with the vertices of an earlier one, in any order; everything else counts them too.
    pub doubled_triangles: usize,
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles disagree on which side is out.
    pub turned_edges: usize,
    /// Vertices whose triangles do not form one ring, closed or open: where parts touch in a vertex, and both ends of each non-manifold
    /// edge.
    pub non_manifold_vertices: usize,
}

impl Topology {
    /// Surveys triangles over `vertices` vertices.
    pub fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let whole: Vec<[u32; 3]> = triangles.iter().copied().filter(|corners| !collapsed(*corners)).collect();
        let survey = Survey::of(vertices, &whole);
        Self {
            triangles: triangles.len(),
            collapsed_triangles: triangles.len() - whole.len(),
            doubled_triangles: firsts(&whole).iter().filter(|first| !**first).count(),
            open_edges: survey.open.len(),
            non_manifold_edges: survey.non_manifold_edges.len(),
            turned_edges: survey.turned.len(),
            non_manifold_vertices: survey.non_manifold_vertices.len(),
        }
    }

    /// Whether it has a triangle and no fault: closed, each edge with two triangles that agree on which side is out, each vertex with one
    /// ring. The surface may still intersect itself ([`super::faults::Faults::is_embedded`]).
    pub fn is_watertight(&self) -> bool {
        let faults = [
            self.collapsed_triangles,
            self.doubled_triangles,
            self.open_edges,
            self.non_manifold_edges,
            self.turned_edges,
            self.non_manifold_vertices,
        ];
        self.triangles > 0 && faults == [0; 6]
    }
}

/// The vertices, and the edges (smaller vertex index first), where triangles do not form a closed 2-manifold; each triangle must have
/// three different vertices.
pub fn faulty(vertices: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let survey = Survey::of(vertices, triangles);
    (survey.non_manifold_vertices, [survey.open, survey.non_manifold_edges, survey.turned].concat())
}

/// The components of a mesh: indices of triangles that edges connect, ascending; each triangle must have three different vertices.
pub fn components(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut sets = Sets::new(triangles.len());
    for pair in half_edges(triangles).windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        sets.join(pair[0].1 / 3, pair[1].1 / 3);
    }
    let mut order: Vec<(u32, u32)> =
        (0..triangles.len() as u32).map(|triangle| (sets.root(triangle), triangle)).collect();
    order.sort_unstable();
    order
        .chunk_by(|a, b| a.0 == b.0)
        .map(|component| component.iter().map(|(_, triangle)| *triangle).collect())
        .collect()
}

/// Edges and vertex rings of triangles with three different vertices each.
pub(in crate::geometry) struct Survey {
    /// Edges with one triangle, smaller vertex index first.
    pub(in crate::geometry) open: Vec<[u32; 2]>,
    /// Edges with more than two triangles, smaller vertex index first.
    pub(in crate::geometry) non_manifold_edges: Vec<[u32; 2]>,
    /// Edges whose two triangles disagree, smaller vertex index first.
    pub(in crate::geometry) turned: Vec<[u32; 2]>,
    /// See [`Topology::non_manifold_vertices`].
    pub(in crate::geometry) non_manifold_vertices: Vec<u32>,
    edges: usize,
    /// Number of rings of all vertices.
    rings: usize,
    /// For each triangle the first one of its component: the triangles that edges connect.
    pub(in crate::geometry) component: Vec<u32>,
    components: usize,
    triangles: usize,
}

impl Survey {
    pub(in crate::geometry) fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let corners = triangles.as_flattened();
        let (mut rings, mut components) = (Sets::new(corners.len()), Sets::new(triangles.len()));
        let mut is_on_non_manifold = vec![false; vertices];
        let (mut open, mut non_manifold_edges, mut turned, mut edges) =
            (Vec::new(), Vec::new(), Vec::new(), 0);
        for uses in half_edges(triangles).chunk_by(|a, b| a.0 == b.0) {
            let ends = uses[0].0;
            edges += 1;
            match uses {
                [_] => open.push(ends),
                [(_, a), (_, b)] if corners[*a as usize] != corners[*b as usize] => {}
                [_, _] => turned.push(ends),
                _ => {
                    non_manifold_edges.push(ends);
                    ends.iter().for_each(|&end| is_on_non_manifold[end as usize] = true);
                }
            }
            for pair in uses.windows(2) {
                let ([a, b], [c, d]) =
                    ([pair[0].1, next_corner(pair[0].1)], [pair[1].1, next_corner(pair[1].1)]);
                let (c, d) = if corners[a as usize] == corners[c as usize] { (c, d) } else { (d, c) };
                rings.join(a, c);
                rings.join(b, d);
                components.join(a / 3, c / 3);
            }
        }
        let mut rings_of = vec![0u32; vertices];
        rings.roots().for_each(|corner| rings_of[corners[corner] as usize] += 1);
        Self {
            open,
            non_manifold_edges,
            turned,
            non_manifold_vertices: (0..vertices as u32)
                .filter(|vertex| rings_of[*vertex as usize] > 1 || is_on_non_manifold[*vertex as usize])
                .collect(),
            edges,
            rings: rings.roots().count(),
            component: (0..triangles.len() as u32).map(|triangle| components.root(triangle)).collect(),
            components: components.roots().count(),
            triangles: triangles.len(),
        }
    }

    /// Handles, summed over all components, if the surface is closed and has no non-manifold edge. A vertex with several rings counts as
    /// that many, and components that touch only there are separate.
    pub(in crate::geometry) fn genus(&self) -> Option<i64> {
        let closed = self.open.is_empty() && self.non_manifold_edges.is_empty() && self.triangles > 0;
        let euler = self.rings as i64 - self.edges as i64 + self.triangles as i64;
        closed.then_some(self.components as i64 - euler / 2)
    }
}

/// Whether a triangle uses a vertex twice.
pub(in crate::geometry) fn collapsed([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// For each triangle, whether no earlier one has the same vertices, in any order.
pub(in crate::geometry) fn firsts(triangles: &[[u32; 3]]) -> Vec<bool> {
    let sorted = |(mut corners, index): ([u32; 3], u32)| {
        corners.sort_unstable();
        (corners, index)
    };
    let mut order: Vec<([u32; 3], u32)> = triangles.iter().copied().zip(0..).map(sorted).collect();
    order.par_sort_unstable();
    let mut firsts = vec![true; triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        same[1..].iter().for_each(|(_, index)| firsts[*index as usize] = false);
    }
    firsts
}

/// The half-edges, sorted: the edge (smaller vertex index first), and the corner where the half-edge begins.
fn half_edges(triangles: &[[u32; 3]]) -> Vec<([u32; 2], u32)> {
    let of_triangle = |([a, b, c], first): ([u32; 3], u32)| {
        let half = |i: u32, j: u32, corner: u32| ([i.min(j), i.max(j)], 3 * first + corner);
        [half(a, b, 0), half(b, c, 1), half(c, a, 2)]
    };
    let mut halves: Vec<([u32; 2], u32)> = triangles.iter().copied().zip(0..).flat_map(of_triangle).collect();
    halves.par_sort_unstable();
    halves
}

/// The next corner of the same triangle.
fn next_corner(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// Number of connected parts of triangles over `vertices` vertices; parts that meet in a vertex are connected.
pub fn parts(vertices: usize, triangles: &[[u32; 3]]) -> usize {
    groups(vertices, triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c]]))
}

/// For each vertex the sum of its neighbours' values, and how many have one. Each triangle around a vertex contributes the next vertex in
/// its order.
pub fn neighbour_sums<T: Default + Copy + std::ops::AddAssign>(
    vertices: usize,
    triangles: &[[u32; 3]],
    of: impl Fn(u32) -> Option<T>,
) -> Vec<(T, u32)> {
    let mut sums = vec![(T::default(), 0); vertices];
    for corners in triangles {
        for (at, next) in [(0, 1), (1, 2), (2, 0)] {
            if let Some(value) = of(corners[next]) {
                let sum = &mut sums[corners[at] as usize];
                sum.0 += value;
                sum.1 += 1;
            }
        }
    }
    sums
}

/// Number of connected groups of the vertices that links use; each link connects two.
pub(in crate::geometry) fn groups(vertices: usize, links: impl Iterator<Item = [u32; 2]>) -> usize {
    let (mut sets, mut is_used) = (Sets::new(vertices), vec![false; vertices]);
    for link in links {
        link.iter().for_each(|&vertex| is_used[vertex as usize] = true);
        sets.join(link[0], link[1]);
    }
    sets.roots().filter(|&vertex| is_used[vertex]).count()
}

/// Disjoint sets: each index points to a smaller one of its set, the smallest to itself.
#[derive(Clone)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// Sets of one index each.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The smallest index of a set.
    pub fn root(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            let up = self.0[self.0[at as usize] as usize];
            self.0[at as usize] = up;
            at = up;
        }
        at
    }

    /// Joins the sets of two indices.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The set of each index, numbered in the order of their smallest ones, and the count of sets.
    pub fn numbered(mut self) -> (Vec<u32>, usize) {
        let (mut numbers, mut count) = (vec![0; self.0.len()], 0);
        for at in 0..numbers.len() {
            let root = self.root(at as u32) as usize;
            numbers[at] = if root == at { count } else { numbers[root] };
            count += u32::from(root == at);
        }
        (numbers, count as usize)
    }

    fn roots(&self) -> impl Iterator<Item = usize> {
        self.0.iter().enumerate().filter(|(at, up)| *at == **up as usize).map(|(at, _)| at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(vertices: usize, triangles: &[[u32; 3]]) -> [usize; 6] {
        let t = Topology::of(vertices, triangles);
        assert_eq!(t.is_watertight(), faults_of(t) == [0; 6]);
        faults_of(t)
    }

    /// Collapsed, doubled, open, non-manifold edges, turned, non-manifold vertices.
    fn faults_of(t: Topology) -> [usize; 6] {
        let edges = [t.open_edges, t.non_manifold_edges, t.turned_edges];
        [t.collapsed_triangles, t.doubled_triangles, edges[0], edges[1], edges[2], t.non_manifold_vertices]
    }

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn each_fault_is_counted_alone() {
        assert_eq!(faults(4, &TETRAHEDRON), [0; 6]);
        assert_eq!(faults(4, &TETRAHEDRON[1..]), [0, 0, 3, 0, 0, 0]);
        let mut turned = TETRAHEDRON;
        turned[2].swap(0, 1);
        assert_eq!(faults(4, &turned), [0, 0, 0, 0, 3, 0]);
        let mut with_needle = TETRAHEDRON.to_vec();
        with_needle.push([3, 1, 3]);
        assert_eq!(faults(4, &with_needle), [1, 0, 0, 0, 0, 0]);
        // Both sides of one triangle: closed, but not a surface.
        assert_eq!(faults(3, &[[0, 1, 2], [2, 1, 0]]), [0, 1, 0, 0, 0, 0]);
        // Two triangles that share only a vertex; then joined by a third into one open ring.
        assert_eq!(faults(5, &[[0, 1, 2], [0, 3, 4]]), [0, 0, 6, 0, 0, 1]);
        assert_eq!(faults(5, &[[0, 1, 2], [0, 3, 4], [0, 2, 3]]), [0, 0, 5, 0, 0, 0]);
        // Three triangles on an edge.
        assert_eq!(faults(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]), [0, 0, 6, 1, 0, 2]);
        assert!(!Topology::of(0, &[]).is_watertight());
    }

    #[test]
    fn groups_are_connected_by_links() {
        assert_eq!(groups(9, [[7, 3], [1, 2], [3, 1], [5, 6], [6, 5]].into_iter()), 2);
        assert_eq!(groups(9, std::iter::empty()), 0);
    }

    #[test]
    fn components_that_touch_in_a_vertex_have_separate_genera() {
        let mirrored = TETRAHEDRON.map(|corners| corners.map(|v| if v == 0 { 0 } else { v + 3 }));
        let two: Vec<[u32; 3]> = TETRAHEDRON.into_iter().chain(mirrored).collect();
        let survey = Survey::of(7, &two);
        assert_eq!((survey.genus(), survey.non_manifold_vertices), (Some(0), vec![0]));
    }
}
