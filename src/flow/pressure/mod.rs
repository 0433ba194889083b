//! Pressure projection: makes the velocity field divergence-free (Chorin 1968), with solids that cover part of a face (Batty, Bertails and
//! Bridson 2007), by conjugate gradients preconditioned with one multigrid cycle.
//!
//! The unknown is p dt / (density x cell), in m/s: its differences are changes of velocity.

pub(in crate::flow) mod multigrid;
pub(in crate::flow) mod operator;
mod pockets;
pub(in crate::flow) mod stencil;
mod transfer;

use rayon::prelude::*;

use super::solids::Solids;
use super::tiles::{FACES, Field, Tile, Tiles, ZEROS};
use super::window::max;
use crate::context::Context;
use crate::error::Result;
use multigrid::Multigrid;
use pockets::Pockets;
use stencil::{Task, row_of};

/// Results of a solve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Solved {
    /// Iterations of the conjugate gradient method.
    pub iterations: usize,
    /// Largest remaining divergence, times the edge of a cell (m/s).
    pub divergence: f32,
    /// Largest speed (m/s) on any axis, before.
    pub fastest: f32,
}

/// Maximum number of iterations.
const MAX_ITERATIONS: usize = 200;

/// Changes the velocity (m/s, at lower faces) so that, in all cells not covered by solids, its divergence times a cell's edge is at most
/// `tolerance` times the largest speed. `pressure` holds the initial guess, then the solution; its values in the rim are fixed.
///
/// # Errors
/// Cancel.
pub fn project(
    ctx: &Context,
    (tiles, solids): (&Tiles, &Solids),
    velocity: &mut [Field; 3],
    pressure: &mut Field,
    multigrid: &mut Multigrid,
    [residual, preconditioned, direction, product, spare, fine_correction]: [&mut [Tile]; 6],
    tolerance: f32,
) -> Result<Solved> {
    multigrid.rebuild(tiles, solids);
    let fastest = max(fastest(velocity), solids.fastest());
    let target = tolerance * fastest;
    let pockets = Pockets::find(&multigrid.finest);
    // Until the first iteration the buffer holds the right-hand side.
    net_inflow(tiles, solids, velocity, preconditioned);
    // Cells inside solids have no equation: divergence that solids cause there must not reach the coarse levels.
    multigrid.finest.clear_covered(preconditioned);
    pockets.subtract_means(preconditioned);
    pockets.subtract_means(pressure);
    multigrid.finest.compute(pressure, |slot| Task::Residual(&preconditioned[slot]), residual);
    let mut solved = Solved { iterations: 0, divergence: max_abs(residual), fastest };
    let mut curvature = 0.0;
    // The divergence that a step leaves adds to that of the next one: at least one iteration, unless it is negligible.
    let is_due = |solved: &Solved| match solved.iterations {
        0 => solved.divergence > 0.01 * target,
        _ => solved.divergence > target,
    };
    while is_due(&solved) && solved.iterations < MAX_ITERATIONS {
        ctx.check()?;
        // Preconditioned conjugate gradients: residual_product is r.z, -overlap is beta, curvature is d.Ld.
        let residual_product =
            multigrid.cycle(residual, preconditioned, [&mut *spare, &mut *fine_correction]);
        // The new direction is made conjugate to the old one even though the preconditioner is not symmetric (Notay 2000).
        let overlap =
            if curvature > 0.0 { multigrid::product(preconditioned, product) / curvature } else { 0.0 };
        update_direction(direction, preconditioned, -overlap as f32, solved.iterations == 0);
        curvature = multigrid.finest.compute(direction, |_| Task::Product, product);
        if !(curvature > 0.0 && residual_product > 0.0) {
            break;
        }
        let step = (residual_product / curvature) as f32;
        solved.divergence = advance(pressure, residual, direction, product, step);
        solved.iterations += 1;
    }
    subtract_gradient(tiles, solids, pressure, velocity);
    Ok(solved)
}

