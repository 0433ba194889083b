//! Faults and properties of a mesh that decide whether it bounds a solid.

use std::collections::{BTreeMap, HashSet};

use rayon::prelude::*;

use super::bvh::Bvh;
use super::mesh::coincident;
use super::{DVec3, TriMesh, Vec3};

/// Triangles a task looks at.
const GRAIN: usize = 512;

/// Faults and properties of a mesh. Vertices at the same position count as one.
#[derive(Debug, Clone, PartialEq)]
pub struct Faults {
    /// Vertices that no triangle names.
    pub unused_vertices: usize,
    /// Vertices that share their place with one before them.
    pub doubled_vertices: usize,
    /// Triangles with two corners at the same place, or without area.
    pub degenerate: usize,
    /// Triangles with the corners of one before them, in any order.
    pub doubled_triangles: usize,
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Connected sets of open edges: holes.
    pub holes: usize,
    /// Edges with more than two triangles.
    pub crowded_edges: usize,
    /// Edges whose two triangles disagree about which side is out.
    pub turned_edges: usize,
    /// Connected parts.
    pub parts: usize,
    /// Pairs of triangles that cut each other.
    pub crossings: usize,
    /// Handles, summed over the parts, when the surface is closed and no edge is crowded.
    pub genus: Option<i64>,
}

impl Faults {
    /// Surveys a mesh whose indices are in range.
    pub fn of(mesh: &TriMesh) -> Self {
        let same = coincident(mesh.positions.iter().map(|p| p.cast()));
        let doubled_vertices =
            same.iter().enumerate().filter(|(vertex, same)| **same as usize != *vertex).count();
        let used: HashSet<u32> = mesh.triangles.iter().flatten().copied().collect();
        let places: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
        let Kept { kept, degenerate, doubled_triangles } = kept(&places, &mesh.triangles, &same);
        let edges = edges(&kept);
        let (mut open, mut crowded_edges, mut turned_edges) = (Vec::new(), 0, 0);
        for (edge, ways) in &edges {
            match ways[..] {
                [_] => open.push(*edge),
                [a, b] => turned_edges += usize::from(a == b),
                _ => crowded_edges += 1,
            }
        }
        let parts = groups(kept.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c]]));
        let closed = open.is_empty() && crowded_edges == 0 && !kept.is_empty();
        let corners: HashSet<u32> = kept.iter().flatten().copied().collect();
        let euler = corners.len() as i64 - edges.len() as i64 + kept.len() as i64;
        Self {
            unused_vertices: mesh.positions.len() - used.len(),
            doubled_vertices,
            degenerate,
            doubled_triangles,
            holes: groups(open.iter().copied()),
            open_edges: open.len(),
            crowded_edges,
            turned_edges,
            parts,
            crossings: crossings(&TriMesh { positions: mesh.positions.clone(), triangles: kept }),
            genus: closed.then_some(parts as i64 - euler / 2),
        }
    }

    /// Whether the mesh bounds a solid without doubt: closed, each edge with two triangles that agree.
    pub fn is_solid(&self) -> bool {
        self.open_edges == 0 && self.crowded_edges == 0 && self.turned_edges == 0 && self.parts > 0
    }
}

/// Holes of a mesh: connected sets of edges with one triangle, as [`Faults::holes`].
pub fn holes(places: &[DVec3], triangles: &[[u32; 3]]) -> usize {
    let same = coincident(places.iter().copied());
    let edges = edges(&kept(places, triangles, &same).kept);
    groups(edges.iter().filter(|(_, ways)| ways.len() == 1).map(|(edge, _)| *edge))
}

/// The triangles that count, with joined corners, and how many do not.
struct Kept {
    kept: Vec<[u32; 3]>,
    degenerate: usize,
    doubled_triangles: usize,
}

fn kept(places: &[DVec3], triangles: &[[u32; 3]], same: &[u32]) -> Kept {
    let mut seen = HashSet::new();
    let mut out = Kept { kept: Vec::with_capacity(triangles.len()), degenerate: 0, doubled_triangles: 0 };
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        let corners = triangle.map(|vertex| same[vertex as usize]);
        let mut sorted = corners;
        sorted.sort_unstable();
        let flat = (b - a).cross(&(c - a)).norm_squared() == 0.0;
        if sorted[0] == sorted[1] || sorted[1] == sorted[2] || flat {
            out.degenerate += 1;
        } else if seen.insert(sorted) {
            out.kept.push(corners);
        } else {
            out.doubled_triangles += 1;
        }
    }
    out
}

