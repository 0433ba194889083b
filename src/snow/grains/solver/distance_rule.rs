//! The distance rule (thesis section 3.3.3), optional: slow, supported grains far from every object and every fast grain come
//! to rest at the start of a step without lying still first. They wake like all resting grains (`rest`).
//!
//! Distances are measured between coarse cells: the rule puts no grain to rest that is nearer than the distance, and may
//! leave one awake that is farther by less than two cell diagonals.

use rayon::prelude::*;

use super::blocks::BlockIndex;
use super::layout::world;
use super::rest;
use super::rows::{Row, norm};
use crate::error::Result;
use crate::geometry::DVec3;
use crate::snow::grains::colliders::set::Pose;
use crate::snow::grains::colliders::shell::Shell;
use crate::snow::grains::heap::Heap;

/// Speed above which a grain is fast, in sqrt(g d): a slower one rises by at most d / 32, too little to leave the hollow
/// between the grains below it.
const FAST: f64 = 0.25;
/// Edge of a cell as a share of the distance, but not below [`MIN_EDGE`].
const EDGE_SHARE: f64 = 0.25;
/// Minimum edge of a cell (diameters), so that a cell holds many grains.
const MIN_EDGE: f64 = 4.0;

type Cell = [i32; 3];

/// A row of cells along z, centred on an offset: offset along x and y, and count of cells on each side.
type Run = [i32; 3];

impl Heap {
    /// Puts grains to rest that are supported, slow, and farther than a distance (m) from every fast grain and from the
    /// meshes at the start and end of the step. Gravity is in m/s2. Grains that have just woken stay awake.
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn rest_far_away(
        &mut self,
        distance: f64,
        gravity: f64,
        shells: &mut [(Shell, Pose<'_>)],
    ) -> Result<()> {
        let diameter = self.diameter;
        let edge = (EDGE_SHARE * distance).max(MIN_EDGE * diameter);
        let fast = (FAST * (gravity.abs() * diameter).sqrt()) as f32;
        let is_fast = |row: &Row| norm(row.velocity) > fast;
        // A grain at the top of its flight is slow but unsupported.
        let may_rest =
            |row: &Row| !row.rests() && row.is_supported() && !rest::has_just_woken(row) && !is_fast(row);
        let cell = |row: &Row, at: &BlockIndex| -> Cell {
            world(*at, row.position, diameter).map(|x| (x / edge).floor() as i32).into()
        };
        let mut cells = self.cells(&may_rest, &cell);
        let sources = self.cells(&is_fast, &cell);
        let runs = runs(distance / edge);
        cells = cells.into_par_iter().filter(|cell| !is_near(*cell, &sources, &runs)).collect();
        let within = distance + 0.5 * 3f64.sqrt() * edge;
        let middle = |cell: &Cell| DVec3::from(cell.map(|index| (f64::from(index) + 0.5) * edge));
        let mut pose = Vec::new();
        for (shell, at) in shells {
            for share in [0.0, 1.0] {
                if cells.is_empty() {
                    return Ok(());
                }
                at(share, &mut pose)?;
                // The first call makes it the next pose, the second the current one.
                shell.advance(&pose);
                shell.advance(&pose);
                let shell = &*shell;
                let is_free = |cell: &Cell| shell.distance(middle(cell), within).is_none();
                cells = cells.into_par_iter().filter(is_free).collect();
            }
        }
        self.rows.par_iter_mut().zip(&self.at).for_each(|(row, at)| {
            if may_rest(row) && cells.binary_search(&cell(row, at)).is_ok() {
                rest::stop(row);
            }
        });
        Ok(())
    }

    /// The cells that contain a grain for which `selects` holds, ascending.
    fn cells(
        &self,
        selects: &(impl Fn(&Row) -> bool + Sync),
        cell: &(impl Fn(&Row, &BlockIndex) -> Cell + Sync),
    ) -> Vec<Cell> {
        let rows = self.rows.par_iter().zip(&self.at).filter(|(row, _)| selects(row));
        let mut cells: Vec<Cell> = rows.map(|(row, at)| cell(row, at)).collect();
        cells.par_sort_unstable();
        cells.dedup();
        cells
    }
}

/// The rows of cells that contain a point nearer than a distance (cells) to a point of the cell in the middle.
fn runs(distance: f64) -> Vec<Run> {
    let reach = distance.ceil() as i32;
    // Minimum distance between two cells along an axis, squared.
    let gap = |steps: i32| f64::from((steps.abs() - 1).max(0)).powi(2);
    let mut runs = Vec::new();
    for (x, y) in (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| (x, y))) {
        let is_within = |z: &i32| gap(x) + gap(y) + gap(*z) < distance * distance;
        if let Some(z) = (0..=reach).rev().find(is_within) {
            runs.push([x, y, z]);
        }
    }
    runs
}

/// Whether `sources` (ascending) contains a cell of the rows around a cell.
fn is_near([x, y, z]: Cell, sources: &[Cell], runs: &[Run]) -> bool {
    runs.iter().any(|[dx, dy, dz]| {
        let [first, last] = [z - dz, z + dz].map(|z| [x + dx, y + dy, z]);
        let at = sources.partition_point(|source| *source < first);
        sources.get(at).is_some_and(|source| *source <= last)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_positions_nearer_than_the_distance_are_around_a_cell() {
        for distance in [0.2, 1.0, 1.7, 4.0] {
            let runs = runs(distance);
            let sources = |at: Cell| is_near([0; 3], &[[-9, 0, 0], at, [9, 0, 0]], &runs);
            for at in (0..11 * 11 * 11).map(|index| [index / 121 - 5, index / 11 % 11 - 5, index % 11 - 5]) {
                // Minimum distance between the two cells along an axis, squared.
                let gap = |corner: i32| f64::from((corner.abs() - 1).max(0)).powi(2);
                let nearest = at.map(gap).iter().sum::<f64>().sqrt();
                assert_eq!(sources(at), nearest < distance, "{at:?} {distance}");
            }
        }
    }
}
