//! The sparse set of tiles and their neighbours.

use crate::numeric::blocks::VOXELS;

/// Coordinate of a tile: that of its lowest cell, divided by 8.
pub type Coord = [i32; 3];
/// 512 values of a tile, in the order of [`crate::numeric::blocks`].
pub type Tile = [f32; VOXELS];
/// A field: a tile of values for each slot.
pub type Field = Vec<Tile>;

/// No tile.
pub const NONE: u32 = u32::MAX;
/// Index of a tile itself among its 27 neighbours.
pub const SELF: usize = 13;
/// A tile of zeros.
pub static ZEROS: Tile = [0.0; VOXELS];

/// Index among the 27 neighbours of the one at an offset of -1, 0 or 1 on each axis.
#[inline]
pub const fn neighbour_at(offset: [i32; 3]) -> usize {
    ((offset[0] + 1) * 9 + (offset[1] + 1) * 3 + offset[2] + 1) as usize
}

/// Indices among the 27 neighbours of the six that share a face: -x, +x, -y, +y, -z, +z.
pub const FACES: [usize; 6] = [4, 22, 10, 16, 12, 14];

/// A sparse set of tiles. The first [`Tiles::active`] slots hold cells. The slots after them, the *rim*, are the tiles adjacent to these in
/// all 26 directions: they hold the upper faces of cells at the border of the active tiles, and the state of the surrounding air.
#[derive(Debug, Default)]
pub struct Tiles {
    coords: Vec<Coord>,
    active: usize,
    neighbours: Vec<[u32; 27]>,
}

impl Clone for Tiles {
    fn clone(&self) -> Self {
        Self { coords: self.coords.clone(), active: self.active, neighbours: self.neighbours.clone() }
    }

    fn clone_from(&mut self, other: &Self) {
        self.coords.clone_from(&other.coords);
        self.active = other.active;
        self.neighbours.clone_from(&other.neighbours);
    }
}

impl Tiles {
    /// A set with these active tiles, sorted and without duplicates.
    pub fn new(active: &[Coord]) -> Self {
        debug_assert!(active.is_sorted_by(|a, b| a < b));
        // All tiles in their order, with their slots.
        let mut all: Vec<(Coord, u32)> = padded(active, 1).into_iter().map(|coord| (coord, NONE)).collect();
        let mut coords = active.to_vec();
        let mut rest = active.iter().zip(0u32..).peekable();
        for (coord, slot) in &mut all {
            if let Some((_, next)) = rest.next_if(|(next, _)| *next == coord) {
                *slot = next;
            } else {
                *slot = coords.len() as u32;
                coords.push(*coord);
            }
        }
        let neighbours = neighbours(&all);
        Self { coords, active: active.len(), neighbours }
    }

    /// The slot of a coordinate.
    pub fn find(&self, coord: Coord) -> Option<u32> {
        let (active, rim) = self.coords.split_at(self.active);
        let found = active.binary_search(&coord);
        let found = found.or_else(|_| rim.binary_search(&coord).map(|slot| slot + self.active));
        found.ok().map(|slot| slot as u32)
    }

    /// Whether both are the same set of tiles.
    pub fn is_same_set(&self, other: &Self) -> bool {
        self.active == other.active && self.coords == other.coords
    }

    /// Coordinates of all tiles, by slot.
    pub fn coords(&self) -> &[Coord] {
        &self.coords
    }

    /// Count of active tiles.
    pub fn active(&self) -> usize {
        self.active
    }

    /// Count of all tiles.
    pub fn count(&self) -> usize {
        self.coords.len()
    }

    /// Slots of the 27 tiles around each tile, itself at [`SELF`].
    pub fn neighbours(&self) -> &[[u32; 27]] {
        &self.neighbours
    }

