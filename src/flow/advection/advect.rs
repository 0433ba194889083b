//! Advection: values are carried along the flow (semi-Lagrangian: Stam 1999). For velocities a MacCormack correction undoes the blur
//! (Selle, Fedkiw, Kim, Liu and Rossignac 2008), clamped to the range of the values around the departure point. The density, which has
//! sharp edges, is interpolated by cubic functions instead, clamped to the same range: MacCormack oscillations trail behind an edge, and
//! where the clamp cuts them off, the edge lags (by about a cell).
//!
//! The path of each cell's centre is traced once (midpoint rule), backward and, for the correction, forward; a face takes the mean of its
//! two cells' paths. All four fields follow these paths, one after the other: velocities in two passes each, first the guess with its
//! bounds, then the correction.

use rayon::prelude::*;

use super::conserve;
use super::paths::{Displacements, Live, Location, Paths, trace};
use super::scheme::{AdvectionStep, MassConservation, Scheme};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::flow::Flow;
use crate::flow::outer_grid::Reader;
use crate::flow::pressure::stencil::row_of;
use crate::flow::scratch::Scratch;
use crate::flow::tiles::{Field, Tile, Tiles};
use crate::flow::window::Window;
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::Lanes;

impl Flow {
    /// Advects velocity and density for a time (s). Paths longer than [`FARTHEST`](crate::flow::FARTHEST) cells are clamped.
    ///
    /// # Errors
    /// Cancel; the fields are then invalid.
    pub fn advect(&mut self, ctx: &Context, dt: f64, scheme: Scheme) -> Result<()> {
        self.prepare_advection();
        self.carry(ctx, dt, scheme, None)
    }

    /// The same with [`Scheme::Bounded`], with mass conservation: a density that is not negative keeps the requested share of its mass, to
    /// rounding. The mass that the scheme loses or gains is restored within two tiles, or farther away if the density there would have to
    /// grow by more than a fifth at once. Mass is lost only if all of the density together would have to grow by more than that: this
    /// happens to the last mist, thinner than `fade_below`.
    ///
    /// # Errors
    /// Cancel; the fields are then invalid.
    pub fn advect_conserving(
        &mut self,
        ctx: &Context,
        dt: f64,
        conservation: MassConservation,
    ) -> Result<()> {
        self.prepare_advection();
        self.carry(ctx, dt, Scheme::Bounded, Some(conservation))
    }

    fn carry(
        &mut self,
        ctx: &Context,
        dt: f64,
        scheme: Scheme,
        conservation: Option<MassConservation>,
    ) -> Result<()> {
        if let Some(around) = &mut self.around {
            std::mem::swap(&mut around.scratch_fields, &mut self.scratch_fields);
            let done = around.carry(ctx, dt, scheme, None);
            std::mem::swap(&mut around.scratch_fields, &mut self.scratch_fields);
            done?;
        }
        let Self { tiles, velocity, density, ambient, around, scratch_fields, .. } = self;
        let (scale, around) = (dt as f32 / self.cell, around.as_deref());
        let step = AdvectionStep { ambient: *ambient, scale, scheme, around, conservation };
        advect(ctx, tiles, (velocity, density), &step, scratch_fields)
    }
}

/// Advects velocity (m/s, at lower faces) and density for a step. The rim (the tiles beside the active ones) keeps its values, except those
/// at the upper faces of active cells, which are stored there.
///
/// # Errors
/// Cancel; the fields are then invalid.
pub fn advect(
    ctx: &Context,
    tiles: &Tiles,
    (velocity, density): (&mut [Field; 3], &mut Field),
    step: &AdvectionStep<'_>,
    scratch: &mut Scratch,
) -> Result<()> {
    let AdvectionStep { ambient, scheme, .. } = *step;
    let (mut back, mut ahead, [first_guess, below, above]) = scratch.paths(tiles);
    let extents = trace(ctx, tiles, velocity, step, [&mut back, &mut ahead])?;
    let paths = Paths { tiles, back: back.map(|field| &*field), ahead: ahead.map(|field| &*field), extents };
    for axis in 0..3 {
        let outside = ambient[axis];
        let around = step.around.map(|around| around.faces(axis));
        let field = (&mut velocity[axis], outside);
        let scratch = [&mut *first_guess, &mut *below, &mut *above];
        carry_faces(ctx, &paths, axis, field, around.as_ref(), scratch, scheme)?;
    }
    let wanted = step.conservation.map(|_| conserve::target_masses(ctx, &paths, density)).transpose()?;
    carry_density(ctx, &paths, density, &mut first_guess[..tiles.active()], scheme)?;
    if let (Some(conservation), Some(wanted)) = (step.conservation, wanted) {
        conserve::restore(tiles, density, &wanted, conservation);
    }
    Ok(())
}

