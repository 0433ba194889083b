//! The liquid of a domain, frame by frame.

use super::clock::Clock;
use super::columns::Columns;
use super::falls::Falling;
use super::flow::Flow;
use super::flow::bands::attended;
use super::flow::lips::Lips;
use super::flows::{FlowPoint, Flows};
use super::grid::BOTTOMLESS;
use super::identity::Identity;
use super::pace::{self, MOST_STEPS, Measures, Next};
use super::params::{Friction, Params, Section};
use super::pipes::rules::{Apart, Rules};
use super::pipes::{Border, Pipes};
use super::remap::Remap;
use super::scalars::amounts::Account;
use super::terrain::Solids;
use super::thicken::Thick;
use crate::base::cpu::FlushDenormals;
use crate::context::Context;
use crate::error::{Error, Result};

/// Liquid that flows over a terrain.
pub struct Shallow {
    pub(super) params: Params,
    pub(super) columns: Columns,
    /// Where the columns change, a new one takes its place.
    pub(super) identity: Identity,
    pub(super) pipes: Pipes,
    pub(super) flow: Flow,
    pub(super) flows: Flows,
    pub(super) remap: Remap,
    pub(super) falls: Falling,
    thick: Thick,
    /// Cells that are another liquid's.
    pub(super) apart: Option<Apart>,
    /// Units poured in, less those taken out, other than by flow points.
    pub(super) poured: i64,
    /// Surface of the liquid at rest beyond an absorbing border (units), or BOTTOMLESS.
    pub(super) still: i32,
    /// Seconds since the start.
    pub(super) time: f64,
    /// Lengths of the last frame's steps (s).
    pub(super) steps: Vec<f64>,
}

/// What a frame did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Report {
    /// Count of steps.
    pub steps: u32,
    /// Simulated time (s): less than was asked for when the budget ran out.
    pub seconds: f64,
    /// Greatest depth (m).
    pub deepest: f64,
    /// Rows, summed over steps, in which columns would have given more than they had (K_min under 1).
    pub emptied: u64,
    /// Rows, summed over steps, in which columns would have taken more than they had room for (K_max under 1).
    pub filled: u64,
    /// Rows, summed over steps, in which films on slopes would have gone so fast that steps of this length could not follow, and were held back
    /// ([`Pace::Realtime`](super::params::Pace)).
    pub slowed: u64,
}

/// Where all liquid is (m3).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balance {
    /// In the columns.
    pub inside: f64,
    /// Poured in so far.
    pub poured: f64,
    /// Come in through sources.
    pub sourced: f64,
    /// Gone out through drains.
    pub drained: f64,
    /// Gone into absorbers.
    pub absorbed: f64,
    /// Gone over the border, or into the void.
    pub lost: f64,
    /// Come in over an absorbing border.
    pub gained: f64,
    /// Waiting for room, where the terrain moved.
    pub held: f64,
    /// In the air ([`Params::falls`]).
    pub falling: f64,
    /// What is missing (units): 0.
    pub error: i64,
}

impl Shallow {
    /// Dry ground.
    ///
    /// # Errors
    /// `Argument`: numbers out of range, a terrain without a surface in the domain. `Memory`: more than the context allows.
    pub fn new(ctx: &Context, solids: &Solids, params: Params) -> Result<Self> {
        Self::beside(ctx, solids, params, None)
    }

