//! Values of a tile and of the cells around it, copied together so that kernels read them without neighbour lookups.

use super::tiles::Tile;
use crate::numeric::lanes::Lanes;

/// Maximum number of cells around a tile: five for the displacement and two for cubic interpolation.
pub const MAX_MARGIN: i32 = 7;
/// Layers, and rows of a layer: 8 + 2 x 7.
const SIDE: usize = 22;
/// Values of a row: the whole rows of three tiles (the tile, and those before and behind it), which are the fastest to copy.
const ROW: usize = 24;
/// Values of a layer.
const LAYER: usize = SIDE * ROW;
/// Index of the tile's first cell.
const FIRST_CELL: usize = MAX_MARGIN as usize * (LAYER + ROW) + 8;
/// Mask that keeps an index in bounds.
const MASK: usize = 16383;
/// Length of the buffer: a masked index, plus the three layers, rows and values that cubic interpolation reads beyond it.
const LENGTH: usize = MASK + 1 + 3 * (LAYER + ROW) + 8;
/// Tolerance (cells) for rounding in the sum of a cell's position and a displacement.
const ROUNDING: f32 = 1.0e-4;

/// Cells that a window covers on each axis, relative to the tile's first cell: from `low` up to `high`, exclusive.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    low: [i32; 3],
    high: [i32; 3],
}

impl Span {
    /// A tile and `margin` cells (up to [`MAX_MARGIN`]) around it.
    pub fn around(margin: i32) -> Self {
        debug_assert!((0..=MAX_MARGIN).contains(&margin));
        Self { low: [-margin; 3], high: [8 + margin; 3] }
    }

    /// Cells from `low` up to `high`, exclusive.
    pub fn new(low: [i32; 3], high: [i32; 3]) -> Self {
        Self { low, high }
    }

    /// Cells that interpolation reads for the first `cells` cells of a tile on each axis, displaced by `displacements` (cells): the
    /// minimum and maximum displacement on each axis.
    pub fn moved(cells: [i32; 3], displacements: &[[f32; 2]; 3]) -> Self {
        let low = displacements.map(|[low, _]| ((low - ROUNDING).floor() as i32).max(-MAX_MARGIN));
        let high = [0, 1, 2].map(|axis| {
            let high = (displacements[axis][1] + ROUNDING).floor() as i32;
            (cells[axis] + high + 1).min(8 + MAX_MARGIN)
        });
        Self { low, high }
    }

    /// Cells that cubic interpolation reads where linear interpolation reads these.
    pub fn for_cubic(self) -> Self {
        Self {
            low: self.low.map(|low| (low - 1).max(-MAX_MARGIN)),
            high: self.high.map(|high| (high + 1).min(8 + MAX_MARGIN)),
        }
    }
}

/// A tile and cells around it.
pub struct Window {
    values: Box<[f32; LENGTH]>,
}

impl Default for Window {
    fn default() -> Self {
        Self { values: Box::new([0.0; LENGTH]) }
    }
}

impl Window {
    /// Copies a tile and its surroundings; `outside` is the value where there are no tiles.
    pub fn fill(&mut self, field: &[Tile], neighbours: &[u32; 27], span: &Span, outside: f32) {
        for part in 0..27 {
            let tile = [part / 9, part / 3 % 3, part % 3];
            // On each axis, the cells of this tile that the window covers.
            let low = [0, 1, 2].map(|axis| span.low[axis].max(8 * tile[axis] as i32 - 8));
            let high = [0, 1, 2].map(|axis| span.high[axis].min(8 * tile[axis] as i32));
            if (0..3).any(|axis| low[axis] >= high[axis]) {
                continue;
            }
            let from = field.get(neighbours[part] as usize);
            for x in low[0]..high[0] {
                let layer = (x + MAX_MARGIN) as usize * LAYER + 8 * tile[2];
                for y in low[1]..high[1] {
                    let to = &mut self.values[layer + (y + MAX_MARGIN) as usize * ROW..][..8];
                    let at = ((x & 7) << 6 | (y & 7) << 3) as usize;
                    match from {
                        Some(tile) => to.copy_from_slice(&tile[at..at + 8]),
                        None => to.fill(outside),
                    }
                }
            }
        }
    }

