//! Triangles and parts that lie on others.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::prepare::{Use, edge_uses, is_same_edge, parts_of, rotated, runs};
use crate::base::Vec3;

/// A part, three corners bit by bit and the triangle of that part which has them.
type Placed = (u32, [[u32; 3]; 3], u32);

/// Which triangles have the vertices of others and go. Of those that are turned the same way the first stays. Where two are turned
/// opposite ways none does: they are a sheet folded onto itself, which encloses nothing. But where such sheets are closed
/// themselves, the first ones stay: a body both sides of whose faces were given.
pub(super) fn doubled(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let by_vertices = |(triangle, number): (&[u32; 3], u32)| {
        let [a, b, c] = rotated(*triangle);
        ([a, b.min(c), b.max(c)], number, b < c)
    };
    let mut order: Vec<([u32; 3], u32, bool)> = triangles.iter().zip(0..).map(by_vertices).collect();
    order.par_sort_unstable();
    let mut is_out = vec![false; triangles.len()];
    let mut folded = Vec::new();
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        same[1..].iter().for_each(|(_, number, _)| is_out[*number as usize] = true);
        if same.iter().any(|(_, _, way)| *way != same[0].2) {
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

/// Whether triangles run along each edge as often one way as the other, without those that are left out; beyond the end of the marks
/// none is.
pub(super) fn is_balanced(vertices: usize, triangles: &[[u32; 3]], is_out: &[bool]) -> bool {
    let is_out = |at: usize| is_out.get(at) == Some(&true);
    let kept: Vec<[u32; 3]> =
        triangles.iter().enumerate().filter(|(at, _)| !is_out(*at)).map(|(_, triangle)| *triangle).collect();
    let way = |(ends, triangle): &Use| if runs(&kept[*triangle as usize], *ends) { 1 } else { -1 };
    edge_uses(vertices, &kept).chunk_by(is_same_edge).all(|run| run.iter().map(way).sum::<i32>() == 0)
}

/// Which triangles are of parts that lie on one before them, triangle by triangle.
pub(super) fn copies(positions: &[Vec3], triangles: &[[u32; 3]], parts: &[u32]) -> Vec<bool> {
    let mut is_copy = vec![false; triangles.len()];
    let placed = |triangle: &[u32; 3]| {
        // Adding zero makes -0 and 0 the same.
        let bits = |place: &Vec3| [place.x + 0.0, place.y + 0.0, place.z + 0.0].map(f32::to_bits);
        rotated(triangle.map(|vertex| bits(&positions[vertex as usize])))
    };
    // Parts that are alike have as many triangles, and the same least corner: only such are compared.
    let mut marks = vec![(0u32, [u32::MAX; 3]); triangles.len()];
    for (triangle, &part) in triangles.iter().zip(parts) {
        let (count, least) = &mut marks[part as usize];
        *count += 1;
        *least = (*least).min(placed(triangle)[0]);
    }
    let mut named: Vec<u32> = (0..triangles.len() as u32).filter(|at| parts[*at as usize] == *at).collect();
    named.sort_unstable_by_key(|&part| (marks[part as usize], part));
    let mut is_compared = vec![false; triangles.len()];
    let is_alike = |a: &u32, b: &u32| marks[*a as usize] == marks[*b as usize];
    for alike in named.chunk_by(is_alike).filter(|alike| alike.len() > 1) {
        alike.iter().for_each(|&part| is_compared[part as usize] = true);
    }
    let mut order: Vec<Placed> = Vec::new();
    for ((triangle, &part), number) in triangles.iter().zip(parts).zip(0..) {
        if is_compared[part as usize] {
            order.push((part, placed(triangle), number));
        }
    }
    order.par_sort_unstable();
    // The sort is stable: of parts at the same place the first stays first.
    let mut bodies: Vec<&[Placed]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    bodies.sort_by(|a, b| by_places(a, b));
    for same in bodies.chunk_by(|a, b| by_places(a, b).is_eq()) {
        for (_, _, number) in same[1..].iter().copied().flatten() {
            is_copy[*number as usize] = true;
        }
    }
    is_copy
}

/// Orders parts by their number of triangles, then by where these lie.
fn by_places(a: &[Placed], b: &[Placed]) -> Ordering {
    let places = || a.iter().map(|one| &one.1).cmp(b.iter().map(|one| &one.1));
    a.len().cmp(&b.len()).then_with(places)
}
