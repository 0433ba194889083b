//! Level of detail: cells of the terrain's size near what matters, and of twice the size everywhere else.
//!
//! Two liquids share one lattice of heights: a *fine* one with ground only in a box of cells, the *near* part, and a *coarse* one with
//! ground in all other cells (`ground.rs`). Outside its region a liquid has no columns, and the edge of the region is a wall. Along the
//! edge of the box, separate pipes join the two (`seam.rs`). A coarse unit is four fine ones, so volumes are counted in fine units. A
//! remainder of less than a coarse unit waits, with the scalars that it carries, and is part of the balance (`remainders.rs`). When the box
//! moves, four fine columns become a coarse one, or the reverse (`shift.rs`), and fluxes persist (`momentum.rs`). Nothing is lost.
//! `surface/` writes one mesh of both.

mod buffers;
mod frame;
mod ground;
mod momentum;
pub(super) mod remainders;
mod scalars;
mod seam;
mod shift;
pub mod surface;

use std::ops::Range;

use super::Shallow;
pub use super::columns::grid::Cells;
use super::columns::grid::Grid;
use super::params::Params;
use super::remap::Moved;
use super::sources::FlowPoint;
use super::system::{Balance, Units};
use super::terrain::Solids;
use super::terrain::shapes::Shape;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::checks::ensure;
use buffers::{Momentum, Shift};
use ground::Ground;
use remainders::Remainders;
use seam::Seam;

/// A side of a box counts as lying on a side of coarse cells if it is within this distance of it (in lengths of a coarse cell).
const ROUNDING: f64 = 1e-6;
/// Fine units in a coarse one.
const FINE_PER_COARSE: i64 = 4;

/// Liquid that flows over a terrain, in fine cells nearby and in coarse ones far away.
pub struct Detail {
    pub(super) fine: Shallow,
    pub(super) coarse: Shallow,
    ground: Ground,
    pub(super) seam: Seam,
    shift: Shift,
    momentum: Momentum,
    /// The near cells.
    pub(super) near: Cells,
    /// For each coarse cell, the liquid that does not make up a coarse unit.
    pub(super) remainders: Remainders,
    points: Vec<FlowPoint>,
    /// The state before the frame, kept if the frame may take so long that it can be cancelled; a cancel restores it.
    rollback: Vec<u8>,
}

impl Detail {
    /// Dry ground; the cells of `near` are fine. The edges of all others are twice as long, and their ground is the mean of four fine
    /// cells, layer by layer.
    ///
    /// # Errors
    /// As [`Shallow::new`]; `Argument` also if the domain has an odd count of cells along an axis, as [`Detail::set_near`], and for falls
    /// and thickening.
    pub fn new(ctx: &Context, solids: &Solids, params: Params, near: Cells) -> Result<Self> {
        params.validate()?;
        solids.grid.validate()?;
        let [nx, nz] = solids.grid.size;
        if nx % 2 + nz % 2 > 0 {
            return Err(Error::argument(format!("{nx} x {nz} cells are not an even count along both axes")));
        }
        check_near(&near, solids.grid.size)?;
        ensure(params.falls.is_none(), "liquid with a level of detail does not fall freely")?;
        check_no_thickening(&params)?;
        ensure(solids.layers() > 0, "the terrain has no surface that faces up within the domain")?;
        let ground = Ground::new(solids);
        let [of_fine, of_coarse] = Ground::excluded(&near).map(Some);
        let [fine, coarse] = ground.divided_solids(&near);
        let fine = Shallow::new_excluding(ctx, &fine, params.clone(), of_fine)?;
        let coarse = Shallow::new_excluding(ctx, &coarse, params, of_coarse)?;
        let mut detail = Self {
            remainders: Remainders::new(coarse.columns.grid.cells()),
            fine,
            coarse,
            ground,
            seam: Seam::default(),
            shift: Shift::default(),
            momentum: Momentum::default(),
            near,
            points: Vec::new(),
            rollback: Vec::new(),
        };
        detail.seam.find(&detail.fine, &detail.coarse, &detail.near);
        Ok(detail)
    }

    /// The liquid of the near cells; in all others it has no columns.
    pub fn fine(&self) -> &Shallow {
        &self.fine
    }

    /// The liquid of all other cells, of twice the size; in near cells it has no columns.
    pub fn coarse(&self) -> &Shallow {
        &self.coarse
    }

    /// The near cells.
    pub fn near(&self) -> &Cells {
        &self.near
    }

