//! Keeps fluxes when the near cells move: the flow through each side of a fine cell continues through the pipe that the side has
//! afterwards.
//!
//! A coarse pipe belongs to two sides, with half of its volume each; the flux within a coarse cell is the mean of its inflow and outflow.

use super::Detail;
use super::buffers::Momentum;
use crate::numeric::lists::refill;
use crate::shallow::Shallow;
use crate::shallow::columns::grid::Cells;
use crate::shallow::pipes::cliffs::index_beyond;
use crate::shallow::pipes::side::Side;

/// The pipe through a side of a fine cell.
enum Pipe {
    /// In the fine liquid: its column.
    Fine(usize),
    /// In the coarse liquid, between two of its cells.
    Coarse(usize),
    /// Within a coarse cell: its column, and the one before it, if a pipe joins them.
    Within(usize, Option<usize>),
    /// Along the edge of the near cells: its fine column, axis and direction.
    Seam(usize, usize, i32),
    /// No pipe.
    Closed,
}

impl Momentum {
    /// Stores the fluxes through the sides of the fine cells in some boxes and up to two cells around them.
    pub fn begin(&mut self, detail: &Detail, near: &Cells, boxes: impl Iterator<Item = Cells>) {
        let size = detail.fine.columns.grid.size;
        let wider = |cells: Cells| {
            [0, 1].map(|axis| cells[axis].start.saturating_sub(2)..(cells[axis].end + 2).min(size[axis]))
        };
        refill(&mut self.boxes, boxes.filter(|cells| cells.iter().all(|range| !range.is_empty())).map(wider));
        self.layers = detail.ground.fine.layers().max(detail.ground.coarse.layers());
        let Self { boxes, layers, fluxes } = self;
        fluxes.clear();
        for cells in boxes {
            each_side(cells, *layers, |cell, layer, axis| {
                let flux = match pipe_at(detail, near, cell, layer, axis) {
                    Pipe::Fine(column) => detail.fine.flow.flux[axis][column],
                    Pipe::Coarse(column) => 2.0 * detail.coarse.flow.flux[axis][column],
                    Pipe::Within(column, before) => {
                        let flux = &detail.coarse.flow.flux[axis];
                        flux[column] + before.map_or(0.0, |before| flux[before])
                    }
                    Pipe::Seam(column, axis, direction) => {
                        direction as f32 * detail.seam.flux(column, axis, direction)
                    }
                    Pipe::Closed => 0.0,
                };
                fluxes.push(flux);
            });
        }
    }

    /// Sets the stored fluxes in the pipes that the sides have now.
    pub fn end(&self, detail: &mut Detail) {
        let near = detail.near.clone();
        let mut first = 0;
        for cells in &self.boxes {
            let width = 2 * self.layers;
            let mut at = first;
            each_side(cells, self.layers, |cell, layer, axis| {
                let flux = self.fluxes[at];
                match pipe_at(detail, &near, cell, layer, axis) {
                    Pipe::Fine(column) => set_flux(&mut detail.fine, axis, column, flux),
                    Pipe::Coarse(column) if cell[1 - axis].is_multiple_of(2) => {
                        let row = if axis == 0 { cells[0].len() } else { 1 };
                        set_flux(
                            &mut detail.coarse,
                            axis,
                            column,
                            0.25 * (flux + self.fluxes[at + row * width]),
                        );
                    }
                    Pipe::Seam(column, axis, direction) => {
                        detail.seam.set_flux(column, axis, direction, direction as f32 * flux);
                    }
                    Pipe::Coarse(_) | Pipe::Within(..) | Pipe::Closed => {}
                }
                at += 1;
            });
            first = at;
        }
    }
}

fn set_flux(liquid: &mut Shallow, axis: usize, column: usize, flux: f32) {
    let open = [&liquid.pipes.east, &liquid.pipes.south][axis][column];
    if open > 0.0 {
        liquid.flow.flux[axis][column] = flux;
    }
}

/// The pipe that leads from a fine cell to the next one along an axis.
fn pipe_at(detail: &Detail, near: &Cells, cell: [usize; 2], layer: usize, axis: usize) -> Pipe {
    let mut next = cell;
    next[axis] += 1;
    let is_near = |cell: [usize; 2]| near[0].contains(&cell[0]) && near[1].contains(&cell[1]);
    let coarse = |cell: [usize; 2]| detail.coarse.columns.column(cell.map(|at| at / 2), layer);
    let found = match [is_near(cell), is_near(next)] {
        [true, true] => detail.fine.columns.column(cell, layer).map(Pipe::Fine),
        [true, false] => detail.fine.columns.column(cell, layer).map(|column| Pipe::Seam(column, axis, 1)),
        [false, true] => detail.fine.columns.column(next, layer).map(|column| Pipe::Seam(column, axis, -1)),
        [false, false] if cell[axis] % 2 == 1 => coarse(cell).map(Pipe::Coarse),
        [false, false] => {
            let before =
                |column| index_beyond(&detail.coarse.columns, column, [Side::West, Side::North][axis]);
            coarse(cell).map(|column| Pipe::Within(column, before(column)))
        }
    };
    found.unwrap_or(Pipe::Closed)
}

/// Calls `visit` with each fine cell of a box, layer and axis.
fn each_side(cells: &Cells, layers: usize, mut visit: impl FnMut([usize; 2], usize, usize)) {
    for z in cells[1].clone() {
        for x in cells[0].clone() {
            for layer in 0..layers {
                (0..2).for_each(|axis| visit([x, z], layer, axis));
            }
        }
    }
}
