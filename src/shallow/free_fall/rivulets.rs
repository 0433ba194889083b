//! Rivulets: liquid from nearby overflow edges gathers into one fall, because of surface tension.
//!
//! A thin sheet that leaves an edge contracts: from the edge of a table a film runs off in rivulets some millimetres apart. Of all overflow
//! edges, the one with the most liquid is the first rivulet, and takes the liquid of those within [`REACH`]; of the remaining edges, the
//! one with the most is the next. The recent flow of a rivulet counts, so that it stays where it is. All comparisons are in integers, and
//! equal edges stay separate: a turned or mirrored scene has the same rivulets.

use super::waiting::{Waiting, add};
use crate::numeric::lists::refill;
use crate::shallow::columns::Columns;
use crate::shallow::pipes::Links;
use crate::shallow::pipes::side::Side;

/// A rivulet takes the liquid of overflow edges within this distance (m); of the order of the capillary length, sqrt(sigma / (rho g)), 2.7
/// mm for water.
const REACH: f64 = 0.004;
/// Sentinel: not merged into another rivulet.
const UNMERGED: u32 = u32::MAX;

/// An overflow edge at which liquid waits.
#[derive(Debug, Clone, Copy)]
struct ActiveEdge {
    /// Index of the cell that it belongs to (`Grid::index`).
    cell: u32,
    link: u32,
    /// Middle of its edge (half cells), and its base (units).
    middle: [i32; 2],
    base: i32,
    side: Side,
    /// Flow in an interval (units); 0 if nothing arrived in the last.
    strength: i64,
    /// Index in this list of the edge that takes its liquid, and the distance to it (square of half cells).
    into: u32,
    square_distance: i32,
}

/// Lists of overflow edges; kept to avoid repeated allocation.
#[derive(Debug, Clone, Default)]
pub(super) struct Rivulets {
    /// Sorted by cell.
    edges: Vec<ActiveEdge>,
    /// Indices of `edges`, by decreasing strength.
    order: Vec<u32>,
}

impl Rivulets {
    /// Empty, with capacity for `links` links.
    pub fn with_room(links: usize) -> Self {
        Self { edges: Vec::with_capacity(links), order: Vec::with_capacity(links) }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.edges.capacity() * size_of::<ActiveEdge>() + self.order.capacity() * size_of::<u32>()
    }

    /// Finds the rivulets among the overflow edges, and for each other edge the rivulet that takes its liquid.
    fn find(&mut self, columns: &Columns, links: &Links, waiting: &[Waiting]) {
        let grid = columns.grid;
        let reach = 2.0 * REACH / grid.cell;
        // The next edge along a straight side is a cell (two halves) away; around a corner it is closer.
        let (reach, cells) = ((reach * reach).min(1e6) as i32, (0.5 * reach).min(500.0) as usize + 1);
        self.edges.clear();
        for (link, own) in waiting.iter().enumerate().filter(|(_, own)| own.is_awake()) {
            let from = (if own.is_back { links.to[link] } else { links.from[link] }) as usize;
            let side = if own.is_back { links.sides[link].opposite() } else { links.sides[link] };
            let [x, z] = columns.cell(from);
            let [east, south] = side.outward();
            let inflow = own.units - own.before;
            self.edges.push(ActiveEdge {
                cell: grid.index([x, z]) as u32,
                link: link as u32,
                middle: [2 * x as i32 + east, 2 * z as i32 + south],
                base: columns.bases()[from],
                side,
                strength: if inflow > 0 { own.steady + inflow } else { 0 },
                into: UNMERGED,
                square_distance: i32::MAX,
            });
        }
        self.edges.sort_unstable_by_key(|edge| (edge.cell, edge.link));
        refill(&mut self.order, 0..self.edges.len() as u32);
        let edges = &self.edges;
        self.order.sort_unstable_by_key(|&at| std::cmp::Reverse(edges[at as usize].strength));
        let step = (grid.cell / columns.heights.unit).min(f64::from(i32::MAX / 2)) as i32;
        let mut first = 0;
        while first < self.order.len() {
            // Edges of equal strength do not take from each other.
            let strength = self.edges[self.order[first] as usize].strength;
            let same =
                self.order[first..].iter().take_while(|&&at| self.edges[at as usize].strength == strength);
            let end = first + same.count();
            if strength > 0 {
                for position in first..end {
                    let at = self.order[position];
                    if self.edges[at as usize].into == UNMERGED {
                        self.take_around(at, [reach, step], cells, grid.size);
                    }
                }
            }
            first = end;
        }
    }

    /// A rivulet takes weaker edges nearby, unless a stronger rivulet takes them; of two equally strong ones, the nearer takes them.
    fn take_around(&mut self, at: u32, [reach, step]: [i32; 2], cells: usize, [nx, nz]: [usize; 2]) {
        let own = self.edges[at as usize];
        let [x, z] = [own.cell as usize % nx, own.cell as usize / nx];
        for row in z.saturating_sub(cells)..(z + cells + 1).min(nz) {
            let [from, to] =
                [x.saturating_sub(cells), (x + cells).min(nx - 1)].map(|x| (row * nx + x) as u32);
            let first = self.edges.partition_point(|edge| edge.cell < from);
            for other in first..self.edges.len() {
                let edge = self.edges[other];
                if edge.cell > to {
                    break;
                }
                let [east, south] = [0, 1].map(|n| edge.middle[n] - own.middle[n]);
                let square_distance = east * east + south * south;
                let joins = square_distance <= reach
                    && edge.strength < own.strength
                    && edge.side != own.side.opposite()
                    && (edge.base - own.base).abs() <= step;
                if !joins {
                    continue;
                }
                let (is_free, taken) = (edge.into == UNMERGED && edge.square_distance == i32::MAX, edge.into);
                let is_equal =
                    !is_free && (taken == UNMERGED || self.edges[taken as usize].strength == own.strength);
                let edge = &mut self.edges[other];
                if is_free || is_equal && square_distance < edge.square_distance {
                    (edge.into, edge.square_distance) = (at, square_distance);
                } else if is_equal && square_distance == edge.square_distance {
                    // Equally far from two equal rivulets: neither takes it.
                    edge.into = UNMERGED;
                }
            }
        }
    }

    /// Gives what waits at overflow edges to the rivulets near them, and updates the inflow of each in this interval.
    pub fn gather(&mut self, columns: &Columns, links: &Links, waiting: &mut [Waiting]) {
        self.find(columns, links, waiting);
        for edge in self.edges.iter().filter(|edge| edge.into != UNMERGED) {
            let given = &mut waiting[edge.link as usize];
            let Waiting { units, amounts, impulse, .. } = *given;
            given.clear();
            let taker = &mut waiting[self.edges[edge.into as usize].link as usize];
            taker.units += units;
            add(&mut taker.amounts, &amounts);
            taker.gathered += impulse.round() as i64;
        }
        for edge in &self.edges {
            let own = &mut waiting[edge.link as usize];
            // A sum of integers, so that it does not depend on their order.
            own.impulse += own.gathered as f64;
            own.gathered = 0;
            let inflow = (own.units - own.before).max(0);
            if inflow > 2 * own.steady {
                own.phase = (scatter(inflow as u64) >> 33) as u32;
            }
            own.steady = (3 * own.steady + inflow) / 4;
        }
    }
}

/// Hashes numbers that are close together to ones scattered over the whole range (splitmix64, Steele et al. 2014).
fn scatter(number: u64) -> u64 {
    let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}