    /// Moves the near cells. Liquid keeps its volume; its surface stays level where it was.
    ///
    /// # Errors
    /// `Argument`: a box that is not within the domain, or whose sides are not at even cells.
    pub fn set_near(&mut self, near: Cells) -> Result<()> {
        check_near(&near, self.fine.columns.grid.size)?;
        if near == self.near {
            return Ok(());
        }
        let mut momentum = std::mem::take(&mut self.momentum);
        momentum.begin(self, &self.near, shift::changed(&self.near, &near));
        let old = std::mem::replace(&mut self.near, near);
        [self.fine.excluded, self.coarse.excluded] = Ground::excluded(&self.near).map(Some);
        self.convert(&old)?;
        self.seam.find(&self.fine, &self.coarse, &self.near);
        momentum.end(self);
        self.momentum = momentum;
        self.assign_points();
        Ok(())
    }

    /// Changes the terrain everywhere.
    ///
    /// # Errors
    /// As [`Shallow::update_terrain`].
    pub fn update_terrain(&mut self, solids: &Solids) -> Result<Moved> {
        if (solids.grid, solids.heights) != (self.fine.columns.grid, self.fine.columns.heights) {
            return Err(Error::argument("the terrain's cells or heights are not those of the liquid"));
        }
        ensure(solids.layers() > 0, "the terrain has no surface that faces up within the domain")?;
        self.ground = Ground::new(solids);
        let Self { ground, near, fine, coarse, .. } = &mut *self;
        // One of the two liquids may have no ground.
        let all = |liquid: &Shallow| liquid.columns.grid.size.map(|count| 0..count);
        let moved = [
            fine.update_cells(all(fine), |cell| ground.fine_cell(near, ground.fine.grid.position(cell)))?,
            coarse.update_cells(all(coarse), |cell| {
                ground.coarse_cell(near, ground.coarse.grid.position(cell))
            })?,
        ];
        Ok(self.rejoin(moved))
    }

    /// Sets the solid shapes that move over the terrain.
    ///
    /// # Errors
    /// As [`Shallow::set_bodies`].
    pub fn set_bodies(&mut self, bodies: &[Shape]) -> Result<Moved> {
        let moved = [self.fine.set_bodies(bodies)?, self.coarse.set_bodies(bodies)?];
        Ok(self.rejoin(moved))
    }

    /// Finds the pipes between both sizes again after the ground has moved; returns the combined report.
    fn rejoin(&mut self, [fine, coarse]: [Moved; 2]) -> Moved {
        if fine.cells + coarse.cells > 0 {
            self.seam.find(&self.fine, &self.coarse, &self.near);
            self.assign_points();
        }
        Moved {
            cells: fine.cells + coarse.cells,
            displaced: fine.displaced + coarse.displaced,
            held: fine.held + coarse.held,
            fallen: fine.fallen + coarse.fallen,
        }
    }

    /// The solid shapes that move over the terrain.
    pub fn bodies(&self) -> &[Shape] {
        self.fine.bodies()
    }