    /// The value of a cell given relative to the tile's first cell; each coordinate is at least -7.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32, z: i32) -> f32 {
        let index = (x + MAX_MARGIN) as usize * LAYER + (y + MAX_MARGIN) as usize * ROW + (z + 8) as usize;
        self.values[index & MASK]
    }

    /// The values of eight cells along z, from a cell relative to the tile's first cell.
    #[inline(always)]
    pub fn row(&self, x: usize, y: usize, z: usize) -> Lanes {
        self.lanes((FIRST_CELL + x * LAYER + y * ROW + z) & MASK)
    }

    #[inline(always)]
    fn lanes(&self, index: usize) -> Lanes {
        Lanes(std::array::from_fn(|lane| self.values[index + lane]))
    }

    #[inline(always)]
    fn pair(&self, index: usize) -> &[f32; 2] {
        self.values[index..].first_chunk().unwrap_or(&[0.0; 2])
    }

    /// Trilinear interpolation at the positions of a row's cells, displaced (cells).
    #[inline(always)]
    pub fn sample(&self, row: usize, displacements: &[Lanes; 3]) -> Lanes {
        let (corners, weights) = self.corners(row, displacements, None);
        interpolate(&corners, &weights)
    }

    /// The same, half a cell further on an axis.
    #[inline(always)]
    pub fn sample_between(&self, row: usize, displacements: &[Lanes; 3], axis: usize) -> Lanes {
        let (corners, weights) = self.corners(row, displacements, Some(axis));
        interpolate(&corners, &weights)
    }

    /// Trilinear interpolation, with the minimum and maximum of the eight values around each position.
    #[inline(always)]
    pub fn sample_bounded(&self, row: usize, displacements: &[Lanes; 3]) -> [Lanes; 3] {
        let (corners, weights) = self.corners(row, displacements, None);
        let [a, b, c, d, e, f, g, h] = corners;
        let low = (a.min(b).min(c.min(d))).min(e.min(f).min(g.min(h)));
        let high = (a.max(b).max(c.max(d))).max(e.max(f).max(g.max(h)));
        [interpolate(&corners, &weights), low, high]
    }

    /// Cubic interpolation (Lagrange, of the 4 x 4 x 4 values around) at the positions of a row's cells, displaced (cells), with the
    /// minimum and maximum of the eight values around each position.
    #[inline(always)]
    pub fn sample_cubic(&self, row: usize, displacements: &[Lanes; 3]) -> [Lanes; 3] {
        let (base, weights) = cell(row, displacements, None, LAYER + ROW + 1);
        let [x, y, z] = weights.map(lagrange);
        let (mut low, mut high) = (Lanes::all(f32::INFINITY), Lanes::all(f32::NEG_INFINITY));
        let mut layers = [Lanes::all(0.0); 4];
        for layer in 0..4 {
            let mut lines = layers;
            for line in 0..4 {
                let shift = layer * LAYER + line * ROW;
                let [[a, b], [c, d]] = [shift, shift + 2].map(|shift| self.pairs(&base, shift));
                if (1..3).contains(&layer) && (1..3).contains(&line) {
                    low = low.min(b.min(c));
                    high = high.max(b.max(c));
                }
                lines[line] = combined([a, b, c, d], &z);
            }
            layers[layer] = combined(lines, &y);
        }
        [combined(layers, &x), low, high]
    }

    /// The values at the eight corners of the cells that contain the positions, and the corners' weights.
    #[inline(always)]
    fn corners(
        &self,
        row: usize,
        displacements: &[Lanes; 3],
        between: Option<usize>,
    ) -> ([Lanes; 8], Weights) {
        let (base, weights) = cell(row, displacements, between, 0);
        let mut corners = [Lanes::all(0.0); 8];
        for pair in 0..4 {
            let shift = (pair >> 1) * LAYER + (pair & 1) * ROW;
            corners[2 * pair..][..2].copy_from_slice(&self.pairs(&base, shift));
        }
        (corners, weights)
    }

    /// For each lane the value at an index, and the next one.
    #[inline(always)]
    fn pairs(&self, base: &[usize; 8], shift: usize) -> [Lanes; 2] {
        let at = |lane: usize| self.pair(base[lane] + shift);
        Lanes::pairs([at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)])
    }
}

