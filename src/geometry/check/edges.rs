//! Edges of triangles, the parts that they connect, and the consistent orientation of neighbours.

use super::topology::Sets;
use crate::geometry::lists::Lists;

/// An edge, smaller vertex index first, and a triangle that has it.
pub type Use = ([u32; 2], u32);

/// Sentinel: no neighbour across an edge, as it does not have exactly two triangles; or no patch yet.
const NONE: u32 = u32::MAX;
/// Minimum triangles of a closed part: a tetrahedron.
const MIN_TRIANGLES: u32 = 4;

/// The edges of triangles over `vertices` vertices, sorted, each listed once for every triangle that has it.
pub fn edge_uses(vertices: usize, triangles: &[[u32; 3]]) -> Vec<Use> {
    // Sorted by the smaller vertex by counting, then by comparisons: few edges begin at one vertex.
    let of_triangle = |(triangle, number)| sides(triangle).map(|ends| (ends[0], (ends, number)));
    let mut uses = Lists::new(vertices, triangles.iter().zip(0..).flat_map(of_triangle));
    uses.each_mut(|uses| uses.sort_unstable());
    uses.into_items()
}

/// The edges of a triangle, smaller vertex index first.
pub fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

/// Whether two uses belong to the same edge.
pub fn is_same_edge(a: &Use, b: &Use) -> bool {
    a.0 == b.0
}

/// Whether a triangle runs along an edge from its first end to its second.
pub fn runs(triangle: &[u32; 3], [from, to]: [u32; 2]) -> bool {
    (0..3).any(|side| triangle[side] == from && triangle[(side + 1) % 3] == to)
}

/// Number of triangles that run along an edge from its first end to its second, minus those that run back.
pub fn imbalance(triangles: &[[u32; 3]], run: &[Use]) -> i32 {
    run.iter().map(|&(ends, triangle)| if runs(&triangles[triangle as usize], ends) { 1 } else { -1 }).sum()
}

/// Index of an edge among the sides of a triangle.
pub fn side(triangle: &[u32; 3], ends: [u32; 2]) -> usize {
    // The side begins after the corner that is not on it.
    triangle.iter().position(|vertex| !ends.contains(vertex)).map_or(0, |apart| (apart + 1) % 3)
}

/// The part of each of `count` triangles, named by its first triangle.
pub fn parts_of(count: usize, uses: &[Use]) -> Vec<u32> {
    let mut sets = Sets::new(count);
    uses.windows(2)
        .filter(|pair| is_same_edge(&pair[0], &pair[1]))
        .for_each(|pair| sets.join(pair[0].1, pair[1].1));
    (0..count as u32).map(|triangle| sets.root(triangle)).collect()
}

/// Marks the triangles of parts that are closed manifolds: each edge has two triangles that agree.
pub fn mark_closed_manifolds(triangles: &[[u32; 3]], uses: &[Use], parts: &[u32]) -> Vec<bool> {
    let mut is_closed = vec![true; parts.len()];
    for run in uses.chunk_by(is_same_edge) {
        if run.len() != 2 || imbalance(triangles, run) != 0 {
            is_closed[parts[run[0].1 as usize] as usize] = false;
        }
    }
    let mut counts = vec![0u32; parts.len()];
    parts.iter().for_each(|&part| counts[part as usize] += 1);
    parts.iter().map(|&part| is_closed[part as usize] && counts[part as usize] >= MIN_TRIANGLES).collect()
}

/// Which triangles must be flipped so that neighbours agree.
pub struct Agreement {
    /// For each triangle, whether it must be flipped.
    pub turned: Vec<bool>,
    /// The patch of each triangle, named by its first triangle: triangles connected by edges that have exactly two triangles.
    pub patch: Vec<u32>,
    /// The patches with only one side (a Mobius strip, a Klein bottle), where no choice makes all agree; ascending.
    pub one_sided: Vec<u32>,
}

/// Finds which triangles to flip so that the two triangles of each edge with exactly two run along it in opposite directions, as far as the
/// surface has two sides. In each patch the orientation with more area stays.
pub fn agree(triangles: &[[u32; 3]], uses: &[Use], area: impl Fn(usize) -> f64) -> Agreement {
    let mut beside = vec![[NONE; 3]; triangles.len()];
    for run in uses.chunk_by(is_same_edge) {
        if let [(ends, a), (_, b)] = *run {
            beside[a as usize][side(&triangles[a as usize], ends)] = b;
            beside[b as usize][side(&triangles[b as usize], ends)] = a;
        }
    }
    let mut out = Agreement {
        turned: vec![false; triangles.len()],
        patch: vec![NONE; triangles.len()],
        one_sided: Vec::new(),
    };
    let mut patch: Vec<u32> = Vec::new();
    for first in 0..triangles.len() as u32 {
        if out.patch[first as usize] != NONE {
            continue;
        }
        out.patch[first as usize] = first;
        patch.clear();
        patch.push(first);
        let mut areas = [0.0f64; 2];
        let mut has_two_sides = true;
        let mut reached = 0;
        while reached < patch.len() {
            let at = patch[reached] as usize;
            reached += 1;
            // Flipped relative to the first of the patch.
            let turned = out.turned[at];
            areas[usize::from(turned)] += area(at);
            for side in 0..3 {
                let other = beside[at][side] as usize;
                if other == NONE as usize {
                    continue;
                }
                let back = [triangles[at][(side + 1) % 3], triangles[at][side]];
                let is_turned = turned == runs(&triangles[other], back);
                if out.patch[other] == NONE {
                    out.patch[other] = first;
                    out.turned[other] = is_turned;
                    patch.push(other as u32);
                } else {
                    has_two_sides &= out.turned[other] == is_turned;
                }
            }
        }
        if areas[1] > areas[0] {
            patch.iter().for_each(|at| out.turned[*at as usize] ^= true);
        }
        if !has_two_sides {
            out.one_sided.push(first);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_agree_as_far_as_there_are_two_sides() {
        let mut turned = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        turned[2].swap(1, 2);
        let agreement = agree(&turned, &edge_uses(4, &turned), |_| 1.0);
        assert_eq!((agreement.turned, agreement.one_sided), (vec![false, false, true, false], vec![]));
        // A band of five triangles, closed with a half twist.
        let strip: Vec<[u32; 3]> = (0..5).map(|at| [at, (at + 1) % 5, (at + 2) % 5]).collect();
        assert_eq!(agree(&strip, &edge_uses(5, &strip), |_| 1.0).one_sided, vec![0]);
    }
}
