//! Faults and properties of a mesh that decide whether it bounds a solid.

use rayon::prelude::*;

use super::intersection::{Meeting, meeting};
use super::predicates::is_flat;
use super::topology::{Survey, Topology, collapsed, firsts, groups, parts};
use crate::geometry::mesh::weld::Weld;
use crate::geometry::mesh::{coincident, used};
use crate::geometry::shape::{bounds, six_volumes};
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::spatial::near_pairs::NearPairs;
use crate::geometry::{DVec3, TriMesh};

/// Triangles per task.
const GRAIN: usize = 512;
/// The volume of a part counts as 0 if it is at most this fraction of the cube of the part's size: rounding alone can produce as much.
const ROUNDING: f64 = 1e-12;

/// Faults and properties of a mesh. Except in `by_index`, vertices at the same position count as one, and so do vertices on open edges that
/// are within rounding of one another ([`Weld`]). Every count is exact, without tolerance, for the resulting 32-bit coordinates; only
/// `inverted_parts` depends on volumes and rays in 64 bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Faults {
    /// Vertices that no triangle uses.
    pub unused_vertices: usize,
    /// Vertices that share their position with an earlier one.
    pub doubled_vertices: usize,
    /// Vertices on open edges that are joined with an earlier one within rounding.
    pub near_vertices: usize,
    /// Vertices on open edges that are within rounding of others, where it is not clear which belong together ([`Weld::ambiguous`]).
    pub ambiguous_vertices: usize,
    /// Triangles with two corners at the same position, or without area; not counted below.
    pub degenerate: usize,
    /// Triangles with the corners of an earlier one, in any order; not counted below.
    pub doubled_triangles: usize,
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Connected sets of open edges: holes.
    pub holes: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles disagree on which side is out.
    pub turned_edges: usize,
    /// Vertices whose triangles do not form one ring, closed or open: where parts touch in a vertex, and both ends of each non-manifold
    /// edge.
    pub non_manifold_vertices: usize,
    /// Connected parts; parts that touch in a vertex are one.
    pub parts: usize,
    /// Parts whose volume has the opposite sign of the whole mesh's, so that they enclose nothing; here parts that touch only in a vertex
    /// are separate. Cavities, whose outermost corners lie within parts that have the whole mesh's sign, do not count. Counted only where
    /// all edges have two triangles that agree.
    pub inverted_parts: usize,
    /// Area (m2).
    pub area: f64,
    /// Enclosed volume (m3), negative if the mesh is inside out; of little meaning if it is open.
    pub volume: f64,
    /// Pairs of triangles without a common corner that intersect.
    pub crossings: usize,
    /// Pairs of triangles with one common corner that intersect.
    pub corner_crossings: usize,
    /// Pairs of triangles with a common edge that are folded onto each other: coplanar, on the same side of it.
    pub folds: usize,
    /// Pairs of triangles without a common edge that overlap in a plane.
    pub overlaps: usize,
    /// Pairs of triangles that touch elsewhere than in a common corner without intersecting: a corner on a face or an edge, an edge across
    /// an edge.
    pub touches: usize,
    /// Handles, summed over the parts; only if the surface is closed and has no non-manifold edge.
    pub genus: Option<i64>,
    /// The mesh by its indices alone: all triangles count, and vertices at the same position are separate.
    pub by_index: Topology,
}

impl Faults {
    /// Surveys a mesh whose positions are finite and whose indices are in range.
    pub fn of(mesh: &TriMesh) -> Self {
        let vertices = mesh.positions.len();
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
        let weld = Weld::of(&positions, &mesh.triangles);
        let same = &weld.firsts;
        let joined_vertices =
            same.iter().enumerate().filter(|(vertex, same)| **same as usize != *vertex).count();
        let flat = |corners: [u32; 3]| is_flat(&corners.map(|vertex| mesh.positions[vertex as usize]));
        let Counted { counted, degenerate, doubled_triangles } = counted(&mesh.triangles, same, flat);
        let survey = Survey::of(vertices, &counted);
        let parts = parts(vertices, &counted);
        let joined = TriMesh { positions: mesh.positions.clone(), triangles: counted };
        let pairs = Pairs::of(&joined);
        let volume = joined.volume();
        let is_closed =
            survey.open.is_empty() && survey.non_manifold_edges.is_empty() && survey.turned.is_empty();
        Self {
            unused_vertices: used(vertices, &mesh.triangles).map_or(0, |used| vertices - used.len()),
            doubled_vertices: joined_vertices - weld.near.len(),
            near_vertices: weld.near.len(),
            ambiguous_vertices: weld.ambiguous.len(),
            degenerate,
            doubled_triangles,
            holes: groups(vertices, survey.open.iter().copied()),
            open_edges: survey.open.len(),
            non_manifold_edges: survey.non_manifold_edges.len(),
            turned_edges: survey.turned.len(),
            non_manifold_vertices: survey.non_manifold_vertices.len(),
            parts,
            inverted_parts: if is_closed { inverted_parts(&joined, &survey.component, volume) } else { 0 },
            area: joined.area(),
            volume,
            crossings: pairs.crossings,
            corner_crossings: pairs.corner_crossings,
            folds: pairs.folds,
            overlaps: pairs.overlaps,
            touches: pairs.touches,
            genus: survey.genus(),
            by_index: Topology::of(vertices, &mesh.triangles),
        }
    }

