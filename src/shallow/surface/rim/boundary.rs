//! Where the liquid ends: walls, the extra vertices within them, and the averages for dry and extra vertices (thesis 4.2.3).

use std::ops::Range;

use crate::shallow::columns::{NONE, STRIP};
use crate::shallow::surface::quartets::links::{LiquidColumns, RING, are_near, cell_at};
use crate::shallow::surface::quartets::strips::{Found, positions};

/// A surface of linked wet columns that ends at a column's solid.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::surface) struct Wall {
    /// Index of the column.
    pub column: u32,
    /// The wet columns whose surface ends there, by position in the ring of cells around, or [`NONE`].
    pub members: [u32; 8],
    /// Whether the members use the column's own vertex, which is dry and lies between columns linked with them, instead of an extra one.
    pub is_own: bool,
    /// Mean height of the members (units).
    pub height: i32,
    /// The extra vertex, or [`NONE`].
    pub vertex: u32,
}

impl Wall {
    /// Whether a column's surface ends there.
    pub fn has(&self, index: u32) -> bool {
        self.members.iter().fold(false, |any, member| any | (*member == index))
    }
}

/// Positions of a column's walls in a list in order of columns.
pub(in crate::shallow::surface) fn walls_of(list: &[Wall], column: u32) -> Range<usize> {
    let first = list.partition_point(|wall| wall.column < column);
    let count = list[first..].iter().take_while(|wall| wall.column == column).count();
    first..first + count
}

/// Walls to reserve beyond those of the terrain: a tool that dips into liquid makes hundreds, in frames that should allocate nothing.
const ROOM: usize = 1024;

/// All walls, in order of columns.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Walls {
    pub list: Vec<Wall>,
    /// For each wall, whether a triangle uses its extra vertex.
    pub used: Vec<bool>,
    /// For one column, the neighbours whose surfaces end at it: position in the ring, index, and whether a wall has it as a member.
    nodes: Vec<(usize, u32, bool)>,
}

impl Walls {
    /// Reserves memory for this many pairs of a wet column and a wall, this many layers, and [`ROOM`] more walls.
    pub fn reserve(&mut self, pairs: usize, layers: usize) {
        self.clear();
        self.list.reserve(pairs + ROOM);
        self.used.reserve(pairs + ROOM);
        self.nodes.reserve(8 * layers);
    }

    pub fn clear(&mut self) {
        self.list.clear();
        self.used.clear();
    }

    /// Finds the surfaces that end at the columns marked as walls.
    pub fn find(&mut self, liquid: LiquidColumns<'_>, found: &Found) {
        for strip in found.candidates.iter() {
            for position in positions(found.states[strip].walls) {
                self.find_at(liquid, strip * STRIP + position);
            }
        }
        self.used.resize(self.list.len(), false);
    }

    fn find_at(&mut self, liquid: LiquidColumns<'_>, column: usize) {
        let cell = liquid.columns.cell(column);
        self.nodes.clear();
        for (ring, step) in RING.into_iter().enumerate() {
            for other in liquid.of_cell(cell_at(cell, step)) {
                if liquid.is_wet(other)
                    && liquid.holds(column, liquid.height(other))
                    && liquid.ends_at(other, column)
                {
                    self.nodes.push((ring, other as u32, false));
                }
            }
        }
        // If the column is dry and linked with wet columns, nodes that are linked with these use its own vertex.
        if !liquid.is_wet(column) {
            let linked = RING.map(|step| liquid.wet_beside(column, step));
            self.add(liquid, column, linked, true);
        }
        for first in 0..self.nodes.len() {
            if !self.nodes[first].2 {
                self.add(liquid, column, [None; 8], false);
            }
        }
    }