/// Edges (lesser vertex first) with the way that each of their triangles runs along them.
fn edges(triangles: &[[u32; 3]]) -> Vec<([u32; 2], Vec<bool>)> {
    let mut uses: Vec<([u32; 2], bool)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .map(|(i, j)| if i < j { ([i, j], true) } else { ([j, i], false) })
        .collect();
    uses.sort_unstable();
    uses.chunk_by(|a, b| a.0 == b.0).map(|uses| (uses[0].0, uses.iter().map(|u| u.1).collect())).collect()
}

/// Number of connected groups of vertices.
fn groups(links: impl Iterator<Item = [u32; 2]>) -> usize {
    fn root(parent: &mut BTreeMap<u32, u32>, vertex: u32) -> u32 {
        let mut at = vertex;
        loop {
            let up = *parent.entry(at).or_insert(at);
            if up == at {
                break;
            }
            at = up;
        }
        parent.insert(vertex, at);
        at
    }
    let mut parent = BTreeMap::new();
    for [i, j] in links {
        let (i, j) = (root(&mut parent, i), root(&mut parent, j));
        parent.insert(i.max(j), i.min(j));
    }
    parent.iter().filter(|(vertex, up)| vertex == up).count()
}

/// Pairs of triangles without a common corner of which an edge of one passes through the other.
fn crossings(mesh: &TriMesh) -> usize {
    let tree = Bvh::new(mesh);
    let of_triangle = |first: usize| {
        let mine = mesh.triangles[first];
        let [a, b, c] = mine.map(|vertex| mesh.positions[vertex as usize]);
        let mut count = 0;
        tree.in_box(a.inf(&b).inf(&c), a.sup(&b).sup(&c), |second| {
            let theirs = mesh.triangles[second];
            let apart = second > first && !mine.iter().any(|vertex| theirs.contains(vertex));
            let cut = apart && {
                let theirs = theirs.map(|vertex| mesh.positions[vertex as usize]);
                pierces([a, b, c], theirs) || pierces(theirs, [a, b, c])
            };
            count += usize::from(cut);
        });
        count
    };
    (0..mesh.triangles.len()).into_par_iter().with_min_len(GRAIN).map(of_triangle).sum()
}

/// Whether an edge of one triangle passes through another, from one side of its plane to the other.
fn pierces(edges: [Vec3; 3], triangle: [Vec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|p| p.cast::<f64>());
    let volume = |p: DVec3, q: DVec3, r: DVec3, s: DVec3| (q - p).dot(&(r - p).cross(&(s - p)));
    (0..3).any(|edge| {
        let [p, q] = [edges[edge], edges[(edge + 1) % 3]].map(|p| p.cast::<f64>());
        let (below, above) = (volume(p, a, b, c), volume(q, a, b, c));
        if below * above >= 0.0 {
            return false;
        }
        let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
        sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron(at: f32) -> TriMesh {
        let shift = Vec3::new(at, at, at);
        TriMesh {
            positions: [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()].map(|p| p + shift).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        }
    }

    #[test]
    fn a_tetrahedron_has_no_fault_and_two_that_overlap_cross() {
        let whole = Faults::of(&tetrahedron(0.0));
        assert!(whole.is_solid());
        assert_eq!((whole.parts, whole.genus, whole.crossings), (1, Some(0), 0));
        let mut two = tetrahedron(0.0);
        two.append(&tetrahedron(0.1));
        let two = Faults::of(&two);
        assert_eq!((two.parts, two.genus), (2, Some(0)));
        assert!(two.crossings > 0 && two.is_solid());
    }

    #[test]
    fn every_kind_of_fault_is_counted() {
        let mut mesh = tetrahedron(0.0);
        mesh.triangles.pop();
        let open = Faults::of(&mesh);
        assert_eq!((open.open_edges, open.holes, open.genus), (3, 1, None));
        let mut mesh = tetrahedron(0.0);
        mesh.triangles[3].swap(0, 1);
        assert_eq!(Faults::of(&mesh).turned_edges, 3);
        let mut mesh = tetrahedron(0.0);
        mesh.positions.extend([Vec3::new(5.0, 0.0, 0.0), Vec3::x(), Vec3::new(-1.0, -1.0, 0.0)]);
        mesh.triangles.extend([[2, 1, 0], [0, 5, 1], [0, 1, 6]]);
        let faults = Faults::of(&mesh);
        assert_eq!((faults.unused_vertices, faults.doubled_vertices), (1, 1));
        assert_eq!((faults.doubled_triangles, faults.degenerate, faults.crowded_edges), (1, 1, 1));
    }
}
