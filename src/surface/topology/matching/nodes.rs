//! Which nodes are solved for, and their equations (thesis 2.4, 2.4.2).

use rayon::prelude::*;

use super::PIECE;
use super::solve::{NONE, Row};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::Coord;
use crate::surface::pieces::in_pieces;

/// Role of a node in the matching.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Near the mesh and not flagged: psi is given.
    Fixed,
    /// psi is solved for.
    Free,
    /// Too far from all flagged nodes: Gamma stays.
    Kept,
}

/// The nodes that are solved for.
pub struct Free {
    /// Their indices, ascending by position.
    pub nodes: Vec<u32>,
    /// The equation of each.
    pub rows: Vec<Row>,
    /// Count of fixed nodes.
    pub fixed: usize,
}

/// Bytes of a node while it is sorted, and additional ones if it is solved for.
const BYTES: [usize; 2] = [28, 200];

impl Free {
    /// The free nodes: those within `reach` cells, on each axis, of flagged ones.
    ///
    /// # Errors
    /// Two nodes at the same position; distances that are not finite; more memory than the context allows; cancel.
    pub fn of(ctx: &Context, nodes: &[Node], reach: i32) -> Result<Self> {
        let sorted = sorted(nodes)?;
        let roles = roles(ctx, nodes, &sorted, reach)?;
        let free: Vec<u32> =
            (0..sorted.len() as u32).filter(|at| roles[*at as usize] == Role::Free).collect();
        ctx.allow("the topology matching", (sorted.len() * BYTES[0] + free.len() * BYTES[1]) as u64)?;
        let mut ranks = vec![NONE; sorted.len()];
        free.iter().zip(0..).for_each(|(at, rank)| ranks[*at as usize] = rank);
        let row = |at: u32, beside: [u32; 6]| {
            let is_odd = sorted[at as usize].0.iter().fold(0, |sum, x| sum ^ x) & 1 == 1;
            let mut row = Row { beside: [NONE; 6], given: 0, load: 0.0, is_odd, is_rim: false };
            for (side, other) in beside.into_iter().enumerate().filter(|(_, other)| *other != NONE) {
                let role = roles[other as usize];
                if role == Role::Free {
                    row.beside[side] = ranks[other as usize];
                    continue;
                }
                row.is_rim |= role == Role::Kept;
                let node = &nodes[sorted[other as usize].1 as usize];
                if role == Role::Fixed || !has_same_side(node) {
                    row.given += 1;
                    row.load += f64::from(node.gamma) - f64::from(node.phi);
                }
            }
            row
        };
        let rows = in_pieces(ctx, &free, PIECE, |_, piece| {
            let beside = beside(&sorted, piece);
            piece.iter().zip(beside).map(|(at, beside)| row(*at, beside)).collect()
        })?;
        let fixed = roles.iter().filter(|role| **role == Role::Fixed).count();
        let nodes = free.iter().map(|at| sorted[*at as usize].1).collect();
        Ok(Self { nodes, rows, fixed })
    }
}

/// Whether a surface at this distance from a node (cells) may pass through one of the cells around it: |d| <= sqrt(3).
fn is_near(distance: f32) -> bool {
    f64::from(distance) * f64::from(distance) <= 3.0
}

/// Whether phi has Gamma's sign at a node, and the particles' surface is not near it.
fn has_same_side(node: &Node) -> bool {
    (node.phi < 0.0) == (node.gamma < 0.0) && !is_near(node.phi)
}

/// Positions of nodes, ascending, with their indices.
fn sorted(nodes: &[Node]) -> Result<Vec<(Coord, u32)>> {
    if nodes.len() >= NONE as usize {
        return Err(Error::argument(format!("{} nodes are too many to match", nodes.len())));
    }
    if let Some(node) = nodes.iter().find(|node| !(node.gamma.is_finite() && node.phi.is_finite())) {
        return Err(Error::argument(format!("the distances of node {:?} are not finite", node.position)));
    }
    let mut sorted: Vec<(Coord, u32)> = nodes.iter().map(|node| node.position).zip(0..).collect();
    sorted.par_sort_unstable();
    match sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => Err(Error::argument(format!("node {:?} is listed twice", pair[0].0))),
        None => Ok(sorted),
    }
}

