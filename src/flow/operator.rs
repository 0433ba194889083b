//! The operator of a level of multigrid: which tiles there are, and the stencils of those near solids and, with wide cells, near
//! the air outside.

use rayon::prelude::*;

use super::solids::Solids;
use super::stencil::{Near, Stencil, Task, compute};
use super::tiles::{Coord, FACES, NONE, Tile, Tiles, neighbour_at};
use crate::base::blocks::Mask;

/// The operator on a level.
#[derive(Debug, Default)]
pub struct Operator {
    /// Its tiles. The rim holds no unknowns: what a field has there is the pressure outside.
    pub tiles: Tiles,
    /// How often cells have doubled.
    level: i32,
    /// The stencil of each active tile; [`NONE`]: all faces are open.
    index: Vec<u32>,
    stencils: Vec<Stencil>,
}

impl Operator {
    /// The operator of the tiles' cells between solids.
    pub fn new(tiles: &Tiles, solids: &Solids) -> Self {
        let one = |slot: usize| {
            let above = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|offset| {
                let near = tiles.neighbours()[slot][neighbour_at(offset)];
                solids.faces(near as usize)
            });
            let own = solids.faces(slot);
            if own.is_none() && above.iter().all(Option::is_none) {
                return None;
            }
            let mut stencil = Stencil::open();
            if let Some(own) = own {
                stencil.lower = own.open;
            }
            for (axis, above) in above.iter().enumerate() {
                if let Some(above) = above {
                    stencil.upper[axis] = std::array::from_fn(|at| above.open[axis][first(axis, at)]);
                }
            }
            stencil.invert(|_| true);
            Some(stencil)
        };
        let stencils = if solids.is_empty() {
            vec![None; tiles.active()]
        } else {
            (0..tiles.active()).into_par_iter().map(one).collect()
        };
        Self::of(tiles.clone(), 0, stencils)
    }

    fn of(tiles: Tiles, level: i32, stencils: Vec<Option<Stencil>>) -> Self {
        let mut operator = Self { tiles, level, ..Self::default() };
        for stencil in stencils {
            match stencil {
                Some(stencil) => {
                    operator.index.push(operator.stencils.len() as u32);
                    operator.stencils.push(stencil);
                }
                None => operator.index.push(NONE),
            }
        }
        operator
    }

    /// Whether some faces are not fully open.
    pub fn has_stencils(&self) -> bool {
        !self.stencils.is_empty()
    }

    /// The stencil of a tile; none: all faces are open.
    pub fn stencil(&self, slot: usize) -> Option<&Stencil> {
        self.stencils.get(self.index[slot] as usize)
    }

    /// Sets a field to 0 in cells that take no part.
    pub fn clear_covered(&self, field: &mut [Tile]) {
        field.par_iter_mut().enumerate().with_min_len(64).for_each(|(slot, tile)| {
            if let Some(stencil) = self.stencil(slot) {
                let covered = tile.iter_mut().zip(&stencil.inverse).filter(|(_, inverse)| **inverse == 0.0);
                covered.for_each(|(value, _)| *value = 0.0);
            }
        });
    }

    /// A tile of a field with its neighbours and coefficients.
    pub fn near<'a>(&'a self, field: &'a [Tile], slot: usize) -> Near<'a> {
        Near { own: &field[slot], six: self.tiles.six(field, slot), stencil: self.stencil(slot) }
    }

    /// Computes all tiles of `out`. Returns the sum of x, or for a sweep that of b, times `out`.
    pub fn compute<'a>(&self, x: &[Tile], task: impl Fn(usize) -> Task<'a> + Sync, out: &mut [Tile]) -> f64 {
        let one = |(slot, out): (usize, &mut Tile)| compute(self.near(x, slot), task(slot), out);
        let sums: Vec<f64> = out.par_iter_mut().enumerate().with_min_len(32).map(one).collect();
        sums.iter().sum()
    }

    /// The operator for cells twice as wide, and the slots of the eight tiles under each of its tiles.
    pub fn coarser(&self) -> (Self, Vec<[u32; 8]>) {
        let active = &self.tiles.coords()[..self.tiles.active()];
        let mut coords: Vec<Coord> = active.iter().map(|coord| coord.map(|x| x >> 1)).collect();
        coords.sort_unstable();
        coords.dedup();
        let children = |coord: &Coord| {
            std::array::from_fn(|octant| {
                let child = [0, 1, 2].map(|axis| coord[axis] * 2 + (octant >> (2 - axis) & 1) as i32);
                self.tiles.find(child).filter(|slot| (*slot as usize) < self.tiles.active()).unwrap_or(NONE)
            })
        };
        let children: Vec<[u32; 8]> = coords.par_iter().with_min_len(16).map(children).collect();
        let stencils = children.par_iter().map(|children| self.coarse_stencil(children)).collect();
        let mut coarse = Self::of(Tiles::new(&coords), self.level + 1, stencils);
        coarse.join();
        (coarse, children)
    }

    /// The coarse stencil over eight tiles, but for the faces that bound the outside and the diagonal; none: all faces are open.
    fn coarse_stencil(&self, children: &[u32; 8]) -> Option<Stencil> {
        let plain = |child: &u32| *child != NONE && self.index[*child as usize] == NONE;
        if children.iter().all(plain) {
            return None;
        }
        let mut out = Stencil::open();
        for cell in 0..512 {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let child = children[(at[0] >> 2) << 2 | (at[1] >> 2) << 1 | at[2] >> 2];
            let fine = at.map(|x| (x & 3) * 2);
            let stencil = (child != NONE).then(|| self.stencil(child as usize)).flatten();
            let fine_cells = std::array::from_fn::<usize, 8, _>(|part| fine_cell(fine, part));
            let is_outside = child == NONE
                || stencil.is_some_and(|stencil| fine_cells.iter().any(|at| is_set(&stencil.outside, *at)));
            let is_solid =
                stencil.is_some_and(|stencil| fine_cells.iter().all(|at| stencil.inverse[*at] == 0.0));
            out.outside[cell >> 6] |= u64::from(is_outside) << (cell & 63);
            // Marks cells that do not take part, until `join` inverts the diagonal.
            out.inverse[cell] = f32::from(u8::from(!is_outside && !is_solid));
            let Some(stencil) = stencil else { continue };
            for axis in 0..3 {
                let four = (0..8).filter(|part| part >> (2 - axis) & 1 == 0);
                let sum: f32 = four.map(|part| stencil.lower[axis][fine_cell(fine, part)]).sum();
                out.lower[axis][cell] = 0.25 * sum;
                if at[axis] == 7 {
                    let four = (0..8).filter(|part| part >> (2 - axis) & 1 == 1);
                    let above = four.map(|part| stencil.upper[axis][layer(axis, fine_cell(fine, part))]);
                    out.upper[axis][layer(axis, cell)] = 0.25 * above.sum::<f32>();
                }
            }
        }
        Some(out)
    }

    /// Completes stencils: faces that bound the outside, the upper faces, which are the next tiles' lower ones, and the diagonal.
    fn join(&mut self) {
        let (tiles, active) = (&self.tiles, self.tiles.active());
        // None: the whole tile is inside.
        let outside: Vec<Option<Mask>> = (0..active)
            .map(|slot| self.stencil(slot).map(|stencil| stencil.outside).filter(|mask| *mask != [0; 8]))
            .collect();
        let mask = |near: u32| match outside.get(near as usize) {
            Some(mask) => *mask,
            None => Some([u64::MAX; 8]),
        };
        for slot in 0..active {
            let borders = FACES.iter().any(|at| mask(tiles.neighbours()[slot][*at]).is_some());
            if self.index[slot] == NONE && borders {
                self.index[slot] = self.stencils.len() as u32;
                self.stencils.push(Stencil::open());
            }
        }
        let mut slots = vec![0; self.stencils.len()];
        let with = (0..active).filter(|slot| self.index[*slot] != NONE);
        with.for_each(|slot| slots[self.index[slot] as usize] = slot);
        let factor = self.nearer();
        self.stencils.par_iter_mut().zip(&slots).for_each(|(stencil, slot)| {
            let near = &tiles.neighbours()[*slot];
            let own = mask(*slot as u32).unwrap_or([0; 8]);
            for axis in 0..3 {
                let below = mask(near[FACES[2 * axis]]).unwrap_or([0; 8]);
                let step = 64 >> (3 * axis);
                for cell in 0..512 {
                    let lower = match cell / step % 8 {
                        0 => is_set(&below, cell + 7 * step),
                        _ => is_set(&own, cell - step),
                    };
                    if lower != is_set(&own, cell) {
                        stencil.lower[axis][cell] *= factor;
                    }
                }
                if near[FACES[2 * axis + 1]] as usize >= active {
                    stencil.upper[axis].iter_mut().for_each(|open| *open *= factor);
                }
            }
        });
        let above = |slot: usize, axis: usize| {
            let near = tiles.neighbours()[slot][FACES[2 * axis + 1]] as usize;
            (near < active).then(|| self.stencil(near))
        };
        let layer = |slot: usize, axis: usize| -> Option<[f32; 64]> {
            let above = above(slot, axis)?;
            Some(std::array::from_fn(|at| above.map_or(1.0, |above| above.lower[axis][first(axis, at)])))
        };
        let uppers: Vec<[Option<[f32; 64]>; 3]> =
            (0..active).map(|slot| [0, 1, 2].map(|axis| layer(slot, axis))).collect();
        for (slot, upper) in uppers.into_iter().enumerate() {
            if self.index[slot] == NONE && upper.iter().flatten().flatten().any(|open| *open != 1.0) {
                self.index[slot] = self.stencils.len() as u32;
                self.stencils.push(Stencil::open());
            }
            if let Some(stencil) = self.stencils.get_mut(self.index[slot] as usize) {
                for (old, new) in stencil.upper.iter_mut().zip(upper) {
                    *old = new.unwrap_or(*old);
                }
                let parts = stencil.inverse;
                stencil.invert(|cell| parts[cell] > 0.0);
            }
        }
    }

    /// How much nearer, in cells, the pressure outside is to the last cells than on the level above. It is known half a finest
    /// cell behind the last face: 2 / (1 + 2^-level) of the distance of two cells.
    fn nearer(&self) -> f32 {
        let share = |level: i32| 2.0 / (1.0 + 0.5f32.powi(level));
        share(self.level) / share(self.level - 1)
    }
}

/// Whether a cell's bit is set.
fn is_set(mask: &Mask, cell: usize) -> bool {
    mask[cell >> 6] >> (cell & 63) & 1 == 1
}

/// The cell of a tile in the first layer on an axis, at a place in that layer.
pub fn first(axis: usize, at: usize) -> usize {
    match axis {
        0 => at,
        1 => (at >> 3) << 6 | at & 7,
        _ => at << 3,
    }
}

/// The place of a cell in its layer on an axis.
pub fn layer(axis: usize, cell: usize) -> usize {
    match axis {
        0 => cell & 63,
        1 => (cell >> 6) << 3 | cell & 7,
        _ => cell >> 3,
    }
}

/// One of eight fine cells of a coarse cell that begins at `fine`.
fn fine_cell(fine: [usize; 3], part: usize) -> usize {
    (fine[0] + (part >> 2)) << 6 | (fine[1] + (part >> 1 & 1)) << 3 | (fine[2] + (part & 1))
}
