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
use super::conserve::{self, Keeping};
use super::paths::{At, Live, Paths, Ways, trace};
use super::room::Room;
use super::stencil::row_of;
use super::tiles::{Field, Tile, Tiles};
use super::window::Window;
use crate::base::cpu::dispatch;
use crate::base::lanes::Lanes;
use crate::context::Context;
use crate::error::{Error, Result};

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

/// How a flow is carried in a step.
pub struct Way<'a> {
    /// Velocity (m/s) of the air outside all tiles.
    pub ambient: [f32; 3],
    /// Cells that a value at 1 m/s moves: the time over the cell's edge (s/m).
    pub scale: f32,
    pub scheme: Scheme,
    /// The air around, as it is after the step.
    pub around: Option<&'a Flow>,
    /// How the density keeps its mass; none: it does so as far as the scheme does.
    pub keeping: Option<Keeping>,
}

/// Carries velocity (m/s, at lower faces) and density along for a step. The rim keeps what it holds, but for the upper faces of
/// cells.
///
/// # Errors
/// Cancel; the fields are then of no use.
pub fn advect(
    ctx: &Context,
    tiles: &Tiles,
    (velocity, density): (&mut [Field; 3], &mut Field),
    way: &Way<'_>,
    room: &mut Room,
) -> Result<()> {
    let Way { ambient, scheme, .. } = *way;
    let (mut back, mut ahead, [hat, below, above]) = room.paths(tiles);
    let extents = trace(ctx, tiles, velocity, way, [&mut back, &mut ahead])?;
    let paths = Paths { tiles, back: back.map(|field| &*field), ahead: ahead.map(|field| &*field), extents };
    for axis in 0..3 {
        let outside = ambient[axis];
        let around = way.around.map(|around| around.faces(axis));
        let field = (&mut velocity[axis], outside);
        let room = [&mut *hat, &mut *below, &mut *above];
        carry(ctx, &paths, At::Faces(axis), field, around.as_ref(), room, scheme)?;
    }
    let wanted = way.keeping.map(|_| conserve::carried(ctx, &paths, density)).transpose()?;
    let room = [hat, below, above].map(|field| &mut field[..tiles.active()]);
    carry(ctx, &paths, At::Centres, (density, 0.0), None, room, scheme)?;
    if let (Some(keeping), Some(wanted)) = (way.keeping, wanted) {
        conserve::restore(tiles, density, &wanted, keeping);
    }
    Ok(())
}