    /// Whether the mesh clearly bounds a solid once vertices at the same position are joined: closed, each edge with two triangles that
    /// agree, and no part inside out, unless all are. For the unjoined mesh, see [`Topology::is_watertight`] of `by_index`.
    pub fn is_solid(&self) -> bool {
        let faults = [self.open_edges, self.non_manifold_edges, self.turned_edges, self.inverted_parts];
        self.parts > 0 && faults == [0; 4]
    }

    /// Whether triangles meet only in common corners and edges.
    pub fn is_embedded(&self) -> bool {
        let pairs = [self.crossings, self.corner_crossings, self.folds, self.overlaps, self.touches];
        pairs == [0; 5] && self.doubled_triangles == 0
    }
}

/// Pairs of triangles (numbers, ascending) that meet elsewhere than in common corners and edges, exactly; vertices at the same position are
/// common. A triangle that coincides with an earlier one is paired with it; triangles without area are left out.
pub fn meeting_pairs(mesh: &TriMesh) -> Vec<[u32; 2]> {
    let same = coincident(mesh.positions.iter().map(|p| p.cast()));
    let position = |corners: [u32; 3]| corners.map(|vertex| mesh.positions[vertex as usize]);
    let joined = mesh.triangles.iter().map(|corners| corners.map(|vertex| same[vertex as usize])).zip(0u32..);
    let (triangles, numbers): (Vec<[u32; 3]>, Vec<u32>) =
        joined.filter(|(corners, _)| !collapsed(*corners) && !is_flat(&position(*corners))).unzip();
    let joined = TriMesh { positions: mesh.positions.clone(), triangles };
    let near = NearPairs::of(&joined);
    let of_triangle = |first: usize| {
        let mut pairs = Vec::new();
        near.of_triangle(first, |second| {
            let [a, b] = [first, second].map(|triangle| position(joined.triangles[triangle]));
            if meeting(&a, &b) != Meeting::Apart {
                let [a, b] = [first, second].map(|triangle| numbers[triangle]);
                pairs.push([a.min(b), a.max(b)]);
            }
        });
        pairs
    };
    let triangles = (0..joined.triangles.len()).into_par_iter().with_min_len(GRAIN);
    let mut pairs: Vec<[u32; 2]> = triangles.flat_map_iter(of_triangle).collect();
    pairs.par_sort_unstable();
    pairs
}

/// Holes of a mesh: connected sets of edges with one triangle, as [`Faults::holes`]; in 64 bits, where rounding decides whether a triangle
/// has an area. For each vertex, `same` gives the first one that is the same corner ([`Weld::firsts`]).
pub fn holes(positions: &[DVec3], triangles: &[[u32; 3]], same: &[u32]) -> usize {
    let flat = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
        (b - a).cross(&(c - a)).norm_squared() == 0.0
    };
    let survey = Survey::of(positions.len(), &counted(triangles, same, flat).counted);
    groups(positions.len(), survey.open.into_iter())
}

/// Area (m2) of the triangles that count: all except those with the corners of an earlier one.
pub fn counted_area(mesh: &TriMesh) -> f64 {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
    let triangles =
        counted(&mesh.triangles, &Weld::of(&positions, &mesh.triangles).firsts, |_| false).counted;
    TriMesh { positions: mesh.positions.clone(), triangles }.area()
}

/// The triangles that count, with joined corners, and the number of those that do not.
struct Counted {
    counted: Vec<[u32; 3]>,
    degenerate: usize,
    doubled_triangles: usize,
}

fn counted(triangles: &[[u32; 3]], same: &[u32], flat: impl Fn([u32; 3]) -> bool) -> Counted {
    let joined = triangles.iter().map(|corners| corners.map(|vertex| same[vertex as usize]));
    let whole: Vec<[u32; 3]> = joined.filter(|corners| !collapsed(*corners) && !flat(*corners)).collect();
    let firsts = firsts(&whole);
    let counted: Vec<[u32; 3]> =
        whole.iter().zip(&firsts).filter(|(_, first)| **first).map(|(corners, _)| *corners).collect();
    Counted {
        degenerate: triangles.len() - whole.len(),
        doubled_triangles: whole.len() - counted.len(),
        counted,
    }
}

/// A connected part of a mesh.
struct Part<'a> {
    triangles: &'a [usize],
    /// Signed volume (m3); 0 where rounding decides.
    volume: f64,
}

