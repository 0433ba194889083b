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

/// Eight values along z from a cell on that has as many behind it.
#[inline(always)]
fn eight(tile: &Tile, first: usize) -> [f32; 8] {
    tile[first..].first_chunk().copied().unwrap_or([0.0; 8])
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
    /// b - L x; 0 in cells that do not take part.
    Residual(&'a Tile),
    /// x + weight / diagonal (b - L x): a damped Jacobi sweep.
    Smooth(&'a Tile, f32),
}

/// Computes a tile. Returns the sum of x, or for a sweep that of b, times the output.
pub fn compute(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    dispatch!(compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64)
}

#[inline(always)]
fn compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    let mut sums = [0.0f32; 8];
    match task {
        Task::Product => each_row(&near, |row, x, product, _| {
            out[row * 8..][..8].copy_from_slice(&product);
            add_products(&mut sums, &x, &product);
        }),
        Task::Residual(b) => each_row(&near, |row, x, product, inverse| {
            let values = &mut out[row * 8..][..8];
            for lane in 0..8 {
                values[lane] = masked(b[row * 8 + lane] - product[lane], inverse[lane]);
            }
            add_products(&mut sums, &x, values);
        }),
        Task::Smooth(b, weight) => each_row(&near, |row, x, product, inverse| {
            let values = &mut out[row * 8..][..8];
            let b = row_of(b, row);
            for lane in 0..8 {
                values[lane] = x[lane] + weight * inverse[lane] * (b[lane] - product[lane]);
            }
            add_products(&mut sums, &b, values);
        }),
    }
    sums.iter().map(|sum| f64::from(*sum)).sum()
}

#[inline(always)]
fn add_products(sums: &mut [f32; 8], a: &[f32; 8], b: &[f32]) {
    for lane in 0..8 {
        sums[lane] += a[lane] * b[lane];
    }
}

/// Calls `work` with each row's index, x, L x and inverse diagonal.
#[inline(always)]
fn each_row(near: &Near<'_>, mut work: impl FnMut(usize, [f32; 8], [f32; 8], [f32; 8])) {
    match near.stencil {
        None => {
            for row in 0..64 {
                let (own, product) = plain(near, row);
                work(row, own, product, [1.0 / 6.0; 8]);
            }
        }
        Some(stencil) => {
            for row in 0..64 {
                let (own, product) = with_faces(near, stencil, row);
                work(row, own, product, row_of(&stencil.inverse, row));
            }
        }
    }
}

/// A value, or 0 in a cell that does not take part.
#[inline(always)]
fn masked(value: f32, inverse: f32) -> f32 {
    if inverse > 0.0 { value } else { 0.0 }
}

/// The mean residual b - L x of each 2 x 2 x 2 cells; those that do not take part count as 0.
pub fn mean_residuals(near: Near<'_>, b: &Tile, out: &mut [f32; 64]) {
    dispatch!(mean_residual_rows(near: Near<'_>, b: &Tile, out: &mut [f32; 64]))
}

#[inline(always)]
fn mean_residual_rows(near: Near<'_>, b: &Tile, out: &mut [f32; 64]) {
    let mut residual = [[0.0f32; 8]; 64];
    each_row(&near, |row, _, product, inverse| {
        for lane in 0..8 {
            residual[row][lane] = masked(b[row * 8 + lane] - product[lane], inverse[lane]);
        }
    });
    for (four, out) in out.chunks_exact_mut(4).enumerate() {
        let first = (four >> 2) << 4 | (four & 3) << 1;
        let rows = [first, first + 1, first + 8, first + 9].map(|row| residual[row]);
        let mut sum = [0.0; 8];
        for lane in 0..8 {
            sum[lane] = (rows[0][lane] + rows[1][lane]) + (rows[2][lane] + rows[3][lane]);
        }
        for (z, out) in out.iter_mut().enumerate() {
            *out = 0.125 * (sum[2 * z] + sum[2 * z + 1]);
        }
    }
}

/// Rows at -x, +x, -y, +y, -z, +z of a row.
#[inline(always)]
fn around(near: &Near<'_>, row: usize) -> [[f32; 8]; 6] {
    let (x, y) = (row >> 3, row & 7);
    let [low_x, high_x, low_y, high_y, low_z, high_z] = near.six;
    let pick = |inside: bool, row: usize, beyond: &Tile, other: usize| {
        let (tile, row) = if inside { (near.own, row) } else { (beyond, other) };
        row_of(tile, row & 63)
    };
    let left = pick(x > 0, row.wrapping_sub(8), low_x, row + 56);
    let right = pick(x < 7, row + 8, high_x, row.wrapping_sub(56));
    let down = pick(y > 0, row.wrapping_sub(1), low_y, row + 7);
    let up = pick(y < 7, row + 1, high_y, row.wrapping_sub(7));
    // Both reach beyond the row, into values that are replaced.
    let (first, last) = (row * 8, row * 8 + 7);
    let mut back = if row > 0 { eight(near.own, first - 1) } else { [0.0; 8] };
    let mut front = if row < 63 { eight(near.own, first + 1) } else { [0.0; 8] };
    if row == 0 {
        back[1..].copy_from_slice(&near.own[..7]);
    }
    if row == 63 {
        front[..7].copy_from_slice(&near.own[505..]);
    }
    back[0] = low_z[last];
    front[7] = high_z[first];
    [left, right, down, up, back, front]
}

/// A row of x and of L x where all faces are open. Terms of opposite neighbours are added first, so that mirrored fields have
/// mirrored results to the last bit.
#[inline(always)]
fn plain(near: &Near<'_>, row: usize) -> ([f32; 8], [f32; 8]) {
    let own = row_of(near.own, row);
    let [left, right, down, up, back, front] = around(near, row);
    let mut product = [0.0; 8];
    for lane in 0..8 {
        let around = (left[lane] + right[lane]) + (down[lane] + up[lane]) + (back[lane] + front[lane]);
        product[lane] = 6.0 * own[lane] - around;
    }
    (own, product)
}

/// The same between faces that are not fully open.
#[inline(always)]
fn with_faces(near: &Near<'_>, stencil: &Stencil, row: usize) -> ([f32; 8], [f32; 8]) {
    let own = row_of(near.own, row);
    let [left, right, down, up, back, front] = around(near, row);
    let faces = stencil.faces(row);
    let pairs = [[left, right], [down, up], [back, front]];
    let mut product = [0.0; 8];
    for lane in 0..8 {
        let term = |axis: usize| {
            let ([low, high], [open_low, open_high]) = (&pairs[axis], &faces[axis]);
            open_low[lane] * (own[lane] - low[lane]) + open_high[lane] * (own[lane] - high[lane])
        };
        product[lane] = term(0) + term(1) + term(2);
    }
    (own, product)
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
