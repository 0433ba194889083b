//! Moves the near cells: four fine columns become a coarse one, or the reverse.
//!
//! A coarse column's liquid goes to the fine ones of its layer, under a surface with the slope that its neighbours give: level where the
//! liquid is level, and along the ground where a film runs. Units that four columns cannot share equally wait in their cell, and return to
//! the coarse column later.

use super::Detail;
use super::buffers::Moving;
use super::ground::{halved, quarters};
use super::remainders::{Contents, add_to_column, of_column};
use super::seam::rise;
use crate::error::Result;
use crate::shallow::Shallow;
use crate::shallow::columns::grid::Cells;
use crate::shallow::remap::Parcel;
use crate::shallow::terrain::solids::Solid;

impl Detail {
    /// Hands the ground and the liquid of cells that change their size to the other liquid. `old`: the previous near cells.
    pub(super) fn convert(&mut self, old: &Cells) -> Result<()> {
        let mut shift = std::mem::take(&mut self.shift);
        let near = self.near.clone();
        let [old_coarse, new_coarse] = [old, &near].map(halved);
        shift.leaving.clear();
        shift.entering.clear();
        for cells in difference(&old_coarse, &new_coarse) {
            self.take_fine(&cells, &mut shift.leaving);
        }
        for cells in difference(&new_coarse, &old_coarse) {
            self.find_coarse(&cells, &mut shift.entering);
        }
        for Moving { cell, layer, .. } in &shift.entering {
            if let Some(column) = self.coarse.columns.column(*cell, *layer) {
                take(&mut self.coarse, column);
            }
        }
        self.take_held(&new_coarse, &mut shift.held);
        for cells in changed(&old_coarse, &new_coarse) {
            let Self { fine, coarse, ground, .. } = self;
            set_ground(coarse, &cells, |cell| ground.coarse_cell(&near, cell))?;
            set_ground(fine, &cells.map(|range| 2 * range.start..2 * range.end), |cell| {
                ground.fine_cell(&near, cell)
            })?;
        }
        for moving in &shift.leaving {
            self.give_coarse(moving);
        }
        for moving in &shift.entering {
            self.give_fine(moving);
        }
        self.give_held(&shift.held);
        self.shift = shift;
        Ok(())
    }

    /// Takes the held liquid of cells that now belong to the other liquid: it would be lost where these cells no longer have ground.
    fn take_held(&mut self, near: &Cells, out: &mut [Vec<Parcel>; 2]) {
        let Self { fine, coarse, .. } = self;
        let is_near = |[x, z]: [usize; 2]| near[0].contains(&x) && near[1].contains(&z);
        let (fine_grid, grid) = (fine.columns.grid, coarse.columns.grid);
        let [fine_held, held] = out;
        fine_held.clear();
        held.clear();
        let is_far = |cell| !is_near(fine_grid.position(cell).map(|at| at / 2));
        fine.remap.held.take_out(is_far, |parcel| fine_held.push(parcel));
        coarse.remap.held.take_out(|cell| is_near(grid.position(cell)), |parcel| held.push(parcel));
    }

    /// Adds the held liquid to the other liquid's cells.
    fn give_held(&mut self, [fine_held, held]: &[Vec<Parcel>; 2]) {
        let Self { fine, coarse, remainders, .. } = self;
        let (fine_grid, grid) = (fine.columns.grid, coarse.columns.grid);
        for parcel in fine_held {
            let cell = grid.index(fine_grid.position(parcel.cell as usize).map(|at| at / 2));
            let whole =
                remainders.take_whole_units(cell, &Contents { units: parcel.units, amounts: parcel.amounts });
            coarse.remap.held.add(cell, parcel.height, whole.units, whole.amounts);
        }
        for parcel in held {
            // A coarse unit is one unit in each of the four cells.
            for cell in quarters(grid.position(parcel.cell as usize)) {
                fine.remap.held.add(fine_grid.index(cell), parcel.height, parcel.units, parcel.amounts);
            }
        }
        fine.remap.held.unite();
        coarse.remap.held.unite();
    }

    /// Takes the contents of the fine columns of coarse cells.
    fn take_fine(&mut self, cells: &Cells, out: &mut Vec<Moving>) {
        let fine = &mut self.fine;
        for [x, z] in cells_of(cells) {
            let first = out.len();
            for [fx, fz] in quarters([x, z]) {
                let mut layer = 0;
                while let Some(column) = fine.columns.column([fx, fz], layer) {
                    let contents = take(fine, column);
                    let own = out[first..].iter_mut().find(|moving| moving.layer == layer);
                    match own {
                        Some(own) => own.contents = own.contents.plus(&contents),
                        None => out.push(Moving { cell: [x, z], layer, contents, eta: 0, rises: [0; 2] }),
                    }
                    layer += 1;
                }
            }
        }
    }

    /// Finds the contents of coarse columns, and the slopes of their surface.
    fn find_coarse(&self, cells: &Cells, out: &mut Vec<Moving>) {
        let coarse = &self.coarse;
        for cell in cells_of(cells) {
            let mut layer = 0;
            while let Some(column) = coarse.columns.column(cell, layer) {
                let contents = of_column(coarse, column).in_fine();
                let eta = surface(coarse, column);
                let rises = surface_rises(coarse, cell, layer, eta);
                out.push(Moving { cell, layer, contents, eta, rises });
                layer += 1;
            }
        }
    }

    fn give_coarse(&mut self, moving: &Moving) {
        let Self { coarse, remainders, .. } = self;
        let index = coarse.columns.grid.index(moving.cell);
        let whole = remainders.take_whole_units(index, &moving.contents);
        let layers = coarse.columns.of_cell(moving.cell).count();
        let column = coarse.columns.column(moving.cell, moving.layer.min(layers.saturating_sub(1)));
        give(coarse, moving.cell, column, &whole);
    }

