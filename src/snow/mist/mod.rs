//! Mist: powder that fast grains raise into the air (thesis section 3.4).
//!
//! The air flows as an incompressible gas ([`crate::flow`]) where there is mist and some way around it. Where there is mist it is
//! heavier than the air around, so that gravity acts there alone. Mist reads grains and never changes them; what it holds is not
//! taken from theirs, and dissipates.

mod forces;
mod params;
mod sources;

use rayon::prelude::*;

use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::flow::{Coord, FARTHEST, Flow, Scheme, Solids, Tiles, tiles};

pub use params::Params;
pub use sources::Source;

/// Density under which there is no mist.
pub const LEAST: f32 = 1.0e-4;
/// Greatest factor by which mass that advection lost is put back in a sub-step.
const MOST_GAIN: f64 = 1.1;
/// Most sub-steps of a step.
const MOST: usize = 1000;

/// What a step did.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Count of active cells after it.
    pub cells: usize,
    /// Sum of the density, times the volume of a cell (m3).
    pub mass: f64,
    /// Count of grains that raised mist.
    pub sources: usize,
    /// Count of sub-steps.
    pub sub_steps: usize,
    /// Iterations of all its projections.
    pub iterations: usize,
    /// Greatest divergence times the cell that a projection left, over the greatest speed before.
    pub divergence: f32,
    /// Greatest speed (m/s) on any axis.
    pub fastest: f32,
    /// Wall-clock time of each phase.
    pub phases: Vec<PhaseTime>,
}

/// Open shares and speeds of faces for tiles with cells of an edge (m), at a share 0..=1 of a step.
pub type Boundary<'a> = dyn Fn(&Tiles, f32, f64) -> Result<Solids> + Sync + 'a;

/// Mist in the air.
#[derive(Debug)]
pub struct Mist {
    params: Params,
    flow: Flow,
}

impl Mist {
    /// No mist yet.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn new(params: Params) -> Result<Self> {
        params.validate()?;
        let flow = Flow::new(params.cell, params.wind.map(|x| x as f32))?;
        Ok(Self { params, flow })
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The air: velocity and density.
    pub fn flow(&self) -> &Flow {
        &self.flow
    }

    /// Adds mist: density and velocity (m/s) at a cell, none where the density is 0.
    pub fn add(&mut self, tiles: &[Coord], of: impl Fn([i32; 3]) -> (f32, [f32; 3])) {
        let seed = |coord: &Coord| {
            let (mut density, mut velocity) = (Box::new([0.0; 512]), Box::new([[0.0; 512]; 3]));
            for cell in 0..512usize {
                let at = [cell >> 6, cell >> 3 & 7, cell & 7];
                let (value, speed) = of([0, 1, 2].map(|axis| coord[axis] * 8 + at[axis] as i32));
                density[cell] = value;
                (0..3).for_each(|axis| velocity[axis][cell] = speed[axis]);
            }
            sources::Seed { coord: *coord, density, velocity }
        };
        let seeds: Vec<sources::Seed> = tiles.iter().map(seed).collect();
        self.sow(&seeds);
    }

    /// Moves the mist through a step of `dt` (s), in which grains raise more of it. After an error it is somewhere within the
    /// step: it must not be stepped any further.
    ///
    /// # Errors
    /// A time that is not positive; cancel; errors of the boundary.
    pub fn step(
        &mut self,
        ctx: &Context,
        sources: &[Source],
        boundary: &Boundary<'_>,
        dt: f64,
    ) -> Result<StepReport> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(Error::argument(format!("dt = {dt} is not over 0")));
        }
        let raising: Vec<Source> =
            sources.iter().filter(|source| source.raises(&self.params)).copied().collect();
        let (mut report, phases) =
            ctx.step(1, || ctx.phase("flow", || self.carry(ctx, &raising, boundary, dt)))?;
        (report.sources, report.phases) = (raising.len(), phases);
        Ok(report)
    }

    /// Count of sub-steps in which nothing moves farther than [`FARTHEST`] cells.
    fn sub_steps(&self, sources: &[Source], dt: f64) -> usize {
        let speeds = sources.iter().flat_map(|source| source.velocity);
        let fastest = speeds.fold(self.flow.fastest(), |most, speed| most.max(speed.abs()));
        let speed = f64::from(fastest) + self.params.gravity.abs() * dt;
        let count = (speed * dt / (f64::from(FARTHEST) * self.params.cell)).ceil();
        (count as usize).clamp(1, MOST)
    }
}

