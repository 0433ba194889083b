//! Checks a mesh against the links of the columns, one by one.

use super::quartets::links::LiquidColumns;
use super::{Columns, NONE};

/// What [`check`] counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Check {
    /// Pairs of linked wet columns, side by side, that share no triangle edge although they have a group: 0 unless the mesh belongs to
    /// other columns.
    pub unlinked: usize,
    /// Pairs of linked wet columns, side by side, with no third column that is linked with both, so that no triangle can join them.
    pub alone: usize,
    /// Edges that two triangles use in the same direction: where the liquid of a quartet splits into two layers.
    pub doubled: usize,
}

/// Checks a mesh of the surface, from the column of each vertex ([`super::Target::columns`]) and the vertex indices of its triangles.
///
/// Slow: for tests.
pub fn check(columns: &Columns, depth: &[i32], vertex_columns: &[u32], indices: &[u32]) -> Check {
    let liquid = LiquidColumns { columns, depth, above: &[] };
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(indices.len());
    for [a, b, c] in indices.as_chunks::<3>().0 {
        edges.extend([[*a, *b], [*b, *c], [*c, *a]]);
    }
    edges.sort_unstable();
    let doubled = edges.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let mut joined: Vec<[u32; 2]> =
        edges.iter().map(|edge| edge.map(|vertex| vertex_columns[vertex as usize])).collect();
    joined.retain(|edge| !edge.contains(&NONE));
    joined.sort_unstable();
    let is_joined = |a: usize, b: usize| {
        let (a, b) = (a as u32, b as u32);
        joined.binary_search(&[a, b]).is_ok() || joined.binary_search(&[b, a]).is_ok()
    };
    let mut out = Check { doubled, ..Check::default() };
    for own in columns.indices().filter(|&index| liquid.is_wet(index)) {
        for step in [[1, 0], [0, 1]] {
            let Some(other) = liquid.wet_beside(own, step) else { continue };
            if is_joined(own, other) {
                continue;
            }
            // The cells on both sides of the pair.
            let sides = [[step[1], step[0]], [-step[1], -step[0]]];
            let has_third = sides.into_iter().any(|side| {
                let steps = [side, [side[0] + step[0], side[1] + step[1]]];
                steps.into_iter().any(|third| {
                    let third = liquid.beside(own, third, liquid.height(own));
                    third
                        .is_some_and(|third| liquid.are_linked(own, third) && liquid.are_linked(other, third))
                })
            });
            if has_third {
                out.unlinked += 1;
            } else {
                out.alone += 1;
            }
        }
    }
    out
}
