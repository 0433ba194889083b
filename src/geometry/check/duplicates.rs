//! Duplicate triangles and parts.

use rayon::prelude::*;

use super::edges::{Use, imbalance, is_same_edge, parts_of};

/// Duplicates among triangles.
pub(in crate::geometry) struct Doubles {
    /// For each triangle, whether it is removed: it has the vertices of an earlier one, in any order.
    pub(in crate::geometry) is_double: Vec<bool>,
    /// For each triangle, whether it has a duplicate of the opposite orientation.
    pub(in crate::geometry) is_two_sided: Vec<bool>,
}

impl Doubles {
    /// Duplicates among triangles with these edges. Doubled triangles that are the common walls of closed parts cancel, and are kept.
    pub(in crate::geometry) fn of(triangles: &[[u32; 3]], uses: &[Use]) -> Self {
        let count = triangles.len();
        let mut out = Self { is_double: vec![false; count], is_two_sided: vec![false; count] };
        let order = by_vertices(triangles);
        let mut is_alone = vec![true; count];
        for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
            let is_two_sided = same.iter().any(|(_, _, is_ascending)| *is_ascending != same[0].2);
            for (at, (_, number, _)) in same.iter().enumerate() {
                let number = *number as usize;
                (out.is_double[number], is_alone[number]) = (at > 0, false);
                out.is_two_sided[number] = is_two_sided;
            }
        }
        if !out.is_double.contains(&true) {
            return out;
        }
        let components = parts_of(count, uses);
        let (mut has_single, mut is_balanced, mut is_closed) =
            (vec![false; count], vec![true; count], vec![true; count]);
        components
            .iter()
            .zip(&is_alone)
            .for_each(|(component, is_alone)| has_single[*component as usize] |= is_alone);
        for run in uses.chunk_by(is_same_edge) {
            let component = components[run[0].1 as usize] as usize;
            is_balanced[component] &= imbalance(triangles, run) == 0;
            let kept = run.iter().filter(|used| !out.is_double[used.1 as usize]).count();
            is_closed[component] &= kept % 2 == 0;
        }
        for (is_double, component) in out.is_double.iter_mut().zip(&components) {
            let component = *component as usize;
            *is_double &= !(has_single[component] && is_balanced[component] && !is_closed[component]);
        }
        out
    }
}

/// Corners of a triangle, starting with the smallest, so that triangles of the same orientation compare equal.
pub fn rotated<T: Ord + Copy>([a, b, c]: [T; 3]) -> [T; 3] {
    [a, b, c].min([b, c, a]).min([c, a, b])
}

/// Triangles sorted by their vertices: each with its vertices in ascending order, its index, and whether its own order of the vertices
/// is a rotation of the ascending one.
pub fn by_vertices(triangles: &[[u32; 3]]) -> Vec<([u32; 3], u32, bool)> {
    let sorted = |(triangle, number): (&[u32; 3], u32)| {
        let [a, b, c] = rotated(*triangle);
        ([a, b.min(c), b.max(c)], number, b < c)
    };
    let mut order: Vec<([u32; 3], u32, bool)> = triangles.iter().zip(0..).map(sorted).collect();
    order.par_sort_unstable();
    order
}

/// Marks the triangles of parts that coincide with an earlier part, triangle by triangle: their keys are the same. Only parts for whose
/// first triangle `is_compared` is true are compared.
pub fn copies<K: Ord + Copy + Send>(
    parts: &[u32],
    is_compared: impl Fn(usize) -> bool,
    key: impl Fn(usize) -> K,
) -> Vec<bool> {
    let mut is_copy = vec![false; parts.len()];
    // Equal parts have the same number of triangles and the same minimum key: only such parts are compared.
    let mut signatures: Vec<(u32, Option<K>)> = vec![(0, None); parts.len()];
    for (at, &part) in parts.iter().enumerate() {
        let (count, least) = &mut signatures[part as usize];
        *count += 1;
        let own = key(at);
        *least = Some(least.map_or(own, |least| least.min(own)));
    }
    let mut firsts: Vec<u32> = (0..parts.len() as u32)
        .filter(|at| parts[*at as usize] == *at && is_compared(*at as usize))
        .collect();
    firsts.sort_unstable_by_key(|&part| (signatures[part as usize], part));
    let mut is_like_another = vec![false; parts.len()];
    let is_alike = |a: &u32, b: &u32| signatures[*a as usize] == signatures[*b as usize];
    for alike in firsts.chunk_by(is_alike).filter(|alike| alike.len() > 1) {
        alike.iter().for_each(|&part| is_like_another[part as usize] = true);
    }
    let mut order: Vec<(u32, K, u32)> = (0u32..)
        .zip(parts)
        .filter(|(_, part)| is_like_another[**part as usize])
        .map(|(at, part)| (*part, key(at as usize), at))
        .collect();
    order.par_sort_unstable();
    // The sort is stable: of equal parts the first stays first.
    let mut groups: Vec<&[(u32, K, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let keys = |group: &&[(u32, K, u32)]| -> Vec<K> { group.iter().map(|one| one.1).collect() };
    groups.sort_by_cached_key(|group| (group.len(), keys(group)));
    for same in groups.chunk_by(|a, b| a.len() == b.len() && a.iter().zip(*b).all(|(a, b)| a.1 == b.1)) {
        same[1..].iter().copied().flatten().for_each(|(_, _, at)| is_copy[*at as usize] = true);
    }
    is_copy
}

#[cfg(test)]
mod tests {
    use super::super::edges::edge_uses;
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn doubled_faces_go_and_walls_that_cancel_stay() {
        let of = |triangles: &[[u32; 3]]| Doubles::of(triangles, &edge_uses(5, triangles)).is_double;
        let back = TETRAHEDRON.map(|[a, b, c]| [a, c, b]);
        assert_eq!(of(&[&TETRAHEDRON[..], &back].concat()), [[false; 4], [true; 4]].concat());
        assert_eq!(of(&[&TETRAHEDRON[..], &back[..1]].concat()), [false, false, false, false, true]);
        // Another tetrahedron on its face 0: the wall is there from both sides.
        let other = [[1, 2, 0], [1, 0, 4], [2, 1, 4], [0, 2, 4]];
        assert_eq!(of(&[TETRAHEDRON, other].concat()), vec![false; 8]);
    }
}