    /// The cell adjacent to a cell on an axis, and its tile.
    pub fn adjacent_cell(&self, slot: usize, cell: usize, axis: usize, upper: bool) -> (u32, usize) {
        let step = 64 >> (3 * axis);
        match (upper, cell / step % 8) {
            (true, 7) => (self.neighbours[slot][FACES[2 * axis + 1]], cell - 7 * step),
            (true, _) => (slot as u32, cell + step),
            (false, 0) => (self.neighbours[slot][FACES[2 * axis]], cell + 7 * step),
            (false, _) => (slot as u32, cell - step),
        }
    }

    /// The values of the six neighbours that share a face with an active tile, in the order of [`FACES`]; zeros where the
    /// field has none.
    pub fn face_neighbours<'a>(&self, field: &'a [Tile], slot: usize) -> [&'a Tile; 6] {
        FACES.map(|at| field.get(self.neighbours[slot][at] as usize).unwrap_or(&ZEROS))
    }
}

/// Slots of the 27 tiles around each of these sorted tiles, by slot.
fn neighbours(all: &[(Coord, u32)]) -> Vec<[u32; 27]> {
    let mut out = vec![[NONE; 27]; all.len()];
    for column in 0..9 {
        let [x, y] = [column / 3, column % 3].map(|at| at - 1);
        // The neighbours that are looked up come in the same order as the tiles.
        let mut next = 0;
        for (coord, slot) in all {
            let sought = [coord[0] + x, coord[1] + y, coord[2] - 1];
            while all.get(next).is_some_and(|(coord, _)| *coord < sought) {
                next += 1;
            }
            let mut found = next;
            for z in 0..3 {
                let wanted = [sought[0], sought[1], sought[2] + z];
                if let Some((_, near)) = all.get(found).filter(|(coord, _)| *coord == wanted) {
                    out[*slot as usize][(3 * column + z) as usize] = *near;
                    found += 1;
                }
            }
        }
    }
    out
}

/// A coordinate moved along an axis.
pub fn shifted(mut coord: Coord, axis: usize, by: i32) -> Coord {
    coord[axis] += by;
    coord
}

/// Sorted runs of coordinates, merged: each once.
fn merged(mut runs: Vec<Coord>) -> Vec<Coord> {
    // A stable sort recognises runs.
    runs.sort();
    runs.dedup();
    runs
}

/// Sorted coordinates of the tiles within `padding` tiles of any of these, in all 26 directions.
pub fn padded(tiles: &[Coord], padding: i32) -> Vec<Coord> {
    let mut out = tiles.to_vec();
    for axis in 0..3 {
        let wider =
            (-padding..=padding).flat_map(|by| out.iter().map(move |coord| shifted(*coord, axis, by)));
        out = merged(wider.collect());
    }
    out
}

/// Sorted coordinates of the tiles within `steps` steps of any of these, each step across a face or an edge.
pub fn bordered(tiles: &[Coord], steps: usize) -> Vec<Coord> {
    let mut out = tiles.to_vec();
    for _ in 0..steps {
        // Pairs of axes: the tiles within one tile on both axes of a pair.
        let pairs = [[0, 1], [0, 2], [1, 2]].into_iter().flat_map(|[a, b]| {
            let offsets = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j)));
            let out = &out;
            offsets.flat_map(move |(i, j)| out.iter().map(move |coord| shifted(shifted(*coord, a, i), b, j)))
        });
        out = merged(pairs.collect());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rim_lies_around_the_active_tiles() {
        let tiles = Tiles::new(&[[0, 0, 0], [0, 0, 1]]);
        assert_eq!((tiles.active(), tiles.count()), (2, 36));
        assert_eq!(tiles.find([-1, -1, -1]), Some(2));
        let near = tiles.neighbours()[0];
        assert_eq!((near[SELF], near[neighbour_at([0, 0, 1])]), (0, 1));
        assert_eq!(tiles.neighbours()[2][neighbour_at([0, 0, -1])], NONE);
        assert_eq!(padded(&[[0, 0, 0]], 1).len(), 27);
        assert_eq!(bordered(&[[0, 0, 0]], 1).len(), 19);
    }
}
