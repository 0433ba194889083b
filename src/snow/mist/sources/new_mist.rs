//! Adds new mist to the air.

use rayon::prelude::*;

use super::Seed;
use crate::flow::{Coord, tiles};
use crate::snow::mist::Mist;

/// New mist in tiles: `of` returns the density and the velocity (m/s) of a cell.
pub fn seeds(tiles: &[Coord], of: impl Fn([i32; 3]) -> (f32, [f32; 3])) -> Vec<Seed> {
    let seed = |coord: &Coord| {
        let (mut density, mut velocity) = (Box::new([0.0; 512]), Box::new([[0.0; 512]; 3]));
        for cell in 0..512usize {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let (value, speed) = of([0, 1, 2].map(|axis| coord[axis] * 8 + at[axis] as i32));
            density[cell] = value;
            (0..3).for_each(|axis| velocity[axis][cell] = speed[axis]);
        }
        Seed { coord: *coord, density, velocity }
    };
    tiles.iter().map(seed).collect()
}

impl Mist {
    /// Adds new mist to air whose tiles exist: the larger density is kept, and the air takes on the new mist's velocity in proportion to
    /// how much of the cells the mist fills.
    pub(in crate::snow::mist) fn add_seeds(&mut self, seeds: &[Seed]) {
        let coords: Vec<Coord> = seeds.iter().map(|seed| seed.coord).collect();
        let (tiles, velocity, density) = self.flow.fields();
        let of = |slot: usize| {
            let coord = tiles.coords().get(slot)?;
            coords.binary_search(coord).ok().map(|index| &seeds[index])
        };
        for (axis, field) in velocity.iter_mut().enumerate() {
            field.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, speeds)| {
                let below = tiles.neighbours()[slot][tiles::FACES[2 * axis]] as usize;
                let (own, below) = (of(slot), of(below));
                if own.is_none() && below.is_none() {
                    return;
                }
                let step = 64 >> (3 * axis);
                let read = |seed: Option<&Seed>, cell: usize| {
                    seed.map_or((0.0, 0.0), |seed| (seed.density[cell], seed.velocity[axis][cell]))
                };
                for (cell, speed) in speeds.iter_mut().enumerate() {
                    let lower = match cell / step % 8 {
                        0 => read(below, cell + 7 * step),
                        _ => read(own, cell - step),
                    };
                    let upper = read(own, cell);
                    let sum = lower.0 + upper.0;
                    if sum > 0.0 {
                        let wanted = (lower.0 * lower.1 + upper.0 * upper.1) / sum;
                        *speed += (0.5 * sum).min(1.0) * (wanted - *speed);
                    }
                }
            });
        }
        density.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, tile)| {
            if let Some(seed) = of(slot) {
                tile.iter_mut().zip(seed.density.iter()).for_each(|(old, new)| *old = old.max(*new));
            }
        });
    }
}
