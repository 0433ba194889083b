//! Triangles and parts that lie on others.

use crate::geometry::Vec3;
use crate::geometry::check::duplicates::{self, by_vertices, rotated};
use crate::geometry::check::edges::{edge_uses, imbalance, is_same_edge, parts_of};

/// Which triangles have the same vertices as others and are removed. Of those with the same orientation the first stays. If two have
/// opposite orientations none stays: they are a sheet folded onto itself, which encloses nothing. But if such sheets are closed
/// themselves, the first triangles stay: they are a solid given with both sides of its faces.
pub(in crate::mesh_repair) fn doubled(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let order = by_vertices(triangles);
    let mut is_out = vec![false; triangles.len()];
    let mut folded = Vec::new();
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        same[1..].iter().for_each(|(_, number, _)| is_out[*number as usize] = true);
        if same.iter().any(|(_, _, is_ascending)| *is_ascending != same[0].2) {
            folded.push(same[0].1);
        }
    }
    if folded.is_empty() {
        return is_out;
    }
    let sheets: Vec<[u32; 3]> = folded.iter().map(|&number| triangles[number as usize]).collect();
    let uses = edge_uses(vertices, &sheets);
    let parts = parts_of(sheets.len(), &uses);
    let mut is_closed = vec![true; sheets.len()];
    for run in uses.chunk_by(is_same_edge).filter(|run| run.len() != 2) {
        is_closed[parts[run[0].1 as usize] as usize] = false;
    }
    for (&number, &part) in folded.iter().zip(&parts) {
        is_out[number as usize] = !is_closed[part as usize];
    }
    is_out
}

/// Whether triangles use each edge equally often in both directions, ignoring those marked in `is_out`; triangles beyond its end are not
/// marked.
pub(in crate::mesh_repair) fn is_balanced(vertices: usize, triangles: &[[u32; 3]], is_out: &[bool]) -> bool {
    let is_out = |at: usize| is_out.get(at) == Some(&true);
    let kept: Vec<[u32; 3]> =
        triangles.iter().enumerate().filter(|(at, _)| !is_out(*at)).map(|(_, triangle)| *triangle).collect();
    edge_uses(vertices, &kept).chunk_by(is_same_edge).all(|run| imbalance(&kept, run) == 0)
}

/// Which triangles belong to parts that coincide with an earlier part, triangle by triangle.
pub(in crate::mesh_repair) fn copies(positions: &[Vec3], triangles: &[[u32; 3]], parts: &[u32]) -> Vec<bool> {
    let position = |vertex: u32| {
        let p = &positions[vertex as usize];
        // Adding zero makes -0 and 0 the same.
        [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f32::to_bits)
    };
    duplicates::copies(parts, |_| true, |triangle| rotated(triangles[triangle].map(position)))
}
