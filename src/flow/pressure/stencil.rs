//! The discrete Laplace operator of a tile: L x = sum over the six faces of open (x - neighbour), with x = 0 outside all tiles.

use crate::flow::tiles::Tile;
use crate::numeric::blocks::Mask;
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::Lanes;

/// Coefficients of a tile that has faces which are not fully open, or inactive cells.
#[derive(Debug, Clone)]
pub struct Stencil {
    /// Open fraction of the lower faces on each axis.
    pub lower: [Tile; 3],
    /// Open fraction of the tile's own upper faces on each axis, as layers of 8 x 8: (y, z), (x, z), (x, y).
    pub upper: [[f32; 64]; 3],
    /// Inverse of the sum of each cell's open fractions; 0: the cell takes no part in the solve.
    pub inverse: Tile,
    /// Cells where the pressure is 0, on levels whose tiles reach beyond the active ones: bit `y << 3 | z` of word `x`.
    pub outside: Mask,
}

impl Stencil {
    /// All faces open.
    pub fn open() -> Self {
        Self { lower: [[1.0; 512]; 3], upper: [[1.0; 64]; 3], inverse: [1.0 / 6.0; 512], outside: [0; 8] }
    }

    /// Open fractions of the lower and upper faces of a row's cells, on each axis.
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

    /// Computes the inverse diagonal; cells for which `takes_part` returns false get 0.
    pub fn invert(&mut self, takes_part: impl Fn(usize) -> bool) {
        for row in 0..64 {
            let faces = self.faces(row);
            for lane in 0..8 {
                let sum: f32 = faces.iter().map(|[low, high]| low[lane] + high[lane]).sum();
                let cell = row * 8 + lane;
                self.inverse[cell] = if sum > MIN_OPEN_SUM && takes_part(cell) { 1.0 / sum } else { 0.0 };
            }
        }
    }
}

/// Minimum sum of open fractions of a cell that takes part.
const MIN_OPEN_SUM: f32 = 1.0e-4;

/// A row of eight values along z.
#[inline(always)]
pub fn row_of(tile: &Tile, row: usize) -> [f32; 8] {
    std::array::from_fn(|lane| tile[row * 8 + lane])
}

/// A row of eight values along z, as lanes.
#[inline(always)]
fn lanes_of(tile: &Tile, row: usize) -> Lanes {
    Lanes(row_of(tile, row))
}

/// Sets a row.
#[inline(always)]
fn put(tile: &mut Tile, row: usize, values: Lanes) {
    tile[row * 8..][..8].copy_from_slice(&values.0);
}

#[inline(always)]
fn layer_of(layer: &[f32; 64], row: usize) -> [f32; 8] {
    std::array::from_fn(|lane| layer[row * 8 + lane])
}

/// A tile of an unknown field and the tiles that share a face with it.
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

/// Computes a tile. Returns the sum of x times the output, or, for a sweep, of b times the output.
pub fn compute(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    dispatch!(compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64)
}

#[inline(always)]
fn compute_rows(near: Near<'_>, task: Task<'_>, out: &mut Tile) -> f64 {
    let sums = match task {
        Task::Product => each_row(&near, Products { out, sums: Lanes::all(0.0) }).sums,
        Task::Residual(b) => each_row(&near, Residuals { b, out, sums: Lanes::all(0.0) }).sums,
        Task::Smooth(b, weight) => {
            each_row(&near, Smoothed { b, weight: Lanes::all(weight), out, sums: Lanes::all(0.0) }).sums
        }
    };
    sums.0.iter().map(|sum| f64::from(*sum)).sum()
}

/// Receives the rows of L x.
trait Rows {
    /// Receives a row's index, x, L x and inverse diagonal.
    fn take(&mut self, row: usize, x: Lanes, product: Lanes, inverse: Lanes);
}

/// L x; accumulates the sum of x times L x.
struct Products<'a> {
    out: &'a mut Tile,
    sums: Lanes,
}

impl Rows for Products<'_> {
    #[inline(always)]
    fn take(&mut self, row: usize, x: Lanes, product: Lanes, _: Lanes) {
        put(self.out, row, product);
        self.sums = self.sums + x * product;
    }
}

/// b - L x; accumulates the sum of x times the residual.
struct Residuals<'a> {
    b: &'a Tile,
    out: &'a mut Tile,
    sums: Lanes,
}

impl Rows for Residuals<'_> {
    #[inline(always)]
    fn take(&mut self, row: usize, x: Lanes, product: Lanes, inverse: Lanes) {
        let residual = masked(lanes_of(self.b, row) - product, inverse);
        put(self.out, row, residual);
        self.sums = self.sums + x * residual;
    }
}