    /// As [`Shallow::new`], beside cells that are another liquid's.
    pub(super) fn beside(
        ctx: &Context,
        solids: &Solids,
        params: Params,
        apart: Option<Apart>,
    ) -> Result<Self> {
        params.validate()?;
        solids.grid.validate()?;
        let count: usize = (0..solids.grid.cells()).map(|cell| solids.cell(cell).len()).sum();
        if count == 0 && apart.is_none() {
            return Err(Error::argument("the terrain has no surface that faces up within the domain"));
        }
        let has_walls = params.friction == Friction::Walls;
        let bytes = if has_walls { BYTES + WALLS } else { BYTES };
        ctx.allow("the columns of the liquid", count as u64 * bytes)?;
        let columns = Columns::new(solids);
        let falls = params.falls.as_ref();
        let pipes = Pipes::with_rules(&columns, Rules::of(&params, &columns, apart.as_ref()));
        let mut flow = Flow::new(&columns, &pipes);
        if has_walls {
            flow.walls.turn_on(&columns);
        }
        if falls.is_some() {
            flow.lips = Lips::with_room(pipes.links.len());
        }
        Ok(Self {
            remap: Remap::new(falls.map_or(0, |falls| falls.most)),
            falls: Falling::new(falls, pipes.links.len()),
            thick: Thick::none(),
            apart,
            params,
            flow,
            pipes,
            columns,
            identity: Identity::new(),
            flows: Flows::default(),
            poured: 0,
            still: BOTTOMLESS,
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
    /// `Argument`: numbers out of range, another border, other falls, or other friction.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        if params.border != self.params.border {
            return Err(Error::argument("the border cannot change after the liquid was made"));
        }
        if params.falls != self.params.falls {
            return Err(Error::argument("falls cannot change after the liquid was made"));
        }
        if params.friction != self.params.friction {
            return Err(Error::argument("friction cannot change after the liquid was made"));
        }
        if params != self.params {
            self.flow.rouse();
        }
        self.params = params;
        Ok(())
    }

    /// Whether pools at rest are worked on all the same, which takes longer, and changes nothing else: for comparison.
    pub fn set_sleepless(&mut self, is_sleepless: bool) {
        self.flow.set_sleepless(is_sleepless);
    }

    /// The columns.
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// H of every column index (units).
    pub fn depths(&self) -> &[i32] {
        self.flow.depths()
    }

    /// Fluxes from each column index to the east and to the south: the depth (units) that they move in a step of [`Shallow::last_step`].
    pub fn fluxes(&self) -> [&[f32]; 2] {
        self.flow.flux.each_ref().map(|numbers| &numbers[..])
    }

    /// Length of the step in whose measure fluxes are (s).
    pub fn last_step(&self) -> f64 {
        self.flow.last
    }

    /// Memory of the columns, their pipes and what flows (bytes).
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

    /// Lengths of the last frame's steps (s): with them [`Shallow::replay`] makes the same frame.
    pub fn last_steps(&self) -> &[f64] {
        &self.steps
    }

    /// Sets sources, drains and absorbers; `which` names one in an error.
    ///
    /// # Errors
    /// As [`Flows::set`].
    pub fn set_flows(&mut self, points: &[FlowPoint], which: impl Fn(usize) -> String) -> Result<()> {
        self.flows.set(&self.columns, points, which)
    }

    /// Adds a depth (m; negative: takes it) to a column, between 0 and its ceiling; returns what was added (m).
    pub fn pour(&mut self, column: usize, depth: f64) -> f64 {
        let heights = self.columns.heights;
        let units = (depth / heights.unit).round().clamp(-4e9, 4e9) as i64;
        let levels = self.flow.amounts.poured;
        let added = self.flow.add(&self.columns, column, units, &levels, Account::Poured);
        self.poured += added;
        heights.length(added as f64)
    }

    /// Fills all columns up to a height (m), or their ceiling; those that are fuller stay as they are. Beyond an absorbing border liquid
    /// stands as high.
    pub fn fill(&mut self, height: f64) {
        self.still = self.columns.heights.round(height);
        self.flow.rouse();
        let level = i64::from(self.still);
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

    /// One frame of `dt` (s).
    ///
    /// The context is asked once, at the start, whether it is cancelled. The caller's thread does all the work, or, where there are many columns,
    /// the threads of its pool do, which are entered once. Nothing is allocated, locked, logged or polled by a pool without threads, but for
    /// the list of steps when it grows.
    ///
    /// # Errors
    /// `Argument`: dt is not positive and finite, or needs over a million steps. `Cancelled`, before anything changes.
    pub fn step(&mut self, ctx: &Context, dt: f64) -> Result<Report> {
        self.frame(ctx, dt, |pace| Some(pace::next(pace)))
    }

    /// As [`Shallow::step`], but when the calling thread has worked for `budget` (s), or, where several do, so long has passed, the frame ends
    /// early, and the rest of its time is dropped. At least one step is made. Another run drops other times: [`Shallow::replay`] makes the
    /// same one again.
    ///
    /// # Errors
    /// As [`Shallow::step`]; also when the budget is not positive.
    pub fn step_within(&mut self, ctx: &Context, dt: f64, budget: f64) -> Result<Report> {
        if budget.is_nan() || budget <= 0.0 {
            return Err(Error::argument(format!("a budget of {budget} s is not positive")));
        }
        let clock = Clock::start(self.flow.divide(&self.columns, ctx.pool().threads()));
        self.frame(ctx, dt, |pace| (pace.steps == 0 || clock.seconds() < budget).then(|| pace::next(pace)))
    }

    /// A frame of given steps (s), as [`Shallow::last_steps`] has listed them.
    ///
    /// # Errors
    /// As [`Shallow::step`].
    pub fn replay(&mut self, ctx: &Context, steps: &[f64]) -> Result<Report> {
        if let Some(step) = steps.iter().find(|step| step.is_nan() || **step <= 0.0) {
            return Err(Error::argument(format!("a step of {step} s is not positive")));
        }
        self.frame(ctx, steps.iter().sum(), |pace| steps.get(pace.steps as usize).copied())
    }

    fn frame(
        &mut self,
        ctx: &Context,
        dt: f64,
        next: impl Fn(&Next) -> Option<f64> + Send,
    ) -> Result<Report> {
        if !(dt > 0.0 && dt <= 1e6) {
            return Err(Error::argument(format!("a frame of {dt} s is not within 0 to 1000000 s")));
        }
        if ctx.is_cancelled() {
            return Err(Error::Cancelled);
        }
        if self.flow.divide(&self.columns, ctx.pool().threads()) {
            let threads = ctx.pool().threads();
            ctx.pool().install(|| attended(threads, || self.steps(dt, next)))
        } else {
            let _flush = FlushDenormals::begin();
            self.steps(dt, next)
        }
    }

    /// The steps of a frame, in which the liquid is as thick as what it carries makes it at the beginning.
    fn steps(&mut self, dt: f64, next: impl Fn(&Next) -> Option<f64>) -> Result<Report> {
        let Self { params, thick, columns, flow, pipes, .. } = &mut *self;
        let Some(law) = params.thickening else { return self.flow_on(dt, next) };
        thick.begin(&law, columns, flow, pipes)?;
        let report = self.flow_on(dt, next);
        self.thick.end(&mut self.pipes);
        report
    }

    fn flow_on(&mut self, dt: f64, next: impl Fn(&Next) -> Option<f64>) -> Result<Report> {
        let measures = self.measures();
        let mut report = Report::default();
        let halvings = self.begin(dt, &measures, &next);
        while report.seconds < dt {
            let left = dt - report.seconds;
            let state = self.next(&measures, left, report.steps, halvings);
            let Some(length) = next(&state) else { break };
            if report.steps == 0 && left / length > f64::from(MOST_STEPS) {
                return Err(Error::argument(format!("a frame of {dt} s would take steps of {length} s")));
            }
            self.advance(&measures, length, &mut report);
            report.seconds = if length >= left { dt } else { report.seconds + length };
        }
        report.deepest = measures.unit * f64::from(self.flow.deepest());
        Ok(report)
    }

    /// Begins a frame; returns how often its steps are halved, for fast films.
    pub(super) fn begin(&mut self, dt: f64, measures: &Measures, next: impl Fn(&Next) -> Option<f64>) -> u32 {
        self.steps.clear();
        self.flow.begin_frame(&self.columns, &self.pipes, pace::bounds(&self.params, measures));
        self.release();
        self.find_fast(dt, measures, next)
    }

    /// One step of a length (s), counted in a report.
    pub(super) fn advance(&mut self, measures: &Measures, length: f64, report: &mut Report) {
        let step = pace::step(&self.params, measures, length, self.flow.last);
        self.find_lips();
        let [emptied, filled, slowed] = self.flow.step(&self.columns, &self.pipes, &step, length);
        self.fall(length);
        self.flows.step(&self.columns, &mut self.flow, -self.params.gravity[1], self.time, length);
        self.steps.push(length);
        self.time += length;
        report.steps += 1;
        report.emptied += u64::from(emptied);
        report.filled += u64::from(filled);
        report.slowed += u64::from(slowed);
    }

    /// Where the frame is, of which so much is left (s).
    pub(super) fn next<'a>(
        &'a self,
        measures: &'a Measures,
        left: f64,
        steps: u32,
        halvings: u32,
    ) -> Next<'a> {
        let deepest = measures.unit * f64::from(self.flow.deepest());
        Next { params: &self.params, measures, left, deepest, steps, last: self.flow.last, halvings }
    }

