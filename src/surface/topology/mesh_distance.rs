//! Gamma, the signed distance from the mesh, near the cells in which the mesh no longer fits the particles, matched to phi there (thesis
//! 2.4): it determines which nodes will be inside the rebuilt mesh.

use std::collections::{BTreeSet, HashMap};

use rayon::prelude::*;

use super::matching::{Matching, Node, match_topology};
use crate::context::Context;
use crate::distance::lattice::Lattice;
use crate::distance::nearest::{Search, search as find};
use crate::distance::triangle::Triangle;
use crate::error::Result;
use crate::geometry::coords::{between, cells_at, is_between, plus};
use crate::geometry::{Coord, DVec3};
use crate::mesh_repair::{CellSet, GridEdge, Inside, Shape, end};
use crate::numeric::blocks::{DIM, VOXELS, Values, offset};
use crate::numeric::lanes::LANES;
use crate::surface::level_set::band::Distances;
use crate::surface::level_set::implicit::{Implicit, SIDE};

/// Distance from the mesh up to which Gamma is known (cells): the thesis' fixed cells reach sqrt(3).
const KNOWN: f32 = 2.0;
/// Distance from flagged nodes within which Gamma may change (cells): at most a block.
const REACH: i32 = 8;
/// Bytes of a block: its distances twice, and its nodes in the matching.
const BYTES: usize = VOXELS * (2 * 4 + 2 * 28);
/// What needs the memory, for messages.
const WHAT: &str = "the mesh's change (larger cells need less)";
/// Minimum magnitude of Gamma (cells), so that its sign shows whether a node is inside.
const MIN_MAGNITUDE: f32 = 1e-6;
/// All nodes of a block.
const ALL: [u64; DIM] = [u64::MAX; DIM];

/// Gamma in blocks of 8 x 8 x 8 nodes around flagged cells.
pub struct Gamma<'a> {
    shape: &'a Shape,
    slots: HashMap<Coord, u32>,
    /// Blocks, counted from the lattice's origin, ascending.
    blocks: Vec<Coord>,
    /// Cells.
    values: Vec<Values>,
    /// Nodes whose Gamma differs from the mesh's own: a bit each.
    changed: Vec<[u64; DIM]>,
    /// Iterations of the matching.
    pub iterations: usize,
}

impl<'a> Gamma<'a> {
    /// Matches Gamma around flagged cells. Vertices have these positions (cells from the lattice's origin); `phi` and its distances are on
    /// the same grid.
    ///
    /// # Errors
    /// More memory than the context allows; cancel.
    pub fn matched(
        ctx: &Context,
        shape: &'a Shape,
        in_cells: &[DVec3],
        lattice: &Lattice,
        flagged: &CellSet,
        (phi, distances): (&Implicit, &Distances),
    ) -> Result<Self> {
        let mut wanted: BTreeSet<Coord> = BTreeSet::new();
        for cell in flagged.iter() {
            let block = cell.map(|at| at >> 3);
            // A cell's last corners may lie in the next block.
            let last = cell.map(|at| (at + 1) >> 3);
            wanted.extend(between(block.map(|at| at - 1), last.map(|at| at + 1)));
        }
        let origin = lattice.origin.map(|at| at >> 3);
        let blocks: Vec<Coord> = wanted.into_iter().collect();
        let slots: HashMap<Coord, u32> = blocks.iter().copied().zip(0..).collect();
        ctx.allow(WHAT, (blocks.len() * BYTES) as u64)?;
        let near = near(shape, in_cells, &blocks, &slots);
        let one = |memory: &mut Search, near: &Vec<Triangle>| {
            ctx.check()?;
            let mut gamma = Box::new([KNOWN; VOXELS]);
            if near.is_empty() {
                return Ok(gamma);
            }
            find(near, KNOWN, &ALL, memory, |group| {
                for lane in 0..LANES {
                    gamma[group.voxel(lane)] = group.squared[lane].sqrt().min(KNOWN);
                }
            });
            Ok(gamma)
        };
        let own: Vec<Box<Values>> = near.par_iter().map_init(Search::default, one).collect::<Result<_>>()?;
        let mut nodes = Vec::new();
        let mut positions = Vec::new();
        for (slot, block) in blocks.iter().enumerate() {
            let there = plus(*block, origin);
            let known = distances.find(there).map(|slot| distances.values(slot));
            if known.is_none() && near[slot].is_empty() {
                continue;
            }
            for at in 0..VOXELS {
                let position = node(*block, at);
                let phi = known.map_or_else(|| far(phi, distances.reach(), there, at), |values| values[at]);
                let size = own[slot][at].clamp(MIN_MAGNITUDE, KNOWN);
                let gamma = if shape.pierces.winding(position) > 0 { -size } else { size };
                let is_flagged = cells_at(position).into_iter().any(|cell| flagged.holds(cell));
                nodes.push(Node { position, gamma, phi, is_flagged });
                positions.push((slot, at));
            }
        }
        let matching = Matching { reach: REACH, ..Matching::default() };
        let matched = match_topology(ctx, &nodes, &matching)?;
        let mut values: Vec<Values> = own.into_iter().map(|values| *values).collect();
        let mut changed = vec![[0; DIM]; blocks.len()];
        for ((node, gamma), (slot, at)) in nodes.iter().zip(&matched.gamma).zip(positions) {
            values[slot][at] = *gamma;
            changed[slot][at >> 6] |= u64::from(gamma.to_bits() != node.gamma.to_bits()) << (at & 63);
        }
        Ok(Self { shape, slots, blocks, values, changed, iterations: matched.iterations })
    }

