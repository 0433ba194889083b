//! Advection: values are carried along the flow (semi-Lagrangian: Stam 1999), and MacCormack's correction of the blur that
//! this leaves (Selle, Fedkiw, Kim, Liu and Rossignac 2008), within the range of the values around the place that a value came
//! from ([`Limit`]).
//!
//! The path of each cell's centre is traced once (midpoint rule), backward and, for the correction, forward; a face takes the
//! mean of its two cells' paths. All four fields follow these, one after the other, in two passes each: the first guess with
//! its bounds, then the correction.

use rayon::prelude::*;

use super::Flow;
use super::around::Reader;
use super::paths::{At, Live, Paths, Ways, trace};
use super::room::Room;
use super::tiles::{Field, Tile, Tiles};
use super::window::{Window, max, min};
use crate::base::cpu::dispatch;

/// How values are carried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// First order: stable, blurs.
    SemiLagrangian,
    /// Second order; no new extremes.
    #[default]
    MacCormack,
    /// Second order where the flow is smooth, without bounds: for measurements of the order.
    Unbounded,
}

/// Carries velocity (m/s, at lower faces) and density along for a step, `scale` = dt / cell; the air outside all tiles moves at
/// `ambient`. The rim keeps what it holds, but for the upper faces of cells.
pub fn advect(
    tiles: &Tiles,
    (velocity, density): (&mut [Field; 3], &mut Field),
    ambient: [f32; 3],
    scale: f32,
    scheme: Scheme,
    around: Option<&Flow>,
    room: &mut Room,
) {
    let (mut back, mut ahead, [hat, below, above]) = room.paths(tiles);
    let extents = trace(tiles, velocity, ambient, scale, [&mut back, &mut ahead]);
    let paths = Paths { tiles, back: back.map(|field| &*field), ahead: ahead.map(|field| &*field), extents };
    for axis in 0..3 {
        let outside = ambient[axis];
        let around = around.map(|around| around.faces(axis));
        let field = (&mut velocity[axis], outside);
        carry(&paths, At::Faces(axis), field, around.as_ref(), [&mut *hat, &mut *below, &mut *above], scheme);
    }
    let three = [hat, below, above].map(|field| &mut field[..tiles.active()]);
    carry(&paths, At::Centres, (density, 0.0), None, three, scheme);
}

/// Carries a field along the paths. `hat` is room for the first guess, `below` and `above` for its distances from the least and
/// the greatest value around the place that it came from.
fn carry(
    paths: &Paths<'_>,
    at: At,
    (field, outside): (&mut Field, f32),
    around: Option<&Reader<'_>>,
    [hat, below, above]: [&mut [Tile]; 3],
    scheme: Scheme,
) {
    let is_moved = moved(paths, at, field, scheme);
    let bounds = below.par_iter_mut().zip(above.par_iter_mut());
    let tiles = hat.par_iter_mut().zip(bounds).enumerate().with_min_len(16);
    tiles.for_each_init(Window::default, |window, (slot, (hat, (below, above)))| {
        // Of what lies around, the guess is what it has become there.
        *hat = match around {
            Some(around) if slot >= paths.tiles.active() => around.read(window, paths.tiles.coords()[slot]),
            _ => field[slot],
        };
        let Some(live) = paths.live(slot, at).filter(|_| is_moved[slot]) else { return };
        window.fill(field, &paths.tiles.neighbours()[slot], &paths.back_span(slot, at), outside);
        guess_tile(&live, &paths.ways(slot, at, &paths.back), window, hat, [below, above]);
    });
    if scheme == Scheme::SemiLagrangian {
        field.copy_from_slice(hat);
        return;
    }
    let (hat, below, above) = (&*hat, &*below, &*above);
    let tiles = field.par_iter_mut().enumerate().with_min_len(16);
    tiles.for_each_init(Window::default, |window, (slot, values)| {
        let Some(live) = paths.live(slot, at).filter(|_| is_moved[slot]) else { return };
        window.fill(hat, &paths.tiles.neighbours()[slot], &paths.ahead_span(slot, at), outside);
        let bounds = [&below[slot], &above[slot]];
        let bounds = (scheme == Scheme::MacCormack).then_some((bounds, Limit::of(at)));
        correct_tile(&live, &paths.ways(slot, at, &paths.ahead), window, &hat[slot], bounds, values);
    });
}

