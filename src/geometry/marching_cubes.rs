//! Marching cubes (Lorensen and Cline 1987): the surface, as triangles, in a cube whose corners are inside or outside. If two diagonal
//! corners of a face are inside, the surface separates them (Montani, Scateni and Scopigno 1994), so that neighbouring cubes match.
//!
//! The cases are generated: on each face the surface is a line from where the face's outline enters the inside to where it leaves again.
//! These lines form loops, which are filled with triangles.

use std::sync::OnceLock;

/// An edge of a cube: its lower corner (bits x, y, z) and its axis.
pub type Edge = (usize, usize);

/// The triangles of each case; bit n of a case is set if corner n is inside.
pub fn cases() -> &'static [Vec<[Edge; 3]>; 256] {
    static CASES: OnceLock<[Vec<[Edge; 3]>; 256]> = OnceLock::new();
    CASES.get_or_init(|| {
        std::array::from_fn(|case| {
            loops(case)
                .iter()
                .flat_map(|ring| filled(ring).expect("each ring of a cube can be filled"))
                .collect()
        })
    })
}

/// Corners of the six faces, counter-clockwise seen from outside the cube.
pub const FACES: [[usize; 4]; 6] =
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

/// The edge between two corners.
pub fn edge_between(a: usize, b: usize) -> Edge {
    let axis = match a ^ b {
        4 => 0,
        2 => 1,
        _ => 2,
    };
    (a.min(b), axis)
}

/// The lines in which the surface crosses a face of a cube: from where the outline enters the inside to where it leaves.
pub fn lines(case: usize, face: &[usize; 4]) -> impl Iterator<Item = [Edge; 2]> {
    let is_inside = move |corner: usize| case >> corner & 1 == 1;
    (0..4).filter_map(move |start| {
        let [before, here] = [face[(start + 3) % 4], face[start]];
        if is_inside(before) || !is_inside(here) {
            return None;
        }
        let run = (1..4).find(|step| !is_inside(face[(start + step) % 4]))?;
        let [last, after] = [face[(start + run - 1) % 4], face[(start + run) % 4]];
        Some([edge_between(before, here), edge_between(last, after)])
    })
}

/// The closed lines in which the surface crosses the faces of a cube.
fn loops(case: usize) -> Vec<Vec<Edge>> {
    let mut lines: Vec<[Edge; 2]> = FACES.iter().flat_map(|face| lines(case, face)).collect();
    let mut rings = Vec::new();
    while let Some([begin, mut end]) = lines.pop() {
        let mut ring = vec![begin];
        while end != begin {
            ring.push(end);
            let next = lines.iter().position(|line| line[0] == end).expect("the lines form loops");
            end = lines.swap_remove(next)[1];
        }
        rings.push(ring);
    }
    rings
}

/// Whether two edges of a cube lie on one of its faces.
fn share_face(a: Edge, b: Edge) -> bool {
    let ends = |(corner, axis): Edge| [corner, corner | 4 >> axis];
    FACES.iter().any(|face| [ends(a), ends(b)].as_flattened().iter().all(|corner| face.contains(corner)))
}

/// Triangles that fill a ring without a diagonal on a face of the cube, where the next cube may have one too; `None` if there are no such
/// triangles. All rings of [`cases`] have them.
pub fn filled(ring: &[Edge]) -> Option<Vec<[Edge; 3]>> {
    let count = ring.len();
    if count == 3 {
        return Some(vec![[ring[0], ring[1], ring[2]]]);
    }
    // Cut off an ear.
    (0..count).find_map(|ear| {
        let [before, after] = [ring[(ear + count - 1) % count], ring[(ear + 1) % count]];
        if share_face(before, after) {
            return None;
        }
        let mut rest = ring.to_vec();
        rest.remove(ear);
        let mut triangles = filled(&rest)?;
        triangles.push([before, ring[ear], after]);
        Some(triangles)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_filled_without_diagonals_on_faces() {
        for (case, triangles) in cases().iter().enumerate() {
            let crossed =
                (0..8).flat_map(|corner| [0, 1, 2].map(|axis| (corner, axis))).filter(|(corner, axis)| {
                    let other = corner | 4 >> axis;
                    other != *corner && (case >> corner & 1) != (case >> other & 1)
                });
            let count = crossed.count();
            let rings = loops(case);
            assert_eq!(rings.iter().map(Vec::len).sum::<usize>(), count, "case {case}");
            assert_eq!(triangles.len() + 2 * rings.len(), count, "case {case}");
        }
    }
}
