//! Mist: powder that fast grains raise into the air (thesis section 3.4).
//!
//! The air flows as an incompressible gas ([`crate::flow`]) in and around the mist. Air with mist is heavier than the air around it, so
//! gravity acts only there. Mist reads grains and never changes them; its mass is not taken from theirs, and dissipates.

mod forces;
#[cfg(feature = "vdb")]
mod grids;
mod params;
mod sources;
mod state;
#[cfg(feature = "vdb")]
mod surroundings;

use rayon::prelude::*;

use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::flow::{Coord, FARTHEST, Flow, FlowState, MassConservation, Solids, Tiles, tiles};
use crate::numeric::checks::ensure;
use sources::Seed;

pub use forces::wind::Wind;
#[cfg(feature = "vdb")]
pub use grids::Grids;
pub use params::{FASTEST_WIND, Params};
pub use sources::{Source, Start};
#[cfg(feature = "vdb")]
pub use surroundings::{Surroundings, Walls};

/// Fraction of the faces at which air may be too fast for a sub-step; such air is pressed through gaps as narrow as a cell, and its path is
/// clamped to [`FARTHEST`] cells. Otherwise a dozen such cells among two million would nearly double the sub-steps of a sleigh's mist.
const JET_SHARE: f64 = 1.0e-4;
/// Density below which there is no mist.
pub const MIN_DENSITY: f32 = 2.0e-3;
/// Density from which a tile is padded with air, so that its mist may spread there. Thinner mist is invisible and only moves within
/// existing tiles: otherwise a few fast grains would open hundreds of tiles for a litre of mist.
const DENSE: f32 = 0.02;
/// Maximum length (s) of a sub-step. The length affects how far mist spreads, and how often grains fill the cells that they cross: it is
/// chosen so that frames of 1/24, 1/48 and 1/96 s have the same sub-steps.
const MAX_SUB_STEP: f64 = 1.0 / 96.0;
/// Maximum number of sub-steps of a step, and of parts of a sub-step.
const MAX_SUB_STEPS: usize = 1000;

/// Results of a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// Number of active cells after the step.
    pub cells: usize,
    /// Sum of the density, times the volume of a cell (m3).
    pub mass: f64,
    /// Number of grains that raised mist.
    pub sources: usize,
    /// Number of sub-steps.
    pub sub_steps: usize,
    /// Iterations of all pressure projections in the mist's own grid.
    pub iterations: usize,
    /// Largest divergence that remained in the mist's own grid after a projection, times the edge of a cell, relative to the largest speed
    /// before that projection.
    pub divergence: f32,
    /// Largest speed (m/s) on any axis.
    pub fastest: f32,
    /// Wall-clock time of each phase.
    pub phases: Vec<PhaseTime>,
}

/// Maximum bytes that a step takes for each active cell, including the surrounding air and solids.
const BYTES_PER_CELL: u64 = 220;

/// Estimated memory (bytes) of a step with this many active tiles of 512 cells; a step that would exceed the context's limit is refused.
pub fn memory(tiles: usize) -> u64 {
    512 * tiles as u64 * BYTES_PER_CELL
}

/// Returns the open fractions and speeds of the faces, given the tiles, the edge (m) of their cells, and the time as a share (0..=1) of the
/// step.
pub type Boundary<'a> = dyn Fn(&Tiles, f32, f64) -> Result<Solids> + Sync + 'a;

/// Inputs of a step of mist besides the mist itself.
pub struct StepInputs<'a> {
    /// Grains; the fast ones raise mist.
    pub sources: &'a [Source],
    /// Obstacles that the air flows around.
    pub boundary: &'a Boundary<'a>,
    /// Largest speed (m/s) of these obstacles.
    pub fastest: f64,
    /// Wind that varies in space; none: [`Params::wind`] everywhere.
    pub wind: Option<&'a Wind<'a>>,
}

/// Mist in the air.
#[derive(Debug)]
pub struct Mist {
    params: Params,
    flow: Flow,
    /// The flow before the step, to restore if the step fails.
    before: FlowState,
}

impl Clone for Mist {
    /// A copy of the state that is carried from step to step.
    fn clone(&self) -> Self {
        Self { params: self.params.clone(), flow: self.flow.copy(), before: FlowState::default() }
    }
}