    /// Gamma at a node; none where it is still the mesh's own.
    fn changed(&self, node: Coord) -> Option<f32> {
        let slot = *self.slots.get(&node.map(|at| at >> 3))? as usize;
        let [x, y, z] = node.map(|at| (at & 7) as usize);
        let is_changed = self.changed[slot][x] >> (y << 3 | z) & 1 == 1;
        is_changed.then(|| self.values[slot][offset(x, y, z)])
    }

    fn value(&self, node: Coord) -> Option<f32> {
        let slot = *self.slots.get(&node.map(|at| at >> 3))? as usize;
        let [x, y, z] = node.map(|at| (at & 7) as usize);
        Some(self.values[slot][offset(x, y, z)])
    }

    /// Nodes that changed between inside and outside.
    pub fn nodes_that_changed_sides(&self) -> impl Iterator<Item = Coord> + '_ {
        self.blocks.iter().flat_map(|block| (0..VOXELS).map(move |at| node(*block, at))).filter(|node| {
            self.changed(*node).is_some_and(|gamma| (gamma < 0.0) != (self.shape.pierces.winding(*node) > 0))
        })
    }
}

impl Inside for Gamma<'_> {
    fn at(&self, node: Coord) -> bool {
        match self.changed(node) {
            Some(gamma) => gamma < 0.0,
            None => self.shape.pierces.winding(node) > 0,
        }
    }

    fn share(&self, edge: GridEdge) -> Option<f64> {
        let ends = [edge.1, end(edge)];
        if ends.iter().all(|node| self.changed(*node).is_none()) {
            return None;
        }
        let [a, b] = [self.value(ends[0])?, self.value(ends[1])?].map(f64::from);
        Some(if a == b { 0.5 } else { (a / (a - b)).clamp(0.0, 1.0) })
    }
}

/// A node of a block.
pub(in crate::surface) fn node(block: Coord, at: usize) -> Coord {
    [block[0] * 8 + (at >> 6) as i32, block[1] * 8 + (at >> 3 & 7) as i32, block[2] * 8 + (at & 7) as i32]
}

/// phi at a node of a block (of phi's grid) in which no distances are known: the reach, with the sign of phi.
pub(in crate::surface) fn far(phi: &Implicit, reach: f32, block: Coord, at: usize) -> f32 {
    let node = node(block, at);
    let patch = node.map(|at| at.div_euclid(SIDE));
    let is_inside = match phi.find(patch) {
        Some(found) => {
            let [x, y, z] = node.map(|at| at.rem_euclid(SIDE) as usize);
            phi.values(found)[x << 4 | y << 2 | z] < 0.0
        }
        None => phi.is_inside(patch),
    };
    if is_inside { -reach } else { reach }
}

/// The triangles near each block, in cells from its first node.
fn near(
    shape: &Shape,
    in_cells: &[DVec3],
    blocks: &[Coord],
    slots: &HashMap<Coord, u32>,
) -> Vec<Vec<Triangle>> {
    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); blocks.len()];
    for (triangle, names) in (0..).zip(&shape.triangles) {
        let v = names.map(|name| in_cells[name as usize]);
        let side = |position: DVec3, by: f32| {
            [0, 1, 2].map(|axis| ((position[axis] + f64::from(by)).floor() as i32) >> 3)
        };
        let low = side(v[0].inf(&v[1]).inf(&v[2]), -KNOWN);
        let high = side(v[0].sup(&v[1]).sup(&v[2]), KNOWN + 1.0);
        let size = (0..3).map(|axis| i64::from(high[axis] - low[axis]) + 1).product::<i64>();
        if size > blocks.len() as i64 {
            // A spike: its box contains more blocks than there are.
            let within = blocks.iter().zip(&mut lists).filter(|(block, _)| is_between(**block, low, high));
            within.for_each(|(_, list)| list.push(triangle));
            continue;
        }
        for block in between(low, high) {
            if let Some(slot) = slots.get(&block) {
                lists[*slot as usize].push(triangle);
            }
        }
    }
    let of_block = |(block, list): (&Coord, &Vec<u32>)| {
        let corner = DVec3::from(block.map(|at| f64::from(at * DIM as i32)));
        let seen = |name: u32| <[f32; 3]>::from((in_cells[name as usize] - corner).cast::<f32>());
        list.iter()
            .map(|triangle| Triangle::of_cells(shape.triangles[*triangle as usize].map(seen)))
            .collect()
    };
    blocks.par_iter().zip(&lists).map(of_block).collect()
}