    fn give_fine(&mut self, moving: &Moving) {
        let Self { fine, remainders, coarse, .. } = self;
        let index = coarse.columns.grid.index(moving.cell);
        let all = remainders.take(index).plus(&moving.contents);
        let cells = quarters(moving.cell);
        let layer = |cell: [usize; 2]| {
            let layers = fine.columns.of_cell(cell).count();
            fine.columns.column(cell, moving.layer.min(layers.saturating_sub(1)))
        };
        let columns = cells.map(layer);
        let signs = [[-1, -1], [1, -1], [-1, 1], [1, 1]];
        let mut depths = [0; 4];
        for (at, depth) in depths.iter_mut().enumerate() {
            let Some(column) = columns[at] else { continue };
            let base = i64::from(fine.columns.bases()[column]);
            let rise = signs[at][0] * moving.rises[0] + signs[at][1] * moving.rises[1];
            *depth = (moving.eta + rise.div_euclid(8) - base).max(0);
        }
        fit_depths(&mut depths, &columns, all.units);
        let mut left = all;
        for (at, &depth) in depths.iter().enumerate() {
            let own = all.part(depth);
            give(fine, cells[at], columns[at], &own);
            left = left.minus(&own);
        }
        remainders.set(index, left);
    }
}

/// Makes depths add up to `units`, except for units that cannot be shared equally.
fn fit_depths(depths: &mut [i64; 4], columns: &[Option<usize>; 4], units: i64) {
    for _ in 0..4 {
        let missing = units - depths.iter().sum::<i64>();
        let is_wet = depths.iter().any(|&depth| depth > 0);
        let takes = |at: usize, depth: i64| columns[at].is_some() && (depth > 0 || !is_wet && missing > 0);
        let count = (0..4).filter(|&at| takes(at, depths[at])).count() as i64;
        if missing == 0 || count == 0 {
            return;
        }
        // Of missing units, each column gets the same whole number; an excess is taken equally from all.
        let each = missing.div_euclid(count);
        for (at, depth) in depths.iter_mut().enumerate() {
            if takes(at, *depth) {
                *depth = (*depth + each).max(0);
            }
        }
        if missing > 0 {
            return;
        }
    }
    // Never more than there is.
    if depths.iter().sum::<i64>() > units {
        *depths = [0; 4];
    }
}

/// Eight times the rise of a surface from the middle of a coarse column to that of a fine one, along x and along z.
fn surface_rises(liquid: &Shallow, [x, z]: [usize; 2], layer: usize, eta: i64) -> [i64; 2] {
    let beside = |x: Option<usize>, z: Option<usize>| {
        let column = liquid.columns.column([x?, z?], layer)?;
        (liquid.flow.depths()[column] > 0).then(|| surface(liquid, column))
    };
    [
        rise(eta, [beside(x.checked_sub(1), Some(z)), beside(Some(x + 1), Some(z))]),
        rise(eta, [beside(Some(x), z.checked_sub(1)), beside(Some(x), Some(z + 1))]),
    ]
}

/// Height of a column's surface (units).
fn surface(liquid: &Shallow, column: usize) -> i64 {
    i64::from(liquid.columns.bases()[column]) + i64::from(liquid.flow.depths()[column])
}

/// Empties a column and returns what was in it.
fn take(liquid: &mut Shallow, column: usize) -> Contents {
    let contents = of_column(liquid, column);
    add_to_column(liquid, column, &Contents::default().minus(&contents));
    contents
}

/// Gives liquid to a column of a cell; what does not fit waits there.
fn give(liquid: &mut Shallow, cell: [usize; 2], column: Option<usize>, contents: &Contents) {
    match column {
        Some(column) => add_to_column(liquid, column, contents),
        None => {
            let cell = liquid.columns.grid.index(cell);
            liquid.remap.held.add(cell, 0, contents.units, contents.amounts);
        }
    }
}

/// Changes the ground of a box of cells.
fn set_ground<'a>(
    liquid: &mut Shallow,
    cells: &Cells,
    solids: impl Fn([usize; 2]) -> &'a [Solid],
) -> Result<()> {
    let [x, z] = cells.clone();
    let width = x.len();
    liquid.update_cells(cells.clone(), |rank| solids([x.start + rank % width, z.start + rank / width]))?;
    Ok(())
}

/// The cells that are in only one of two boxes, as boxes; some may be empty.
pub(super) fn changed(old: &Cells, new: &Cells) -> impl Iterator<Item = Cells> {
    difference(old, new).into_iter().chain(difference(new, old))
}

fn cells_of(cells: &Cells) -> impl Iterator<Item = [usize; 2]> {
    let [x, z] = cells.clone();
    z.flat_map(move |z| x.clone().map(move |x| [x, z]))
}

/// The cells of a box that are not in another one, as boxes; some may be empty.
fn difference(cells: &Cells, other: &Cells) -> [Cells; 4] {
    let [x, z] = cells;
    let [ox, oz] = other;
    let meets = x.start.max(ox.start) < x.end.min(ox.end) && z.start.max(oz.start) < z.end.min(oz.end);
    if !meets {
        return [[x.clone(), z.clone()], [0..0, 0..0], [0..0, 0..0], [0..0, 0..0]];
    }
    let rows = z.start.max(oz.start)..z.end.min(oz.end);
    [
        [x.clone(), z.start..rows.start],
        [x.clone(), rows.end..z.end],
        [x.start..ox.start.max(x.start), rows.clone()],
        [ox.end.min(x.end)..x.end, rows],
    ]
}