/// x + weight / diagonal (b - L x); accumulates the sum of b times the result.
struct Smoothed<'a> {
    b: &'a Tile,
    weight: Lanes,
    out: &'a mut Tile,
    sums: Lanes,
}

impl Rows for Smoothed<'_> {
    #[inline(always)]
    fn take(&mut self, row: usize, x: Lanes, product: Lanes, inverse: Lanes) {
        let b = lanes_of(self.b, row);
        let smooth = x + self.weight * inverse * (b - product);
        put(self.out, row, smooth);
        self.sums = self.sums + b * smooth;
    }
}

/// Passes each row to `rows`.
#[inline(always)]
fn each_row<R: Rows>(near: &Near<'_>, mut rows: R) -> R {
    match near.stencil {
        None => {
            for row in 0..64 {
                let (own, product) = open_row(near, row);
                rows.take(row, own, product, Lanes::all(1.0 / 6.0));
            }
        }
        Some(stencil) => {
            for row in 0..64 {
                let (own, product) = partly_closed_row(near, stencil, row);
                rows.take(row, own, product, lanes_of(&stencil.inverse, row));
            }
        }
    }
    rows
}

/// Values, or 0 in cells that do not take part.
#[inline(always)]
fn masked(values: Lanes, inverse: Lanes) -> Lanes {
    let zero = Lanes::all(0.0);
    zero.is_less(inverse).choose(values, zero)
}

/// The mean residual b - L x of each block of 2 x 2 x 2 cells; cells that do not take part count as 0.
pub fn mean_residuals(near: Near<'_>, b: &Tile, out: &mut [f32; 64]) {
    dispatch!(mean_residual_rows(near: Near<'_>, b: &Tile, out: &mut [f32; 64]))
}

#[inline(always)]
fn mean_residual_rows(near: Near<'_>, b: &Tile, out: &mut [f32; 64]) {
    let mut residual = [0.0f32; 512];
    each_row(&near, Residuals { b, out: &mut residual, sums: Lanes::all(0.0) });
    for (four, out) in out.chunks_exact_mut(4).enumerate() {
        let first = (four >> 2) << 4 | (four & 3) << 1;
        let rows = [first, first + 1, first + 8, first + 9].map(|row| lanes_of(&residual, row));
        let sum = (rows[0] + rows[1]) + (rows[2] + rows[3]);
        for (z, out) in out.iter_mut().enumerate() {
            *out = 0.125 * (sum.0[2 * z] + sum.0[2 * z + 1]);
        }
    }
}

/// The rows beside a row at -x, +x, -y, +y, -z, +z.
#[inline(always)]
fn around(near: &Near<'_>, row: usize, own: Lanes) -> [Lanes; 6] {
    let (x, y) = (row >> 3, row & 7);
    let [low_x, high_x, low_y, high_y, low_z, high_z] = near.six;
    let pick = |inside: bool, row: usize, beyond: &Tile, other: usize| {
        let (tile, row) = if inside { (near.own, row) } else { (beyond, other) };
        lanes_of(tile, row & 63)
    };
    let left = pick(x > 0, row.wrapping_sub(8), low_x, row + 56);
    let right = pick(x < 7, row + 8, high_x, row.wrapping_sub(56));
    let down = pick(y > 0, row.wrapping_sub(1), low_y, row + 7);
    let up = pick(y < 7, row + 1, high_y, row.wrapping_sub(7));
    let back = own.shift_up(low_z[row * 8 + 7]);
    let front = own.shift_down(high_z[row * 8]);
    [left, right, down, up, back, front]
}

/// A row of x and of L x where all faces are open. Opposite neighbours are added first, so that mirrored fields have bitwise mirrored results.
#[inline(always)]
fn open_row(near: &Near<'_>, row: usize) -> (Lanes, Lanes) {
    let own = lanes_of(near.own, row);
    let [left, right, down, up, back, front] = around(near, row, own);
    (own, Lanes::all(6.0) * own - ((left + right) + (down + up) + (back + front)))
}

/// The same where faces are partly closed.
#[inline(always)]
fn partly_closed_row(near: &Near<'_>, stencil: &Stencil, row: usize) -> (Lanes, Lanes) {
    let own = lanes_of(near.own, row);
    let [left, right, down, up, back, front] = around(near, row, own);
    let [x, y, z] = stencil.faces(row);
    let term = |low: Lanes, high: Lanes, open: [[f32; 8]; 2]| {
        Lanes(open[0]) * (own - low) + Lanes(open[1]) * (own - high)
    };
    (own, term(left, right, x) + term(down, up, y) + term(back, front, z))
}

/// The first sweep from x = 0: weight / diagonal b.
pub fn first_sweep(b: &Tile, weight: f32, stencil: Option<&Stencil>, out: &mut Tile) {
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
