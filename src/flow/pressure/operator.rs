//! The operator of a multigrid level: its tiles, and the stencils of tiles near solids and, on coarse levels, near the outside air.

use rayon::prelude::*;

use super::stencil::{Near, Stencil, Task, compute};
use crate::flow::solids::Solids;
use crate::flow::tiles::{Coord, FACES, NONE, Tile, Tiles, neighbour_at};
use crate::numeric::blocks::Mask;

/// The operator on a level.
#[derive(Debug, Default)]
pub struct Operator {
    /// Its tiles. The rim holds no unknowns: the values of a field there are the outside pressure.
    pub tiles: Tiles,
    /// Number of times that cells have doubled in width.
    level: i32,
    /// The stencil index of each active tile; [`NONE`]: all faces are open.
    index: Vec<u32>,
    stencils: Vec<Stencil>,
}

impl Operator {
    /// The operator for the cells of the tiles between solids.
    pub fn new(tiles: &Tiles, solids: &Solids) -> Self {
        let above = |slot: usize| {
            [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
                .map(|offset| solids.faces(tiles.neighbours()[slot][neighbour_at(offset)] as usize))
        };
        let has_one =
            |slot: &usize| solids.faces(*slot).is_some() || above(*slot).iter().any(Option::is_some);
        let one = |slot: usize| {
            let mut stencil = Stencil::open();
            if let Some(own) = solids.faces(slot) {
                stencil.lower = own.open;
            }
            for (axis, above) in above(slot).iter().enumerate() {
                if let Some(above) = above {
                    stencil.upper[axis] = std::array::from_fn(|at| above.open[axis][first(axis, at)]);
                }
            }
            stencil.invert(|_| true);
            stencil
        };
        let count = if solids.is_empty() { 0 } else { tiles.active() };
        let slots: Vec<usize> = (0..count).filter(has_one).collect();
        Self::of(tiles.clone(), 0, &slots, one)
    }

    /// An operator with stencils for these slots. Stencils are large: capacity is reserved for exactly this many.
    fn of(tiles: Tiles, level: i32, slots: &[usize], one: impl Fn(usize) -> Stencil + Sync) -> Self {
        let mut index = vec![NONE; tiles.active()];
        slots.iter().zip(0..).for_each(|(slot, at)| index[*slot] = at);
        let stencils = slots.par_iter().map(|slot| one(*slot)).collect();
        Self { tiles, level, index, stencils }
    }

    /// Gives these slots a stencil with open faces.
    fn open(&mut self, slots: &[usize]) {
        self.stencils.reserve_exact(slots.len());
        for slot in slots {
            self.index[*slot] = self.stencils.len() as u32;
            self.stencils.push(Stencil::open());
        }
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
        Near { own: &field[slot], six: self.tiles.face_neighbours(field, slot), stencil: self.stencil(slot) }
    }

    /// Computes all tiles of `out`. Returns the sum of x times `out`, or, for a sweep, of b times `out`.
    pub fn compute<'a>(&self, x: &[Tile], task: impl Fn(usize) -> Task<'a> + Sync, out: &mut [Tile]) -> f64 {
        let one = |(slot, out): (usize, &mut Tile)| compute(self.near(x, slot), task(slot), out);
        let sums: Vec<f64> = out.par_iter_mut().enumerate().with_min_len(32).map(one).collect();
        sums.iter().sum()
    }