    /// Finds the fast films of a frame, and how often they want its steps to be halved.
    fn find_fast(&mut self, dt: f64, measures: &Measures, next: impl Fn(&Next) -> Option<f64>) -> u32 {
        let Params { liquid, section, .. } = self.params;
        if liquid.viscosity == 0.0 || section == Section::Whole {
            self.flow.calm();
            return 0;
        }
        let last = self.flow.last;
        let drive = pace::drive(&self.params, measures, last);
        let longest = pace::next(&self.next(measures, dt, 0, 0));
        let farthest = 1 << pace::most_halvings(&self.params);
        let cells = self.flow.find_fast(&self.columns, drive, longest / last, farthest);
        let halvings = cells.trailing_zeros();
        if let Some(length) = next(&self.next(measures, dt, 0, halvings)) {
            let step = pace::step(&self.params, measures, length, last);
            self.flow.lighten(drive, &step);
        }
        halvings
    }

    pub(super) fn measures(&self) -> Measures {
        Measures {
            cell: self.columns.grid.cell,
            unit: self.columns.heights.unit,
            pipes: self.pipes.links.most,
            still: if self.params.border == Border::Absorbing { self.still } else { BOTTOMLESS },
        }
    }

    /// Where all liquid is.
    pub fn balance(&self) -> Balance {
        let units = self.units();
        let volume = self.columns.grid.cell * self.columns.grid.cell * self.columns.heights.unit;
        units.balance(volume)
    }

