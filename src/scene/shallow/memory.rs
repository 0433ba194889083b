//! How much memory a liquid on a terrain takes, before any of it is taken.

use crate::context::Context;
use crate::error::Result;
use crate::shallow::grid::Grid;

/// Bytes that every run takes.
const FIXED: u64 = 32_000_000;
/// Bytes of a cell while the terrain becomes columns: its crossings and solids, in two copies.
const CELL: u64 = 64;
/// Bytes of a column: liquid, pipes and what steps need of it 100, its vertex and triangles while they are made 150, in up to three steps
/// that wait for the writer 120 each, in files and states 100.
const COLUMN: u64 = 710;
/// Bytes of a triangle of the terrain: corners and a place, twice while it is read.
const TRIANGLE: u64 = 100;

/// Refuses more cells than the context allows, before they are made.
///
/// # Errors
/// [`crate::Error::Memory`], naming the cells.
pub(super) fn allow_cells(ctx: &Context, grid: &Grid) -> Result<()> {
    let [across, along] = grid.size;
    let what = format!("shallow.cell = {} m, {across} x {along} cells,", grid.cell);
    ctx.allow(&what, FIXED + (CELL + COLUMN) * grid.cells() as u64)
}

/// Bytes that a run takes, about.
pub(super) fn estimate(grid: &Grid, columns: u64, triangles: u64) -> u64 {
    FIXED + CELL * grid.cells() as u64 + COLUMN * columns + TRIANGLE * triangles
}