/// Carries a field along the paths. `hat` is room for the first guess, `below` and `above` for its distances from the least and
/// the greatest value around the place that it came from.
///
/// # Errors
/// Cancel.
fn carry(
    ctx: &Context,
    paths: &Paths<'_>,
    at: At,
    (field, outside): (&mut Field, f32),
    around: Option<&Reader<'_>>,
    [hat, below, above]: [&mut [Tile]; 3],
    scheme: Scheme,
) -> Result<()> {
    let is_moved = moved(paths, at, field, scheme);
    let is_bounded = scheme == Scheme::MacCormack;
    let bounds = below.par_iter_mut().zip(above.par_iter_mut());
    let tiles = hat.par_iter_mut().zip(bounds).enumerate().with_min_len(16);
    tiles.try_for_each_init(Window::default, |window, (slot, (hat, (below, above)))| {
        ctx.check()?;
        let live = paths.live(slot, at).filter(|_| is_moved[slot]);
        if live.as_ref().is_none_or(|live| !live.is_whole()) {
            // Of what lies around, the guess is what it has become there.
            *hat = match around {
                Some(around) if slot >= paths.tiles.active() => {
                    around.read(window, paths.tiles.coords()[slot])
                }
                _ => field[slot],
            };
        }
        if let Some(live) = live {
            window.fill(field, &paths.tiles.neighbours()[slot], &paths.back_span(slot, at), outside);
            let bounds = is_bounded.then_some([below, above]);
            guess_tile(&live, &paths.ways(slot, at, &paths.back), window, hat, bounds);
        }
        Ok::<_, Error>(())
    })?;
    if scheme == Scheme::SemiLagrangian {
        field.copy_from_slice(hat);
        return Ok(());
    }
    let (hat, below, above) = (&*hat, &*below, &*above);
    let tiles = field.par_iter_mut().enumerate().with_min_len(16);
    tiles.try_for_each_init(Window::default, |window, (slot, values)| {
        ctx.check()?;
        let Some(live) = paths.live(slot, at).filter(|_| is_moved[slot]) else { return Ok(()) };
        window.fill(hat, &paths.tiles.neighbours()[slot], &paths.ahead_span(slot, at), outside);
        let bounds = is_bounded.then(|| ([&below[slot], &above[slot]], Limit::of(at)));
        correct_tile(&live, &paths.ways(slot, at, &paths.ahead), window, &hat[slot], bounds, values);
        Ok(())
    })
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

fn guess_tile(live: &Live, ways: &Ways<'_>, window: &Window, hat: &mut Tile, bounds: Option<[&mut Tile; 2]>) {
    dispatch!(guess_rows(
        live: &Live,
        ways: &Ways<'_>,
        window: &Window,
        hat: &mut Tile,
        bounds: Option<[&mut Tile; 2]>
    ))
}

/// First guesses, and their bounds.
#[inline(always)]
fn guess_rows(live: &Live, ways: &Ways<'_>, window: &Window, hat: &mut Tile, bounds: Option<[&mut Tile; 2]>) {
    let Some([below, above]) = bounds else {
        for row in live.rows() {
            let values = window.sample(row, &ways.row(row));
            hat[row * 8..][..live.lanes()].copy_from_slice(&values.0[..live.lanes()]);
        }
        return;
    };
    for row in live.rows() {
        let [values, low, high] = window.sample_bounded(row, &ways.row(row));
        hat[row * 8..][..live.lanes()].copy_from_slice(&values.0[..live.lanes()]);
        below[row * 8..][..8].copy_from_slice(&(values - low).0);
        above[row * 8..][..8].copy_from_slice(&(high - values).0);
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
    let rows = |tile: &Tile, row: usize| Lanes(row_of(tile, row));
    for row in live.rows() {
        let there = window.sample(row, &ways.row(row));
        let guess = rows(hat, row);
        let mut change = Lanes::all(0.5) * (rows(values, row) - there);
        if let Some(([below, above], limit)) = bounds {
            change = limited(change, rows(below, row), rows(above, row), limit);
        }
        values[row * 8..][..live.lanes()].copy_from_slice(&(guess + change).0[..live.lanes()]);
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
fn limited(change: Lanes, below: Lanes, above: Lanes, limit: Limit) -> Lanes {
    let zero = Lanes::all(0.0);
    let is_negative = change.is_less(zero);
    let most = is_negative.choose(below, above);
    let size = change.max(zero - change);
    let bound = if limit == Limit::Fold { (Lanes::all(2.0) * most - size).max(zero) } else { most };
    // Rounding may leave a distance a little under 0.
    let kept = size.min(bound).max(zero);
    is_negative.choose(zero - kept, kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_stay_in_their_bounds_and_do_not_jump() {
        let within =
            |change, limit| limited(Lanes::all(change), Lanes::all(1.0), Lanes::all(2.0), limit).0[0];
        let cut = |change| within(change, Limit::Cut);
        let fold = |change| within(change, Limit::Fold);
        assert_eq!([-3.0, -1.5, -0.5, 1.5, 2.5, 5.0].map(cut), [-1.0, -1.0, -0.5, 1.5, 2.0, 2.0]);
        assert_eq!([-3.0, -1.5, -0.5, 1.5, 2.5, 5.0].map(fold), [0.0, -0.5, -0.5, 1.5, 1.5, 0.0]);
    }
}
