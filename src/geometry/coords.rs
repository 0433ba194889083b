//! Coordinates of cells, nodes and blocks of a grid.

use super::{Coord, DVec3};

/// The cell that holds a position (cells).
pub fn cell_of(position: &DVec3) -> Coord {
    [0, 1, 2].map(|axis| position[axis].floor() as i32)
}

/// The sum of two coordinates.
pub fn plus(a: Coord, b: Coord) -> Coord {
    [0, 1, 2].map(|axis| a[axis] + b[axis])
}

/// All coordinates of the box from `low` to `high`, including both, ascending.
pub fn between(low: Coord, high: Coord) -> impl Iterator<Item = Coord> {
    let on = move |axis: usize| low[axis]..=high[axis];
    on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| [x, y, z])))
}

/// Whether a coordinate is in the box from `low` to `high`, including both.
pub fn is_between(at: Coord, low: Coord, high: Coord) -> bool {
    (0..3).all(|axis| (low[axis]..=high[axis]).contains(&at[axis]))
}

/// A cell and the 26 around it, ascending.
pub fn around(cell: Coord) -> [Coord; 27] {
    std::array::from_fn(|n| plus(cell, [n / 9, n / 3 % 3, n % 3].map(|at| at as i32 - 1)))
}

/// The eight nodes of a cell; the three bits of a node's index, the highest first, are its offsets along x, y and z.
pub fn nodes_of(cell: Coord) -> [Coord; 8] {
    std::array::from_fn(|n| plus(cell, [n >> 2, n >> 1 & 1, n & 1].map(|at| at as i32)))
}

/// The eight cells around a node.
pub fn cells_at(node: Coord) -> [Coord; 8] {
    std::array::from_fn(|n| plus(node, [n >> 2, n >> 1 & 1, n & 1].map(|at| -(at as i32))))
}
