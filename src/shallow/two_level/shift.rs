//! The near cells move: four fine columns become a coarse one, and back.
//!
//! A coarse column's liquid goes to the fine ones of its layer, under a surface with the slope that its neighbours give: level where the
//! liquid is level, and along the ground where a film runs. What four columns cannot share equally waits in their cell, and returns to the
//! coarse column later.

use super::Detail;
use super::buffers::Moving;
use super::ground::{halved, quarters};
use super::rests::{Load, change, of_column};
use super::seam::rise;
use crate::error::Result;
use crate::shallow::Shallow;
use crate::shallow::columns::grid::Cells;
use crate::shallow::remap::Parcel;

impl Detail {
    /// Hands the cells that were near, or are now, to the other liquid.
    pub(super) fn convert(&mut self, old: &Cells) -> Result<()> {
        let mut shift = std::mem::take(&mut self.shift);
        let near = self.near.clone();
        let [old_coarse, new_coarse] = [old, &near].map(halved);
        shift.leaving.clear();
        shift.entering.clear();
        for cells in beyond(&old_coarse, &new_coarse) {
            self.take_fine(&cells, &mut shift.leaving);
        }
        for cells in beyond(&new_coarse, &old_coarse) {
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
            lay(coarse, &cells, |cell| ground.coarse_cell(&near, cell))?;
            lay(fine, &cells.map(|range| 2 * range.start..2 * range.end), |cell| {
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

    /// Takes the held liquid of cells that now belong to the other liquid: where there is no ground, it would fall.
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
        let Self { fine, coarse, rest, .. } = self;
        let (fine_grid, grid) = (fine.columns.grid, coarse.columns.grid);
        for parcel in fine_held {
            let cell = grid.index(fine_grid.position(parcel.cell as usize).map(|at| at / 2));
            let whole = rest.whole(cell, &Load { units: parcel.units, amounts: parcel.amounts });
            coarse.remap.held.add(cell, parcel.height, whole.units, whole.amounts);
        }
        for parcel in held {
            // A coarse unit is one unit in each of the four.
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
        for [x, z] in each(cells) {
            let first = out.len();
            for [fx, fz] in quarters([x, z]) {
                let mut layer = 0;
                while let Some(column) = fine.columns.column([fx, fz], layer) {
                    let load = take(fine, column);
                    let own = out[first..].iter_mut().find(|moving| moving.layer == layer);
                    match own {
                        Some(own) => own.load = own.load.with(&load),
                        None => out.push(Moving { cell: [x, z], layer, load, eta: 0, rises: [0; 2] }),
                    }
                    layer += 1;
                }
            }
        }
    }

    /// Finds the contents of coarse columns, and the slopes of their surface.
    fn find_coarse(&self, cells: &Cells, out: &mut Vec<Moving>) {
        let coarse = &self.coarse;
        for cell in each(cells) {
            let mut layer = 0;
            while let Some(column) = coarse.columns.column(cell, layer) {
                let load = of_column(coarse, column).in_fine();
                let eta = surface(coarse, column);
                let rises = lean(coarse, cell, layer, eta);
                out.push(Moving { cell, layer, load, eta, rises });
                layer += 1;
            }
        }
    }

    fn give_coarse(&mut self, moving: &Moving) {
        let Self { coarse, rest, .. } = self;
        let index = coarse.columns.grid.index(moving.cell);
        let whole = rest.whole(index, &moving.load);
        let layers = coarse.columns.of_cell(moving.cell).count();
        let column = coarse.columns.column(moving.cell, moving.layer.min(layers.saturating_sub(1)));
        give(coarse, moving.cell, column, &whole);
    }

    fn give_fine(&mut self, moving: &Moving) {
        let Self { fine, rest, coarse, .. } = self;
        let index = coarse.columns.grid.index(moving.cell);
        let all = rest.take(index).with(&moving.load);
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
            let lift = signs[at][0] * moving.rises[0] + signs[at][1] * moving.rises[1];
            *depth = (moving.eta + lift.div_euclid(8) - base).max(0);
        }
        share(&mut depths, &columns, all.units);
        let mut left = all;
        for (at, &depth) in depths.iter().enumerate() {
            let own = all.part(depth);
            give(fine, cells[at], columns[at], &own);
            left = left.without(&own);
        }
        rest.set(index, left);
    }
}

/// Makes depths add up to `units`, except for what cannot be shared equally.
fn share(depths: &mut [i64; 4], columns: &[Option<usize>; 4], units: i64) {
    for _ in 0..4 {
        let missing = units - depths.iter().sum::<i64>();
        let is_wet = depths.iter().any(|&depth| depth > 0);
        let takes = |at: usize, depth: i64| columns[at].is_some() && (depth > 0 || !is_wet && missing > 0);
        let count = (0..4).filter(|&at| takes(at, depths[at])).count() as i64;
        if missing == 0 || count == 0 {
            return;
        }
        // A remainder of less than a unit each is not shared; an excess is taken from all.
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
    // Never more than is available.
    if depths.iter().sum::<i64>() > units {
        *depths = [0; 4];
    }
}

/// Eight times the rise of a surface from the middle of a coarse column to that of a fine one, along x and along z.
fn lean(liquid: &Shallow, [x, z]: [usize; 2], layer: usize, eta: i64) -> [i64; 2] {
    let beside = |x: Option<usize>, z: Option<usize>| {
        let column = liquid.columns.column([x?, z?], layer)?;
        (liquid.flow.depths()[column] > 0).then(|| surface(liquid, column))
    };
    [
        rise(eta, [beside(x.checked_sub(1), Some(z)), beside(Some(x + 1), Some(z))]),
        rise(eta, [beside(Some(x), z.checked_sub(1)), beside(Some(x), Some(z + 1))]),
    ]
}

fn surface(liquid: &Shallow, column: usize) -> i64 {
    i64::from(liquid.columns.bases()[column]) + i64::from(liquid.flow.depths()[column])
}

/// Empties a column and returns what was in it.
fn take(liquid: &mut Shallow, column: usize) -> Load {
    let load = of_column(liquid, column);
    change(liquid, column, &Load::default().without(&load));
    load
}

/// Gives liquid to a column of a cell; what does not fit waits there.
fn give(liquid: &mut Shallow, cell: [usize; 2], column: Option<usize>, load: &Load) {
    match column {
        Some(column) => change(liquid, column, load),
        None => {
            let cell = liquid.columns.grid.index(cell);
            liquid.remap.held.add(cell, 0, load.units, load.amounts);
        }
    }
}

/// Changes the ground of a box of cells.
fn lay<'a>(
    liquid: &mut Shallow,
    cells: &Cells,
    solids: impl Fn([usize; 2]) -> &'a [crate::shallow::terrain::solids::Solid],
) -> Result<()> {
    let [x, z] = cells.clone();
    let width = x.len();
    liquid.update_cells(cells.clone(), |rank| solids([x.start + rank % width, z.start + rank / width]))?;
    Ok(())
}

/// The boxes of fine cells that are near in only one of two boxes; some may be empty.
pub(super) fn changed(old: &Cells, new: &Cells) -> impl Iterator<Item = Cells> {
    beyond(old, new).into_iter().chain(beyond(new, old))
}

fn each(cells: &Cells) -> impl Iterator<Item = [usize; 2]> {
    let [x, z] = cells.clone();
    z.flat_map(move |z| x.clone().map(move |x| [x, z]))
}

/// The boxes of `cells` that are not in `other`; some may be empty.
fn beyond(cells: &Cells, other: &Cells) -> [Cells; 4] {
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
