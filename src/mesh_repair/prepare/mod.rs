//! Turns arbitrary triangles into triangles that are closed as a chain and turned outward.
//!
//! Parts that are closed by their indices stay as they are. In all others, coinciding vertices are joined, then triangles are turned so that
//! neighbours agree, and holes are closed (`fill/holes.rs`). Every step takes some n log n operations for n triangles.

pub(in crate::mesh_repair) mod closed;
pub(in crate::mesh_repair) mod copies;

pub(super) use closed::Closed;
pub use closed::Prepared;
use rayon::prelude::*;

use super::fill::holes::close;
use crate::geometry::check::edges::{Use, edge_uses, is_same_edge, mark_closed_manifolds, parts_of, side};
use crate::geometry::check::predicates::is_flat;
use crate::geometry::{TriMesh, Vec3};
use copies::{copies, doubled, is_balanced};

/// Triangles per task.
const GRAIN: usize = 2048;

/// Closes a mesh, whose positions are finite and whose indices are in range, and turns it outward, part by part: a part is a set of
/// triangles connected by edges. The solid is then where the winding number is over 0. A cavity, which is an inside-out part within another,
/// is turned outward too: it is filled.
///
/// Parts that are closed by their indices, with two agreeing triangles at each edge, keep their vertices, and also their triangles without
/// area; of parts that coincide triangle by triangle the first stays. The result may be empty.
pub(super) fn prepare(mesh: &TriMesh) -> Closed {
    let vertices = mesh.positions.len();
    let mut closed = Closed {
        mesh: mesh.clone(),
        sources: (0..mesh.triangles.len() as u32).map(Some).collect(),
        prepared: Prepared::default(),
    };
    let uses = edge_uses(vertices, &mesh.triangles);
    let mut parts = parts_of(mesh.triangles.len(), &uses);
    let is_closed_manifold = mark_closed_manifolds(&mesh.triangles, &uses, &parts);
    if is_closed_manifold.contains(&false) {
        closed.join(&is_closed_manifold);
        closed.leave_out(&collapsed(&closed.mesh.triangles));
        let is_out = doubled(vertices, &closed.mesh.triangles);
        // Solids that nearly coincide share some triangles: if everything is closed as it is, it stays closed.
        if !is_balanced(vertices, &closed.mesh.triangles, &[])
            || is_balanced(vertices, &closed.mesh.triangles, &is_out)
        {
            closed.leave_out(&is_out);
        }
        closed.leave_out(&loose_needles(&closed.mesh.positions, &closed.mesh.triangles));
        let uses = edge_uses(vertices, &closed.mesh.triangles);
        closed.make_agree(&uses);
        close(&mut closed, &uses);
        let uses = edge_uses(closed.mesh.positions.len(), &closed.mesh.triangles);
        parts = parts_of(closed.mesh.triangles.len(), &uses);
    }
    closed.turn_outward(&parts);
    closed.leave_out(&copies(&closed.mesh.positions, &closed.mesh.triangles, &parts));
    closed.prepared.added_triangles = closed.sources.iter().filter(|source| source.is_none()).count();
    closed
}

/// Which triangles use a vertex twice.
fn collapsed(triangles: &[[u32; 3]]) -> Vec<bool> {
    triangles.iter().map(|[a, b, c]| a == b || b == c || c == a).collect()
}

