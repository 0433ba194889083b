//! Which cells are rebuilt.
//!
//! The mesh is cut along the outer faces of a set of cells, so it must be sound there: it crosses each outer edge of the grid at most once,
//! and only where the winding number changes between 0 or less and over 0. The set grows until that holds, before anything is cut.

pub(in crate::mesh_repair) mod faulty_cells;

use std::collections::BTreeMap;

use super::cut::exact::{GridEdge, cells_around, end};
use super::cut::pierces::Pierces;
use crate::geometry::{Coord, coords};
use crate::numeric::blocks::{Mask, origin_of};

/// A set of cells, in blocks of 8 x 8 x 8.
#[derive(Debug, Clone, Default)]
pub struct CellSet {
    blocks: BTreeMap<Coord, Mask>,
    count: usize,
}

impl CellSet {
    /// Whether a cell is in it.
    pub fn holds(&self, cell: Coord) -> bool {
        let (row, bit) = bit_of(cell);
        self.blocks.get(&origin_of(cell)).is_some_and(|mask| mask[row] & bit != 0)
    }

    /// Adds a cell; returns whether it is new.
    pub fn add(&mut self, cell: Coord) -> bool {
        let (row, bit) = bit_of(cell);
        let word = &mut self.blocks.entry(origin_of(cell)).or_default()[row];
        let is_new = *word & bit == 0;
        *word |= bit;
        self.count += usize::from(is_new);
        is_new
    }

    /// Count of cells.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The cells, block by block.
    pub fn iter(&self) -> impl Iterator<Item = Coord> + '_ {
        self.blocks.iter().flat_map(|(origin, mask)| {
            (0..512usize).filter(|at| mask[at >> 6] >> (at & 63) & 1 == 1).map(|at| {
                [origin[0] + (at >> 6) as i32, origin[1] + (at >> 3 & 7) as i32, origin[2] + (at & 7) as i32]
            })
        })
    }

    /// The set with the 26 cells around each of its cells.
    pub fn with_ring(&self) -> Self {
        let mut out = self.clone();
        for cell in self.iter() {
            coords::around(cell).into_iter().for_each(|cell| _ = out.add(cell));
        }
        out
    }
}

fn bit_of(cell: Coord) -> (usize, u64) {
    let [x, y, z] = cell.map(|at| (at & 7) as usize);
    (x, 1 << (y << 3 | z))
}

/// The twelve edges of a cell.
pub fn edges_of(cell: Coord) -> impl Iterator<Item = GridEdge> {
    (0..12).map(move |at| {
        let (axis, corner) = (at >> 2, at & 3);
        let mut node = cell;
        node[(axis + 1) % 3] += (corner >> 1) as i32;
        node[(axis + 2) % 3] += (corner & 1) as i32;
        (axis, node)
    })
}

/// Which nodes are inside the new surface.
pub trait Inside: Sync {
    /// Whether a node is inside.
    fn at(&self, node: Coord) -> bool;

    /// Position of the surface along an edge of the grid that has one end inside and one outside (0..=1); none: it lies where the mesh
    /// crosses the edge.
    fn share(&self, edge: GridEdge) -> Option<f64>;
}

/// The inside of the mesh itself: where its winding number is over 0.
impl Inside for Pierces {
    fn at(&self, node: Coord) -> bool {
        self.winding(node) > 0
    }

    fn share(&self, _edge: GridEdge) -> Option<f64> {
        None
    }
}

/// Whether the mesh cannot be cut at this edge.
pub fn is_unsound(pierces: &Pierces, inside: &impl Inside, edge: GridEdge) -> bool {
    let ends = [edge.1, end(edge)];
    let [a, b] = ends.map(|node| inside.at(node));
    let own = ends.map(|node| pierces.winding(node) > 0);
    [a, b] != own || pierces.on(edge).len() != usize::from(a != b)
}

/// Grows a set from the cells just added to it until the mesh is sound on all of its outer edges.
pub fn grow(set: &mut CellSet, mut added: Vec<Coord>, pierces: &Pierces, inside: &impl Inside) {
    while let Some(cell) = added.pop() {
        for edge in edges_of(cell) {
            let cells = cells_around(edge);
            if cells.iter().all(|cell| set.holds(*cell)) || !is_unsound(pierces, inside, edge) {
                continue;
            }
            added.extend(cells.into_iter().filter(|cell| set.add(*cell)));
        }
    }
}