    /// Where all liquid is, in units.
    pub(super) fn units(&self) -> Units {
        Units {
            inside: self.flow.units(),
            poured: self.poured,
            sourced: self.flows.sourced,
            drained: self.flows.drained,
            absorbed: self.flows.absorbed,
            lost: self.flow.links.lost,
            gained: self.flow.links.gained,
            held: self.remap.held.units(),
            falling: self.falls.units(),
        }
    }

    /// The mean velocity of a column over its depth (m/s), along x and z: at its surface it is 1.5 times as fast (Eq. 4.4). 0 where it is dry.
    pub fn velocity(&self, index: usize) -> [f32; 2] {
        let depth = self.flow.depths()[index];
        if depth == 0 {
            return [0.0; 2];
        }
        let [east, south] = &self.flow.flux;
        let strip = index / super::columns::STRIP;
        let west = if index.is_multiple_of(super::columns::STRIP) {
            self.columns.west(strip).map_or(0.0, |_| east[index - 1])
        } else {
            east[index - 1]
        };
        let north = match self.columns.north(strip) {
            super::columns::NONE => 0.0,
            north => south[north as usize * super::columns::STRIP + index % super::columns::STRIP],
        };
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
    /// The volumes of units of a volume (m3).
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

/// Bytes of a column with its pipes, and its share of strips.
const BYTES: u64 = 64;
/// More of them for friction at walls.
const WALLS: u64 = 108;
