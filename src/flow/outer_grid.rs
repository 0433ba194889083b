//! The air around the tiles: a flow with cells twice as wide, which covers the same region and a margin around it, with another such flow
//! around it, and so on. It provides the pressure and the velocity at the border of the tiles, as if the air continued: one tile of padding
//! is enough.
//!
//! Where both exist, the fine velocity takes precedence: its mean is written into the coarse cells before their projection.

use rayon::prelude::*;

use super::Flow;
use super::pressure::operator::Operator;
use super::tiles::{Coord, FACES, Field, Tile, Tiles, padded};
use super::window::{Span, Window};
use crate::numeric::cpu::dispatch;

/// Ratio of the cell width of a surrounding flow to that of the flow inside it.
pub const RATIO: i32 = 2;
/// Number of surrounding flows, one around the other.
pub const LEVELS: u32 = 3;
/// Width (coarse tiles) of the border around the coarse tiles that cover fine ones.
const PADDING: i32 = 1;

/// Sorted coordinates of the coarse tiles around fine ones.
pub fn tiles_around(fine: &[Coord]) -> Vec<Coord> {
    let mut coarse: Vec<Coord> = fine.iter().map(|coord| coord.map(|x| x.div_euclid(RATIO))).collect();
    coarse.sort_unstable();
    coarse.dedup();
    padded(&coarse, PADDING)
}

/// Coarse cells along the edge of a fine tile.
const COARSE_EDGE: usize = 8 / RATIO as usize;
/// Coarse cells in a fine tile.
const COARSE_CELLS: usize = COARSE_EDGE * COARSE_EDGE * COARSE_EDGE;

/// Writes the mean fine velocity into the coarse faces that fine faces of active cells cover.
pub fn restrict(fine: &Flow, coarse: &mut Flow) {
    let (tiles, velocity) = (&fine.tiles, &fine.velocity);
    for axis in 0..3 {
        let means: Vec<[f32; COARSE_CELLS]> =
            velocity[axis].par_iter().with_min_len(16).map(|tile| means_of(tile, axis)).collect();
        for (slot, means) in means.into_iter().enumerate() {
            let is_active = slot < tiles.active();
            let below = tiles.neighbours()[slot][FACES[2 * axis]] as usize;
            if !is_active && below >= tiles.active() {
                continue;
            }
            let coord = tiles.coords()[slot];
            let Some(parent) = coarse.tiles.find(coord.map(|x| x.div_euclid(RATIO))) else { continue };
            let corner = coord.map(|x| x.rem_euclid(RATIO) as usize * COARSE_EDGE);
            let tile = &mut coarse.velocity[axis][parent as usize];
            for (index, mean) in means.into_iter().enumerate() {
                let at = position_of(index);
                // In the rim only the first faces bound active cells.
                if is_active || at[axis] == 0 {
                    tile[(corner[0] + at[0]) << 6 | (corner[1] + at[1]) << 3 | (corner[2] + at[2])] = mean;
                }
            }
        }
    }
}

/// Position of a coarse cell in a fine tile, from its index.
fn position_of(index: usize) -> [usize; 3] {
    [index / (COARSE_EDGE * COARSE_EDGE), index / COARSE_EDGE % COARSE_EDGE, index % COARSE_EDGE]
}

/// Means over the faces of the coarse cells in a fine tile.
fn means_of(tile: &Tile, axis: usize) -> [f32; COARSE_CELLS] {
    std::array::from_fn(|index| {
        let at = position_of(index).map(|x| RATIO as usize * x);
        let face = |a: usize, b: usize| {
            let [x, y, z] = match axis {
                0 => [0, a, b],
                1 => [a, 0, b],
                _ => [a, b, 0],
            };
            tile[(at[0] + x) << 6 | (at[1] + y) << 3 | (at[2] + z)]
        };
        // Summed so that mirrored fields have mirrored results.
        0.25 * ((face(0, 0) + face(1, 1)) + (face(0, 1) + face(1, 0)))
    })
}