/// direction = preconditioned + share direction; in the first iteration, direction = preconditioned.
fn update_direction(direction: &mut [Tile], preconditioned: &[Tile], share: f32, is_first: bool) {
    direction.par_iter_mut().zip(preconditioned).with_min_len(64).for_each(|(direction, preconditioned)| {
        if is_first {
            *direction = *preconditioned;
        } else {
            direction.iter_mut().zip(preconditioned).for_each(|(to, from)| *to = from + share * *to);
        }
    });
}

/// One iteration. Returns the largest residual.
fn advance(
    pressure: &mut [Tile],
    residual: &mut [Tile],
    direction: &[Tile],
    product: &[Tile],
    step: f32,
) -> f32 {
    let tiles = pressure.par_iter_mut().zip(residual).zip(direction).zip(product).with_min_len(64);
    let each = tiles.map(|(((pressure, residual), direction), product)| {
        let mut largest = [0.0f32; 8];
        for cell in 0..512 {
            pressure[cell] += step * direction[cell];
            residual[cell] -= step * product[cell];
            largest[cell & 7] = max(largest[cell & 7], residual[cell].abs());
        }
        largest.into_iter().fold(0.0, max)
    });
    each.reduce(|| 0.0, max)
}

/// Largest absolute value.
fn max_abs(field: &[Tile]) -> f32 {
    let of_tile = |tile: &Tile| tile.iter().fold(0.0, |largest, value| max(largest, value.abs()));
    field.par_iter().with_min_len(64).map(of_tile).reduce(|| 0.0, max)
}

/// Largest speed (m/s) on any axis.
pub fn fastest(velocity: &[Field; 3]) -> f32 {
    velocity.iter().map(|field| max_abs(field)).fold(0.0, max)
}

/// Trailing bits of a float that are ignored when speeds are binned: the exponent and seven mantissa bits remain.
const IGNORED_BITS: u32 = 16;

/// Speed (m/s, rounded up to a float with [`IGNORED_BITS`] zero bits at its end) that only a share of the values exceeds.
pub fn fastest_except(velocity: &[Field; 3], share: f64) -> f32 {
    let bin = |speed: f32| (speed.abs().to_bits() >> IGNORED_BITS) as usize;
    let tiles = velocity.iter().map(Vec::len).sum::<usize>();
    let none = || vec![0u32; 1 << (31 - IGNORED_BITS + 1)];
    let sum = |mut a: Vec<u32>, b: Vec<u32>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let counts = velocity.iter().map(|field| {
        let counted = field.par_iter().with_min_len(512).fold(none, |mut counts, tile| {
            tile.iter().for_each(|speed| counts[bin(*speed)] += 1);
            counts
        });
        counted.reduce(none, sum)
    });
    let counts = counts.fold(none(), sum);
    let allowed = (share * (512 * tiles) as f64) as u64;
    let mut beyond = 0;
    for (bin, count) in counts.iter().enumerate().rev() {
        beyond += u64::from(*count);
        if beyond > allowed {
            return f32::from_bits((bin as u32 + 1) << IGNORED_BITS);
        }
    }
    0.0
}

/// Net inflow of each cell (m/s): minus the divergence times a cell's edge.
pub fn net_inflow(tiles: &Tiles, solids: &Solids, velocity: &[Field; 3], out: &mut [Tile]) {
    out.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, out)| {
        for (row, out) in out.chunks_exact_mut(8).enumerate() {
            let sides = [0, 1, 2].map(|axis| fluxes(tiles, solids, velocity, axis, [slot, row]));
            let [[left, right], [down, up], [back, front]] = &sides;
            for (lane, out) in out.iter_mut().enumerate() {
                *out = (left[lane] - right[lane]) + (down[lane] - up[lane]) + (back[lane] - front[lane]);
            }
        }
    });
}

