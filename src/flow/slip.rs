//! Velocities inside solids. A wall stops what flows through it, not what flows along it: faces just inside continue the flow
//! outside, so that values carried along a wall are not mixed with the solid's velocity (free slip).

use rayon::prelude::*;

use super::operator::Operator;
use super::solids::Solids;
use super::tiles::{Field, NONE, Tiles};

/// Layers of faces that continue the flow.
const LAYERS: usize = 2;

/// The faces of a tile whose velocity is known, on each axis: bit `y << 3 | z` of word `x`.
type Known = [[u64; 8]; 3];
/// All faces.
const ALL: Known = [[u64::MAX; 8]; 3];

/// Continues the velocity into solids.
pub fn extend(tiles: &Tiles, operator: &Operator, solids: &Solids, velocity: &mut [Field; 3]) {
    if solids.is_empty() {
        return;
    }
    let slots: Vec<usize> = (0..tiles.count()).filter(|slot| solids.faces(*slot).is_some()).collect();
    let mut index = vec![NONE; tiles.count()];
    slots.iter().zip(0u32..).for_each(|(slot, at)| index[*slot] = at);
    let mut known: Vec<Known> =
        slots.par_iter().map(|slot| known_of(tiles, operator, solids, *slot)).collect();
    for _ in 0..LAYERS {
        let is_known = |slot: u32, axis: usize, cell: usize| match index.get(slot as usize) {
            None => false,
            Some(&NONE) => true,
            Some(at) => known[*at as usize][axis][cell >> 6] >> (cell & 63) & 1 == 1,
        };
        let found: Vec<Vec<(usize, u16, f32)>> = slots
            .par_iter()
            .zip(&known)
            .map(|(&slot, own)| {
                let mut found = Vec::new();
                for axis in 0..3 {
                    if own[axis] == ALL[axis] {
                        continue;
                    }
                    for cell in (0..512usize).filter(|cell| own[axis][cell >> 6] >> (cell & 63) & 1 == 0) {
                        let (mut sums, mut count) = ([0.0f32; 3], 0);
                        for (across, sum) in sums.iter_mut().enumerate() {
                            let both = [false, true].map(|upper| {
                                let (near, cell) = tiles.beside(slot, cell, across, upper);
                                let known = is_known(near, axis, cell);
                                count += usize::from(known);
                                if known { velocity[axis][near as usize][cell] } else { 0.0 }
                            });
                            *sum = both[0] + both[1];
                        }
                        if count > 0 {
                            let mean = (sums[0] + sums[1] + sums[2]) / count as f32;
                            found.push((axis, cell as u16, mean));
                        }
                    }
                }
                found
            })
            .collect();
        for ((slot, known), found) in slots.iter().zip(&mut known).zip(found) {
            for (axis, cell, speed) in found {
                let cell = usize::from(cell);
                velocity[axis][*slot][cell] = speed;
                known[axis][cell >> 6] |= 1 << (cell & 63);
            }
        }
    }
}

/// The faces of a tile that bound a cell of the flow.
fn known_of(tiles: &Tiles, operator: &Operator, solids: &Solids, slot: usize) -> Known {
    let mut known = [[0; 8]; 3];
    let Some(faces) = solids.faces(slot) else { return ALL };
    let flows = |slot: u32, cell: usize| {
        (slot as usize) < tiles.active()
            && operator.stencil(slot as usize).is_none_or(|stencil| stencil.inverse[cell] > 0.0)
    };
    for (axis, known) in known.iter_mut().enumerate() {
        for cell in 0..512usize {
            let (below, lower) = tiles.beside(slot, cell, axis, false);
            let is_known = faces.open[axis][cell] > 0.0 || flows(slot as u32, cell) || flows(below, lower);
            known[cell >> 6] |= u64::from(is_known) << (cell & 63);
        }
    }
    known
}