    /// Adds a wall: nodes that have none yet and are linked with each other, directly or through others. With `is_own` it starts from nodes
    /// that are linked with the given columns, else from the first node left.
    fn add(&mut self, liquid: LiquidColumns<'_>, column: usize, linked: [Option<usize>; 8], is_own: bool) {
        let mut members = [NONE; 8];
        let is_linked =
            |a: (usize, usize), b: (usize, usize)| are_near(a.0, b.0) && liquid.are_linked(a.1, b.1);
        loop {
            let is_empty = members == [NONE; 8];
            let next = self.nodes.iter().position(|&(ring, index, has_wall)| {
                if has_wall || members[ring] != NONE || linked[ring].is_some() {
                    return false;
                }
                let node = (ring, index as usize);
                let with = |(other, index)| is_linked((other, index), node);
                let of_members = members.iter().enumerate().filter(|(_, member)| **member != NONE);
                (is_empty && !is_own)
                    || linked
                        .iter()
                        .enumerate()
                        .any(|(other, index)| index.is_some_and(|index| with((other, index))))
                    || of_members.map(|(other, member)| (other, *member as usize)).any(with)
            });
            let Some(next) = next else { break };
            let (ring, index, has_wall) = &mut self.nodes[next];
            members[*ring] = *index;
            *has_wall = true;
        }
        let (mut sum, mut count) = (0, 0);
        for &member in members.iter().filter(|member| **member != NONE) {
            sum += i64::from(liquid.height(member as usize));
            count += 1;
        }
        if count > 0 {
            let height = (sum / count) as i32;
            self.list.push(Wall { column: column as u32, members, is_own, height, vertex: NONE });
        }
    }

    /// Numbers the extra vertices that triangles use, starting at `first`, and returns their count.
    pub fn number(&mut self, first: u32) -> u32 {
        let mut next = first;
        for (wall, _) in self.list.iter_mut().zip(&self.used).filter(|(_, used)| **used) {
            wall.vertex = next;
            next += 1;
        }
        next - first
    }
}

/// The wet columns whose mean a dry or extra vertex takes: position in the ring around the vertex's cell, and index.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Stencil(Vec<(usize, usize)>);

impl Stencil {
    /// Reserves memory for the maximum: eight columns, and eight neighbours of each.
    pub fn reserve(&mut self) {
        self.0.clear();
        self.0.reserve(8 + 8 + 8 * 8);
    }

    fn add(&mut self, ring: usize, index: usize) {
        if !self.0.contains(&(ring, index)) {
            self.0.push((ring, index));
        }
    }

    /// Collects the wet columns that a dry one is linked with.
    pub fn take_linked(&mut self, liquid: LiquidColumns<'_>, column: usize) {
        self.0.clear();
        for (ring, step) in RING.into_iter().enumerate() {
            if let Some(wet) = liquid.wet_beside(column, step) {
                self.0.push((ring, wet));
            }
        }
    }

    /// Collects the members of a wall and the neighbours of its cell that are linked with one of them; if they use its column's vertex,
    /// also the columns that this column is linked with.
    pub fn take_wall(&mut self, liquid: LiquidColumns<'_>, wall: &Wall) {
        self.0.clear();
        if wall.is_own {
            self.take_linked(liquid, wall.column as usize);
        }
        for (ring, &member) in wall.members.iter().enumerate().filter(|(_, member)| **member != NONE) {
            self.add(ring, member as usize);
            for other in (0..8).filter(|&other| are_near(ring, other)) {
                let step = [RING[other][0] - RING[ring][0], RING[other][1] - RING[ring][1]];
                if let Some(wet) = liquid.wet_beside(member as usize, step) {
                    self.add(other, wet);
                }
            }
        }
    }

    /// Mean of heights (units).
    pub fn mean_height(&self, height: impl Fn(usize) -> i32) -> f64 {
        let sum: i64 = self.0.iter().map(|&(_, index)| i64::from(height(index))).sum();
        sum as f64 / self.0.len().max(1) as f64
    }

    /// Sum of vectors, in an order that rotates and mirrors with the scene.
    pub fn sum<const N: usize>(&self, mut vector: impl FnMut(usize) -> [f32; N]) -> [f32; N] {
        let mut of_ring = [[0.0; N]; 8];
        for &(ring, index) in &self.0 {
            let vector = vector(index);
            for axis in 0..N {
                of_ring[ring][axis] += vector[axis];
            }
        }
        std::array::from_fn(|axis| {
            let [e, ne, n, nw, w, sw, s, se] = of_ring.map(|vector| vector[axis]);
            ((e + w) + (n + s)) + ((ne + sw) + (nw + se))
        })
    }

    /// Count of columns.
    pub fn len(&self) -> usize {
        self.0.len()
    }
}
