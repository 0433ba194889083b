//! The air around the tiles: a second flow whose cells are four times as wide, over the same place and some way around it. It
//! gives the tiles the pressure and the velocity at their border, as if the air went on: a few tiles of padding do.
//!
//! Where both are, the fine velocity counts: its mean goes into the wide cells before their projection.

use rayon::prelude::*;

use super::Flow;
use super::multigrid::Operator;
use super::tiles::{Coord, FACES, Field, Tile, Tiles, padded};
use super::window::Window;

/// How many times wider the cells around are.
pub const WIDER: i32 = 4;
/// Tiles of wide cells around those that hold fine ones.
const PADDING: i32 = 1;

/// Sorted coordinates of the wide tiles around fine ones.
pub fn tiles_around(fine: &[Coord]) -> Vec<Coord> {
    let mut wide: Vec<Coord> = fine.iter().map(|coord| coord.map(|x| x.div_euclid(WIDER))).collect();
    wide.sort_unstable();
    wide.dedup();
    padded(&wide, PADDING)
}

/// The mean fine velocity, in the wide faces that fine faces of active cells cover.
pub fn restrict(fine: &Flow, wide: &mut Flow) {
    let (tiles, velocity) = (&fine.tiles, &fine.velocity);
    for axis in 0..3 {
        let means: Vec<[f32; 8]> =
            velocity[axis].par_iter().with_min_len(16).map(|tile| means_of(tile, axis)).collect();
        for (slot, means) in means.into_iter().enumerate() {
            let is_active = slot < tiles.active();
            let below = tiles.neighbours()[slot][FACES[2 * axis]] as usize;
            if !is_active && below >= tiles.active() {
                continue;
            }
            let coord = tiles.coords()[slot];
            let Some(parent) = wide.tiles.find(coord.map(|x| x.div_euclid(WIDER))) else { continue };
            let corner = coord.map(|x| x.rem_euclid(WIDER) as usize * 2);
            let tile = &mut wide.velocity[axis][parent as usize];
            for (index, mean) in means.into_iter().enumerate() {
                let at = [index >> 2, index >> 1 & 1, index & 1];
                // Of the rim, only the first faces bound active cells.
                if is_active || at[axis] == 0 {
                    tile[(corner[0] + at[0]) << 6 | (corner[1] + at[1]) << 3 | (corner[2] + at[2])] = mean;
                }
            }
        }
    }
}

/// Means over the faces of eight wide cells in a fine tile.
fn means_of(tile: &Tile, axis: usize) -> [f32; 8] {
    std::array::from_fn(|index| {
        let at = [index >> 2, index >> 1 & 1, index & 1].map(|x: usize| 4 * x);
        let mut sum = 0.0;
        for part in 0..16 {
            let [a, b] = [part >> 2, part & 3];
            let off = match axis {
                0 => [0, a, b],
                1 => [a, 0, b],
                _ => [a, b, 0],
            };
            sum += tile[(at[0] + off[0]) << 6 | (at[1] + off[1]) << 3 | (at[2] + off[2])];
        }
        sum / 16.0
    })
}

/// Values of a wide field at the faces on an axis, or at the centres, of a fine tile.
pub struct Reader<'a> {
    /// Tiles of the field.
    pub tiles: &'a Tiles,
    /// The field.
    pub field: &'a [Tile],
    /// The axis of the faces; none: centres.
    pub axis: Option<usize>,
    /// Its value outside all tiles.
    pub outside: f32,
}

impl Reader<'_> {
    /// Interpolates linearly at the places of a fine tile's values.
    pub fn read(&self, window: &mut Window, coord: Coord) -> Tile {
        let parent = coord.map(|x| x.div_euclid(WIDER));
        let mut out = [self.outside; 512];
        let Some(slot) = self.tiles.find(parent) else { return out };
        window.fill(self.field, &self.tiles.neighbours()[slot as usize], 1, self.outside);
        let wide = WIDER as f32;
        let at = |axis: usize, index: usize| {
            let within = (coord[axis].rem_euclid(WIDER) as usize * 8 + index) as f32;
            let half = if self.axis == Some(axis) { 0.0 } else { 0.5 };
            1.0 + (within + half) / wide - half
        };
        for (row, out) in out.chunks_exact_mut(8).enumerate() {
            let place = [[at(0, row >> 3); 8], [at(1, row & 7); 8], std::array::from_fn(|lane| at(2, lane))];
            out.copy_from_slice(&window.sample(&place));
        }
        out
    }
}

/// The wide pressure, with the mean of their neighbours in cells that take no part.
pub fn continued(operator: &Operator, pressure: &Field) -> Field {
    let takes_part =
        |slot: usize, cell: usize| operator.stencil(slot).is_none_or(|stencil| stencil.inverse[cell] > 0.0);
    let tiles = &operator.tiles;
    let mut out = pressure.clone();
    out[..tiles.active()].par_iter_mut().enumerate().for_each(|(slot, tile)| {
        if operator.stencil(slot).is_none() {
            return;
        }
        for cell in (0..512usize).filter(|cell| !takes_part(slot, *cell)) {
            let (mut sum, mut count) = (0.0, 0.0);
            for axis in 0..3 {
                for upper in [false, true] {
                    let (near, cell) = tiles.beside(slot, cell, axis, upper);
                    if (near as usize) < tiles.active() && takes_part(near as usize, cell) {
                        sum += pressure[near as usize][cell];
                        count += 1.0;
                    }
                }
            }
            tile[cell] = if count > 0.0 { sum / count } else { 0.0 };
        }
    });
    out
}
