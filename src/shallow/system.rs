//! The liquid of a domain, and its frames.

use super::columns::Columns;
use super::columns::grid::BOTTOMLESS;
use super::free_fall::Falling;
use super::params::{Friction, Params, Section};
use super::pipes::cliffs::index_beyond;
use super::pipes::pipe_rules::{ExcludedCells, Rules};
use super::pipes::side::Side;
use super::pipes::{Border, Pipes};
use super::remap::Remap;
use super::scalars::amounts::Account;
use super::solver::Flow;
use super::solver::overflow_edges::OverflowEdges;
use super::solver::stop::Stop;
use super::solver::thickening::ThickenedPipes;
use super::sources::{FlowPoint, Flows};
use super::terrain::Solids;
use super::terrain::identity::Identity;
use super::time_step::{self, FrameProgress, Measures};
use crate::context::Context;
use crate::error::Result;
use crate::numeric::checks::ensure;

/// Liquid that flows over terrain.
pub struct Shallow {
    pub(super) params: Params,
    pub(super) columns: Columns,
    /// Replaced whenever the columns change.
    pub(super) identity: Identity,
    pub(super) pipes: Pipes,
    pub(super) flow: Flow,
    pub(super) flow_points: Flows,
    pub(super) remap: Remap,
    pub(super) falls: Falling,
    pub(super) thick: ThickenedPipes,
    /// The state before a frame that may take a long time, restored if the frame fails or is cancelled.
    pub(super) rollback: Rollback,
    /// Cells that belong to another liquid.
    pub(super) excluded: Option<ExcludedCells>,
    /// Units poured in, less those removed, other than by flow points.
    pub(super) poured: i64,
    /// Surface of the liquid at rest beyond an absorbing border (units), or BOTTOMLESS.
    pub(super) still_level: i32,
    /// Seconds since the start.
    pub(super) time: f64,
    /// Lengths of the last frame's steps (s).
    pub(super) steps: Vec<f64>,
}

/// Results of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Report {
    /// Count of steps.
    pub steps: u32,
    /// Simulated time (s): less than requested if the budget ran out.
    pub seconds: f64,
    /// Maximum depth (m).
    pub deepest: f64,
    /// Rows, summed over steps, in which columns would have given more than they had (K_min below 1).
    pub emptied: u64,
    /// Rows, summed over steps, in which columns would have received more than they had room for (K_max below 1).
    pub filled: u64,
    /// Rows, summed over steps, in which films on slopes were too fast for the step length and were limited
    /// ([`TimeStepping::Realtime`](super::params::TimeStepping)).
    pub slowed: u64,
}

/// Where all the liquid is (m3).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balance {
    /// In the columns.
    pub inside: f64,
    /// Poured in so far.
    pub poured: f64,
    /// Added by sources.
    pub sourced: f64,
    /// Removed by drains.
    pub drained: f64,
    /// Removed by absorbers.
    pub absorbed: f64,
    /// Lost over the border, or into the void.
    pub lost: f64,
    /// Entered over an absorbing border.
    pub gained: f64,
    /// Waiting for room after the terrain moved.
    pub held: f64,
    /// In the air ([`Params::falls`]).
    pub falling: f64,
    /// Units unaccounted for; always 0.
    pub error: i64,
}

impl Shallow {
    /// A dry domain.
    ///
    /// # Errors
    /// `Argument`: numbers out of range; a terrain without a surface in the domain. `Memory`: more than the context allows.
    pub fn new(ctx: &Context, solids: &Solids, params: Params) -> Result<Self> {
        Self::new_excluding(ctx, solids, params, None)
    }

    /// As [`Shallow::new`], but without the cells that belong to another liquid.
    pub(super) fn new_excluding(
        ctx: &Context,
        solids: &Solids,
        params: Params,
        excluded: Option<ExcludedCells>,
    ) -> Result<Self> {
        params.validate()?;
        solids.grid.validate()?;
        let count: usize = (0..solids.grid.cells()).map(|cell| solids.cell(cell).len()).sum();
        ensure(
            count > 0 || excluded.is_some(),
            "the terrain has no surface that faces up within the domain",
        )?;
        let has_walls = params.friction == Friction::Walls;
        let bytes = if has_walls { COLUMN_BYTES + FRICTION_BYTES } else { COLUMN_BYTES };
        ctx.allow("the columns of the liquid", count as u64 * bytes)?;
        let columns = Columns::new(solids);
        let falls = params.falls.as_ref();
        let pipes = Pipes::with_rules(&columns, Rules::of(&params, &columns, excluded.as_ref()));
        let mut flow = Flow::new(&columns, &pipes);
        if has_walls {
            flow.friction.enable(&columns);
        }
        if falls.is_some() {
            flow.overflow_edges = OverflowEdges::with_room(pipes.links.len());
        }
        Ok(Self {
            remap: Remap::new(falls.map_or(0, |falls| falls.max_packets)),
            falls: Falling::new(falls, pipes.links.len()),
            thick: ThickenedPipes::none(),
            rollback: Rollback::default(),
            excluded,
            params,
            flow,
            pipes,
            columns,
            identity: Identity::new(),
            flow_points: Flows::default(),
            poured: 0,
            still_level: BOTTOMLESS,
            time: 0.0,
            steps: Vec::with_capacity(1024),
        })
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Changes the parameters.
    ///
    /// # Errors
    /// `Argument`: numbers out of range; a different border, falls or friction.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        ensure(params.border == self.params.border, "the border cannot change after the liquid was made")?;
        ensure(params.falls == self.params.falls, "falls cannot change after the liquid was made")?;
        ensure(params.friction == self.params.friction, "friction cannot change after the liquid was made")?;
        if params != self.params {
            self.flow.wake_all();
        }
        self.params = params;
        Ok(())
    }

