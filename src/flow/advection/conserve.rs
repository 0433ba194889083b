//! Conserves the mass of an advected density: mass that advection loses is restored where it was lost, mass that it gains is removed where
//! it was gained.
//!
//! Every corner of the tiles has a hat function: a weight of 1 there that falls linearly to 0 at the adjacent corners, so that all hats
//! sum to 1 at each point. Each cell carries its mass along its path to a point, and thus into the eight hats around it: this is
//! the mass that each hat should hold. After advection the hat holds a different mass. The density is then multiplied by factors that are
//! given at the corners (the mass that the hat should hold divided by the mass that it holds) and linear in between, so that the total mass
//! is right to rounding and no density farther than a tile from a loss changes, unless a hat would have to grow by more than `MAX_GAIN`.

use rayon::prelude::*;

use super::paths::{Extent, Paths};
use super::scheme::MassConservation;
use crate::context::Context;
use crate::error::Result;
use crate::flow::pressure::stencil::row_of;
use crate::flow::tiles::{Field, Tile, Tiles, neighbour_at};
use crate::flow::window::{max, min};
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::Lanes;

/// Largest factor of a hat, and then of all density, in a round: if nearly all the mist of a tile was removed, its mass must not return in
/// the little that is left.
const MAX_GAIN: f64 = 1.2;
/// Passes in which a hat that would have to grow by more than [`MAX_GAIN`] hands the excess to the adjacent hats. The excess that remains
/// after them is spread over all of the density.
const PASSES: usize = 6;
/// In a step a density below `fade_below` loses this share of its difference from `fade_below`. It fades slowly on purpose: when it was
/// removed at once, flows that differed only by rounding soon differed by as much as `fade_below`.
const FADING: f32 = 0.125;
/// Rounds of factors. Factors that are linear between corners correct a hat only in part where the adjacent hats need the opposite; the
/// last round makes the sum of all hats right.
const ROUNDS: usize = 2;
/// Factors of hats, and the global factor of the density, that differ from 1 by less are rounding: still air must stay unchanged.
const ROUNDING: [f64; 2] = [2.0e-6, 1.0e-7];
/// Hats on an axis that a tile's mass may go to: those of the corners 8 cells before its first corner, at it, and 8 and 16 cells behind it.
const HATS: usize = 4;
/// Masses in the hats around a tile (in cells of density 1).
pub type Masses = [f32; HATS * HATS * HATS];

/// The mass (in cells of density 1) that each corner's hat should hold after advection; corners are indexed by the slot of the tile whose
/// first cell they bound.
///
/// # Errors
/// Cancel.
pub fn target_masses(ctx: &Context, paths: &Paths<'_>, density: &Field) -> Result<Vec<f64>> {
    let of_tile = |(slot, tile): (usize, &Tile)| {
        ctx.check()?;
        let ahead = paths.ahead.map(|field| &field[slot]);
        Ok(masses(tile, Some(&ahead), &paths.extents[slot][1]))
    };
    let masses: Result<Vec<Masses>> = density.par_iter().enumerate().with_min_len(16).map(of_tile).collect();
    Ok(hat_masses(paths.tiles, &masses?))
}

/// Scales the density by the remaining share, fades thin density and restores the mass that each hat should hold.
pub fn restore(tiles: &Tiles, density: &mut Field, wanted: &[f64], conservation: MassConservation) {
    let thin_out = |value: &mut f32| {
        let kept = *value * conservation.kept_share;
        *value = min(kept, max(kept - FADING * (conservation.fade_below - kept), 0.0));
    };
    density.par_iter_mut().with_min_len(64).for_each(|tile| tile.iter_mut().for_each(thin_out));
    let wanted: Vec<f64> = wanted.iter().map(|mass| mass * f64::from(conservation.kept_share)).collect();
    for _ in 0..ROUNDS {
        let held: Vec<Masses> =
            density.par_iter().with_min_len(16).map(|tile| masses(tile, None, &[[0.0; 2]; 3])).collect();
        let held = hat_masses(tiles, &held);
        multiply(tiles, density, &factors(tiles, wanted.clone(), &held));
    }
}

