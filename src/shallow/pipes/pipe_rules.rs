//! Settings that pipes depend on besides the columns.

use super::Border;
use super::cliffs::Cliffs;
use crate::shallow::columns::Columns;
use crate::shallow::columns::grid::Cells;
use crate::shallow::free_fall::Falls;
use crate::shallow::params::{Friction, Params};

/// Settings that pipes depend on besides the columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::shallow) struct Rules {
    pub border: Border,
    pub cliffs: Cliffs,
    /// A rise of more than this over a cell (units), on only one side of a column, is a wall and not a slope.
    pub wall_rise: i32,
    pub excluded: Option<ExcludedCells>,
}

/// Cells that belong to another liquid. Where they have no columns, they are a wall and not a void.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::shallow) struct ExcludedCells {
    /// A box of cells: ranges of x and of z.
    pub cells: Cells,
    /// Whether the cells are those in the box; otherwise they are all others.
    pub is_inside: bool,
}

impl ExcludedCells {
    /// Whether a cell (x, z) is one of them.
    pub fn has(&self, [x, z]: [usize; 2]) -> bool {
        (self.cells[0].contains(&x) && self.cells[1].contains(&z)) == self.is_inside
    }
}

impl Rules {
    /// The rules for a liquid.
    pub fn of(params: &Params, columns: &Columns, excluded: Option<&ExcludedCells>) -> Self {
        let wall_rise = match params.friction {
            Friction::Ground => i32::MAX,
            Friction::Walls => (columns.grid.cell / columns.heights.unit).min(f64::from(i32::MAX)) as i32,
        };
        let cliffs = Falls::cliffs(params.falls.as_ref(), columns);
        Self { border: params.border, cliffs, wall_rise, excluded: excluded.cloned() }
    }

    /// Rules with neither cliffs nor walls.
    pub fn bordered(border: Border) -> Self {
        Self { border, cliffs: Cliffs::NONE, wall_rise: i32::MAX, excluded: None }
    }
}