/// Values of a coarse field at the faces on an axis, or at the centres, of a fine tile.
pub struct Reader<'a> {
    /// Tiles of the field.
    pub tiles: &'a Tiles,
    /// The field.
    pub field: &'a [Tile],
    /// The axis of the faces; none: centres.
    pub axis: Option<usize>,
    /// Value outside all tiles.
    pub outside: f32,
}

/// Coarse cells on an axis that the interpolation of a fine tile reads: those that the tile covers and one on each side.
const READ: usize = COARSE_EDGE + 2;

/// For each of eight fine positions on an axis: the first of the two coarse cells that are read, as an index among the [`READ`] cells,
/// and the weight of the second.
type Weights = [(usize, f32); 8];

/// Weights of linear interpolation; `is_centre`: values are at the centres on this axis.
fn weights(is_centre: bool) -> Weights {
    let half = if is_centre { 0.5 } else { 0.0 };
    std::array::from_fn(|fine| {
        let at = (fine as f32 + half) / RATIO as f32 - half + 1.0;
        (at as usize, at - at.floor())
    })
}

impl Reader<'_> {
    /// Interpolates at the positions of a fine tile's values.
    pub fn read(&self, window: &mut Window, coord: Coord) -> Tile {
        let parent = coord.map(|x| x.div_euclid(RATIO));
        let mut out = [self.outside; 512];
        let Some(slot) = self.tiles.find(parent) else { return out };
        let corner = coord.map(|x| x.rem_euclid(RATIO) * COARSE_EDGE as i32 - 1);
        let span = Span::new(corner, corner.map(|x| x + READ as i32));
        window.fill(self.field, &self.tiles.neighbours()[slot as usize], &span, self.outside);
        let weights = [0, 1, 2].map(|axis| weights(self.axis != Some(axis)));
        interpolate(window, corner, &weights, &mut out);
        out
    }
}

fn interpolate(window: &Window, corner: [i32; 3], weights: &[Weights; 3], out: &mut Tile) {
    dispatch!(interpolate_rows(window: &Window, corner: [i32; 3], weights: &[Weights; 3], out: &mut Tile))
}

/// Along z, then y, then x.
#[inline(always)]
fn interpolate_rows(window: &Window, corner: [i32; 3], weights: &[Weights; 3], out: &mut Tile) {
    let mix = |a: &[f32; 8], b: &[f32; 8], share: f32| -> [f32; 8] {
        std::array::from_fn(|lane| (1.0 - share) * a[lane] + share * b[lane])
    };
    let mut lines = [[[0.0f32; 8]; READ]; READ];
    for (x, lines) in lines.iter_mut().enumerate() {
        for (y, line) in lines.iter_mut().enumerate() {
            let [x, y] = [corner[0] + x as i32, corner[1] + y as i32];
            let values: [f32; READ] = std::array::from_fn(|z| window.at(x, y, corner[2] + z as i32));
            for (to, (first, share)) in line.iter_mut().zip(&weights[2]) {
                *to = (1.0 - share) * values[*first] + share * values[first + 1];
            }
        }
    }
    let mut planes = [[[0.0f32; 8]; 8]; READ];
    for (lines, plane) in lines.iter().zip(&mut planes) {
        for (row, (first, share)) in plane.iter_mut().zip(&weights[1]) {
            *row = mix(&lines[*first], &lines[first + 1], *share);
        }
    }
    for (row, out) in out.chunks_exact_mut(8).enumerate() {
        let (first, share) = weights[0][row >> 3];
        out.copy_from_slice(&mix(&planes[first][row & 7], &planes[first + 1][row & 7], share));
    }
}

/// The coarse pressure, extrapolated into covered cells: these get the mean of their neighbours.
pub fn extrapolated(operator: &Operator, pressure: &Field) -> Field {
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
                    let (near, cell) = tiles.adjacent_cell(slot, cell, axis, upper);
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
