//! Full columns, as nodes of the network.

use std::cmp::Ordering;

use crate::shallow::columns::{Columns, NONE};

/// Heads closer than this (units) are equal, like surfaces that differ by less than a unit: liquid at rest stays at rest.
pub(in crate::shallow::solver) const HEAD_TOLERANCE: f64 = 0.5;

/// Regularisation of the diagonal, as a fraction of the conductance: just enough that a closed cavity has a solution.
pub(in crate::shallow::solver) const REGULARISATION: f64 = 1e-12;

/// Flows through links are summed in fractions of a unit: a unit is this many.
pub(in crate::shallow::solver) const LINK_SCALE: f64 = 65536.0;

/// A full column in the system of heads.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::solver) struct Node {
    /// Its pipes to the east, west, south and north, or [`NONE`].
    pub edges: [u32; 4],
    /// Whether it is still in the system.
    pub is_in_system: bool,
    /// Head above its surface (units).
    pub excess_head: f64,
    /// Right side: the inflow required, less the inflow without heads; and the diagonal of the system.
    pub right: f64,
    pub diagonal: f64,
    /// Sum over links, in 1/65536 unit.
    pub linked: i64,
}

impl Node {
    /// A node with the head above its surface of the last step.
    pub fn new(excess_head: f64) -> Self {
        Self { edges: [NONE; 4], is_in_system: true, excess_head, right: 0.0, diagonal: 0.0, linked: 0 }
    }
}

/// Fixed-point value of a link's number, clamped so that any sum of such values fits 64 bits.
pub(in crate::shallow::solver) fn scaled(number: f64) -> i64 {
    (number * LINK_SCALE).clamp(-1e16, 1e16) as i64
}

/// The height of a pipe's section (units): the depth of the last step's donor, at most the height of the opening between both columns.
pub fn section(columns: &Columns, depth: &[i32], i: usize, j: Option<usize>, flux: f32) -> f64 {
    let (base, ceiling) = (columns.bases(), columns.ceilings());
    let Some(j) = j else { return f64::from(depth[i]) };
    let opening = ceiling[i].min(ceiling[j]) - base[i].max(base[j]);
    let eta = |k: usize| base[k] + depth[k];
    let flows = flux.partial_cmp(&0.0).filter(|order| order.is_ne());
    let gives = match flows.unwrap_or_else(|| eta(i).cmp(&eta(j))) {
        Ordering::Greater => depth[i],
        Ordering::Less => depth[j],
        // The result is the same from either end.
        Ordering::Equal => depth[i].min(depth[j]),
    };
    f64::from(gives.min(opening))
}
