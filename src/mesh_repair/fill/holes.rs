//! Holes of triangles, closed.
//!
//! The boundary of any oriented triangles is a cycle: as many of the edges that lack a counterpart leave each vertex as arrive there. So
//! these edges form rings, and each ring is closed by itself.

use std::collections::BTreeSet;
use std::iter::repeat_n;

use crate::geometry::check::duplicates::rotated;
use crate::geometry::check::edges::{Use, is_same_edge, runs, sides};
use crate::geometry::{DVec3, PolygonMesh, Vec3};
use crate::mesh_repair::prepare::Closed;

/// Maximum number of corners of a ring that is triangulated between its corners: larger ones take too long.
const MAX_CORNERS: usize = 500;
/// Largest distance of the corners of such a ring from its mean plane, divided by their largest distance from its middle.
const FLAT: f64 = 0.5;
/// Maximum edges compared where several leave a vertex.
const MAX_BRANCHES: usize = 8;

/// Closes the holes of triangles with these edges, so that along every edge as many triangles run in one direction as in the other. A ring
/// of three around which a triangle already runs in the other direction is no hole: that triangle is left out.
pub(in crate::mesh_repair) fn close(closed: &mut Closed, uses: &[Use]) {
    let rings = rings(closed.mesh.positions.len(), missing_edges(&closed.mesh.triangles, uses));
    let mut is_out = vec![false; closed.mesh.triangles.len()];
    let mut made = BTreeSet::new();
    for ring in rings {
        let caps = if let [a, b, c] = ring[..] {
            if let Some(opposite) = find(uses, &closed.mesh.triangles, [a, c, b], &is_out) {
                is_out[opposite as usize] = true;
                continue;
            }
            vec![[a, b, c]]
        } else if let Some(caps) = cut(&closed.mesh.positions, &ring, uses, &made) {
            made.extend(caps.iter().flat_map(sides));
            caps
        } else {
            fan(&mut closed.mesh.positions, &ring)
        };
        closed.prepared.holes += 1;
        closed.sources.extend(repeat_n(None, caps.len()));
        closed.mesh.triangles.extend(caps);
    }
    closed.leave_out(&is_out);
}

/// The directed edges to add so that each edge is used equally often in both directions.
fn missing_edges(triangles: &[[u32; 3]], uses: &[Use]) -> Vec<[u32; 2]> {
    let mut out = Vec::new();
    for run in uses.chunk_by(is_same_edge) {
        let ends = run[0].0;
        let forward = run.iter().filter(|used| runs(&triangles[used.1 as usize], ends)).count();
        let back = run.len() - forward;
        out.extend(repeat_n([ends[1], ends[0]], forward.saturating_sub(back)));
        out.extend(repeat_n(ends, back.saturating_sub(forward)));
    }
    out
}

/// Splits directed edges between `vertices` vertices, with as many leaving each vertex as arriving there, into rings that pass no vertex
/// twice.
fn rings(vertices: usize, mut edges: Vec<[u32; 2]>) -> Vec<Vec<u32>> {
    let mut out = Vec::new();
    if edges.is_empty() {
        return out;
    }
    edges.sort_unstable();
    // For each vertex, where its outgoing edges begin, and the next of them to take.
    let mut begins = vec![0usize; vertices + 1];
    edges.iter().for_each(|edge| begins[edge[0] as usize + 1] += 1);
    (0..vertices).for_each(|vertex| begins[vertex + 1] += begins[vertex]);
    let mut next = begins.clone();
    let mut path: Vec<u32> = Vec::new();
    // For each vertex, its position along the path, from 1 on; 0: it is not on the path.
    let mut position = vec![0usize; vertices];
    for first in 0..vertices {
        while next[first] < begins[first + 1] {
            let mut at = first;
            loop {
                if position[at] > 0 {
                    let ring = path.split_off(position[at] - 1);
                    ring.iter().for_each(|&vertex| position[vertex as usize] = 0);
                    out.push(ring);
                    if path.is_empty() {
                        break;
                    }
                }
                path.push(at as u32);
                position[at] = path.len();
                // An edge that closes a ring goes first, the smallest ring before others.
                let branches = (next[at]..begins[at + 1]).take(MAX_BRANCHES);
                let branch =
                    branches.max_by_key(|&edge| position[edges[edge][1] as usize]).unwrap_or(next[at]);
                edges.swap(branch, next[at]);
                let to = edges[next[at]][1];
                next[at] += 1;
                at = to as usize;
            }
        }
    }
    out
}

