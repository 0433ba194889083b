//! One V-cycle of multigrid: an approximate solution of L x = b, used as the preconditioner of conjugate gradients (McAdams, Sifakis and
//! Teran 2010).
//!
//! Cells double in width from level to level; the open fraction of a coarse face is the mean of its four fine faces. A coarse cell takes
//! part if one of its eight fine cells does and none of them is outside, where the pressure is 0. Residuals are restricted as means,
//! corrections are prolonged by trilinear interpolation. Near solids a correction is scaled so that it reduces the error most. Each level
//! is smoothed by two weighted Jacobi sweeps before and after, with Chebyshev weights for the upper half of the frequencies: unlike
//! Gauss-Seidel, Jacobi does not depend on an order, so mirrored fields have mirrored results.

use rayon::prelude::*;

use super::operator::Operator;
use super::stencil::{Task, first_sweep};
use super::transfer::{prolong, restrict};
use crate::flow::scratch::first_tiles;
use crate::flow::solids::Solids;
use crate::flow::tiles::{Field, NONE, Tile, Tiles};

/// Weights of two Jacobi sweeps: 1 over the roots of the Chebyshev polynomial on [1/3, 2], the range of eigenvalues (over the diagonal) of
/// the modes that a coarser level cannot represent. At most 0.34 of these modes remains.
const WEIGHTS: [f32; 2] = [1.731_9, 0.569_5];
/// Pairs of sweeps on the coarsest level.
const COARSEST_PAIRS: usize = 8;
/// Maximum number of levels.
const MAX_LEVELS: usize = 7;

/// A level below the finest.
#[derive(Debug, Default)]
struct Level {
    operator: Operator,
    /// Slots of the eight finer tiles that each tile covers.
    children: Vec<[u32; 8]>,
    /// For each finer tile, the slot of its coarse tile and its octant.
    parents: Vec<(u32, u8)>,
    b: Field,
    x: Field,
    spare: Field,
    /// Scratch field for the correction that the next level adds near solids.
    fine_correction: Field,
}

/// The preconditioner.
#[derive(Debug, Default)]
pub struct Multigrid {
    /// The operator of the finest level.
    pub finest: Operator,
    levels: Vec<Level>,
}

impl Multigrid {
    /// Rebuilds the levels for the cells of these tiles between solids. Reuses the fields of its levels.
    pub fn rebuild(&mut self, tiles: &Tiles, solids: &Solids) {
        let is_plain = solids.is_empty() && !self.finest.has_stencils();
        if is_plain && self.finest.tiles.is_same_set(tiles) {
            return;
        }
        self.finest = Operator::new(tiles, solids);
        let mut count = 0;
        while count + 1 < MAX_LEVELS {
            let finer = if count == 0 { &self.finest } else { &self.levels[count - 1].operator };
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
            if self.levels.len() == count {
                self.levels.push(Level::default());
            }
            let level = &mut self.levels[count];
            (level.operator, level.children, level.parents) = (operator, children, parents);
            count += 1;
        }
        self.levels.truncate(count);
    }

    /// Applies the preconditioner M: x = M b. Returns the sum of x times b.
    pub fn cycle(&mut self, b: &[Tile], x: &mut [Tile], scratch: [&mut [Tile]; 2]) -> f64 {
        descend(&self.finest, &mut self.levels, b, x, scratch)
    }
}

fn descend(
    operator: &Operator,
    coarser: &mut [Level],
    b: &[Tile],
    x: &mut [Tile],
    [spare, fine_correction]: [&mut [Tile]; 2],
) -> f64 {
    let [first_weight, second_weight] = WEIGHTS;
    let begin =
        |(slot, out): (usize, &mut Tile)| first_sweep(&b[slot], first_weight, operator.stencil(slot), out);
    spare.par_iter_mut().enumerate().with_min_len(64).for_each(begin);
    let mut sum = operator.compute(spare, |slot| Task::Smooth(&b[slot], second_weight), x);
    let Some((next, further)) = coarser.split_first_mut() else {
        for _ in 1..COARSEST_PAIRS {
            operator.compute(x, |slot| Task::Smooth(&b[slot], first_weight), spare);
            sum = operator.compute(spare, |slot| Task::Smooth(&b[slot], second_weight), x);
        }
        return sum;
    };
    let Level {
        operator: coarse,
        children,
        parents,
        b: below,
        x: correction,
        spare: scratch,
        fine_correction: next_correction,
    } = next;
    let count = coarse.tiles.active();
    let next_correction = first_tiles(next_correction, if coarse.has_stencils() { count } else { 0 });
    let [below, correction, scratch] = [below, correction, scratch].map(|field| first_tiles(field, count));
    restrict(operator, (b, x), children, below);
    descend(coarse, further, below, correction, [scratch, next_correction]);
    if operator.has_stencils() {
        fine_correction.par_iter_mut().with_min_len(64).for_each(|tile| *tile = [0.0; 512]);
        prolong(coarse, correction, operator, parents, fine_correction);
        correct(operator, fine_correction, b, x, spare);
    } else {
        prolong(coarse, correction, operator, parents, x);
    }
    operator.compute(x, |slot| Task::Smooth(&b[slot], first_weight), spare);
    operator.compute(spare, |slot| Task::Smooth(&b[slot], second_weight), x)
}

/// Adds a correction to x, scaled so that the energy of the error is smallest. Coarse cells do not resolve narrow gaps and thin walls, and
/// interpolation crosses them: unscaled, a correction may be many times too large.
fn correct(operator: &Operator, correction: &[Tile], b: &[Tile], x: &mut [Tile], spare: &mut [Tile]) {
    let energy = operator.compute(correction, |_| Task::Product, spare);
    // The operator is symmetric: correction . L x = L correction . x.
    let gain = product(correction, b) - product(spare, x);
    let share = if energy > 0.0 { (gain / energy) as f32 } else { 0.0 };
    x.par_iter_mut().zip(correction).with_min_len(64).for_each(|(x, correction)| {
        x.iter_mut().zip(correction).for_each(|(x, value)| *x += share * value);
    });
}

/// Sum of the products of two fields' values.
pub fn product(a: &[Tile], b: &[Tile]) -> f64 {
    let sums: Vec<f64> = a.par_iter().zip(b).with_min_len(64).map(|(a, b)| dot(a, b)).collect();
    sums.iter().sum()
}

/// Sum of the products of two tiles' values.
fn dot(a: &Tile, b: &Tile) -> f64 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().map(|sum| f64::from(*sum)).sum()
}
