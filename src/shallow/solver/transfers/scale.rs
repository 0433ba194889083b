//! Scaling of transfers, so that no column gives more than it has or takes more than it has room for (thesis 4.1.1, K_min and K_max).
//!
//! A pipe's transfer is multiplied by K_min of the donor and K_max of the receiver: what leaves one column arrives in the other. K_max
//! depends on the outflow of its column in the same step, which depends on the K_max of others: it is found in sweeps that start from a
//! safe value and only raise it, so that it is safe after each.

use crate::shallow::columns::{STRIP, strip_from, strip_mut, strip_of};
use crate::shallow::solver::viscous_flux::{max, min};

/// Factor on depths and room: sums of four or more rounded transfers then stay within them.
pub const MARGIN: f32 = 1.0 - 1.0 / (1u32 << 20) as f32;

/// The transfers (units) of a span's pipes on all sides; `west` begins one element before `east`, so that all four are indexed by column.
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

impl<'a> Around<'a> {
    /// The transfers of a strip of the span: to the east, from the west, to the south, and from the north.
    #[inline(always)]
    pub fn strip(&self, strip: usize) -> [&'a [f32; STRIP]; 4] {
        [self.east, self.west, self.south, self.north].map(|numbers| strip_of(numbers, strip))
    }
}

/// A quantity of the columns of a span, and of those around them.
pub struct Beside<'a, T = f32> {
    /// The span's own columns, and one more: the column to the east.
    pub own: &'a [T],
    /// The columns to the south.
    pub south: &'a [T],
}

/// The depth that a column can give (units); for a dry one almost a unit, which moves nothing.
#[inline(always)]
fn spare(depth: i32) -> f32 {
    (depth.max(1)) as f32 * MARGIN
}

/// Sums the outflow of each column; returns whether it exceeds the depth of any. Where columns may fill up, `into` is raised to the maximum
/// inflow at each position of a strip.
#[inline(always)]
pub fn outflow<const FILLS: bool>(
    depth: &[i32],
    around: &Around,
    out: &mut [f32],
    into: &mut [f32; STRIP],
) -> bool {
    let mut over = [0; STRIP];
    for strip in 0..out.len() / STRIP {
        let around = around.strip(strip);
        outflow_of::<FILLS>(strip_of(depth, strip), &around, strip_mut(out, strip), &mut over, into);
    }
    over != [0; STRIP]
}

#[inline(always)]
fn outflow_of<const FILLS: bool>(
    depth: &[i32; STRIP],
    around: &[&[f32; STRIP]; 4],
    out: &mut [f32; STRIP],
    over: &mut [i32; STRIP],
    into: &mut [f32; STRIP],
) {
    let [east, west, south, north] = around;
    for x in 0..STRIP {
        let along = max(east[x], 0.0) - min(west[x], 0.0);
        let across = max(south[x], 0.0) - min(north[x], 0.0);
        out[x] = along + across;
        over[x] |= i32::from(out[x] > spare(depth[x]));
        if FILLS {
            into[x] = max(into[x], coming(around, x));
        }
    }
}

/// Turns the outflow of each column into K_min; returns the minimum.
#[inline(always)]
pub fn find_k_min(depth: &[i32], out: &mut [f32]) -> f32 {
    let mut minimum = [1.0; STRIP];
    for strip in 0..out.len() / STRIP {
        k_min_of(strip_of(depth, strip), strip_mut(out, strip), &mut minimum);
    }
    minimum.into_iter().fold(1.0, min)
}

#[inline(always)]
fn k_min_of(depth: &[i32; STRIP], out: &mut [f32; STRIP], minimum: &mut [f32; STRIP]) {
    for x in 0..STRIP {
        let spare = spare(depth[x]);
        out[x] = if out[x] > spare { spare / out[x] } else { 1.0 };
        minimum[x] = min(out[x], minimum[x]);
    }
}

/// Multiplies transfers and fluxes by K_min of the donors (`GIVES`), or by K_max of the receivers.
#[inline(always)]
pub fn scale<const GIVES: bool>(
    factor: &Beside,
    east: &mut [f32],
    south: &mut [f32],
    flux_east: &mut [f32],
    flux_south: &mut [f32],
) {
    for strip in 0..east.len() / STRIP {
        let own = strip_of(factor.own, strip);
        let beyond = strip_from(factor.own, strip * STRIP + 1);
        let factors = if GIVES { [own, beyond] } else { [beyond, own] };
        scale_strip(factors, strip_mut(east, strip), strip_mut(flux_east, strip));
        let beyond = strip_of(factor.south, strip);
        let factors = if GIVES { [own, beyond] } else { [beyond, own] };
        scale_strip(factors, strip_mut(south, strip), strip_mut(flux_south, strip));
    }
}

/// Multiplies by the first factor where liquid flows away from a column, and by the second where it flows towards it.
#[inline(always)]
fn scale_strip([away, towards]: [&[f32; STRIP]; 2], transfer: &mut [f32; STRIP], flux: &mut [f32; STRIP]) {
    for x in 0..STRIP {
        // A pipe that moves nothing has neither donor nor receiver.
        let (away, towards) = (away[x], towards[x]);
        let k = if transfer[x] > 0.0 { away } else { 1.0 };
        let k = if transfer[x] < 0.0 { towards } else { k };
        transfer[x] *= k;
        flux[x] *= k;
    }
}

/// Sums the inflow of each column.
#[inline(always)]
pub fn inflow(around: &Around, into: &mut [f32]) {
    for strip in 0..into.len() / STRIP {
        inflow_of(&around.strip(strip), strip_mut(into, strip));
    }
}

#[inline(always)]
fn inflow_of(around: &[&[f32; STRIP]; 4], into: &mut [f32; STRIP]) {
    for (x, into) in into.iter_mut().enumerate() {
        *into = coming(around, x);
    }
}

/// The inflow of a column. Scaling transfers down never increases it, even with rounding.
#[inline(always)]
fn coming([east, west, south, north]: &[&[f32; STRIP]; 4], x: usize) -> f32 {
    let along = max(west[x], 0.0) - min(east[x], 0.0);
    let across = max(north[x], 0.0) - min(south[x], 0.0);
    along + across
}

/// The room of a column (units).
#[inline(always)]
pub fn room(base: i32, ceiling: i32, depth: i32) -> f32 {
    (ceiling - base - depth).max(0) as f32 * MARGIN
}

/// K_max of a column, from its inflow and its room.
#[inline(always)]
pub fn k_max(into: f32, room: f32) -> f32 {
    if into > room { room / into } else { 1.0 }
}

/// Turns the inflow of each column into K_max, as if nothing flowed out; returns the minimum.
#[inline(always)]
pub fn find_k_max(base: &[i32], ceiling: &[i32], depth: &[i32], into: &mut [f32]) -> f32 {
    let mut minimum = [1.0; STRIP];
    for strip in 0..into.len() / STRIP {
        let columns = [base, ceiling, depth].map(|numbers| strip_of(numbers, strip));
        k_max_of(columns, strip_mut(into, strip), &mut minimum);
    }
    minimum.into_iter().fold(1.0, min)
}

#[inline(always)]
fn k_max_of([base, ceiling, depth]: [&[i32; STRIP]; 3], into: &mut [f32; STRIP], minimum: &mut [f32; STRIP]) {
    for x in 0..STRIP {
        into[x] = k_max(into[x], room(base[x], ceiling[x], depth[x]));
        minimum[x] = min(into[x], minimum[x]);
    }
}