    /// Changes the parameters.
    ///
    /// # Errors
    /// As [`Shallow::set_params`]; also for thickening.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        check_no_thickening(&params)?;
        self.fine.set_params(params.clone())?;
        self.coarse.set_params(params)
    }

    /// Sets sources, drains and absorbers; `which` names one in an error. Each acts on the cells of the size at its centre.
    ///
    /// # Errors
    /// As [`Shallow::set_flows`].
    pub fn set_flows(&mut self, points: &[FlowPoint], which: impl Fn(usize) -> String) -> Result<()> {
        for (at, point) in points.iter().enumerate() {
            let owner = if self.is_near(point.at) { &self.fine } else { &self.coarse };
            let found = point.columns(&owner.columns);
            found.map_err(|error| Error::argument(format!("{}: {error}", which(at))))?;
        }
        self.fine.set_flows_resting(points, &which)?;
        self.coarse.set_flows_resting(points, &which)?;
        self.points = points.to_vec();
        self.assign_points();
        Ok(())
    }

    /// Gives a flow point another rate (m3/s).
    ///
    /// # Errors
    /// As [`Shallow::set_rate`].
    pub fn set_rate(&mut self, point: usize, rate: f64) -> Result<()> {
        self.fine.set_rate(point, rate)?;
        self.coarse.set_rate(point, rate)?;
        self.points[point].rate = rate;
        Ok(())
    }

    /// Pours a volume (m3; negative: takes it) as [`Shallow::pour_at`], into cells of the size at this position; returns what came in (m3).
    ///
    /// # Errors
    /// As [`Shallow::pour_at`].
    pub fn pour_at(&mut self, at: [f64; 3], radius: f64, volume: f64) -> Result<f64> {
        let is_near = self.is_near(at);
        if is_near { &mut self.fine } else { &mut self.coarse }.pour_at(at, radius, volume)
    }

    /// Fills all columns up to a height (m), as [`Shallow::fill`].
    pub fn fill(&mut self, height: f64) {
        self.fine.fill(height);
        self.coarse.fill(height);
    }

    /// What a flow point has moved since it was set (m3), in or out.
    pub fn moved(&self, point: usize) -> f64 {
        self.fine.moved(point) + self.coarse.moved(point)
    }

    /// Moves a flow point, as [`Shallow::move_flow`].
    pub fn move_flow(&mut self, point: usize, at: [f64; 3]) {
        self.points[point].at = at;
        self.fine.move_flow(point, at);
        self.coarse.move_flow(point, at);
        self.assign_points();
    }

    /// Whether a position lies over near cells.
    fn is_near(&self, [x, _, z]: [f64; 3]) -> bool {
        let grid = self.fine.columns.grid;
        let within = |axis: usize, at: f64| {
            let at = (at - grid.origin[axis]) / grid.cell;
            self.near[axis].start as f64 <= at && at < self.near[axis].end as f64
        };
        within(0, x) && within(1, z)
    }

    /// Assigns each flow point to the liquid that it acts on. Its pending units, and the count of units that it has moved, go with it.
    fn assign_points(&mut self) {
        for at in 0..self.points.len() {
            let position = self.points[at].at;
            let is_near = self.is_near(position);
            let [own, other] =
                if is_near { [&mut self.fine, &mut self.coarse] } else { [&mut self.coarse, &mut self.fine] };
            own.flow_points.move_to(&own.columns, at, position);
            let (pending, moved) = other.flow_points.deactivate(at);
            let (own_pending, own_moved) = own.flow_points.pending_and_moved(at);
            // In units of the liquid that it acts on now.
            let (pending, moved) = match is_near {
                true => (pending * FINE_PER_COARSE as f64, moved * FINE_PER_COARSE),
                false => (pending / FINE_PER_COARSE as f64, moved / FINE_PER_COARSE),
            };
            own.flow_points.set_progress(at, own_pending + pending, own_moved + moved);
        }
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.fine.time()
    }

    /// Where all the liquid is; remainders of less than a coarse unit count as held.
    pub fn balance(&self) -> Balance {
        let [fine, coarse] = [self.fine.units(), self.coarse.units()];
        let sum = |of: fn(&Units) -> i64| of(&fine) + FINE_PER_COARSE * of(&coarse);
        let Grid { cell, .. } = self.fine.columns.grid;
        let units = Units {
            inside: sum(|units| units.inside),
            poured: sum(|units| units.poured),
            sourced: sum(|units| units.sourced),
            drained: sum(|units| units.drained),
            absorbed: sum(|units| units.absorbed),
            lost: sum(|units| units.lost),
            gained: sum(|units| units.gained),
            held: sum(|units| units.held) + self.remainders.units(),
            falling: 0,
        };
        units.balance(cell * cell * self.fine.columns.heights.unit)
    }
}

fn check_no_thickening(params: &Params) -> Result<()> {
    ensure(params.thickening.is_none(), "liquid with a level of detail has no scalar that thickens it")
}

/// The smallest box of near cells that covers a rectangle, as far as it lies in the domain. `bounds`: minimum x and z, then maximum (m).
///
/// # Errors
/// `Argument`: corners that enclose nothing, or lie outside the domain.
pub fn cells_around(grid: &Grid, bounds: [f64; 4]) -> Result<Cells> {
    let [x0, z0, x1, z1] = bounds;
    // Also fails if a number is NaN.
    ensure(x0 < x1 && z0 < z1, format_args!("bounds = {bounds:?} m have no inside"))?;
    let range = |axis: usize, low: f64, high: f64| {
        let [low, high] = [low, high].map(|at| 0.5 * (at - grid.origin[axis]) / grid.cell);
        let count = (grid.size[axis] / 2) as f64;
        // Rounding errors add no cells.
        let [low, high] = [(low + ROUNDING).floor(), (high - ROUNDING).ceil()];
        2 * low.clamp(0.0, count) as usize..2 * high.clamp(0.0, count) as usize
    };
    let cells = [range(0, x0, x1), range(1, z0, z1)];
    if cells.iter().any(Range::is_empty) {
        return Err(Error::argument(format!("bounds = {bounds:?} m lie outside of the domain")));
    }
    Ok(cells)
}

pub(super) fn check_near(near: &Cells, [nx, nz]: [usize; 2]) -> Result<()> {
    let [x, z] = near;
    ensure(
        x.start < x.end && z.start < z.end && x.end <= nx && z.end <= nz,
        format_args!("near cells {x:?} x {z:?} are not a box within {nx} x {nz} cells"),
    )?;
    if [x.start, x.end, z.start, z.end].iter().any(|side| side % 2 > 0) {
        return Err(Error::argument(format!("near cells {x:?} x {z:?} do not begin and end at even ones")));
    }
    Ok(())
}