impl Mist {
    /// No mist yet.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn new(params: Params) -> Result<Self> {
        params.validate()?;
        let flow = Flow::new(params.cell, params.wind.map(|x| x as f32))?;
        Ok(Self { params, flow, before: FlowState::default() })
    }

    /// Resumes from a state that [`Mist::save`] wrote.
    ///
    /// # Errors
    /// A parameter out of range; bytes that are not a valid state.
    pub fn resume(params: Params, bytes: &[u8]) -> Result<Self> {
        let mut mist = Self::new(params)?;
        state::load(&mut mist, bytes)?;
        Ok(mist)
    }

    /// Unpacked size (bytes) of a saved state; 0 if it is invalid.
    pub fn unpacked_size(bytes: &[u8]) -> u64 {
        state::unpacked_size(bytes)
    }

    /// The exact state as bytes, the same for any number of threads.
    pub fn save(&self) -> Vec<u8> {
        state::save(self)
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Sets the parameters from the next step on.
    ///
    /// # Errors
    /// A parameter out of range, another cell size or another wind; the old parameters are then kept.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        let old = &self.params;
        if params.cell != old.cell {
            return Err(Error::argument(format!("cell = {} cannot change, it is {}", params.cell, old.cell)));
        }
        ensure(
            params.wind == old.wind,
            format_args!("wind = {:?} cannot change, it is {:?}", params.wind, old.wind),
        )?;
        self.params = params;
        Ok(())
    }

    /// The air: velocity and density.
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Adds mist to tiles: `of` returns the density and velocity (m/s) of a cell; a density of 0 adds none.
    pub fn add(&mut self, tiles: &[Coord], of: impl Fn([i32; 3]) -> (f32, [f32; 3])) {
        let seeds = sources::new_mist::seeds(tiles, of);
        self.flow.resize(&self.needed_tiles(&seeds));
        self.add_seeds(&seeds);
    }

    /// Moves the mist from `from` to `to` (s), while grains raise more. A step that fails or is cancelled leaves it unchanged.
    ///
    /// # Errors
    /// Times that do not ascend; a grain that is not finite or is too large; air that moves too fast for its cells; more memory than the
    /// context allows; cancel; errors of the boundary.
    pub fn step(&mut self, ctx: &Context, around: &StepInputs<'_>, times: [f64; 2]) -> Result<StepReport> {
        let [from, to] = times;
        ensure(
            to > from && (to - from).is_finite(),
            format_args!("the length of a step, {from} s to {to} s, must be positive and finite"),
        )?;
        around.sources.iter().try_for_each(|source| source.check(self.params.cell))?;
        let raising = around.sources.iter().filter(|source| source.raises(&self.params));
        let raising: Vec<Source> = raising.copied().collect();
        ctx.pool().install(|| self.before.copy_from(&self.flow));
        let around = StepInputs { sources: &raising, ..*around };
        match ctx.step(1, || ctx.phase("flow", || self.run_sub_steps(ctx, &around, times))) {
            Ok((report, phases)) => Ok(StepReport { sources: raising.len(), phases, ..report }),
            Err(error) => {
                self.flow.restore(&mut self.before);
                Err(error)
            }
        }
    }

    /// Moves the mist in sub-steps; in each of them grains raise more along their paths.
    fn run_sub_steps(
        &mut self,
        ctx: &Context,
        around: &StepInputs<'_>,
        [from, to]: [f64; 2],
    ) -> Result<StepReport> {
        let sub_steps = self.sub_steps(around, to - from)?;
        let part = (to - from) / sub_steps as f64;
        let mut report = StepReport { sub_steps, ..StepReport::default() };
        ctx.expect(sub_steps);
        for sub in 0..sub_steps {
            ctx.check()?;
            let shares = [sub, sub + 1].map(|sub| sub as f64 / sub_steps as f64);
            self.apply_forces(ctx, around.wind, from + part * sub as f64, part)?;
            let boundary = |tiles: &Tiles, cell: f32| (around.boundary)(tiles, cell, shares[1]);
            let solved = self.flow.project(ctx, &boundary, self.params.tolerance as f32)?;
            report.iterations += solved.iterations;
            if solved.fastest > 0.0 {
                report.divergence = report.divergence.max(solved.divergence / solved.fastest);
            }
            self.flow.clear_covered();
            self.advect(ctx, part)?;
            // Last, so that new mist is where its grains were and begins to move in the next sub-step.
            self.raise(ctx, around.sources, to - from, shares)?;
            ctx.advance();
        }
        report.cells = 512 * self.flow.tiles().active();
        report.mass = self.mass();
        report.fastest = self.flow.fastest();
        Ok(report)
    }

    /// Number of sub-steps such that neither the air nor a grain nor an object moves farther than [`FARTHEST`] cells in one.
    fn sub_steps(&self, around: &StepInputs<'_>, dt: f64) -> Result<usize> {
        let speeds = around.sources.iter().map(Source::fastest);
        let fastest = speeds.fold(self.bulk_speed(), |max, speed| max.max(speed));
        let speed = f64::from(fastest).max(around.fastest) + self.params.gravity.abs() * dt;
        // Each sub-step of maximum length is divided into the same whole number of parts, so that frames of other lengths have the same
        // sub-steps.
        let min = ((dt / MAX_SUB_STEP * (1.0 - 1.0e-9)).ceil() as usize).clamp(1, MAX_SUB_STEPS);
        Ok(self.parts(speed, dt)?.div_ceil(min) * min)
    }

    /// Speed (m/s) that the air does not exceed, except in jets.
    fn bulk_speed(&self) -> f32 {
        self.flow.fastest_except(JET_SHARE).min(self.flow.fastest())
    }

    /// Number of parts into which a time (s) is divided for a speed (m/s).
    fn parts(&self, speed: f64, dt: f64) -> Result<usize> {
        let count = (speed * dt / (f64::from(FARTHEST) * self.params.cell)).ceil();
        ensure(
            count <= MAX_SUB_STEPS as f64,
            format_args!(
                "mist moves at {speed:.0} m/s: in {dt:.4} s it passes more than {MAX_SUB_STEPS} times {FARTHEST} cells of {} m",
                self.params.cell
            ),
        )?;
        Ok((count as usize).max(1))
    }

    /// Adds the mist that grains raise in a step of `dt` (s) along the part of their paths between two fractions (0..=1) of the step.
    fn raise(&mut self, ctx: &Context, sources: &[Source], dt: f64, shares: [f64; 2]) -> Result<()> {
        let paths = sources::paths(sources, &self.params, dt, shares);
        let seeds = sources::seeds(ctx, &paths, &self.params)?;
        let needed_tiles = self.needed_tiles(&seeds);
        let what = format!("mist of {} cells of {:.4} m", 512 * needed_tiles.len(), self.params.cell);
        ctx.allow(&what, memory(needed_tiles.len()))?;
        self.flow.resize(&needed_tiles);
        self.add_seeds(&seeds);
        Ok(())
    }

    /// Applies the forces to the air for `dt` (s) from a time (s) on.
    fn apply_forces(&mut self, ctx: &Context, wind: Option<&Wind<'_>>, time: f64, dt: f64) -> Result<()> {
        forces::apply_gravity(&mut self.flow, (self.params.gravity * dt) as f32);
        if let Some(wind) = wind {
            wind.blow(ctx, &mut self.flow, dt)?;
        }
        forces::turbulence::stir(ctx, &mut self.flow, &self.params, time, dt)?;
        if self.params.confinement > 0.0 {
            self.flow.confine(ctx, (self.params.confinement * dt) as f32)?;
        }
        Ok(())
    }

    /// Advects the air and the mist for `dt` (s); some of the mist dissipates.
    fn advect(&mut self, ctx: &Context, dt: f64) -> Result<()> {
        self.flow.prepare_advection();
        // The boundary may have made the air faster than it was when the sub-steps were chosen.
        let parts = self.parts(f64::from(self.bulk_speed()), dt)?;
        let part = dt / parts as f64;
        let conservation = MassConservation {
            kept_share: libm::exp2(-part / self.params.half_life) as f32,
            fade_below: MIN_DENSITY,
        };
        (0..parts).try_for_each(|_| self.flow.advect_conserving(ctx, part, conservation))
    }

    /// Sum of the density, times the volume of a cell (m3).
    pub fn mass(&self) -> f64 {
        let of_tile = |tile: &crate::flow::Tile| tile.iter().map(|value| f64::from(*value)).sum::<f64>();
        let sums: Vec<f64> = self.flow.density().par_iter().map(of_tile).collect();
        (sums.iter().sum::<f64>() + 0.0) * self.params.cell.powi(3)
    }

    /// The tiles that hold mist or will receive some, and padding around those whose density is visible.
    fn needed_tiles(&self, seeds: &[Seed]) -> Vec<Coord> {
        let max = |tile: &crate::flow::Tile| tile.iter().fold(0.0f32, |max, density| max.max(*density));
        let held = self.flow.tiles().coords().iter().zip(self.flow.density());
        let held = held.map(|(coord, tile)| (*coord, max(tile)));
        let new = seeds.iter().map(|seed| (seed.coord, max(&seed.density)));
        let all: Vec<(Coord, f32)> = held.chain(new).filter(|(_, max)| *max > MIN_DENSITY).collect();
        let mut dense: Vec<Coord> =
            all.iter().filter(|(_, max)| *max > DENSE).map(|(coord, _)| *coord).collect();
        dense.sort_unstable();
        dense.dedup();
        let mut needed_tiles = tiles::bordered(&dense, self.params.padding as usize);
        needed_tiles.extend(all.iter().map(|(coord, _)| *coord));
        needed_tiles.sort_unstable();
        needed_tiles.dedup();
        needed_tiles
    }
}
