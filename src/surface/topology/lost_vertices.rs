//! Vertices that have lost the surface. Particles that fly apart carry them far away, and their triangles would become spikes through the
//! rest of the mesh. If the mesh is rebuilt, they follow the vertices around them instead.

use crate::geometry::DVec3;

/// Maximum distance (edges) from a vertex that found the surface up to which lost vertices follow it.
const RINGS: usize = 16;

/// Moves lost vertices (m) by the mean displacement, since `before`, of the vertices around them that found the surface or have been moved
/// already, ring by ring; those that this does not reach stay.
pub fn move_lost_vertices(
    before: &[DVec3],
    triangles: &[[u32; 3]],
    is_lost: &[bool],
    vertices: &mut [DVec3],
) {
    let near: Vec<&[u32; 3]> =
        triangles.iter().filter(|corners| corners.iter().any(|corner| is_lost[*corner as usize])).collect();
    let mut due: Vec<u32> = near.iter().flat_map(|corners| **corners).collect();
    due.sort_unstable();
    due.dedup();
    let slot = |vertex: u32| due.binary_search(&vertex).unwrap_or_default();
    let mut is_known: Vec<bool> = due.iter().map(|vertex| !is_lost[*vertex as usize]).collect();
    for _ in 0..RINGS {
        let mut sums = vec![(DVec3::zeros(), 0.0f64); due.len()];
        for corners in &near {
            let slots = corners.map(slot);
            for (at, next) in [(0, 1), (1, 2), (2, 0)] {
                if !is_known[slots[at]] && is_known[slots[next]] {
                    let to = corners[next] as usize;
                    let sum = &mut sums[slots[at]];
                    *sum = (sum.0 + (vertices[to] - before[to]), sum.1 + 1.0);
                }
            }
        }
        let mut has_changed = false;
        for (slot, (sum, count)) in sums.into_iter().enumerate().filter(|(_, (_, count))| *count > 0.0) {
            let at = due[slot] as usize;
            vertices[at] = before[at] + sum / count;
            is_known[slot] = true;
            has_changed = true;
        }
        if !has_changed {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_goes_with_its_neighbours() {
        // A strip of triangles: each vertex follows the one before it.
        let before: Vec<DVec3> =
            (0..6).map(|n| DVec3::new(f64::from(n / 2), f64::from(n % 2), 0.0)).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|n| [n, n + 1, n + 2]).collect();
        let mut vertices = before.clone();
        vertices[0] += DVec3::y();
        vertices[1] += DVec3::y();
        vertices[3] = DVec3::repeat(1e6);
        let is_lost = [false, false, true, true, true, true];
        move_lost_vertices(&before, &triangles, &is_lost, &mut vertices);
        for (position, first) in vertices.iter().zip(&before) {
            assert!((position - first - DVec3::y()).norm() < 1e-12, "{position:?}");
        }
        // If no vertex is known, none moves.
        let mut alone = vertices.clone();
        move_lost_vertices(&before, &triangles, &[true; 6], &mut alone);
        assert!(alone == vertices);
    }
}