/// The indices of the first corners of the cells that contain the positions, minus `before`, and the weights of the lower and upper
/// corners. Mirrored positions have bitwise mirrored weights.
#[inline(always)]
fn cell(
    row: usize,
    displacements: &[Lanes; 3],
    between: Option<usize>,
    before: usize,
) -> ([usize; 8], Weights) {
    let (zero, one, half) = (Lanes::all(0.0), Lanes::all(1.0), Lanes::all(0.5));
    let (mut whole, mut weights) = ([zero; 3], [[zero; 2]; 3]);
    for axis in 0..3 {
        let at = displacements[axis];
        let nearest = (at + Lanes::all(WHOLE)) - Lanes::all(WHOLE);
        if between == Some(axis) {
            whole[axis] = nearest;
            weights[axis] = [half - (at - nearest), half + (at - nearest)];
        } else {
            let down = nearest - at.is_less(nearest).choose(one, zero);
            whole[axis] = down;
            weights[axis] = [(down + one) - at, at - down];
        }
    }
    let first = WHOLE + (FIRST_CELL + (row >> 3) * LAYER + (row & 7) * ROW - before) as f32;
    // Integers: the sum is exact, and its low bits are the index.
    let index = whole[0] * Lanes::all(LAYER as f32) + whole[1] * Lanes::all(ROW as f32) + whole[2];
    ((index + (Lanes::all(first) + STEPS)).0.map(|index| index.to_bits() as usize & MASK), weights)
}

/// Weights of four consecutive values for a position between the middle two, from the linear weights of the middle two.
#[inline(always)]
fn lagrange([low, high]: [Lanes; 2]) -> [Lanes; 4] {
    let one = Lanes::all(1.0);
    let outer = Lanes::all(-1.0 / 6.0) * (low * high);
    let inner = Lanes::all(0.5) * ((one + low) * (one + high));
    [outer * (one + low), inner * low, inner * high, outer * (one + high)]
}

/// Mirrored values with mirrored weights have bitwise the same result.
#[inline(always)]
fn combined([a, b, c, d]: [Lanes; 4], weights: &[Lanes; 4]) -> Lanes {
    (a * weights[0] + d * weights[3]) + (b * weights[1] + c * weights[2])
}

