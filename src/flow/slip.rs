//! Velocities in and near solids, as advection reads them. A wall stops flow through it, not along it: faces just inside continue the
//! outside flow, so that values carried along a wall are not mixed with the solid's velocity (free slip). In gaps narrower than
//! half a cell, air moves more like the solid the narrower the gap is.

use rayon::prelude::*;

use super::pressure::operator::Operator;
use super::solids::Solids;
use super::tiles::{FACES, Field, NONE, Tile, Tiles};

/// Layers of faces into which the flow is extrapolated.
const LAYERS: usize = 2;
/// Minimum open fraction of a face for advection to read the air's own speed there.
const WIDE: f32 = 0.5;

/// The faces of a tile with known velocity, on each axis: bit `y << 3 | z` of word `x`.
type Known = [[u64; 8]; 3];
/// All faces.
const ALL: Known = [[u64::MAX; 8]; 3];

/// Brings the speed of air in narrow gaps closer to that of the solid: the less a face is open, the closer. The projection balances fluxes,
/// so where a twentieth of a face is open, the air is twenty times as fast as it would be with the same flux through an open face. Carried
/// to open faces at that speed, it would gain energy in every step.
pub fn slow_gaps(solids: &Solids, velocity: &mut [Field; 3]) {
    for (axis, field) in velocity.iter_mut().enumerate() {
        field.par_iter_mut().enumerate().with_min_len(64).for_each(|(slot, tile)| {
            let Some(faces) = solids.faces(slot) else { return };
            let faces = faces.open[axis].iter().zip(&faces.speed[axis]);
            for (speed, (open, solid)) in tile.iter_mut().zip(faces).filter(|(_, (open, _))| **open < WIDE) {
                *speed = solid + open / WIDE * (*speed - solid);
            }
        });
    }
}

