//! Pipes of the network.

use crate::shallow::columns::Columns;
use crate::shallow::solver::overflow_edges::{Fall, edge_drop};

/// A pipe of the network: its index in the array that holds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PipeIndex {
    /// To the east of a column.
    East(u32),
    /// To the south of a column.
    South(u32),
    /// A link.
    Link(u32),
}

/// A pipe of the network.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::solver) struct Edge {
    pub at: PipeIndex,
    /// Parties at both ends, or [`NONE`]: outside.
    pub ends: [u32; 2],
    /// Flux at equal heads, and flux per unit of head difference (units per step).
    pub kept: f64,
    pub conductance: f64,
    /// Surface outside (units), where one end is outside.
    pub outside: f64,
    /// Flux (units per step), and the remainder of its transfer.
    pub flux: f64,
    pub remainder: f64,
    /// Transfer (units).
    pub units: i64,
}

impl Edge {
    /// Makes the pipe an overflow edge out of the column `donor`.
    pub fn make_overflow_edge(&mut self, columns: &Columns, donor: u32, fall: Fall) {
        self.outside = f64::from(columns.bases()[donor as usize] - edge_drop(columns));
        // Earlier flow in the opposite direction does not return.
        let outward = |flow: f64| if fall == Fall::Ahead { flow.max(0.0) } else { flow.min(0.0) };
        (self.kept, self.remainder) = (outward(self.kept), outward(self.remainder));
        if fall == Fall::Back {
            self.ends.swap(0, 1);
        }
    }
}