/// Multiplies a density by the factors of the corners.
fn multiply(tiles: &Tiles, density: &mut Field, factors: &[f32]) {
    density.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, tile)| {
        let near = &tiles.neighbours()[slot];
        let corner = |at: usize| {
            let offset = [at >> 2, at >> 1 & 1, at & 1].map(|x| x as i32);
            factors[near[neighbour_at(offset)] as usize]
        };
        let corners: [f32; 8] = std::array::from_fn(corner);
        if corners.iter().any(|factor| *factor != 1.0) {
            scale(tile, &corners);
        }
    });
}

/// The masses of a tile in the hats around it, along paths with this extent.
fn masses(tile: &Tile, ahead: Option<&[&Tile; 3]>, extent: &Extent) -> Masses {
    let holds = tile.iter().any(|value| *value != 0.0);
    if holds { masses_of(tile, ahead, extent) } else { [0.0; HATS * HATS * HATS] }
}

fn masses_of(tile: &Tile, ahead: Option<&[&Tile; 3]>, extent: &Extent) -> Masses {
    dispatch!(masses_of_rows(tile: &Tile, ahead: Option<&[&Tile; 3]>, extent: &Extent) -> Masses)
}

#[inline(always)]
fn masses_of_rows(tile: &Tile, ahead: Option<&[&Tile; 3]>, extent: &Extent) -> Masses {
    const CENTRES: Lanes = Lanes([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]);
    let zero = Lanes::all(0.0);
    // The hats that any cell reaches on each axis.
    let ranges = extent.map(|[min, max]| {
        let first = ((0.5 + min) / 8.0).floor() as i32 + 1;
        let end = ((7.5 + max) / 8.0).floor() as i32 + 3;
        first.clamp(0, 3) as usize..end.clamp(1, 4) as usize
    });
    let weights = |at: Lanes, range: &std::ops::Range<usize>| -> [Lanes; HATS] {
        let mut weights = [zero; HATS];
        for hat in range.clone() {
            let off = at * Lanes::all(0.125) - Lanes::all(hat as f32 - 1.0);
            weights[hat] = (Lanes::all(1.0) - off.max(zero - off)).max(zero);
        }
        weights
    };
    let of_row = |row: usize| {
        let density = Lanes(row_of(tile, row));
        let middle = [Lanes::all((row >> 3) as f32 + 0.5), Lanes::all((row & 7) as f32 + 0.5), CENTRES];
        let at = |axis: usize| match ahead {
            Some(ahead) => middle[axis] + Lanes(row_of(ahead[axis], row)),
            None => middle[axis],
        };
        let [x, y, z] = [0, 1, 2].map(|axis| weights(at(axis), &ranges[axis]));
        (x.map(|x| density * x), y, z)
    };
    let mut sums = [zero; HATS * HATS * HATS];
    for four in 0..16 {
        // A row and its mirror images, summed so that mirrored fields have mirrored results.
        let (x, y) = (four >> 2, four & 3);
        let rows = [[x, y], [7 - x, 7 - y], [x, 7 - y], [7 - x, y]].map(|[x, y]| x << 3 | y);
        if rows.iter().all(|row| row_of(tile, *row).iter().all(|value| *value == 0.0)) {
            continue;
        }
        let rows = rows.map(of_row);
        for i in ranges[0].clone() {
            for j in ranges[1].clone() {
                let lines = rows.each_ref().map(|(x, y, _)| x[i] * y[j]);
                for k in ranges[2].clone() {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|row| lines[row] * rows[row].2[k]);
                    let sum = &mut sums[(i * HATS + j) * HATS + k];
                    *sum = *sum + ((a + b) + (c + d));
                }
            }
        }
    }
    sums.map(|Lanes([a, b, c, d, e, f, g, h])| ((a + h) + (b + g)) + ((c + f) + (d + e)))
}