/// Flux through the lower and upper faces of a row of cells on an axis (m/s).
fn fluxes(
    tiles: &Tiles,
    solids: &Solids,
    velocity: &[Field; 3],
    axis: usize,
    [slot, row]: [usize; 2],
) -> [[f32; 8]; 2] {
    let above = tiles.neighbours()[slot][FACES[2 * axis + 1]] as usize;
    let flux = |slot: usize, row: usize| {
        let mut flux = row_of(&velocity[axis][slot], row);
        if let Some(faces) = solids.faces(slot) {
            let (open, speed) = (row_of(&faces.open[axis], row), row_of(&faces.speed[axis], row));
            for lane in 0..8 {
                flux[lane] = open[lane] * flux[lane] + (1.0 - open[lane]) * speed[lane];
            }
        }
        flux
    };
    let lower = flux(slot, row);
    let upper = match axis {
        0 if row < 56 => flux(slot, row + 8),
        0 => flux(above, row - 56),
        1 if row & 7 < 7 => flux(slot, row + 1),
        1 => flux(above, row - 7),
        _ => {
            let mut upper = [0.0; 8];
            upper[..7].copy_from_slice(&lower[1..]);
            upper[7] = flux(above, row)[0];
            upper
        }
    };
    [lower, upper]
}

/// Subtracts the pressure gradient from the velocity; covered faces move with the solid.
fn subtract_gradient(tiles: &Tiles, solids: &Solids, pressure: &Field, velocity: &mut [Field; 3]) {
    for (axis, velocity) in velocity.iter_mut().enumerate() {
        velocity.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, speed)| {
            let below = tiles.neighbours()[slot][FACES[2 * axis]] as usize;
            let is_active = slot < tiles.active();
            if !is_active && below >= tiles.active() {
                return;
            }
            let (here, below) = (&pressure[slot], pressure.get(below).unwrap_or(&ZEROS));
            let faces = solids.faces(slot);
            for (row, speed) in speed.chunks_exact_mut(8).enumerate() {
                // In the rim only the faces of active cells change.
                let changed_lanes = match axis {
                    _ if is_active => 8,
                    0 => 8 * usize::from(row < 8),
                    1 => 8 * usize::from(row & 7 == 0),
                    _ => 1,
                };
                let upper = row_of(here, row);
                let lower = match axis {
                    0 if row >= 8 => row_of(here, row - 8),
                    0 => row_of(below, row + 56),
                    1 if row & 7 > 0 => row_of(here, row - 1),
                    1 => row_of(below, row + 7),
                    _ => {
                        let mut lower = [0.0; 8];
                        lower[0] = below[row * 8 + 7];
                        lower[1..].copy_from_slice(&upper[..7]);
                        lower
                    }
                };
                for (lane, speed) in speed.iter_mut().enumerate().take(changed_lanes) {
                    *speed -= upper[lane] - lower[lane];
                }
                if let Some(faces) = faces {
                    let (open, solid) = (row_of(&faces.open[axis], row), row_of(&faces.speed[axis], row));
                    for (lane, speed) in speed.iter_mut().enumerate().filter(|(lane, _)| open[*lane] == 0.0) {
                        *speed = solid[lane];
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_jets_do_not_count() {
        let mut field = vec![[1.5f32; 512]; 40];
        field[7][9] = -90.0;
        field[3][1] = 30.0;
        let velocity = [field, vec![[0.25; 512]; 40], vec![[-0.5; 512]; 40]];
        assert_eq!(fastest(&velocity), 90.0);
        // Two of 61,440 faces are a share of 3.3e-5.
        let bulk = fastest_except(&velocity, 4.0e-5);
        assert!((1.5..1.52).contains(&bulk), "{bulk}");
        assert!(fastest_except(&velocity, 2.0e-5) > 29.9 && fastest_except(&velocity, 0.0) > 89.9);
        assert_eq!(fastest_except(&[vec![], vec![], vec![]], 0.1), 0.0);
    }
}