/// Whether paths bring something to each tile of a field: into tiles among others without density they bring none.
fn moved(paths: &Paths<'_>, at: At, field: &Field, scheme: Scheme) -> Vec<bool> {
    if at != At::Centres || scheme == Scheme::Unbounded {
        return vec![true; field.len()];
    }
    let holds = |tile: &Tile| tile.iter().any(|value| *value != 0.0);
    let holds: Vec<bool> = field.par_iter().with_min_len(64).map(holds).collect();
    let any = |near: &[u32; 27]| near.iter().any(|near| holds.get(*near as usize) == Some(&true));
    paths.tiles.neighbours()[..field.len()].iter().map(any).collect()
}

fn guess_tile(live: &Live, ways: &Ways<'_>, window: &Window, hat: &mut Tile, bounds: [&mut Tile; 2]) {
    dispatch!(guess_rows(live: &Live, ways: &Ways<'_>, window: &Window, hat: &mut Tile, bounds: [&mut Tile; 2]))
}

/// First guesses, and their bounds.
#[inline(always)]
fn guess_rows(live: &Live, ways: &Ways<'_>, window: &Window, hat: &mut Tile, bounds: [&mut Tile; 2]) {
    let [below, above] = bounds;
    for row in live.rows() {
        let [values, low, high] = window.sample_bounded(row, &ways.row(row));
        hat[row * 8..][..live.lanes()].copy_from_slice(&values[..live.lanes()]);
        let (below, above) = (&mut below[row * 8..][..8], &mut above[row * 8..][..8]);
        for lane in 0..8 {
            below[lane] = values[lane] - low[lane];
            above[lane] = high[lane] - values[lane];
        }
    }
}

fn correct_tile(
    live: &Live,
    ways: &Ways<'_>,
    window: &Window,
    hat: &Tile,
    bounds: Option<([&Tile; 2], Limit)>,
    values: &mut Tile,
) {
    dispatch!(correct_rows(
        live: &Live,
        ways: &Ways<'_>,
        window: &Window,
        hat: &Tile,
        bounds: Option<([&Tile; 2], Limit)>,
        values: &mut Tile
    ))
}

/// Corrects first guesses by half of what the way forth and back changes.
#[inline(always)]
fn correct_rows(
    live: &Live,
    ways: &Ways<'_>,
    window: &Window,
    hat: &Tile,
    bounds: Option<([&Tile; 2], Limit)>,
    values: &mut Tile,
) {
    for row in live.rows() {
        let there = window.sample(row, &ways.row(row));
        let range = row * 8..row * 8 + 8;
        let mut new = [0.0; 8];
        for (lane, new) in new.iter_mut().enumerate() {
            *new = hat[range.start + lane] + 0.5 * (values[range.start + lane] - there[lane]);
        }
        if let Some(([below, above], limit)) = bounds {
            for (lane, new) in new.iter_mut().enumerate() {
                let guess = hat[range.start + lane];
                let at = range.start + lane;
                *new = guess + limited(*new - guess, below[at], above[at], limit);
            }
        }
        values[range][..live.lanes()].copy_from_slice(&new[..live.lanes()]);
    }
}

/// What becomes of a correction that leaves the range of the values around the place that a value came from. Nothing jumps:
/// where a correction was dropped at the bound, the least difference between two flows grew fourfold in ten steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limit {
    /// It ends at the bound.
    Cut,
    /// What lies behind the bound is taken off: from twice the distance on, nothing is left. Thin mist gains no mass so.
    Fold,
}

impl Limit {
    fn of(at: At) -> Self {
        if at == At::Centres { Self::Fold } else { Self::Cut }
    }
}

/// A correction within its bounds.
#[inline(always)]
fn limited(change: f32, below: f32, above: f32, limit: Limit) -> f32 {
    let most = if change < 0.0 { below } else { above };
    let size = change.abs();
    let bound = if limit == Limit::Fold { max(2.0 * most - size, 0.0) } else { most };
    // Rounding may leave a distance a little under 0.
    let kept = max(min(size, bound), 0.0);
    if change < 0.0 { -kept } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_stay_in_their_bounds_and_do_not_jump() {
        let cut = |change| limited(change, 1.0, 2.0, Limit::Cut);
        let fold = |change| limited(change, 1.0, 2.0, Limit::Fold);
        assert_eq!([-3.0, -1.5, -0.5, 1.5, 2.5, 5.0].map(cut), [-1.0, -1.0, -0.5, 1.5, 2.0, 2.0]);
        assert_eq!([-3.0, -1.5, -0.5, 1.5, 2.5, 5.0].map(fold), [0.0, -0.5, -0.5, 1.5, 1.5, 0.0]);
    }
}