/// Marks the triangles without area whose removal leaves fewer edges open. A needle that is alone on one edge and has one neighbour at each
/// of the others stays.
fn loose_needles(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut is_out = vec![false; triangles.len()];
    let is_needle = |triangle: &[u32; 3]| is_flat(&triangle.map(|vertex| positions[vertex as usize]));
    let is_needle: Vec<bool> = triangles.par_iter().with_min_len(GRAIN).map(is_needle).collect();
    if !is_needle.contains(&true) {
        return is_out;
    }
    let uses = edge_uses(positions.len(), triangles);
    let edges: Vec<&[Use]> = uses.chunk_by(is_same_edge).collect();
    let mut remaining: Vec<usize> = edges.iter().map(|run| run.len()).collect();
    let mut own = vec![[0usize; 3]; triangles.len()];
    for (edge, run) in edges.iter().enumerate() {
        for &(ends, triangle) in run.iter() {
            own[triangle as usize][side(&triangles[triangle as usize], ends)] = edge;
        }
    }
    let mut todo: Vec<u32> = (0..triangles.len() as u32).rev().filter(|at| is_needle[*at as usize]).collect();
    while let Some(needle) = todo.pop() {
        let counts = own[needle as usize].map(|edge| remaining[edge]);
        // Without it an edge with an even number of triangles is open, one with an odd number no longer is.
        let gained = counts.iter().filter(|count| **count % 2 == 1).count();
        if is_out[needle as usize] || gained < 2 || !counts.contains(&1) {
            continue;
        }
        is_out[needle as usize] = true;
        for edge in own[needle as usize] {
            remaining[edge] -= 1;
            // The last needle on an edge may be loose now.
            if remaining[edge] == 1 {
                todo.extend(edges[edge].iter().map(|used| used.1).filter(|at| is_needle[*at as usize]));
            }
        }
    }
    is_out
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::test_meshes::{both, tetrahedron};

    /// Prepares a mesh and checks what holds for any; returns the result and how it was prepared.
    pub fn checked(mesh: &TriMesh) -> (TriMesh, Prepared) {
        let Closed { mesh: out, sources, prepared } = prepare(mesh);
        assert!(out.positions.starts_with(&mesh.positions));
        assert_eq!(sources.len(), out.triangles.len());
        let own: Vec<u32> = sources.iter().copied().flatten().collect();
        assert!(own.is_sorted_by(|a, b| a < b));
        assert_eq!(own.len() + prepared.dropped_triangles, mesh.triangles.len());
        assert_eq!(out.triangles.len() - own.len(), prepared.added_triangles);
        assert!(out.is_closed());
        (out, prepared)
    }

    pub fn cube(at: f32) -> TriMesh {
        TriMesh::cuboid([at, 0.0, 0.0], [at + 1.0, 1.0, 1.0])
    }

    /// A copy of a mesh in which each triangle has its own vertices.
    pub fn soup(mesh: &TriMesh) -> TriMesh {
        let corners = mesh.triangles.as_flattened().iter().map(|&vertex| mesh.positions[vertex as usize]);
        TriMesh::soup(corners.collect())
    }

    #[test]
    fn few_triangles_are_turned_and_whole_parts_outward() {
        let mut turned = cube(0.0);
        turned.triangles[..2].iter_mut().for_each(|triangle| triangle.swap(1, 2));
        let (out, prepared) = checked(&turned);
        assert_eq!((out, prepared), (cube(0.0), Prepared { turned_triangles: 2, ..Prepared::default() }));
        let (out, prepared) = checked(&cube(0.0).reversed());
        assert_eq!((out, prepared), (cube(0.0), Prepared { turned_parts: 1, ..Prepared::default() }));
        // A cavity is filled.
        let cavity = TriMesh::cuboid([0.25; 3], [0.75; 3]).reversed();
        let (out, prepared) = checked(&both(cube(0.0), &cavity));
        assert_eq!((out.volume(), prepared.turned_parts, prepared.dropped_triangles), (1.125, 1, 0));
    }

    #[test]
    fn loose_triangles_are_joined() {
        let (out, prepared) = checked(&soup(&tetrahedron(0.0)));
        assert_eq!(prepared, Prepared { joined_vertices: 8, ..Prepared::default() });
        assert!(out.is_manifold() && out.triangles.len() == 4 && out.volume() > 0.16);
    }

    #[test]
    fn of_doubled_parts_one_is_left() {
        let (one, inverted) = (cube(0.0), cube(0.0).reversed());
        let mut twice = one.clone();
        twice.triangles.extend_from_slice(&one.triangles);
        let mut two_sided = one.clone();
        two_sided.triangles.extend_from_slice(&inverted.triangles);
        let soups = both(soup(&one), &soup(&inverted));
        for mesh in [both(one.clone(), &one), both(one.clone(), &inverted), twice, two_sided, soups] {
            let (out, prepared) = checked(&mesh);
            assert_eq!((out.volume(), prepared.dropped_triangles, prepared.holes), (1.0, 12, 0));
            assert!(out.is_manifold());
        }
        // Both sides of a square enclose nothing, nor does a triangle alone.
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0), Vec3::y()];
        let sheet = [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]];
        for count in [4, 1] {
            let mesh = TriMesh { positions: positions.clone(), triangles: sheet[..count].to_vec() };
            let (out, prepared) = checked(&mesh);
            assert_eq!((out.triangles.len(), prepared.dropped_triangles), (0, count));
        }
    }

    #[test]
    fn what_is_closed_stays_as_it_is() {
        // Cubes that share an edge, by their indices.
        let mut joined = both(cube(0.0), &TriMesh::cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]));
        let shared = |vertex: u32| [(8, 3), (12, 7)].iter().find(|pair| pair.0 == vertex).map(|pair| pair.1);
        joined.triangles.as_flattened_mut().iter_mut().for_each(|at| *at = shared(*at).unwrap_or(*at));
        assert_eq!(checked(&joined), (joined.clone(), Prepared::default()));
        // Cubes with a wall at the same position, beside one that is open.
        let mut mesh = both(both(cube(0.0), &cube(1.0)), &cube(5.0));
        mesh.triangles.truncate(34);
        let (out, prepared) = checked(&mesh);
        assert_eq!(prepared, Prepared { holes: 1, added_triangles: 2, ..Prepared::default() });
        assert!(out.triangles.starts_with(&mesh.triangles) && out.is_manifold() && out.volume() == 3.0);
    }
}
