//! One V-cycle of multigrid: a good guess at the solution of L x = b, and a symmetric operator, as the conjugate gradient
//! method needs of its preconditioner (McAdams, Sifakis and Teran 2010).
//!
//! Cells double from level to level; the open share of a coarse face is the mean of its four fine ones. A coarse cell takes part
//! if one of its eight does and none is outside, where the pressure is 0. Values go down and up by trilinear interpolation. Each level is smoothed by two weighted
//! Jacobi sweeps before and after, with Chebyshev's weights for the upper half of the frequencies: unlike Gauss and Seidel's,
//! these do not depend on any order, so that mirrored fields have mirrored results.

use rayon::prelude::*;

use super::solids::Solids;
use super::stencil::{Near, Stencil, Task, compute, start};
use super::tiles::{Coord, Field, NONE, SELF, Tile, Tiles};
use super::window::Window;
use crate::base::blocks::Mask;

/// Weights of two Jacobi sweeps: the inverse roots of Chebyshev's polynomial on [1/3, 2], the eigenvalues (over the diagonal) of
/// the modes that a coarser level cannot hold. They leave at most 0.34 of those.
const WEIGHTS: [f32; 2] = [1.731_9, 0.569_5];
/// Pairs of sweeps on the coarsest level.
const LAST: usize = 8;
/// Most levels.
const LEVELS: usize = 7;

/// The operator on a level.
#[derive(Debug, Default)]
pub struct Operator {
    /// Its tiles. The rim holds no unknowns: what a field has there is the pressure outside.
    pub tiles: Tiles,
    /// The stencil of each active tile; [`NONE`]: all faces are open.
    index: Vec<u32>,
    stencils: Vec<Stencil>,
}