/// A direction that no edges of modelled meshes follow.
const ASLANT: DVec3 = DVec3::new(0.5773, 0.6533, 0.4896);

impl<'a> Part<'a> {
    fn of(mesh: &TriMesh, triangles: &'a [usize]) -> Self {
        let (low, high) = bounds(Self::corners(mesh, triangles));
        let six = triangles.iter().map(|&triangle| six_volumes(&mesh.corners(triangle), &low));
        let volume = six.sum::<f64>() / 6.0 + 0.0;
        let none = ROUNDING * (high - low).norm().powi(3);
        Self { triangles, volume: if volume.abs() > none { volume } else { 0.0 } }
    }

    fn corners(mesh: &TriMesh, triangles: &[usize]) -> impl Iterator<Item = DVec3> {
        triangles.iter().flat_map(|&triangle| mesh.corners(triangle))
    }

    /// Whether its outermost corners lie within `others`, which face outward (`turn` = 1) or inward (-1).
    fn is_within(&self, mesh: &TriMesh, others: &Bvh, turn: i32) -> bool {
        let corners = || Self::corners(mesh, self.triangles);
        (0..3).all(|axis| {
            let by_axis = |a: &DVec3, b: &DVec3| a[axis].total_cmp(&b[axis]);
            let ends = [corners().min_by(by_axis), corners().max_by(by_axis)];
            ends.into_iter().flatten().all(|position| turn * others.winding_number(position, ASLANT) > 0)
        })
    }
}

/// See [`Faults::inverted_parts`]; for a closed mesh of this volume, with the component of each triangle.
fn inverted_parts(mesh: &TriMesh, component: &[u32], volume: f64) -> usize {
    let mut order: Vec<usize> = (0..component.len()).collect();
    order.sort_by_key(|&triangle| component[triangle]);
    let parts =
        order.chunk_by(|a, b| component[*a] == component[*b]).map(|triangles| Part::of(mesh, triangles));
    let (out, inverted): (Vec<Part<'_>>, Vec<Part<'_>>) =
        parts.filter(|part| part.volume != 0.0).partition(|part| (part.volume < 0.0) == (volume < 0.0));
    if inverted.is_empty() {
        return 0;
    }
    let triangles = out.iter().flat_map(|part| part.triangles).map(|&at| mesh.triangles[at]).collect();
    let others = Bvh::new(&TriMesh { positions: mesh.positions.clone(), triangles });
    let turn = if volume > 0.0 { 1 } else { -1 };
    inverted.par_iter().filter(|part| !part.is_within(mesh, &others, turn)).count()
}

/// Counts of pairs of triangles that meet elsewhere than in common corners and edges.
#[derive(Default)]
struct Pairs {
    crossings: usize,
    corner_crossings: usize,
    folds: usize,
    overlaps: usize,
    touches: usize,
}

impl Pairs {
    /// Requires triangles with an area, and corners joined by position.
    fn of(mesh: &TriMesh) -> Self {
        let near = NearPairs::of(mesh);
        let corners =
            |triangle: usize| mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize]);
        let of_triangle = |first: usize| {
            let (vertices, own) = (mesh.triangles[first], corners(first));
            let mut pairs = Self::default();
            near.of_triangle(first, |second| {
                let common = vertices.iter().filter(|vertex| mesh.triangles[second].contains(vertex)).count();
                pairs.count(meeting(&own, &corners(second)), common);
            });
            pairs
        };
        let triangles = (0..mesh.triangles.len()).into_par_iter().with_min_len(GRAIN);
        triangles.map(of_triangle).reduce(Self::default, Self::with)
    }

    /// Counts a pair with `common` common corners.
    fn count(&mut self, meeting: Meeting, common: usize) {
        match (meeting, common) {
            (Meeting::Apart, _) => {}
            (Meeting::Touch, _) => self.touches += 1,
            (Meeting::Overlap, 2) => self.folds += 1,
            (Meeting::Overlap, _) => self.overlaps += 1,
            (Meeting::Cross, 0) => self.crossings += 1,
            (Meeting::Cross, _) => self.corner_crossings += 1,
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            crossings: self.crossings + other.crossings,
            corner_crossings: self.corner_crossings + other.corner_crossings,
            folds: self.folds + other.folds,
            overlaps: self.overlaps + other.overlaps,
            touches: self.touches + other.touches,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::geometry::test_meshes::{both, tetrahedron};

    #[test]
    fn a_tetrahedron_has_no_fault_and_two_that_overlap_cross() {
        let whole = Faults::of(&tetrahedron(0.0));
        assert!(whole.is_solid() && whole.is_embedded() && whole.by_index.is_watertight());
        assert_eq!((whole.parts, whole.genus, whole.crossings), (1, Some(0), 0));
        let two = Faults::of(&both(tetrahedron(0.0), &tetrahedron(0.1)));
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
        assert_eq!((faults.doubled_triangles, faults.degenerate, faults.non_manifold_edges), (1, 1, 1));
    }
}
