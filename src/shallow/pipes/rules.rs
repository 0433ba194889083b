//! What pipes follow from besides the columns.

use super::Border;
use super::cliffs::Cliffs;
use crate::shallow::columns::Columns;
use crate::shallow::falls::Falls;
use crate::shallow::params::{Friction, Params};

/// What pipes follow from besides the columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::shallow) struct Rules {
    pub border: Border,
    pub cliffs: Cliffs,
    /// Ground that rises by more than so many units over a cell, on one side of a column only, is a wall and no slope.
    pub steepest: i32,
}

impl Rules {
    /// Of a liquid.
    pub fn of(params: &Params, columns: &Columns) -> Self {
        let steepest = match params.friction {
            Friction::Ground => i32::MAX,
            Friction::Walls => (columns.grid.cell / columns.heights.unit).min(f64::from(i32::MAX)) as i32,
        };
        let cliffs = Falls::cliffs(params.falls.as_ref(), columns);
        Self { border: params.border, cliffs, steepest }
    }

    /// With neither cliffs nor walls.
    pub fn bordered(border: Border) -> Self {
        Self { border, cliffs: Cliffs::NONE, steepest: i32::MAX }
    }
}
