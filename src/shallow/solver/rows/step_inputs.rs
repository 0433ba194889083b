//! The inputs of a step, and its results.

use super::band_views::BandView;
use crate::shallow::columns::Columns;
use crate::shallow::pipes::Pipes;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::{Changes, LawEffect};
use crate::shallow::solver::active::Active;
use crate::shallow::solver::fast_films::Fast;
use crate::shallow::solver::lateral_friction::LateralFriction;
use crate::shallow::solver::link_step::{Outside, RowLinks, indices_of};
use crate::shallow::solver::overflow_edges::OverflowEdges;
use crate::shallow::solver::pressurised::network::Network;

/// The inputs of a step.
pub struct StepInputs<'a> {
    /// Columns.
    pub columns: &'a Columns,
    /// Pipes between them.
    pub pipes: &'a Pipes,
    /// Active strips.
    pub active: &'a Active,
    /// Flow through full columns.
    pub network: &'a Network,
    /// Films with reduced inertia.
    pub fast: &'a Fast,
    /// Lateral friction of pipes.
    pub friction: &'a LateralFriction,
    /// Overflow edges: links that liquid falls freely from.
    pub overflow_edges: &'a OverflowEdges,
    /// Whether slow liquid may come to rest.
    pub may_rest: bool,
    /// Rows with columns that may fill up.
    pub may_fill: &'a [bool],
    /// Minimum room of each row's columns (units).
    pub room: &'a [f32],
    /// Changes of scalars by their laws.
    pub law_effects: &'a [LawEffect],
}

impl<'a> StepInputs<'a> {
    /// The links that a row owns.
    pub fn links_of(&self, row: usize) -> RowLinks<'a> {
        RowLinks { links: &self.pipes.links, overflow_edges: self.overflow_edges, row }
    }

    /// Whether there is nothing to do in a row.
    #[inline(always)]
    pub fn is_idle(&self, row: usize) -> bool {
        let links = &self.pipes.links;
        row >= self.columns.grid.size[1]
            || self.active.row(row).is_empty()
                && (links.row(row).is_empty() && links.columns_of(row).is_empty() || self.active.rests(row))
                && self.network.is_empty()
    }
}

/// Results of a band in a step.
#[derive(Debug, Clone, Default)]
pub struct StepResults {
    /// Counts of rows with columns that would have given more than they had, with columns that would have received more than they had room
    /// for, and with fast films that were limited.
    pub scaled: [u32; 3],
    /// Units that crossed the border.
    pub outside: Outside,
    /// Strips that became wet, and resting ones that a transfer changed.
    pub woken: Vec<u32>,
    /// Changes of scalars.
    pub scalar_changes: [Changes; MAX_SCALARS],
}

/// Calls `add` with each column of a row that gives (or receives) through a link, and how much (units).
pub fn for_each_link_end(
    inputs: &StepInputs,
    view: &BandView,
    row: usize,
    gives: bool,
    mut add: impl FnMut(u32, i64),
) {
    if inputs.pipes.links.columns_of(row).is_empty() {
        return;
    }
    let within = indices_of(inputs.columns, row);
    for owner in row.saturating_sub(1).max(view.first)..row + 1 {
        view.part(owner).links.for_each_end(inputs.links_of(owner), &within, gives, &mut add);
    }
}
