//! The discrete Laplace operator of a tile: L x = sum over the six faces of open (x - neighbour), 0 outside all tiles.

use super::tiles::Tile;
use crate::base::blocks::Mask;
use crate::base::cpu::dispatch;

/// Coefficients of a tile with faces that are not fully open, or with cells that do not take part.
#[derive(Debug, Clone)]
pub struct Stencil {
    /// Open share of the lower faces on each axis.
    pub lower: [Tile; 3],
    /// Open share of the tile's own upper faces on each axis, as layers of 8 x 8: (y, z), (x, z), (x, y).
    pub upper: [[f32; 64]; 3],
    /// Inverse of the sum of each cell's open shares; 0: the cell does not take part.
    pub inverse: Tile,
    /// Cells where the pressure is 0, of levels whose tiles reach beyond the active ones: bit `y << 3 | z` of word `x`.
    pub outside: Mask,
}

impl Stencil {
    /// All faces open.
    pub fn open() -> Self {
        Self { lower: [[1.0; 512]; 3], upper: [[1.0; 64]; 3], inverse: [1.0 / 6.0; 512], outside: [0; 8] }
    }

    /// Open shares of the lower and the upper faces of a row's cells, on each axis.
    #[inline(always)]
    pub fn faces(&self, row: usize) -> [[[f32; 8]; 2]; 3] {
        let (x, y) = (row >> 3, row & 7);
        let lower = self.lower.each_ref().map(|tile| row_of(tile, row));
        let upper_x = if x < 7 { row_of(&self.lower[0], row + 8) } else { layer_of(&self.upper[0], y) };
        let upper_y = if y < 7 { row_of(&self.lower[1], row + 1) } else { layer_of(&self.upper[1], x) };
        let mut upper_z = [0.0; 8];
        upper_z[..7].copy_from_slice(&lower[2][1..]);
        upper_z[7] = self.upper[2][row];
        [[lower[0], upper_x], [lower[1], upper_y], [lower[2], upper_z]]
    }

    /// Computes the inverse diagonal; cells that `takes_part` denies get 0.
    pub fn invert(&mut self, takes_part: impl Fn(usize) -> bool) {
        for row in 0..64 {
            let faces = self.faces(row);
            for lane in 0..8 {
                let sum: f32 = faces.iter().map(|[low, high]| low[lane] + high[lane]).sum();
                let cell = row * 8 + lane;
                self.inverse[cell] = if sum > LEAST && takes_part(cell) { 1.0 / sum } else { 0.0 };
            }
        }
    }
}

/// Least sum of open shares of a cell that takes part.
const LEAST: f32 = 1.0e-4;

/// A row of eight values along z.
#[inline(always)]
pub fn row_of(tile: &Tile, row: usize) -> [f32; 8] {
    std::array::from_fn(|lane| tile[row * 8 + lane])
}

#[inline(always)]
fn layer_of(layer: &[f32; 64], row: usize) -> [f32; 8] {
    std::array::from_fn(|lane| layer[row * 8 + lane])
}

/// A tile of an unknown field with the tiles that share a face.
#[derive(Clone, Copy)]
pub struct Near<'a> {
    /// The tile.
    pub own: &'a Tile,
    /// Tiles at -x, +x, -y, +y, -z, +z.
    pub six: [&'a Tile; 6],
    /// Coefficients; none: all faces are open.
    pub stencil: Option<&'a Stencil>,
}

/// What to compute from L x.
#[derive(Clone, Copy)]
pub enum Task<'a> {
    /// L x.
    Product,
    /// b - L x.
    Residual(&'a Tile),
    /// x + weight / diagonal (b - L x): a damped Jacobi sweep.
    Smooth(&'a Tile, f32),
}

/// Computes a tile. Returns the sum of x times the output.
pub fn compute(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    dispatch!(compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64)
}

#[inline(always)]
fn compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    let mut sums = [0.0f32; 8];
    for row in 0..64 {
        let (x, product, inverse) = apply(&near, row);
        let values = &mut out[row * 8..][..8];
        match task {
            Task::Product => values.copy_from_slice(&product),
            Task::Residual(b) => {
                for lane in 0..8 {
                    values[lane] = b[row * 8 + lane] - product[lane];
                }
            }
            Task::Smooth(b, weight) => {
                for lane in 0..8 {
                    let residual = b[row * 8 + lane] - product[lane];
                    values[lane] = x[lane] + weight * inverse[lane] * residual;
                }
            }
        }
        for lane in 0..8 {
            sums[lane] += x[lane] * values[lane];
        }
    }
    sums.iter().map(|sum| f64::from(*sum)).sum()
}

/// A row of x, of L x and of the inverse diagonal. Terms of opposite neighbours are added first, so that mirrored fields have
/// mirrored results to the last bit.
#[inline(always)]
fn apply(near: &Near<'_>, row: usize) -> ([f32; 8], [f32; 8], [f32; 8]) {
    let (x, y) = (row >> 3, row & 7);
    let [low_x, high_x, low_y, high_y, low_z, high_z] = near.six;
    let own = row_of(near.own, row);
    let left = if x > 0 { row_of(near.own, row - 8) } else { row_of(low_x, row + 56) };
    let right = if x < 7 { row_of(near.own, row + 8) } else { row_of(high_x, row - 56) };
    let down = if y > 0 { row_of(near.own, row - 1) } else { row_of(low_y, row + 7) };
    let up = if y < 7 { row_of(near.own, row + 1) } else { row_of(high_y, row - 7) };
    let (mut back, mut front) = ([0.0; 8], [0.0; 8]);
    back[0] = low_z[row * 8 + 7];
    back[1..].copy_from_slice(&own[..7]);
    front[..7].copy_from_slice(&own[1..]);
    front[7] = high_z[row * 8];
    let mut product = [0.0; 8];
    let Some(stencil) = near.stencil else {
        for lane in 0..8 {
            let around = (left[lane] + right[lane]) + (down[lane] + up[lane]) + (back[lane] + front[lane]);
            product[lane] = 6.0 * own[lane] - around;
        }
        return (own, product, [1.0 / 6.0; 8]);
    };
    let faces = stencil.faces(row);
    let pairs = [[left, right], [down, up], [back, front]];
    for lane in 0..8 {
        let term = |axis: usize| {
            let ([low, high], [open_low, open_high]) = (&pairs[axis], &faces[axis]);
            open_low[lane] * (own[lane] - low[lane]) + open_high[lane] * (own[lane] - high[lane])
        };
        product[lane] = term(0) + term(1) + term(2);
    }
    (own, product, row_of(&stencil.inverse, row))
}

/// The first sweep from x = 0: weight / diagonal b.
pub fn start(b: &Tile, weight: f32, stencil: Option<&Stencil>, out: &mut Tile) {
    match stencil {
        Some(stencil) => {
            for ((out, b), inverse) in out.iter_mut().zip(b).zip(&stencil.inverse) {
                *out = weight * inverse * b;
            }
        }
        None => {
            for (out, b) in out.iter_mut().zip(b) {
                *out = weight / 6.0 * b;
            }
        }
    }
}