/// 1.5 x 2^23: adding it to a small number rounds that number to an integer, in the low bits of the sum.
const WHOLE: f32 = 12_582_912.0;
/// The indices of the lanes.
const STEPS: Lanes = Lanes([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Weights of the lower and the upper corners on each axis.
type Weights = [[Lanes; 2]; 3];

/// Mirrored corners with mirrored weights have bitwise the same result.
#[inline(always)]
fn interpolate(corners: &[Lanes; 8], [x, y, z]: &Weights) -> Lanes {
    let mix = |a: Lanes, b: Lanes, [low, high]: &[Lanes; 2]| a * *low + b * *high;
    let [a, b, c, d, e, f, g, h] = *corners;
    let low = mix(mix(a, b, z), mix(c, d, z), y);
    let high = mix(mix(e, f, z), mix(g, h, z), y);
    mix(low, high, x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tiles::{Coord, Tiles, padded};

    #[test]
    fn a_linear_field_is_interpolated_exactly() {
        let tiles = Tiles::new(&padded(&[[0, 0, 0]], 1));
        let field_of = |value: &dyn Fn(f32, f32, f32) -> f32| -> Vec<Tile> {
            let tile = |coord: &Coord| {
                std::array::from_fn(|at| {
                    let cell = [at >> 6, at >> 3 & 7, at & 7];
                    let [x, y, z] = [0, 1, 2].map(|axis| (coord[axis] * 8 + cell[axis] as i32) as f32);
                    value(x, y, z)
                })
            };
            tiles.coords().iter().map(tile).collect()
        };
        let field = field_of(&|x, y, z| x + 2.0 * y - 3.0 * z);
        let middle = tiles.find([0, 0, 0]).unwrap() as usize;
        let fill = |span: Span| {
            // Values that a window does not cover must not be read.
            let mut window = Window::default();
            window.values.fill(f32::NAN);
            window.fill(&field, &tiles.neighbours()[middle], &span, 0.0);
            window
        };
        for margin in 1..=MAX_MARGIN {
            let window = fill(Span::around(margin));
            assert_eq!(window.at(-1, 3, 8), -1.0 + 6.0 - 24.0);
            assert_eq!(window.row(1, 2, 1).0[7], 5.0 - 24.0);
            // Row 42 begins at (5, 2, 0).
            let displacements = [0.25, 0.5, -0.75].map(Lanes::all);
            let value = window.sample(42, &displacements).0[3];
            assert!((value - (5.25 + 5.0 - 6.75)).abs() < 1e-5, "{margin}: {value}");
            let far = margin as f32;
            let value = window.sample(7, &[-far, far - 0.25, 0.0].map(Lanes::all)).0[0];
            assert!((value - (13.5 + far)).abs() < 1e-5, "{margin}: {value}");
            let [_, low, high] = window.sample_bounded(42, &displacements).map(|values| values.0[3]);
            assert_eq!((low, high), (0.0, 6.0));
        }
        // Cubic interpolation is exact for cubic functions, up to five cells away.
        let cube = |x: f32, y: f32, z: f32| 0.01 * x * x * x + 0.1 * x * y - 0.2 * y * y * z + z;
        let cubic = field_of(&cube);
        for displacements in [[-4.9f32, 4.9, 0.3], [0.25, -0.5, -4.75], [0.0, 1.0, 2.5]] {
            let mut window = Window::default();
            window.values.fill(f32::NAN);
            let span = Span::moved([8; 3], &displacements.map(|x| [x, x])).for_cubic();
            window.fill(&cubic, &tiles.neighbours()[middle], &span, 0.0);
            for (row, lane) in [(0usize, 0usize), (63, 7), (42, 3)] {
                let [value, low, high] =
                    window.sample_cubic(row, &displacements.map(Lanes::all)).map(|values| values.0[lane]);
                let wanted = cube(
                    (row >> 3) as f32 + displacements[0],
                    (row & 7) as f32 + displacements[1],
                    lane as f32 + displacements[2],
                );
                assert!(
                    (value - wanted).abs() < 1e-3 * (1.0 + wanted.abs()),
                    "{displacements:?} {value} {wanted}"
                );
                assert!(low <= high && low.is_finite());
            }
        }
        // Only the cells that paths reach are covered, up to the last cell.
        let extent = [[-4.3, -3.7], [1.0, 1.0], [-0.2, 4.9]];
        let window = fill(Span::moved([8; 3], &extent));
        for (row, lane, displacements) in [(0, 0, [-4.3, 1.0, -0.2]), (63, 7, [-3.7, 1.0, 4.9])] {
            let value = window.sample(row, &displacements.map(Lanes::all)).0[lane];
            let [x, y, z] = displacements;
            let cell = (row >> 3) as f32 + 2.0 * (row & 7) as f32 - 3.0 * lane as f32;
            assert!((value - (cell + x + 2.0 * y - 3.0 * z)).abs() < 1e-5, "{value}");
        }
    }
}