/// The mass in each corner's hat, from that of the active tiles around it.
fn hat_masses(tiles: &Tiles, masses: &[Masses]) -> Vec<f64> {
    let holds: Vec<bool> =
        masses.par_iter().with_min_len(64).map(|masses| masses.iter().any(|mass| *mass != 0.0)).collect();
    let neighbours = tiles.neighbours();
    let of_corner = |corner: usize| {
        let mut sum = 0.0;
        for hat in 0..HATS * HATS * HATS {
            // Offset of the tile that counts this corner's hat as number `hat`; a tile two away is reached through one adjacent to both.
            let off = [hat / (HATS * HATS), hat / HATS % HATS, hat % HATS].map(|hat| 1 - hat as i32);
            let first = off.map(|x| x.max(-1));
            let next = [0, 1, 2].map(|axis| off[axis] - first[axis]);
            let Some(beside) = neighbours.get(neighbours[corner][neighbour_at(first)] as usize) else {
                continue;
            };
            let slot = beside[neighbour_at(next)] as usize;
            if holds.get(slot) == Some(&true) {
                sum += f64::from(masses[slot][hat]);
            }
        }
        sum
    };
    (0..tiles.count()).into_par_iter().with_min_len(16).map(of_corner).collect()
}

/// The corners' factors, from the masses that their hats should hold and do hold.
fn factors(tiles: &Tiles, mut wanted: Vec<f64>, held: &[f64]) -> Vec<f32> {
    let around = |values: &[f64], corner: usize| -> f64 {
        let near = tiles.neighbours()[corner].iter();
        near.filter_map(|near| values.get(*near as usize)).sum()
    };
    for _ in 0..PASSES {
        let rest: Vec<f64> =
            wanted.iter().zip(held).map(|(wanted, held)| (wanted - MAX_GAIN * held).max(0.0)).collect();
        if rest.iter().all(|rest| *rest == 0.0) {
            break;
        }
        let each = |corner: usize| {
            let room = if rest[corner] > 0.0 { around(held, corner) } else { 0.0 };
            if room > 0.0 { rest[corner] / room } else { 0.0 }
        };
        let each: Vec<f64> = (0..wanted.len()).into_par_iter().with_min_len(64).map(each).collect();
        let next = |corner: usize| wanted[corner] - rest[corner] + held[corner] * around(&each, corner);
        wanted = (0..wanted.len()).into_par_iter().with_min_len(64).map(next).collect();
    }
    let factor = |(wanted, held): (&f64, &f64)| match *held > 0.0 {
        true => without_rounding(wanted / held, ROUNDING[0]).min(MAX_GAIN),
        false => 1.0,
    };
    let factors: Vec<f64> = wanted.iter().zip(held).map(factor).collect();
    let all: f64 = factors.iter().zip(held).map(|(factor, held)| factor * held).sum();
    let rest = without_rounding(wanted.iter().sum::<f64>() / all, ROUNDING[1]).min(MAX_GAIN);
    let rest = if rest.is_finite() { rest } else { 1.0 };
    factors.iter().map(|factor| (factor * rest) as f32).collect()
}

/// A factor, or 1 if it differs from 1 only by rounding.
fn without_rounding(factor: f64, rounding: f64) -> f64 {
    if (factor - 1.0).abs() > rounding { factor } else { 1.0 }
}

fn scale(tile: &mut Tile, corners: &[f32; 8]) {
    dispatch!(scale_rows(tile: &mut Tile, corners: &[f32; 8]))
}

/// Multiplies a tile's values by the factors of its corners, linear between them.
#[inline(always)]
fn scale_rows(tile: &mut Tile, corners: &[f32; 8]) {
    let share = |at: usize| (at as f32 + 0.5) / 8.0;
    let mix = |a: f32, b: f32, share: f32| a * (1.0 - share) + b * share;
    for row in 0..64 {
        let (x, y) = (share(row >> 3), share(row & 7));
        let line =
            |z: usize| mix(mix(corners[z], corners[4 + z], x), mix(corners[2 + z], corners[6 + z], x), y);
        let (low, high) = (line(0), line(1));
        for (z, value) in tile[row * 8..][..8].iter_mut().enumerate() {
            *value *= mix(low, high, share(z));
        }
    }
}