/// The role of each node, in the order of positions.
fn roles(ctx: &Context, nodes: &[Node], sorted: &[(Coord, u32)], reach: i32) -> Result<Vec<Role>> {
    ctx.check()?;
    let flagged = sorted.iter().filter(|(_, at)| nodes[*at as usize].is_flagged);
    let flagged = Flagged::new(flagged.map(|(position, _)| *position));
    let role = |(position, at): &(Coord, u32)| {
        let node = &nodes[*at as usize];
        if node.is_flagged {
            Role::Free
        } else if is_near(node.gamma) {
            Role::Fixed
        } else if flagged.is_within(position, reach) {
            Role::Free
        } else {
            Role::Kept
        }
    };
    in_pieces(ctx, sorted, PIECE, |_, piece| piece.iter().map(role).collect())
}

/// The neighbours of some nodes, before and behind them on x, y and z; [`NONE`]: there is none. All are indices in the order of positions;
/// `piece` ascends.
fn beside(sorted: &[(Coord, u32)], piece: &[u32]) -> Vec<[u32; 6]> {
    let mut out = vec![[NONE; 6]; piece.len()];
    for side in 0..6 {
        // The neighbours of ascending positions ascend too: both lists are traversed once.
        let mut last: Option<usize> = None;
        for (found, at) in out.iter_mut().zip(piece) {
            let Some(wanted) = step(sorted[*at as usize].0, side) else { continue };
            let mut next = last.unwrap_or_else(|| sorted.partition_point(|(position, _)| *position < wanted));
            while sorted.get(next).is_some_and(|(position, _)| *position < wanted) {
                next += 1;
            }
            if sorted.get(next).is_some_and(|(position, _)| *position == wanted) {
                found[side] = next as u32;
            }
            last = Some(next);
        }
    }
    out
}

/// The neighbouring position: before or behind on x, y, z.
fn step(mut position: Coord, side: usize) -> Option<Coord> {
    let axis = side / 2;
    position[axis] = position[axis].checked_add(if side.is_multiple_of(2) { -1 } else { 1 })?;
    Some(position)
}

/// Flagged nodes in a binary tree of boxes, split at medians. A leaf is a run of nodes on z.
struct Flagged {
    boxes: Vec<TreeBox>,
}

/// Children of an inner box are the next box and `right`, which is 0 for a leaf.
struct TreeBox {
    low: Coord,
    high: Coord,
    right: u32,
}

impl Flagged {
    /// The tree of ascending positions.
    fn new(positions: impl Iterator<Item = Coord>) -> Self {
        let mut runs: Vec<[Coord; 2]> = Vec::new();
        for position in positions {
            match runs.last_mut() {
                Some([_, [x, y, z]]) if [*x, *y, z.wrapping_add(1)] == position => *z = position[2],
                _ => runs.push([position; 2]),
            }
        }
        let mut tree = Self { boxes: Vec::new() };
        if !runs.is_empty() {
            tree.split(&mut runs);
        }
        tree
    }

    fn split(&mut self, runs: &mut [[Coord; 2]]) -> u32 {
        let [mut low, mut high] = runs[0];
        for run in runs.iter() {
            for axis in 0..3 {
                low[axis] = low[axis].min(run[0][axis]);
                high[axis] = high[axis].max(run[1][axis]);
            }
        }
        let index = self.boxes.len();
        self.boxes.push(TreeBox { low, high, right: 0 });
        if runs.len() > 1 {
            let length = |axis: usize| i64::from(high[axis]) - i64::from(low[axis]);
            let axis = if length(0) >= length(1).max(length(2)) {
                0
            } else if length(1) >= length(2) {
                1
            } else {
                2
            };
            let middle = runs.len() / 2;
            runs.select_nth_unstable_by_key(middle, |run| run[0][axis]);
            let (first, second) = runs.split_at_mut(middle);
            self.split(first);
            let right = self.split(second);
            self.boxes[index].right = right;
        }
        index as u32
    }