/// The triangles that have an edge.
fn uses_of(uses: &[Use], ends: [u32; 2]) -> &[Use] {
    let begin = uses.partition_point(|used| used.0 < ends);
    let count = uses[begin..].partition_point(|used| used.0 == ends);
    &uses[begin..begin + count]
}

/// A triangle, not yet left out, with these corners in this order, starting at any of them.
fn find(uses: &[Use], triangles: &[[u32; 3]], corners: [u32; 3], is_out: &[bool]) -> Option<u32> {
    let runs = sides(&corners).map(|ends| uses_of(uses, ends));
    let fewest = runs.into_iter().min_by_key(|run| run.len())?;
    let is_match = |at: &u32| !is_out[*at as usize] && rotated(triangles[*at as usize]) == rotated(corners);
    fewest.iter().map(|used| used.1).find(is_match)
}

/// Triangulates a ring between its corners. None if it has too many corners or is not flat enough, or if one of the triangles would share an
/// inner edge with an existing triangle, or with one of those that have been `made`.
fn cut(positions: &[Vec3], ring: &[u32], uses: &[Use], made: &BTreeSet<[u32; 2]>) -> Option<Vec<[u32; 3]>> {
    let corners: Vec<DVec3> = ring.iter().map(|&vertex| positions[vertex as usize].cast()).collect();
    if ring.len() > MAX_CORNERS || !is_flat_enough(&corners) {
        return None;
    }
    // Starting at the next corner gives a convex ring other inner edges.
    (0..2).find_map(|turn| {
        let mut ring = ring.to_vec();
        ring.rotate_left(turn);
        let positions = ring.iter().map(|&vertex| positions[vertex as usize]).collect();
        let mut polygon = PolygonMesh { positions, ..PolygonMesh::default() };
        let count = ring.len() as u32;
        polygon.push(0..count);
        let triangles = polygon.triangles();
        let is_free = |&[i, j]: &[u32; 2]| {
            let is_inner = j - i != 1 && (i, j) != (0, count - 1);
            let [a, b] = [i, j].map(|corner| ring[corner as usize]);
            let ends = [a.min(b), a.max(b)];
            !is_inner || uses_of(uses, ends).is_empty() && !made.contains(&ends)
        };
        let is_free = triangles.iter().flat_map(sides).all(|ends| is_free(&ends));
        is_free.then(|| triangles.iter().map(|corners| corners.map(|corner| ring[corner as usize])).collect())
    })
}

/// Whether the corners of a ring lie near a plane.
fn is_flat_enough(positions: &[DVec3]) -> bool {
    let middle = positions.iter().sum::<DVec3>() / positions.len() as f64;
    let arms: Vec<DVec3> = positions.iter().map(|position| position - middle).collect();
    let next = arms.iter().cycle().skip(1);
    let normal: DVec3 = arms.iter().zip(next).map(|(p, q)| p.cross(q)).sum();
    let radius = arms.iter().map(|arm| arm.norm()).fold(0.0, f64::max);
    let is_near = |normal: DVec3| arms.iter().all(|arm| arm.dot(&normal).abs() <= FLAT * radius);
    normal.try_normalize(0.0).is_none_or(is_near)
}