    /// Sets whether pools at rest are stepped, too. This is slower and has the same result: for comparison.
    pub fn set_sleepless(&mut self, is_sleepless: bool) {
        self.flow.set_sleepless(is_sleepless);
    }

    /// The columns.
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// Depth H of every column index (units).
    pub fn depths(&self) -> &[i32] {
        self.flow.depths()
    }

    /// Fluxes from each column index to the east and to the south: the depth (units) that they move in a step of [`Shallow::last_step`].
    pub fn fluxes(&self) -> [&[f32]; 2] {
        self.flow.flux.each_ref().map(|numbers| &numbers[..])
    }

    /// The step length (s) that fluxes refer to.
    pub fn last_step(&self) -> f64 {
        self.flow.last
    }

    /// Memory of the columns, their pipes and the liquid (bytes).
    pub fn bytes(&self) -> usize {
        self.columns.bytes()
            + self.pipes.bytes()
            + self.flow.bytes()
            + self.falls.bytes()
            + self.thick.bytes()
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Lengths of the last frame's steps (s): [`Shallow::replay`] repeats the frame with them.
    pub fn last_steps(&self) -> &[f64] {
        &self.steps
    }

    /// Sets sources, drains and absorbers; `which` names one in an error message.
    ///
    /// # Errors
    /// As [`Flows::set`].
    pub fn set_flows(&mut self, points: &[FlowPoint], which: impl Fn(usize) -> String) -> Result<()> {
        self.flow_points.set(&self.columns, points, which)
    }

    /// Adds a depth (m; negative: removes it) to a column, as far as its liquid and its ceiling allow; returns the depth added (m).
    pub fn pour(&mut self, column: usize, depth: f64) -> f64 {
        let heights = self.columns.heights;
        let units = (depth / heights.unit).round().clamp(-4e9, 4e9) as i64;
        let levels = self.flow.amounts.poured;
        let added = self.flow.add(&self.columns, column, units, &levels, Account::Poured);
        self.poured += added;
        heights.length(added as f64)
    }

    /// Fills all columns up to a height (m), or their ceiling; those that are fuller stay as they are. The level beyond an absorbing border
    /// is set to this height, too.
    pub fn fill(&mut self, height: f64) {
        self.still_level = self.columns.heights.round(height);
        self.flow.wake_all();
        let level = i64::from(self.still_level);
        for index in 0..self.columns.len() {
            if self.columns.is_column(index) {
                let missing =
                    level - i64::from(self.columns.bases()[index]) - i64::from(self.flow.depths()[index]);
                let levels = self.flow.amounts.poured;
                let missing = missing.max(0);
                self.poured += self.flow.add(&self.columns, index, missing, &levels, Account::Poured);
            }
        }
    }

    /// Begins a frame; returns how many times its steps are halved because of fast films.
    pub(super) fn begin_frame(
        &mut self,
        dt: f64,
        measures: &Measures,
        next: impl Fn(&FrameProgress) -> Option<f64>,
    ) -> u32 {
        self.steps.clear();
        self.flow.begin_frame(&self.columns, &self.pipes, time_step::rest_bounds(&self.params, measures));
        self.settle_held();
        self.find_fast_films(dt, measures, next)
    }

    /// One step of a length (s), counted in a report.
    pub(super) fn advance(&mut self, measures: &Measures, length: f64, report: &mut Report, stop: &Stop) {
        let step = time_step::step(&self.params, measures, length, self.flow.last);
        self.find_overflow_edges();
        let [emptied, filled, slowed] = self.flow.step(&self.columns, &self.pipes, &step, length, stop);
        self.advance_falling(length);
        self.flow_points.step(&self.columns, &mut self.flow, -self.params.gravity[1], self.time, length);
        self.steps.push(length);
        self.time += length;
        report.steps += 1;
        report.emptied += u64::from(emptied);
        report.filled += u64::from(filled);
        report.slowed += u64::from(slowed);
    }

    /// The progress of the frame, with `left` (s) to go.
    pub(super) fn progress<'a>(
        &'a self,
        measures: &'a Measures,
        left: f64,
        steps: u32,
        halvings: u32,
    ) -> FrameProgress<'a> {
        let deepest = measures.unit * f64::from(self.flow.bands.deepest());
        FrameProgress { params: &self.params, measures, left, deepest, steps, last: self.flow.last, halvings }
    }

    /// Finds the fast films of a frame; returns how many times its steps must be halved for them.
    fn find_fast_films(
        &mut self,
        dt: f64,
        measures: &Measures,
        next: impl Fn(&FrameProgress) -> Option<f64>,
    ) -> u32 {
        let Params { liquid, section, .. } = self.params;
        if liquid.viscosity == 0.0 || section == Section::Whole {
            self.flow.fast.clear();
            return 0;
        }
        let last = self.flow.last;
        let drive = time_step::drive(&self.params, measures, last);
        let longest = time_step::next_length(&self.progress(measures, dt, 0, 0));
        let max_cells = 1 << time_step::max_halvings(&self.params);
        let cells = self.flow.find_fast_films(&self.columns, drive, longest / last, max_cells);
        let halvings = cells.trailing_zeros();
        if let Some(length) = next(&self.progress(measures, dt, 0, halvings)) {
            let step = time_step::step(&self.params, measures, length, last);
            self.flow.reduce_inertia(drive, &step);
        }
        halvings
    }

    pub(super) fn measures(&self) -> Measures {
        Measures {
            cell: self.columns.grid.cell,
            unit: self.columns.heights.unit,
            pipes: self.pipes.links.max_pipes,
            still_level: if self.params.border == Border::Absorbing { self.still_level } else { BOTTOMLESS },
        }
    }

    /// Where all the liquid is.
    pub fn balance(&self) -> Balance {
        let units = self.units();
        let volume = self.columns.grid.cell * self.columns.grid.cell * self.columns.heights.unit;
        units.balance(volume)
    }

    /// Where all the liquid is, in units.
    pub(super) fn units(&self) -> Units {
        Units {
            inside: self.flow.units(),
            poured: self.poured,
            sourced: self.flow_points.sourced,
            drained: self.flow_points.drained,
            absorbed: self.flow_points.absorbed,
            lost: self.flow.links.lost,
            gained: self.flow.links.gained,
            held: self.remap.held.units(),
            falling: self.falls.units(),
        }
    }

    /// Mean velocity of a column over its depth (m/s), along x and z; the surface moves 1.5 times as fast (Eq. 4.4). 0 where it is dry.
    pub fn velocity(&self, index: usize) -> [f32; 2] {
        let depth = self.flow.depths()[index];
        if depth == 0 {
            return [0.0; 2];
        }
        let [east, south] = &self.flow.flux;
        let inflow =
            |flux: &[f32], side| index_beyond(&self.columns, index, side).map_or(0.0, |before| flux[before]);
        let (west, north) = (inflow(east, Side::West), inflow(south, Side::North));
        let scale = (0.5 * self.columns.grid.cell / self.flow.last) as f32 / depth as f32;
        [(east[index] + west) * scale, (south[index] + north) * scale]
    }
}