    /// The operator for cells twice as wide, and the slots of the eight fine tiles under each of its tiles.
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
        let plain = |child: &u32| *child != NONE && self.index[*child as usize] == NONE;
        let slots: Vec<usize> = (0..coords.len()).filter(|slot| !children[*slot].iter().all(plain)).collect();
        let one = |slot: usize| self.coarse_stencil(&children[slot]);
        let mut coarse = Self::of(Tiles::new(&coords), self.level + 1, &slots, one);
        coarse.complete_stencils();
        (coarse, children)
    }

    /// The coarse stencil over eight tiles, without the diagonal and without the faces next to the outside.
    fn coarse_stencil(&self, children: &[u32; 8]) -> Stencil {
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
            // Marks the cells that take part, until `complete_stencils` inverts the diagonal.
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
        out
    }

    /// Completes stencils: faces next to the outside, upper faces (the lower faces of the next tiles) and the diagonal.
    fn complete_stencils(&mut self) {
        self.weight_outside_faces();
        let active = self.tiles.active();
        let closed = |slot: &usize| {
            let uppers = (0..3).filter_map(|axis| self.upper(*slot, axis));
            self.index[*slot] == NONE && uppers.flatten().any(|open| open != 1.0)
        };
        let new: Vec<usize> = (0..active).filter(closed).collect();
        self.open(&new);
        let uppers: Vec<[Option<[f32; 64]>; 3]> =
            self.slots().par_iter().map(|slot| [0, 1, 2].map(|axis| self.upper(*slot, axis))).collect();
        self.stencils.par_iter_mut().zip(uppers).for_each(|(stencil, upper)| {
            for (old, new) in stencil.upper.iter_mut().zip(upper) {
                *old = new.unwrap_or(*old);
            }
            let parts = stencil.inverse;
            stencil.invert(|cell| parts[cell] > 0.0);
        });
    }

    /// A tile's upper faces on an axis, which are the lower faces of the tile above; none: that tile is not active.
    fn upper(&self, slot: usize, axis: usize) -> Option<[f32; 64]> {
        let above = self.tiles.neighbours()[slot][FACES[2 * axis + 1]] as usize;
        let stencil = (above < self.tiles.active()).then(|| self.stencil(above))?;
        Some(std::array::from_fn(|at| stencil.map_or(1.0, |above| above.lower[axis][first(axis, at)])))
    }

    /// The slot of each stencil.
    fn slots(&self) -> Vec<usize> {
        let mut slots = vec![0; self.stencils.len()];
        let with = self.index.iter().enumerate().filter(|(_, index)| **index != NONE);
        with.for_each(|(slot, index)| slots[*index as usize] = slot);
        slots
    }

    /// Weights the faces between a cell inside and a cell outside.
    fn weight_outside_faces(&mut self) {
        // None: the whole tile is inside.
        let outside: Vec<Option<Mask>> = (0..self.tiles.active())
            .map(|slot| self.stencil(slot).map(|stencil| stencil.outside).filter(|mask| *mask != [0; 8]))
            .collect();
        let mask = |near: u32| match outside.get(near as usize) {
            Some(mask) => *mask,
            None => Some([u64::MAX; 8]),
        };
        let borders = |slot: &usize| {
            let near = &self.tiles.neighbours()[*slot];
            self.index[*slot] == NONE && FACES.iter().any(|at| mask(near[*at]).is_some())
        };
        let new: Vec<usize> = (0..outside.len()).filter(borders).collect();
        self.open(&new);
        let (slots, factor) = (self.slots(), self.outside_factor());
        let Self { tiles, stencils, .. } = self;
        stencils.par_iter_mut().zip(&slots).for_each(|(stencil, slot)| {
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
                if near[FACES[2 * axis + 1]] as usize >= outside.len() {
                    stencil.upper[axis].iter_mut().for_each(|open| *open *= factor);
                }
            }
        });
    }

    /// Factor by which the weight of a face to the outside changes from the finer level to this one. The outside pressure is known half a
    /// finest cell behind the last face, so that the weight is 2 / (1 + 2^-level), relative to a face between two cells.
    fn outside_factor(&self) -> f32 {
        let share = |level: i32| 2.0 / (1.0 + 0.5f32.powi(level));
        share(self.level) / share(self.level - 1)
    }
}

/// Whether a cell's bit is set.
fn is_set(mask: &Mask, cell: usize) -> bool {
    mask[cell >> 6] >> (cell & 63) & 1 == 1
}

/// The cell of a tile in the first layer on an axis, at a position in that layer.
pub fn first(axis: usize, at: usize) -> usize {
    match axis {
        0 => at,
        1 => (at >> 3) << 6 | at & 7,
        _ => at << 3,
    }
}

/// The position of a cell within its layer on an axis.
pub fn layer(axis: usize, cell: usize) -> usize {
    match axis {
        0 => cell & 63,
        1 => (cell >> 6) << 3 | cell & 7,
        _ => cell >> 3,
    }
}

/// One of the eight fine cells of the coarse cell that begins at `fine`.
fn fine_cell(fine: [usize; 3], part: usize) -> usize {
    (fine[0] + (part >> 2)) << 6 | (fine[1] + (part >> 1 & 1)) << 3 | (fine[2] + (part & 1))
}