impl Mist {
    /// Moves the mist in sub-steps, in each of which grains raise more along their way.
    fn carry(
        &mut self,
        ctx: &Context,
        sources: &[Source],
        boundary: &Boundary<'_>,
        dt: f64,
    ) -> Result<StepReport> {
        let sub_steps = self.sub_steps(sources, dt);
        let part = dt / sub_steps as f64;
        let mut report = StepReport {
            cells: 0,
            mass: 0.0,
            sources: 0,
            sub_steps,
            iterations: 0,
            divergence: 0.0,
            fastest: 0.0,
            phases: Vec::new(),
        };
        ctx.expect(sub_steps);
        for sub in 0..sub_steps {
            ctx.check()?;
            let [from, share] = [sub, sub + 1].map(|sub| sub as f64 / sub_steps as f64);
            self.sow(&sources::seeds(&sources::ways(sources, &self.params, dt, [from, share]), &self.params));
            let boundary = |tiles: &Tiles, cell: f32| boundary(tiles, cell, share);
            forces::fall(&mut self.flow, (self.params.gravity * part) as f32);
            let solved = self.flow.project(ctx, &boundary, self.params.tolerance as f32)?;
            report.iterations += solved.iterations;
            if solved.fastest > 0.0 {
                report.divergence = report.divergence.max(solved.divergence / solved.fastest);
            }
            let mass = self.mass();
            self.flow.advect(part, Scheme::MacCormack);
            self.settle(mass * libm::exp2(-part / self.params.half_life));
            ctx.advance();
        }
        report.cells = 512 * self.flow.tiles().active();
        report.mass = self.mass();
        report.fastest = self.flow.fastest();
        Ok(report)
    }

    /// Sum of the density, times the volume of a cell (m3).
    pub fn mass(&self) -> f64 {
        let of_tile = |tile: &crate::flow::Tile| tile.iter().map(|value| f64::from(*value)).sum::<f64>();
        let sums: Vec<f64> = self.flow.density().par_iter().map(of_tile).collect();
        sums.iter().sum::<f64>() * self.params.cell.powi(3)
    }

    /// Makes the tiles that hold mist, and others, active, with padding.
    fn follow(&mut self, others: &[Coord]) {
        let holds = |tile: &crate::flow::Tile| tile.iter().any(|density| *density > LEAST);
        let held = self.flow.tiles().coords().iter().zip(self.flow.density());
        let mut wanted: Vec<Coord> = held
            .filter(|(_, tile)| holds(tile))
            .map(|(coord, _)| *coord)
            .chain(others.iter().copied())
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        self.flow.resize(&tiles::padded(&wanted, self.params.padding as i32));
    }

    /// Puts new mist into the air: the greater density counts, and the air takes the new one's velocity as far as it fills the
    /// cells.
    fn sow(&mut self, seeds: &[sources::Seed]) {
        let coords: Vec<Coord> = seeds.iter().map(|seed| seed.coord).collect();
        self.follow(&coords);
        let (tiles, velocity, density) = self.flow.fields();
        let of = |slot: usize| {
            let coord = tiles.coords().get(slot)?;
            coords.binary_search(coord).ok().map(|index| &seeds[index])
        };
        for (axis, field) in velocity.iter_mut().enumerate() {
            field.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, speeds)| {
                let below = tiles.neighbours()[slot][tiles::FACES[2 * axis]] as usize;
                let (own, below) = (of(slot), of(below));
                if own.is_none() && below.is_none() {
                    return;
                }
                let step = 64 >> (3 * axis);
                let read = |seed: Option<&sources::Seed>, cell: usize| {
                    seed.map_or((0.0, 0.0), |seed| (seed.density[cell], seed.velocity[axis][cell]))
                };
                for (cell, speed) in speeds.iter_mut().enumerate() {
                    let lower = match cell / step % 8 {
                        0 => read(below, cell + 7 * step),
                        _ => read(own, cell - step),
                    };
                    let upper = read(own, cell);
                    let sum = lower.0 + upper.0;
                    if sum > 0.0 {
                        let wanted = (lower.0 * lower.1 + upper.0 * upper.1) / sum;
                        *speed += (0.5 * sum).min(1.0) * (wanted - *speed);
                    }
                }
            });
        }
        density.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, tile)| {
            if let Some(seed) = of(slot) {
                tile.iter_mut().zip(seed.density.iter()).for_each(|(old, new)| *old = old.max(*new));
            }
        });
    }

    /// Makes the mass (m3) what it should be: advection does not keep it, and of almost no mist nothing is left.
    fn settle(&mut self, mass: f64) {
        let (_, _, density) = self.flow.fields();
        density.par_iter_mut().with_min_len(64).for_each(|tile| {
            tile.iter_mut().filter(|value| **value < LEAST).for_each(|value| *value = 0.0);
        });
        let share = mass / self.mass();
        if share.is_finite() {
            // Mist of which nearly all was cut off must not come back in what is left.
            let share = share.min(MOST_GAIN) as f32;
            let (_, _, density) = self.flow.fields();
            density.par_iter_mut().with_min_len(64).flatten().for_each(|value| *value *= share);
        }
    }
}