    /// Whether a position is within `reach` cells of a flagged node on each axis.
    fn is_within(&self, position: &Coord, reach: i32) -> bool {
        !self.boxes.is_empty() && self.has_within(0, position, i64::from(reach))
    }

    fn has_within(&self, index: usize, position: &Coord, reach: i64) -> bool {
        let part = &self.boxes[index];
        let (mut nearest, mut farthest) = (0i64, 0i64);
        for axis in 0..3 {
            let [at, low, high] = [position[axis], part.low[axis], part.high[axis]].map(i64::from);
            nearest = nearest.max(low - at).max(at - high);
            farthest = farthest.max(high - at).max(at - low);
        }
        if nearest > reach || farthest <= reach || part.right == 0 {
            return nearest <= reach;
        }
        self.has_within(index + 1, position, reach) || self.has_within(part.right as usize, position, reach)
    }
}

/// A node of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Its position (cells).
    pub position: [i32; 3],
    /// Signed distance from the mesh (cells), negative inside; may be clamped beyond sqrt(3).
    pub gamma: f32,
    /// Signed distance from the particles' surface (cells), negative inside; clamped to the width of its band.
    pub phi: f32,
    /// Whether Gamma follows phi here.
    pub is_flagged: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random positions, within `size` cells of the origin on each axis; ascending.
    fn scattered(count: u32, size: u32) -> Vec<Coord> {
        let position = |n: u32| {
            let of = |axis: u32| {
                (n.wrapping_mul(2_654_435_761).wrapping_add(axis.wrapping_mul(40_503)) >> (axis * 5 + 7))
                    % (2 * size + 1)
            };
            [0, 1, 2].map(|axis| of(axis) as i32 - size as i32)
        };
        let mut positions: Vec<Coord> = (0..count).map(position).collect();
        positions.sort_unstable();
        positions.dedup();
        positions
    }

    #[test]
    fn the_tree_finds_what_a_search_through_all_finds() {
        let flagged = scattered(60, 12);
        let tree = Flagged::new(flagged.iter().copied());
        let mut counts = [0; 2];
        for reach in [1, 2, 5] {
            for position in scattered(400, 17) {
                let is_near =
                    |other: &Coord| (0..3).all(|axis| (other[axis] - position[axis]).abs() <= reach);
                let expected = flagged.iter().any(is_near);
                assert_eq!(tree.is_within(&position, reach), expected, "{position:?} within {reach}");
                counts[usize::from(expected)] += 1;
            }
        }
        assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
        // Distances that exceed 32 bits.
        let far = [i32::MIN, 0, i32::MAX - 20];
        assert!(flagged[0][0] < 0 && tree.is_within(&far, i32::MAX));
        assert!(!tree.is_within(&far, i32::MAX - 30));
        assert!(!Flagged::new(std::iter::empty()).is_within(&[0; 3], i32::MAX));
    }

    #[test]
    fn nodes_beside_others_are_found_at_the_ends_of_the_grid_too() {
        let ends =
            [[i32::MIN, 0, 0], [-1, 0, 0], [0, 0, -1], [0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 0, i32::MAX]];
        let sorted: Vec<(Coord, u32)> = ends.into_iter().zip(0..).collect();
        let found = beside(&sorted, &[0, 1, 3, 5, 6]);
        assert_eq!(found[0], [NONE; 6]);
        assert_eq!(found[1], [NONE, 3, NONE, NONE, NONE, NONE]);
        assert_eq!(found[2], [1, 5, NONE, 4, 2, NONE]);
        assert_eq!(found[3], [3, NONE, NONE, NONE, NONE, NONE]);
        assert_eq!(found[4], [NONE; 6]);
    }
}