/// Advects the velocity on an axis along the paths. `first_guess` is scratch for the first guess, `below` and `above` for its distances
/// from the minimum and maximum around its departure point.
///
/// # Errors
/// Cancel.
fn carry_faces(
    ctx: &Context,
    paths: &Paths<'_>,
    axis: usize,
    (field, outside): (&mut Field, f32),
    around: Option<&Reader<'_>>,
    [first_guess, below, above]: [&mut [Tile]; 3],
    scheme: Scheme,
) -> Result<()> {
    let at = Location::Faces(axis);
    let is_bounded = scheme == Scheme::Bounded;
    let bounds = below.par_iter_mut().zip(above.par_iter_mut());
    let tiles = first_guess.par_iter_mut().zip(bounds).enumerate().with_min_len(16);
    tiles.try_for_each_init(Window::default, |window, (slot, (first_guess, (below, above)))| {
        ctx.check()?;
        let live = paths.live(slot, at);
        if live.as_ref().is_none_or(|live| !live.is_whole()) {
            // In the rim, the guess is the velocity of the surrounding air, which has made this step already.
            *first_guess = match around {
                Some(around) if slot >= paths.tiles.active() => {
                    around.read(window, paths.tiles.coords()[slot])
                }
                _ => field[slot],
            };
        }
        if let Some(live) = live {
            window.fill(field, &paths.tiles.neighbours()[slot], &paths.back_span(slot, at), outside);
            let bounds = is_bounded.then_some([below, above]);
            guess_tile(&live, &paths.displacements(slot, at, &paths.back), window, first_guess, bounds);
        }
        Ok::<_, Error>(())
    })?;
    if scheme == Scheme::SemiLagrangian {
        field.copy_from_slice(first_guess);
        return Ok(());
    }
    let (first_guess, below, above) = (&*first_guess, &*below, &*above);
    let tiles = field.par_iter_mut().enumerate().with_min_len(16);
    tiles.try_for_each_init(Window::default, |window, (slot, values)| {
        ctx.check()?;
        let Some(live) = paths.live(slot, at) else { return Ok(()) };
        window.fill(first_guess, &paths.tiles.neighbours()[slot], &paths.ahead_span(slot, at), outside);
        let bounds = is_bounded.then(|| [&below[slot], &above[slot]]);
        let guess = Guess { values: &first_guess[slot], bounds };
        correct_tile(&live, &paths.displacements(slot, at, &paths.ahead), window, &guess, values);
        Ok(())
    })
}

/// Advects the density along the paths, with `to` as scratch.
///
/// # Errors
/// Cancel.
fn carry_density(
    ctx: &Context,
    paths: &Paths<'_>,
    density: &mut Field,
    to: &mut [Tile],
    scheme: Scheme,
) -> Result<()> {
    let holds = |tile: &Tile| tile.iter().any(|value| *value != 0.0);
    let holds: Vec<bool> = density.par_iter().with_min_len(64).map(holds).collect();
    let tiles = to.par_iter_mut().enumerate().with_min_len(16);
    tiles.try_for_each_init(Window::default, |window, (slot, to)| {
        ctx.check()?;
        let near = &paths.tiles.neighbours()[slot];
        // No path can bring density into a tile that is surrounded by tiles without density.
        if !near.iter().any(|near| holds.get(*near as usize) == Some(&true)) {
            to.fill(0.0);
            return Ok(());
        }
        window.fill(density, near, &paths.back_span(slot, Location::Centres).for_cubic(), 0.0);
        density_tile(&paths.displacements(slot, Location::Centres, &paths.back), window, scheme, to);
        Ok::<_, Error>(())
    })?;
    density.copy_from_slice(to);
    Ok(())
}

