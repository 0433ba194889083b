//! Triangles of groups of three and four columns.

use crate::shallow::surface::quartets::cells::Entry;

/// For each corner of a quartet, the other three.
pub(in crate::shallow) const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

/// Divides a group of four.
pub(in crate::shallow::surface) fn divide(four: [&Entry; 4]) -> [[u32; 3]; 2] {
    let [a, b, c, d] = four;
    let turned = match (a.wet == d.wet, b.wet == c.wet) {
        (true, true) if a.wet != b.wet => b.wet,
        (true, false) => false,
        (false, true) => true,
        _ => a.height.wrapping_sub(b.height) < c.height.wrapping_sub(d.height),
    };
    let omitted = if turned { [3, 0] } else { [1, 2] };
    omitted.map(|corner| TRIANGLES[corner].map(|corner| four[corner].id))
}

/// The triangle of three columns, of which two are at given corners.
pub(in crate::shallow::surface) fn triangle(
    first: u32,
    others: [(usize, u32); 2],
    omitted: usize,
) -> [u32; 3] {
    let mut ids = [first; 4];
    others.into_iter().for_each(|(corner, id)| ids[corner] = id);
    TRIANGLES[omitted].map(|corner| ids[corner])
}

/// For each corner, the triangle of the other three, facing up.
const TRIANGLES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [1, 0, 3], [0, 2, 1]];
