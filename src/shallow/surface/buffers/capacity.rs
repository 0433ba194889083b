//! Maximum size of a mesh of liquid in given columns.

use crate::numeric::lists::refill;
use crate::shallow::columns::grid::BOTTOMLESS;
use crate::shallow::columns::{Columns, STRIP};
use crate::shallow::surface::Counts;
use crate::shallow::surface::quartets::links::{LiquidColumns, RING};
use crate::shallow::surface::quartets::strips::positions;

/// The maximum counts that the surface of any liquid in these columns can have, so that a host sizes its buffers once. Liquids that fill up
/// to just below uneven ceilings come close: their surface ends at every step of the ceiling.
pub fn bound(columns: &Columns) -> Counts {
    let walls = Walls::of(columns);
    let [nx, nz] = columns.grid.size;
    let mut triangles = 0;
    // The columns of each cell of a row and of the one before.
    let mut rows = [(); 2].map(|()| vec![Vec::new(); nx]);
    let mut quartet = Quartet::default();
    for row in 0..nz {
        rows.swap(0, 1);
        rows[1].iter_mut().for_each(Vec::clear);
        for strip in columns.row(row) {
            for position in positions(columns.present(strip)) {
                let index = strip * STRIP + position;
                let [under, base, ceiling] =
                    [columns.unders(), columns.bases(), columns.ceilings()].map(|of| of[index]);
                rows[1][columns.cell(index)[0]].push(Room {
                    under,
                    base,
                    ceiling,
                    walls: walls.sides[index],
                });
            }
        }
        if row > 0 {
            for x in 1..nx {
                // The bit of the quartet in `Room::walls`: it is to the south-east of its first cell, and so on.
                let cells = [(&rows[0][x - 1], 3), (&rows[0][x], 2), (&rows[1][x - 1], 0), (&rows[1][x], 1)];
                triangles += quartet.max_triangles(cells);
            }
        }
    }
    Counts { vertices: columns.count() + walls.pairs, extras: walls.pairs, indices: 3 * triangles }
}

/// A column of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Room {
    under: i32,
    base: i32,
    ceiling: i32,
    /// A bit for each of the quartets to the north-east, north-west, south-west and south-east in which its surface may end at a wall.
    walls: u8,
}

impl Room {
    /// Whether the two are linked at some depths.
    fn may_link(&self, other: &Self) -> bool {
        let holds =
            |own: &Self, other: &Self| own.under.max(other.base) <= other.ceiling.min(own.ceiling - 1);
        holds(self, other) && holds(other, self)
    }
}

/// The columns of a quartet.
#[derive(Debug, Default)]
struct Quartet {
    /// Each with its corner and its set; a set is joined by chains of possible links.
    rooms: Vec<(Room, usize, usize)>,
    /// Distinct undersides of a set: scratch.
    undersides: Vec<i32>,
}

