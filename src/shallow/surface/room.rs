//! The largest mesh that liquid in given columns can have.

use super::links::{RING, Scene};
use super::strips::places;
use super::{Columns, Counts, STRIP};
use crate::shallow::grid::BOTTOMLESS;

/// The largest counts that the surface of any liquid in these columns can have, so that a host sizes its buffers once. With uneven ceilings
/// it is several times what liquids come to, since a surface may end at every step of a ceiling.
pub fn bound(columns: &Columns) -> Counts {
    let walls = Walls::of(columns);
    let [nx, nz] = columns.grid.size;
    let mut triangles = 2 * walls.quartets;
    // Of each cell of a row and of the one before: the undersides of its columns, as `BOTTOMLESS` or a height.
    let mut rows = [(); 2].map(|()| vec![Vec::new(); nx]);
    let mut changes = Vec::new();
    for row in 0..nz {
        rows.swap(0, 1);
        rows[1].iter_mut().for_each(Vec::clear);
        for strip in columns.row(row) {
            for place in places(columns.present(strip)) {
                let index = strip * STRIP + place;
                rows[1][columns.cell(index)[0]].push(columns.unders()[index]);
            }
        }
        if row > 0 {
            for x in 1..nx {
                let cells = [&rows[0][x - 1], &rows[0][x], &rows[1][x - 1], &rows[1][x]];
                triangles += most_triangles(cells, &mut changes);
            }
        }
    }
    Counts { vertices: columns.count() + walls.pairs, extras: walls.pairs, indices: 3 * triangles }
}

/// The most triangles of a quartet without walls. Each column is linked with at most one of a cell, so that a wet column is in one group of
/// four or two of three. A group has a wet column, and others only where they are dry, which three groups at most can share: one triangle for
/// each column. Groups that have no wet column in common are at different heights, between which an underside lies: two triangles for each,
/// and two more.
fn most_triangles(cells: [&Vec<i32>; 4], changes: &mut Vec<i32>) -> usize {
    let count: usize = cells.iter().map(|cell| cell.len()).sum();
    match cells.iter().filter(|cell| !cell.is_empty()).count() {
        0..3 => 0,
        occupied if count == occupied => occupied - 2,
        _ => {
            changes.clear();
            changes.extend(cells.into_iter().flatten().filter(|under| **under != BOTTOMLESS));
            changes.sort_unstable();
            changes.dedup();
            count.min(2 + 2 * changes.len())
        }
    }
}

/// Where surfaces may end at walls.
#[derive(Debug, Default)]
pub(super) struct Walls {
    /// Pairs of a column and one beside it whose solid reaches from below the ceiling of the first to it, or higher.
    pub pairs: usize,
    /// Pairs of a column and a quartet in which it has such a wall; it may be in two triangles more there.
    pub quartets: usize,
}

impl Walls {
    pub fn of(columns: &Columns) -> Self {
        let scene = Scene { columns, depth: &[], above: &[] };
        let mut out = Self::default();
        for strip in 0..columns.strips().len() {
            for place in places(columns.present(strip)) {
                let index = strip * STRIP + place;
                let ceiling = columns.ceilings()[index];
                let is_wall = RING.map(|step| {
                    scene
                        .beside(index, step, ceiling - 1)
                        .is_some_and(|other| ceiling <= columns.bases()[other])
                });
                out.pairs += is_wall.iter().filter(|is_wall| **is_wall).count();
                // Each quartet has three cells of the ring, the middle one in a corner.
                let has_wall = |corner: usize| {
                    [corner - 1, corner, (corner + 1) % 8].into_iter().any(|cell| is_wall[cell])
                };
                out.quartets += [1, 3, 5, 7].into_iter().filter(|corner| has_wall(*corner)).count();
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartets_have_room_for_their_groups() {
        let most = |cells: [&[i32]; 4]| {
            let cells = cells.map(<[i32]>::to_vec);
            most_triangles(cells.each_ref(), &mut Vec::new())
        };
        let ground: &[i32] = &[BOTTOMLESS];
        assert_eq!(most([ground, ground, ground, ground]), 2);
        assert_eq!(most([ground, ground, &[], &[5]]), 1);
        assert_eq!(most([ground, ground, &[], &[]]), 0);
        // Two floors at one height everywhere, and at different heights.
        assert_eq!(most([&[BOTTOMLESS, 7]; 4]), 4);
        assert_eq!(most([&[BOTTOMLESS, 7], &[BOTTOMLESS, 7], &[BOTTOMLESS, 8], ground]), 6);
    }
}
