//! Scaling of transfers, so that no column gives more than it has or takes more than it has room for (thesis 4.1.1, K_min and K_max).
//!
//! A pipe's transfer is multiplied by one K_min, of the column that gives, and one K_max, of the one that takes: what leaves one column
//! arrives in the other. K_max depends on what leaves the column in the same step, which depends on the K_max of others: it is found in
//! sweeps, from below, so that it is safe after each.

use super::flux::{greater, lesser};

/// Depths and room are counted as this much less, and sums of four or more rounded transfers stay within them.
pub const MARGIN: f32 = 1.0 - 1.0 / (1u32 << 20) as f32;

/// The transfers (units) of a span's pipes on all sides; `west` begins one before `east`, so that each column's is at its place.
pub struct Around<'a> {
    /// To the east.
    pub east: &'a [f32],
    /// From the west.
    pub west: &'a [f32],
    /// To the south.
    pub south: &'a [f32],
    /// From the north.
    pub north: &'a [f32],
}

/// One number of the columns of a span, and of those around them.
pub struct Beside<'a> {
    /// The span's own, and one more: the columns to the east.
    pub own: &'a [f32],
    /// Those to the south.
    pub south: &'a [f32],
}

/// The depth that a column can give (units): a dry one keeps what is less than a unit.
#[inline(always)]
fn spare(depth: i32) -> f32 {
    (depth.max(1)) as f32 * MARGIN
}

/// Sums what is to leave each column; whether it is more than the column has anywhere.
#[inline(always)]
pub fn outflow(depth: &[i32], around: &Around, out: &mut [f32]) -> bool {
    let count = out.len();
    let (depth, east, west) = (&depth[..count], &around.east[..count], &around.west[..count]);
    let (south, north) = (&around.south[..count], &around.north[..count]);
    let mut over = false;
    for x in 0..count {
        let along = greater(east[x], 0.0) - lesser(west[x], 0.0);
        let across = greater(south[x], 0.0) - lesser(north[x], 0.0);
        out[x] = along + across;
        over |= out[x] > spare(depth[x]);
    }
    over
}

/// Turns what is to leave each column into K_min; returns the least.
#[inline(always)]
pub fn least(depth: &[i32], out: &mut [f32]) -> f32 {
    let depth = &depth[..out.len()];
    let mut least = 1.0;
    for x in 0..out.len() {
        let spare = spare(depth[x]);
        out[x] = if out[x] > spare { spare / out[x] } else { 1.0 };
        least = lesser(out[x], least);
    }
    least
}

/// Multiplies transfers and fluxes by K_min of the columns that give.
#[inline(always)]
pub fn shrink(
    least: &Beside,
    east: &mut [f32],
    south: &mut [f32],
    flux_east: &mut [f32],
    flux_south: &mut [f32],
) {
    scale(least, east, south, flux_east, flux_south, |transfer| transfer > 0.0);
}

/// Multiplies transfers and fluxes by K_max of the columns that take.
#[inline(always)]
pub fn fit(
    most: &Beside,
    east: &mut [f32],
    south: &mut [f32],
    flux_east: &mut [f32],
    flux_south: &mut [f32],
) {
    scale(most, east, south, flux_east, flux_south, |transfer| transfer < 0.0);
}

#[inline(always)]
fn scale(
    factor: &Beside,
    east: &mut [f32],
    south: &mut [f32],
    flux_east: &mut [f32],
    flux_south: &mut [f32],
    takes_own: impl Fn(f32) -> bool,
) {
    let count = east.len();
    let (own, beyond, south) = (&factor.own[..count + 1], &factor.south[..count], &mut south[..count]);
    let (flux_east, flux_south) = (&mut flux_east[..count], &mut flux_south[..count]);
    for x in 0..count {
        let k = if takes_own(east[x]) { own[x] } else { own[x + 1] };
        east[x] *= k;
        flux_east[x] *= k;
        let k = if takes_own(south[x]) { own[x] } else { beyond[x] };
        south[x] *= k;
        flux_south[x] *= k;
    }
}

/// Sums what is to come into each column.
#[inline(always)]
pub fn inflow(around: &Around, into: &mut [f32]) {
    let count = into.len();
    let (east, west) = (&around.east[..count], &around.west[..count]);
    let (south, north) = (&around.south[..count], &around.north[..count]);
    for x in 0..count {
        let along = greater(west[x], 0.0) - lesser(east[x], 0.0);
        let across = greater(north[x], 0.0) - lesser(south[x], 0.0);
        into[x] = along + across;
    }
}

/// The room of a column (units).
#[inline(always)]
pub fn room(base: i32, ceiling: i32, depth: i32) -> f32 {
    (ceiling - base - depth).max(0) as f32 * MARGIN
}

/// K_max of a column, of what is to come in and the room for it.
#[inline(always)]
pub fn most(into: f32, room: f32) -> f32 {
    if into > room { room / into } else { 1.0 }
}

/// Turns what is to come into each column into K_max, as if nothing left; returns the least.
#[inline(always)]
pub fn find_most(base: &[i32], ceiling: &[i32], depth: &[i32], into: &mut [f32]) -> f32 {
    let count = into.len();
    let (base, ceiling, depth) = (&base[..count], &ceiling[..count], &depth[..count]);
    let mut least = 1.0;
    for x in 0..count {
        into[x] = most(into[x], room(base[x], ceiling[x], depth[x]));
        least = lesser(into[x], least);
    }
    least
}