impl Quartet {
    /// Maximum number of triangles, from the columns at each corner and the bit of this quartet in their `walls`. Columns of different sets
    /// share no triangle: the maxima of the sets are summed.
    ///
    /// A set with at most one column at each corner has at most two triangles, or one if it has three corners: if all links exist, its
    /// columns are a group of four; if one is missing, two of the four possible groups of three would need it. If its surface may end at
    /// walls, and each of its columns may be linked with every other, then the higher of two surfaces is linked with the other or ends
    /// above it. The highest wet column A, alone at its corner, is then in at most two triangles, as each column has one entry at a corner
    /// where it is linked or ends. Triangles without A lie at the three other corners and contain the next lower wet column B. It may be
    /// linked there with both a column and A's wall at either corner, but not at both, or else A would be in a group with them: three
    /// triangles. Or B is not linked with A, and the third, C, may be: two triangles. There is one fewer where the set lacks a corner, as
    /// only walls are there.
    ///
    /// In other sets without walls, a wet column is in one group of four or two of three. A group has a wet column, and others only where
    /// they are dry, which at most three groups can share: one triangle per column. Groups without a common wet column are at different
    /// heights with an underside between them: two triangles for each, and two more. A column with walls may be in two more, and its
    /// neighbours' walls add four more in the sets of random scenes that need most (not proved: a test tries many).
    fn max_triangles(&mut self, cells: [(&Vec<Room>, u8); 4]) -> usize {
        let Self { rooms, undersides } = self;
        rooms.clear();
        for (corner, (cell, side)) in cells.into_iter().enumerate() {
            let here = |room: &Room| Room { walls: room.walls >> side & 1, ..*room };
            rooms.extend(cell.iter().map(|room| (here(room), corner, 0)));
        }
        for own in 0..rooms.len() {
            let (room, corner, _) = rooms[own];
            rooms[own].2 = own;
            for before in 0..own {
                let (other, of, set) = rooms[before];
                let own_set = rooms[own].2;
                if of != corner && set != own_set && room.may_link(&other) {
                    rooms[..=own].iter_mut().filter(|room| room.2 == own_set).for_each(|room| room.2 = set);
                }
            }
        }
        let mut max = 0;
        for set in 0..rooms.len() {
            let of_set = || rooms.iter().filter(|room| room.2 == set);
            let count = of_set().count();
            if count == 0 {
                continue;
            }
            let walls = of_set().filter(|(room, ..)| room.walls == 1).count();
            let corners = (0..4).filter(|&corner| of_set().any(|(_, of, _)| *of == corner)).count();
            let all_link = || {
                of_set().all(|(own, corner, _)| {
                    of_set().all(|(other, of, _)| of == corner || own.may_link(other))
                })
            };
            max += if count > corners || (walls > 0 && !all_link()) {
                refill(
                    undersides,
                    of_set().map(|(room, ..)| room.under).filter(|under| *under != BOTTOMLESS),
                );
                undersides.sort_unstable();
                undersides.dedup();
                count.min(2 + 2 * undersides.len()) + 6 * walls
            } else if walls > 0 {
                count + 1
            } else {
                count.saturating_sub(2)
            };
        }
        max
    }
}

/// Where surfaces may end at walls.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Walls {
    /// Pairs of a column and an adjacent one whose solid reaches from below the first one's ceiling up to it, or higher.
    pub pairs: usize,
    /// For each index, a bit for each of the quartets to the north-east, north-west, south-west and south-east in which it has such a wall.
    sides: Vec<u8>,
}

impl Walls {
    pub fn of(columns: &Columns) -> Self {
        let liquid = LiquidColumns { columns, depth: &[], above: &[] };
        let mut out = Self { pairs: 0, sides: vec![0; columns.len()] };
        for strip in 0..columns.strips().len() {
            for position in positions(columns.present(strip)) {
                let index = strip * STRIP + position;
                let ceiling = columns.ceilings()[index];
                let is_wall = RING.map(|step| {
                    liquid
                        .beside(index, step, ceiling - 1)
                        .is_some_and(|other| ceiling <= columns.bases()[other])
                });
                out.pairs += is_wall.iter().filter(|is_wall| **is_wall).count();
                // Each quartet has three cells of the ring, the middle one in a corner.
                let has_wall = |corner: usize| {
                    [corner - 1, corner, (corner + 1) % 8].into_iter().any(|cell| is_wall[cell])
                };
                for (side, corner) in [1, 3, 5, 7].into_iter().enumerate() {
                    out.sides[index] |= u8::from(has_wall(corner)) << side;
                }
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
        // Rooms of 3 units above undersides.
        let max = |cells: [&[i32]; 4]| {
            let cells = cells.map(|cell| {
                let bases = cell.iter().map(|under| if *under == BOTTOMLESS { 0 } else { under + 1 });
                let bases: Vec<i32> = bases.collect();
                let room = |(at, base): (usize, &i32)| Room {
                    under: cell[at],
                    base: *base,
                    ceiling: cell.get(at + 1).copied().unwrap_or(20),
                    walls: 0,
                };
                bases.iter().enumerate().map(room).collect::<Vec<_>>()
            });
            let [a, b, c, d] = &cells;
            Quartet::default().max_triangles([(a, 0), (b, 0), (c, 0), (d, 0)])
        };
        let ground: &[i32] = &[BOTTOMLESS];
        assert_eq!(max([ground, ground, ground, ground]), 2);
        assert_eq!(max([ground, ground, &[], &[5]]), 1);
        assert_eq!(max([ground, ground, &[], &[]]), 0);
        // Two floors at one height everywhere, and at different heights.
        assert_eq!(max([&[BOTTOMLESS, 7]; 4]), 4);
        assert_eq!(max([&[BOTTOMLESS, 7], &[BOTTOMLESS, 7], &[BOTTOMLESS, 8], ground]), 6);
    }
}