/// Extrapolates the velocity into solids.
pub fn extend(tiles: &Tiles, operator: &Operator, solids: &Solids, velocity: &mut [Field; 3]) {
    if solids.is_empty() {
        return;
    }
    let slots: Vec<usize> = (0..tiles.count()).filter(|slot| solids.faces(*slot).is_some()).collect();
    let mut index = vec![NONE; tiles.count()];
    slots.iter().zip(0u32..).for_each(|(slot, at)| index[*slot] = at);
    let flow_cells: Vec<[u64; 8]> = (0..tiles.count())
        .into_par_iter()
        .with_min_len(16)
        .map(|slot| flow_cells(tiles, operator, slot))
        .collect();
    let mut known: Vec<Known> =
        slots.par_iter().map(|slot| known_of(tiles, &flow_cells, solids, *slot)).collect();
    for _ in 0..LAYERS {
        let of = |slot: u32, axis: usize| match index.get(slot as usize) {
            None => [0; 8],
            Some(&NONE) => [u64::MAX; 8],
            Some(at) => known[*at as usize][axis],
        };
        let found: Vec<Vec<(usize, u16, f32)>> = slots
            .par_iter()
            .zip(&known)
            .map(|(&slot, own)| {
                let mut found = Vec::new();
                for axis in 0..3 {
                    if own[axis] == [u64::MAX; 8] {
                        continue;
                    }
                    let six = FACES.map(|at| of(tiles.neighbours()[slot][at], axis));
                    let adjacent = adjacent(&own[axis], &six);
                    for cell in
                        (0..8).flat_map(|x| bits(adjacent[x] & !own[axis][x]).map(move |at| x << 6 | at))
                    {
                        let (mut sums, mut count) = ([0.0f32; 3], 0);
                        for (across, sum) in sums.iter_mut().enumerate() {
                            let mut both = [0.0; 2];
                            for (side, value) in both.iter_mut().enumerate() {
                                let (near, cell) = tiles.adjacent_cell(slot, cell, across, side == 1);
                                let mask =
                                    if near as usize == slot { &own[axis] } else { &six[2 * across + side] };
                                if mask[cell >> 6] >> (cell & 63) & 1 == 1 {
                                    *value = velocity[axis][near as usize][cell];
                                    count += 1;
                                }
                            }
                            *sum = both[0] + both[1];
                        }
                        let mean = (sums[0] + sums[1] + sums[2]) / count as f32;
                        found.push((axis, cell as u16, mean));
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

/// The positions of bits that are set.
fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = (mask != 0).then(|| mask.trailing_zeros() as usize)?;
        mask &= mask - 1;
        Some(at)
    })
}

/// The first cell of each row of a layer.
const FIRST: u64 = 0x0101_0101_0101_0101;
/// The first row of a layer.
const ROW: u64 = 0xff;

/// The positions adjacent to those of a mask, given the masks of the six adjacent tiles.
fn adjacent(own: &[u64; 8], [low_x, high_x, low_y, high_y, low_z, high_z]: &[[u64; 8]; 6]) -> [u64; 8] {
    std::array::from_fn(|x| {
        let left = if x > 0 { own[x - 1] } else { low_x[7] };
        let right = if x < 7 { own[x + 1] } else { high_x[0] };
        let down = own[x] << 8 | low_y[x] >> 56;
        let up = own[x] >> 8 | (high_y[x] & ROW) << 56;
        let back = own[x] << 1 & !FIRST | low_z[x] >> 7 & FIRST;
        let front = own[x] >> 1 & !(FIRST << 7) | (high_z[x] & FIRST) << 7;
        left | right | down | up | back | front
    })
}

/// The cells of a tile that belong to the flow: bit `y << 3 | z` of word `x`.
fn flow_cells(tiles: &Tiles, operator: &Operator, slot: usize) -> [u64; 8] {
    if slot >= tiles.active() {
        return [0; 8];
    }
    let Some(stencil) = operator.stencil(slot) else { return [u64::MAX; 8] };
    mask(&stencil.inverse)
}

/// The cells of a tile with a value above 0.
fn mask(tile: &Tile) -> [u64; 8] {
    std::array::from_fn(|x| {
        let layer = tile[64 * x..][..64].iter().enumerate();
        layer.fold(0, |mask, (at, value)| mask | u64::from(*value > 0.0) << at)
    })
}

/// The faces of a tile that bound a cell of the flow or are open.
fn known_of(tiles: &Tiles, flow_cells: &[[u64; 8]], solids: &Solids, slot: usize) -> Known {
    let Some(faces) = solids.faces(slot) else { return ALL };
    let own = &flow_cells[slot];
    [0, 1, 2].map(|axis| {
        let open = mask(&faces.open[axis]);
        let below = tiles.neighbours()[slot][FACES[2 * axis]] as usize;
        let below = flow_cells.get(below).unwrap_or(&[0; 8]);
        std::array::from_fn(|x| {
            let lower = match axis {
                0 if x > 0 => own[x - 1],
                0 => below[7],
                1 => own[x] << 8 | below[x] >> 56,
                _ => own[x] << 1 & !FIRST | below[x] >> 7 & FIRST,
            };
            open[x] | own[x] | lower
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjacent_positions_have_a_neighbour_in_the_mask() {
        let tiles = Tiles::new(&[[0, 0, 0]]);
        let near = tiles.neighbours()[0];
        let mut state = 1u64;
        // One bit in sixteen is set.
        let mut word = || {
            (0..4).fold(u64::MAX, |word, _| {
                state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
                word & (state ^ state >> 32)
            })
        };
        for _ in 0..100 {
            let (own, six): ([u64; 8], [[u64; 8]; 6]) =
                (std::array::from_fn(|_| word()), std::array::from_fn(|_| std::array::from_fn(|_| word())));
            let found = adjacent(&own, &six);
            for cell in 0..512usize {
                let wanted = (0..6).any(|face| {
                    let (slot, at) = tiles.adjacent_cell(0, cell, face / 2, face % 2 == 1);
                    let mask = if slot == 0 { &own } else { &six[face] };
                    assert!(slot == 0 || slot == near[FACES[face]]);
                    mask[at >> 6] >> (at & 63) & 1 == 1
                });
                assert_eq!(found[cell >> 6] >> (cell & 63) & 1 == 1, wanted, "{cell}");
            }
        }
    }
}
