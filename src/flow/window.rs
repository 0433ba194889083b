//! Values of a tile and of cells around it, copied together so that kernels read them without asking for neighbours.

use super::tiles::Tile;

/// Most cells around a tile: a displacement of five cells, and one for interpolation.
pub const MOST: usize = 6;
/// Room for the values, a power of two so that a masked index is in bounds: (8 + 2 x 6)^3 are 8000.
const ROOM: usize = 8192;

/// A cube of values: a tile and `margin` cells on each side.
pub struct Window {
    values: Box<[f32; ROOM]>,
    margin: usize,
    size: usize,
}

impl Default for Window {
    fn default() -> Self {
        Self { values: Box::new([0.0; ROOM]), margin: 0, size: 8 }
    }
}

impl Window {
    /// Copies a tile's surroundings; `outside` where there are no tiles.
    pub fn fill(&mut self, field: &[Tile], neighbours: &[u32; 27], margin: usize, outside: f32) {
        debug_assert!((1..=MOST).contains(&margin));
        (self.margin, self.size) = (margin, 8 + 2 * margin);
        let (low, size) = (8 - margin, self.size);
        for x in 0..size {
            let (tile_x, in_x) = ((low + x) / 8, (low + x) % 8);
            for y in 0..size {
                let (tile_y, in_y) = ((low + y) / 8, (low + y) % 8);
                let near = &neighbours[tile_x * 9 + tile_y * 3..][..3];
                let row = &mut self.values[(x * size + y) * size..][..size];
                let at = in_x << 6 | in_y << 3;
                let [before, own, after] = [near[0], near[1], near[2]].map(|near| field.get(near as usize));
                let (first, rest) = row.split_at_mut(margin);
                let (middle, last) = rest.split_at_mut(8);
                for (z, to) in first.iter_mut().enumerate() {
                    *to = before.map_or(outside, |tile| tile[at + low + z]);
                }
                match own {
                    Some(tile) => middle.copy_from_slice(&tile[at..at + 8]),
                    None => middle.fill(outside),
                }
                for (z, to) in last.iter_mut().enumerate() {
                    *to = after.map_or(outside, |tile| tile[at + z]);
                }
            }
        }
    }

    /// Whether all values are 0.
    pub fn is_zero(&self) -> bool {
        self.values[..self.size.pow(3)].iter().all(|value| *value == 0.0)
    }

    /// Cells around the tile.
    pub fn margin(&self) -> usize {
        self.margin
    }

    /// The value at a place whose coordinates are non-negative integers (cells from the window's corner).
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize, z: usize) -> f32 {
        self.values[((x * self.size + y) * self.size + z) & (ROOM - 1)]
    }

    /// Trilinear interpolation at eight places (cells from the window's corner).
    #[inline(always)]
    pub fn sample(&self, place: &[[f32; 8]; 3]) -> [f32; 8] {
        let (corners, weights) = self.corners(place);
        interpolate(&corners, &weights)
    }

    /// The same, with the least and the greatest of the eight values around each place.
    #[inline(always)]
    pub fn sample_bounded(&self, place: &[[f32; 8]; 3]) -> [[f32; 8]; 3] {
        let (corners, weights) = self.corners(place);
        let mut bounds = [corners[0]; 2];
        for corner in &corners[1..] {
            for lane in 0..8 {
                bounds[0][lane] = min(bounds[0][lane], corner[lane]);
                bounds[1][lane] = max(bounds[1][lane], corner[lane]);
            }
        }
        [interpolate(&corners, &weights), bounds[0], bounds[1]]
    }

    /// The values at the eight corners of the cells of places, and the places' weights in them.
    #[inline(always)]
    fn corners(&self, place: &[[f32; 8]; 3]) -> ([[f32; 8]; 8], [[f32; 8]; 3]) {
        let size = self.size;
        let (most, last) = ((size - 1) as f32, size as i32 - 2);
        let (mut base, mut weights) = ([0u32; 8], [[0.0f32; 8]; 3]);
        for axis in 0..3 {
            for lane in 0..8 {
                let at = max(min(place[axis][lane], most), 0.0);
                let whole = if at as i32 > last { last } else { at as i32 };
                weights[axis][lane] = at - whole as f32;
                base[lane] = base[lane] * size as u32 + whole as u32;
            }
        }
        let mut corners = [[0.0f32; 8]; 8];
        for (index, corner) in corners.iter_mut().enumerate() {
            let shift = ((index >> 2) * size + (index >> 1 & 1)) * size + (index & 1);
            for lane in 0..8 {
                corner[lane] = self.values[(base[lane] as usize + shift) & (ROOM - 1)];
            }
        }
        (corners, weights)
    }
}

#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn interpolate(corners: &[[f32; 8]; 8], [x, y, z]: &[[f32; 8]; 3]) -> [f32; 8] {
    let mut out = [0.0; 8];
    for lane in 0..8 {
        let c = |index: usize| corners[index][lane];
        let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
        let low = mix(mix(c(0), c(1), z[lane]), mix(c(2), c(3), z[lane]), y[lane]);
        let high = mix(mix(c(4), c(5), z[lane]), mix(c(6), c(7), z[lane]), y[lane]);
        out[lane] = mix(low, high, x[lane]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tiles::{Tiles, padded};

    #[test]
    fn a_linear_field_is_interpolated_exactly() {
        let tiles = Tiles::new(&padded(&[[0, 0, 0]], 1));
        let field: Vec<Tile> = tiles
            .coords()
            .iter()
            .map(|coord| {
                std::array::from_fn(|at| {
                    let cell = [at >> 6, at >> 3 & 7, at & 7];
                    let [x, y, z] = [0, 1, 2].map(|axis| (coord[axis] * 8 + cell[axis] as i32) as f32);
                    x + 2.0 * y - 3.0 * z
                })
            })
            .collect();
        let mut window = Window::default();
        for margin in 1..=MOST {
            let middle = tiles.find([0, 0, 0]).unwrap() as usize;
            window.fill(&field, &tiles.neighbours()[middle], margin, 0.0);
            let from = margin as f32;
            let place = [[from + 0.25; 8], [from + 7.5; 8], [from - 0.75; 8]];
            let far = window.sample(&[[from + 7.75; 8], [from; 8], [from; 8]])[0];
            assert!((far - 7.75).abs() < 1e-5, "{margin}: {far}");
            let value = window.sample(&place)[3];
            assert!((value - (0.25 + 15.0 + 2.25)).abs() < 1e-5, "{margin}: {value}");
            let [_, low, high] = window.sample_bounded(&place).map(|values| values[0]);
            assert_eq!((low, high), (14.0, 20.0));
        }
    }
}
