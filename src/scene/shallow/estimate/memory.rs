//! Memory of a liquid on a terrain, estimated before any is allocated.

use crate::context::Context;
use crate::error::Result;
use crate::scene::shallow::Shallow;
use crate::shallow::columns::grid::Grid;
use crate::shallow::params::Friction;

/// Bytes that every run takes.
const FIXED: u64 = 32_000_000;
/// Bytes of a cell during conversion of the terrain to columns: its crossings and solids, in two copies.
const CELL: u64 = 64;
/// Bytes of a column: liquid, pipes and data of steps 100; its vertex and triangles while they are made 150; up to three steps that wait
/// for the writer, 120 each; files and states 100; minimum heights 20.
const COLUMN: u64 = 730;
/// Bytes of a scalar in a column: its amount 8, its concentration 4, and 50 in those steps, files and states.
const SCALAR: u64 = 62;
/// Additional bytes of a column for friction at walls, and for viscosity that depends on a scalar.
const WALLS: u64 = 108;
const THICK: u64 = 12;
/// Bytes of a drop: its own data 500; its ball and strand while they are made, and in up to three steps that wait for the writer, 5,600
/// each.
const DROP: u64 = 22_900;
/// Bytes of a triangle of the terrain: corners and a position, twice while it is read or while minimum heights are found, and the data that
/// these need.
const TRIANGLE: u64 = 110;

/// Additional bytes of a triangle that the liquid stains: stains, and the mesh in up to three steps that wait for the writer.
const STAINED: u64 = 110;

/// Refuses more cells than the context's memory limit allows, before they are made.
///
/// # Errors
/// [`crate::Error::Memory`], naming the cells.
pub(in crate::scene::shallow) fn allow_cells(ctx: &Context, grid: &Grid) -> Result<()> {
    let [across, along] = grid.size;
    let what = format!("shallow.cell = {} m, {across} x {along} cells,", grid.cell);
    ctx.allow(&what, FIXED + (CELL + COLUMN) * grid.cells() as u64)
}

/// Estimated bytes of a run.
pub(in crate::scene::shallow) fn estimate(of: &Shallow, grid: &Grid, columns: u64, triangles: u64) -> u64 {
    let walls = if of.params.friction == Friction::Walls { WALLS } else { 0 };
    let thick = if of.params.thickening.is_some() { THICK } else { 0 };
    let triangle = TRIANGLE + if of.staining.is_some() { STAINED } else { 0 };
    let column = COLUMN + SCALAR * of.scalars.len() as u64 + walls + thick;
    let drops = DROP * of.params.falls.map_or(0, |falls| falls.most as u64);
    FIXED + CELL * grid.cells() as u64 + column * columns + triangle * triangles + drops
}