fn density_tile(displacements: &Displacements<'_>, window: &Window, scheme: Scheme, to: &mut Tile) {
    dispatch!(density_rows(displacements: &Displacements<'_>, window: &Window, scheme: Scheme, to: &mut Tile))
}

#[inline(always)]
fn density_rows(displacements: &Displacements<'_>, window: &Window, scheme: Scheme, to: &mut Tile) {
    for row in 0..64 {
        let displacements = displacements.row(row);
        let values = match scheme {
            Scheme::SemiLagrangian => window.sample(row, &displacements),
            Scheme::Unbounded => window.sample_cubic(row, &displacements)[0],
            Scheme::Bounded => {
                let [values, low, high] = window.sample_cubic(row, &displacements);
                values.max(low).min(high)
            }
        };
        to[row * 8..][..8].copy_from_slice(&values.0);
    }
}

fn guess_tile(
    live: &Live,
    displacements: &Displacements<'_>,
    window: &Window,
    first_guess: &mut Tile,
    bounds: Bounds<&mut Tile>,
) {
    dispatch!(guess_rows(live: &Live, displacements: &Displacements<'_>, window: &Window, first_guess: &mut Tile, bounds: Bounds<&mut Tile>))
}

/// Distances of values from their lower and upper bounds; none for unbounded schemes.
type Bounds<T> = Option<[T; 2]>;

/// First guesses, and their bounds.
#[inline(always)]
fn guess_rows(
    live: &Live,
    displacements: &Displacements<'_>,
    window: &Window,
    first_guess: &mut Tile,
    bounds: Bounds<&mut Tile>,
) {
    let Some([below, above]) = bounds else {
        for row in live.rows() {
            let values = window.sample(row, &displacements.row(row));
            first_guess[row * 8..][..live.lanes()].copy_from_slice(&values.0[..live.lanes()]);
        }
        return;
    };
    for row in live.rows() {
        let [values, low, high] = window.sample_bounded(row, &displacements.row(row));
        first_guess[row * 8..][..live.lanes()].copy_from_slice(&values.0[..live.lanes()]);
        below[row * 8..][..8].copy_from_slice(&(values - low).0);
        above[row * 8..][..8].copy_from_slice(&(high - values).0);
    }
}

/// First guesses of a tile, and their bounds.
struct Guess<'a> {
    values: &'a Tile,
    bounds: Bounds<&'a Tile>,
}

fn correct_tile(
    live: &Live,
    displacements: &Displacements<'_>,
    window: &Window,
    guess: &Guess<'_>,
    values: &mut Tile,
) {
    dispatch!(correct_rows(live: &Live, displacements: &Displacements<'_>, window: &Window, guess: &Guess<'_>, values: &mut Tile))
}

/// Corrects first guesses by half of the error of the round trip, forward and back.
#[inline(always)]
fn correct_rows(
    live: &Live,
    displacements: &Displacements<'_>,
    window: &Window,
    guess: &Guess<'_>,
    values: &mut Tile,
) {
    let rows = |tile: &Tile, row: usize| Lanes(row_of(tile, row));
    for row in live.rows() {
        let there = window.sample(row, &displacements.row(row));
        let first = rows(guess.values, row);
        let mut change = Lanes::all(0.5) * (rows(values, row) - there);
        if let Some([below, above]) = guess.bounds {
            change = limited(change, rows(below, row), rows(above, row));
        }
        values[row * 8..][..live.lanes()].copy_from_slice(&(first + change).0[..live.lanes()]);
    }
}

/// Clamps a correction to its bounds, the range of the values around the departure point. The clamp is continuous: when out-of-range
/// corrections were dropped instead, the smallest difference between two flows grew fourfold in ten steps.
#[inline(always)]
fn limited(change: Lanes, below: Lanes, above: Lanes) -> Lanes {
    let zero = Lanes::all(0.0);
    // Rounding may make a distance slightly negative.
    change.max(zero - below.max(zero)).min(above.max(zero))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_stay_in_their_bounds() {
        let within = |change| limited(Lanes::all(change), Lanes::all(1.0), Lanes::all(2.0)).0[0];
        assert_eq!([-3.0, -1.0, -0.5, 1.5, 2.5, 5.0].map(within), [-1.0, -1.0, -0.5, 1.5, 2.0, 2.0]);
        assert_eq!(limited(Lanes::all(0.1), Lanes::all(0.0), Lanes::all(-1e-9)).0, [0.0; 8]);
    }
}