/// Triangulates a ring around a new vertex at the mean position of its corners.
fn fan(positions: &mut Vec<Vec3>, ring: &[u32]) -> Vec<[u32; 3]> {
    let sum: DVec3 = ring.iter().map(|&vertex| positions[vertex as usize].cast::<f64>()).sum();
    let middle = positions.len() as u32;
    positions.push((sum / ring.len() as f64).cast());
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&from, &to)| [from, to, middle]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;
    use crate::mesh_repair::prepare::Prepared;
    use crate::mesh_repair::prepare::tests::{checked, cube, soup};

    #[test]
    fn an_open_cube_gets_its_face() {
        let mut open = cube(0.0);
        open.triangles.truncate(10);
        let (out, prepared) = checked(&open);
        assert_eq!(prepared, Prepared { holes: 1, added_triangles: 2, ..Prepared::default() });
        assert!(out.is_manifold());
        assert_eq!((out.volume(), out.area(), out.positions.len()), (1.0, 6.0, 8));
    }

    #[test]
    fn rings_pass_no_vertex_twice() {
        let eight = vec![[0, 1], [1, 2], [2, 0], [0, 3], [3, 4], [4, 0]];
        assert_eq!(rings(5, eight), [[0u32, 3, 4], [0, 1, 2]]);
        let apart = vec![[0, 1], [1, 2], [2, 0], [1, 3], [3, 4], [4, 1]];
        assert_eq!(rings(5, apart), [[1u32, 3, 4], [0, 1, 2]]);
        assert!(rings(5, Vec::new()).is_empty());
    }

    #[test]
    fn edges_stay_manifold() {
        // The diagonal of the square is already in use.
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0), Vec3::y()];
        let (out, prepared) = checked(&TriMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]] });
        assert!(out.is_manifold());
        assert_eq!((prepared.holes, prepared.added_triangles, out.positions.len()), (1, 2, 4));
    }

    #[test]
    fn holes_that_are_bent_or_large_get_a_vertex() {
        // Two faces of a tetrahedron around the origin.
        let positions = [[1.0f32, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]];
        let positions = positions.map(Vec3::from).to_vec();
        let (out, prepared) = checked(&TriMesh { positions, triangles: vec![[0, 1, 2], [1, 0, 3]] });
        assert!(out.is_manifold() && (out.volume() - 4.0 / 3.0).abs() < 1e-9, "{}", out.volume());
        assert_eq!((prepared.holes, prepared.added_triangles), (1, 4));
        assert_eq!(out.positions[4..], [Vec3::zeros()]);
        // A pyramid without its base.
        let mut positions: Vec<Vec3> = (0..600)
            .map(|at| {
                let along = (at % 150) as f32;
                let (x, y) =
                    [(along, 0.0), (150.0, along), (150.0 - along, 150.0), (0.0, 150.0 - along)][at / 150];
                Vec3::new(x, y, 0.0)
            })
            .collect();
        positions.push(Vec3::new(75.0, 75.0, 10.0));
        let triangles = (0..600).map(|at| [at, (at + 1) % 600, 600]).collect();
        let (out, prepared) = checked(&TriMesh { positions, triangles });
        assert!(out.is_manifold() && (out.volume() / 75_000.0 - 1.0).abs() < 1e-6, "{}", out.volume());
        assert_eq!((prepared.holes, prepared.added_triangles, out.positions.len()), (1, 600, 602));
    }

    #[test]
    fn a_triangle_without_area_stays_where_it_is_needed() {
        // A tetrahedron with an extra vertex on one side of an edge.
        let half = Vec3::new(0.5, 0.0, 0.0);
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), half];
        let split = vec![[0, 2, 1], [1, 2, 3], [2, 0, 3], [0, 4, 3], [4, 1, 3], [0, 1, 4]];
        let mut mesh = TriMesh { positions, triangles: split };
        let (out, prepared) = checked(&soup(&mesh));
        assert_eq!(prepared, Prepared { joined_vertices: 13, ..Prepared::default() });
        assert!(out.is_manifold());
        mesh.triangles.truncate(5);
        let (out, prepared) = checked(&mesh);
        assert_eq!(prepared, Prepared { holes: 1, added_triangles: 1, ..Prepared::default() });
        assert!(out.is_manifold());
        // On an edge that is already closed.
        mesh.triangles.truncate(3);
        mesh.triangles.extend([[0, 1, 3], [0, 1, 4]]);
        let (out, prepared) = checked(&mesh);
        assert_eq!(prepared, Prepared { dropped_triangles: 1, ..Prepared::default() });
        assert!(out.is_manifold());
    }

    #[test]
    fn nothing_stays_open() {
        let mut state = 11u64;
        let mut random = |below: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let mut positions = |count: usize, range: u64| -> Vec<Vec3> {
            (0..count).map(|_| Vec3::from([0; 3].map(|_| random(range) as f32))).collect()
        };
        let (few, far) = (positions(40, 4), positions(40, 1000));
        // A Moebius strip: each edge between its triangles is used in one direction only, once.
        let strip: Vec<[u32; 3]> = (0..5).map(|at| [at, (at + 1) % 5, (at + 2) % 5]).collect();
        let (out, prepared) = checked(&TriMesh { positions: far.clone(), triangles: strip });
        assert!(out.triangles.len() > 5 && prepared.dropped_triangles == 0);
        // Three triangles on an edge.
        let book = vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        assert!(checked(&TriMesh { positions: far.clone(), triangles: book }).0.triangles.len() >= 4);
        for round in 0..200 {
            let triangles = (0..300).map(|_| [0; 3].map(|_| random(40) as u32)).collect();
            let positions = if round % 2 == 0 { few.clone() } else { far.clone() };
            assert!(!checked(&TriMesh { positions, triangles }).0.triangles.is_empty());
        }
    }
}