impl Operator {
    /// The operator of the tiles' cells between solids.
    pub fn new(tiles: &Tiles, solids: &Solids) -> Self {
        let one = |slot: usize| {
            let above = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|offset| {
                let near = tiles.neighbours()[slot][super::tiles::neighbour_at(offset)];
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
        Self::of(tiles.clone(), stencils)
    }

    fn of(tiles: Tiles, stencils: Vec<Option<Stencil>>) -> Self {
        let mut operator = Self { tiles, ..Self::default() };
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
    pub fn clear_covered(&self, field: &mut Field) {
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

    /// Computes all tiles of `out`. Returns the sum of x times `out`.
    pub fn compute<'a>(&self, x: &[Tile], task: impl Fn(usize) -> Task<'a> + Sync, out: &mut Field) -> f64 {
        let one = |(slot, out): (usize, &mut Tile)| compute(self.near(x, slot), task(slot), out);
        let sums: Vec<f64> = out.par_iter_mut().enumerate().with_min_len(32).map(one).collect();
        sums.iter().sum()
    }

    /// The operator for cells twice as wide.
    fn coarser(&self) -> (Self, Vec<[u32; 8]>) {
        let mut coords: Vec<Coord> = self.coords().iter().map(|coord| coord.map(|x| x >> 1)).collect();
        coords.sort_unstable();
        coords.dedup();
        let tiles = Tiles::new(&coords);
        let children = |coord: &Coord| {
            std::array::from_fn(|octant| {
                let child = [0, 1, 2].map(|axis| coord[axis] * 2 + (octant >> (2 - axis) & 1) as i32);
                self.tiles.find(child).filter(|slot| (*slot as usize) < self.tiles.active()).unwrap_or(NONE)
            })
        };
        let children: Vec<[u32; 8]> = coords.iter().map(children).collect();
        let stencils = children.par_iter().map(|children| self.coarse_stencil(children)).collect();
        let mut coarse = Self::of(tiles, stencils);
        coarse.join();
        (coarse, children)
    }

    fn coords(&self) -> &[Coord] {
        &self.tiles.coords()[..self.tiles.active()]
    }

    /// The coarse stencil over eight tiles, but for its upper faces and diagonal; none: all faces are open.
    fn coarse_stencil(&self, children: &[u32; 8]) -> Option<Stencil> {
        let plain = |child: &u32| *child != NONE && self.index[*child as usize] == NONE;
        if children.iter().all(plain) {
            return None;
        }
        let mut out = Stencil::open();
        for cell in 0..512 {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let octant = (at[0] >> 2) << 2 | (at[1] >> 2) << 1 | at[2] >> 2;
            let child = children[octant];
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
            if let Some(stencil) = stencil {
                for axis in 0..3 {
                    let four = (0..8).filter(|part| part >> (2 - axis) & 1 == 0);
                    let sum: f32 = four.map(|part| stencil.lower[axis][fine_cell(fine, part)]).sum();
                    out.lower[axis][cell] = 0.25 * sum;
                }
            }
        }
        Some(out)
    }

    /// Completes the upper faces and the diagonal of stencils from their neighbours' lower faces.
    fn join(&mut self) {
        let active = self.tiles.active();
        let above = |slot: usize, axis: usize| {
            let near = self.tiles.neighbours()[slot][super::tiles::FACES[2 * axis + 1]] as usize;
            (near < active).then(|| self.stencil(near)).flatten()
        };
        let layer = |slot: usize, axis: usize| -> [f32; 64] {
            let above = above(slot, axis);
            std::array::from_fn(|at| above.map_or(1.0, |above| above.lower[axis][first(axis, at)]))
        };
        let uppers: Vec<[[f32; 64]; 3]> =
            (0..active).map(|slot| [0, 1, 2].map(|axis| layer(slot, axis))).collect();
        for (slot, upper) in uppers.into_iter().enumerate() {
            if self.index[slot] == NONE && upper.iter().flatten().any(|open| *open != 1.0) {
                self.index[slot] = self.stencils.len() as u32;
                self.stencils.push(Stencil::open());
            }
            if let Some(stencil) = self.stencils.get_mut(self.index[slot] as usize) {
                stencil.upper = upper;
                let parts = stencil.inverse;
                stencil.invert(|cell| parts[cell] > 0.0);
            }
        }
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

/// One of eight fine cells of a coarse cell that begins at `fine`.
fn fine_cell(fine: [usize; 3], part: usize) -> usize {
    (fine[0] + (part >> 2)) << 6 | (fine[1] + (part >> 1 & 1)) << 3 | (fine[2] + (part & 1))
}

/// A level below the finest.
#[derive(Debug, Default)]
struct Level {
    operator: Operator,
    /// Slots of the eight finer tiles under each tile.
    children: Vec<[u32; 8]>,
    /// For each finer tile, the slot here and its octant.
    parents: Vec<(u32, u8)>,
    b: Field,
    x: Field,
    spare: Field,
}

/// The preconditioner.
#[derive(Debug, Default)]
pub struct Multigrid {
    /// The finest level's operator.
    pub finest: Operator,
    levels: Vec<Level>,
}

impl Multigrid {
    /// Builds the levels.
    pub fn new(finest: Operator) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        while levels.len() + 1 < LEVELS {
            let finer = levels.last().map_or(&finest, |level| &level.operator);
            if finer.tiles.active() <= 1 {
                break;
            }
            let (operator, children) = finer.coarser();
            let mut parents = vec![(NONE, 0); finer.tiles.active()];
            for (slot, children) in children.iter().enumerate() {
                for (octant, child) in children.iter().enumerate().filter(|(_, child)| **child != NONE) {
                    parents[*child as usize] = (slot as u32, octant as u8);
                }
            }
            let zeros = vec![[0.0; 512]; operator.tiles.active()];
            let (b, x, spare) = (zeros.clone(), zeros.clone(), zeros);
            levels.push(Level { operator, children, parents, b, x, spare });
        }
        Self { finest, levels }
    }

    /// x = M b; returns the sum of x times b.
    pub fn cycle(&mut self, b: &Field, x: &mut Field, spare: &mut Field) -> f64 {
        descend(&self.finest, &mut self.levels, b, x, spare);
        let one = |(x, b): (&Tile, &Tile)| dot(x, b);
        let sums: Vec<f64> = x.par_iter().zip(b).with_min_len(64).map(one).collect();
        sums.iter().sum()
    }
}

/// Sum of the products of two tiles' values.
pub fn dot(a: &Tile, b: &Tile) -> f64 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().map(|sum| f64::from(*sum)).sum()
}

fn descend(operator: &Operator, coarser: &mut [Level], b: &Field, x: &mut Field, spare: &mut Field) {
    let [first, second] = WEIGHTS;
    let begin = |(slot, out): (usize, &mut Tile)| start(&b[slot], first, operator.stencil(slot), out);
    spare.par_iter_mut().enumerate().with_min_len(64).for_each(begin);
    operator.compute(spare, |slot| Task::Smooth(&b[slot], second), x);
    let Some((next, further)) = coarser.split_first_mut() else {
        for _ in 1..LAST {
            operator.compute(x, |slot| Task::Smooth(&b[slot], first), spare);
            operator.compute(spare, |slot| Task::Smooth(&b[slot], second), x);
        }
        return;
    };
    operator.compute(x, |slot| Task::Residual(&b[slot]), spare);
    restrict(operator, next, spare);
    let Level { operator: coarse, b: below, x: correction, spare: room, .. } = next;
    descend(coarse, further, below, correction, room);
    prolong(next, x);
    operator.compute(x, |slot| Task::Smooth(&b[slot], first), spare);
    operator.compute(spare, |slot| Task::Smooth(&b[slot], second), x);
}

/// Share of the four fine cells around a coarse one in its value.
const DOWN: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
/// Square of the ratio of the cells' widths, which the stencils leave out.
const WIDER: f32 = 4.0;

/// The coarse right side: the fine residual, averaged.
fn restrict(operator: &Operator, level: &mut Level, residual: &Field) {
    let Level { children, b, .. } = level;
    let tiles = b.par_iter_mut().zip(children).with_min_len(4);
    tiles.for_each_init(Window::default, |window, (out, children)| {
        *out = [0.0; 512];
        for (octant, child) in children.iter().enumerate().filter(|(_, child)| **child != NONE) {
            window.fill(residual, &operator.tiles.neighbours()[*child as usize], 1, 0.0);
            let corner = [octant >> 2 & 1, octant >> 1 & 1, octant & 1].map(|x| x * 4);
            let mut lines = [[[0.0f32; 4]; 10]; 10];
            for x in 0..10 {
                for y in 0..10 {
                    for z in 0..4 {
                        let at = |k: usize| DOWN[k] * window.at(x, y, 2 * z + k);
                        lines[x][y][z] = (at(0) + at(3)) + (at(1) + at(2));
                    }
                }
            }
            let mut planes = [[[0.0f32; 4]; 4]; 10];
            for x in 0..10 {
                for y in 0..4 {
                    for z in 0..4 {
                        let at = |k: usize| DOWN[k] * lines[x][2 * y + k][z];
                        planes[x][y][z] = (at(0) + at(3)) + (at(1) + at(2));
                    }
                }
            }
            for x in 0..4 {
                for y in 0..4 {
                    for z in 0..4 {
                        let at = |k: usize| DOWN[k] * planes[2 * x + k][y][z];
                        let cell = (corner[0] + x) << 6 | (corner[1] + y) << 3 | (corner[2] + z);
                        out[cell] = WIDER * ((at(0) + at(3)) + (at(1) + at(2)));
                    }
                }
            }
        }
    });
}

/// Adds the coarse correction, interpolated.
fn prolong(level: &Level, x: &mut Field) {
    let (near, correction) = (level.operator.tiles.neighbours(), &level.x);
    let tiles = x.par_iter_mut().zip(&level.parents).with_min_len(16);
    tiles.for_each_init(Window::default, |window, (out, (parent, octant))| {
        debug_assert_eq!(near[*parent as usize][SELF], *parent);
        window.fill(correction, &near[*parent as usize], 1, 0.0);
        let corner = [octant >> 2 & 1, octant >> 1 & 1, octant & 1].map(|x| usize::from(x) * 4);
        // A fine cell takes 3/4 of the coarse cell that contains it and 1/4 of the next one on its side.
        let two = |fine: usize| (fine / 2 + 1, fine / 2 + 2 * (fine & 1));
        let mut lines = [[[0.0f32; 8]; 6]; 6];
        for x in 0..6 {
            for y in 0..6 {
                for z in 0..8 {
                    let (own, next) = two(z);
                    let at = |z: usize| window.at(corner[0] + x, corner[1] + y, corner[2] + z);
                    lines[x][y][z] = 0.75 * at(own) + 0.25 * at(next);
                }
            }
        }
        for x in 0..8 {
            let (own_x, next_x) = two(x);
            for y in 0..8 {
                let (own_y, next_y) = two(y);
                let row = &mut out[x << 6 | y << 3..][..8];
                for z in 0..8 {
                    let plane = |x: usize| 0.75 * lines[x][own_y][z] + 0.25 * lines[x][next_y][z];
                    row[z] += 0.75 * plane(own_x) + 0.25 * plane(next_x);
                }
            }
        }
    });
}
