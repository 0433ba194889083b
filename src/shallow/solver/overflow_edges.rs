//! Overflow edges: links that liquid falls freely from. What goes over one does not arrive at its other end in the same step, and
//! the liquid there does not push back.

use super::link_flow::LinkFlow;
use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::pipes::Links;
use crate::shallow::pipes::cliffs::Cliffs;

/// Direction in which liquid falls freely over a link in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Fall {
    /// It does not fall.
    #[default]
    No,
    /// From its first column.
    Ahead,
    /// From its second column.
    Back,
}

/// The overflow edges of a step, by link; empty without falls.
#[derive(Debug, Clone, Default)]
pub struct OverflowEdges {
    falls: Vec<Fall>,
    /// H of the donor at the start of the step (units).
    depth: Vec<i32>,
    /// Units that the network of full columns moves over each.
    flooded: Vec<i64>,
}

/// Liquid that went over an overflow edge in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overflow {
    /// The link.
    pub link: usize,
    /// The donor, and the column below; [`NONE`]: the void.
    pub from: u32,
    pub to: u32,
    /// Volume (units).
    pub units: i64,
    /// H of the donor at the start of the step (units).
    pub depth: i32,
}

impl OverflowEdges {
    /// With capacity for `links` links.
    pub(in crate::shallow) fn with_room(links: usize) -> Self {
        let (falls, depth) = (Vec::with_capacity(links), Vec::with_capacity(links));
        Self { falls, depth, flooded: Vec::with_capacity(links) }
    }

    /// Finds the overflow edges: links whose base is more than `cliffs` above the surface at the other end, and those into the void.
    pub(in crate::shallow) fn find(
        &mut self,
        columns: &Columns,
        links: &Links,
        cliffs: Cliffs,
        depth: &[i32],
    ) {
        self.falls.clear();
        self.depth.clear();
        reset(&mut self.flooded, links.len(), 0);
        for link in 0..links.len() {
            let fall = fall(columns, links, cliffs, link, depth);
            let from = if fall == Fall::Back { links.to[link] } else { links.from[link] };
            self.falls.push(fall);
            self.depth.push(depth[from as usize]);
        }
    }

    /// Direction in which liquid falls freely over a link.
    #[inline(always)]
    pub fn at(&self, link: usize) -> Fall {
        self.falls.get(link).copied().unwrap_or_default()
    }

    /// Adds what the network of full columns moves over an overflow edge.
    pub(super) fn add_flooded(&mut self, link: usize, units: i64) {
        self.flooded[link] += units;
    }

    /// The liquid that went over the overflow edges in a step, in their order.
    pub fn overflow<'a>(
        &'a self,
        links: &'a Links,
        flow: &'a LinkFlow,
    ) -> impl Iterator<Item = Overflow> + 'a {
        let overflow_edges = (0..self.falls.len()).filter(|&link| self.falls[link] != Fall::No);
        overflow_edges.filter_map(move |link| {
            let units = i64::from(flow.transfer[link].abs() as i32) + self.flooded[link];
            let (from, to) = match self.falls[link] {
                Fall::Back => (links.to[link], links.from[link]),
                _ => (links.from[link], links.to[link]),
            };
            (units > 0).then(|| Overflow { link, from, to, units, depth: self.depth[link] })
        })
    }
}

/// Surface drop assumed where the ground beyond does not count: the edge of a cell (units).
pub(super) fn edge_drop(columns: &Columns) -> i32 {
    (columns.grid.cell / columns.heights.unit).min(f64::from(i32::MAX / 2)) as i32
}

fn fall(columns: &Columns, links: &Links, cliffs: Cliffs, link: usize, depth: &[i32]) -> Fall {
    let (from, to) = (links.from[link], links.to[link]);
    if to == NONE {
        // There is no void beyond the border of the domain.
        let is_void = links.sides[link].cell(columns.cell(from as usize), columns.grid.size).is_some();
        return if is_void { Fall::Ahead } else { Fall::No };
    }
    let base = columns.bases();
    let (i, j) = (from as usize, to as usize);
    // Bases, depths and surfaces are within 2^30.
    if base[i] - (base[j] + depth[j]) > cliffs.0 {
        Fall::Ahead
    } else if base[j] - (base[i] + depth[i]) > cliffs.0 {
        Fall::Back
    } else {
        Fall::No
    }
}