/// As [`Balance`], in units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    pub inside: i64,
    pub poured: i64,
    pub sourced: i64,
    pub drained: i64,
    pub absorbed: i64,
    pub lost: i64,
    pub gained: i64,
    pub held: i64,
    pub falling: i64,
}

impl Units {
    /// The volumes (m3), given the volume of a unit.
    pub fn balance(&self, volume: f64) -> Balance {
        let Self { inside, poured, sourced, drained, absorbed, lost, gained, held, falling } = *self;
        let cubic = |units: i64| units as f64 * volume;
        Balance {
            inside: cubic(inside),
            poured: cubic(poured),
            sourced: cubic(sourced),
            drained: cubic(drained),
            absorbed: cubic(absorbed),
            lost: cubic(lost),
            gained: cubic(gained),
            held: cubic(held),
            falling: cubic(falling),
            error: poured + sourced + gained - drained - absorbed - lost - inside - held - falling,
        }
    }
}

/// Bytes of a column with its pipes, and its share of a strip's data.
const COLUMN_BYTES: u64 = 64;
/// Additional bytes for friction at walls.
const FRICTION_BYTES: u64 = 108;

/// The state at the beginning of a frame, and the steps of the frame before.
#[derive(Debug, Default)]
pub(super) struct Rollback {
    pub state: Vec<u8>,
    pub steps: Vec<f64>,
}
