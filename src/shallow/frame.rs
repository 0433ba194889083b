//! Frames: the choice of their steps, and how they end. A frame that fails or is cancelled leaves the liquid as it was.
//!
//! To allow this, a frame that may take a long time first copies what it changes, 20 bytes a column where there is liquid. It checks for
//! cancellation between its steps, and between the iterations that find the heads of full columns. Other frames are too short for a cancel
//! to matter, and copy nothing.

use std::sync::atomic::AtomicBool;

use super::clock::Clock;
use super::params::TimeStepping;
use super::solver::rows::bands::with_spinning_threads;
use super::solver::stop::Stop;
use super::system::{Report, Shallow};
use super::time_step::{self, FrameProgress, LENGTHS, MAX_STEPS, Measures};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::checks::ensure;
use crate::numeric::cpu::FlushDenormals;
use crate::numeric::digits;

/// Columns times steps above which a frame counts as long: some 20 ms.
const LONG_FRAME: f64 = (1 << 21) as f64;
/// Fixed cost of a step, in columns.
const STEP_COST: f64 = 1024.0;
/// Cost of a column that may be full, in columns: its head is found iteratively.
const FULL_COST: f64 = 16.0;

/// Checks the length of a frame.
pub(super) fn check_length(dt: f64) -> Result<()> {
    if LENGTHS.contains(&dt) {
        return Ok(());
    }
    Err(out_of_range("frame", dt))
}

/// The error for a length (s) of a frame or a step that is out of range.
fn out_of_range(noun: &str, length: f64) -> Error {
    let (min, max) = LENGTHS.into_inner();
    let [min, max] = [min, max].map(digits::bound);
    Error::argument(format!("a {noun} of {} s is not within {min} to {max} s", digits::given(length)))
}

/// The error for a frame that would take too many steps; raised after some of them.
pub(super) fn too_many_steps(dt: f64, done: f64, length: f64) -> Error {
    let [dt, done, length] = [dt, done, length].map(digits::given);
    Error::argument(format!(
        "a frame of {dt} s takes over {MAX_STEPS} steps: after {done} s, the next step is only {length} s long"
    ))
}

impl Shallow {
    /// One frame of `dt` (s), 1e-12 to 1e6.
    ///
    /// Cancellation is checked at the start and, if the frame may take a long time (it has exact steps or many full columns, or its columns
    /// times its steps exceed about two million), every few milliseconds. The caller's thread does all the work or, with many columns, the
    /// context's pool, which is entered once. With a pool without threads, nothing is allocated, locked, logged or polled, except that the
    /// list of steps may grow.
    ///
    /// # Errors
    /// `Argument`: dt out of range, or over a million steps needed. `Cancelled`. In either case the liquid is as it was.
    pub fn step(&mut self, ctx: &Context, dt: f64) -> Result<Report> {
        self.frame(ctx, dt, None, |progress| Some(time_step::next_length(progress)))
    }

    /// As [`Shallow::step`], but the frame ends early, and the rest of its time is dropped, once the calling thread has worked for `budget`
    /// (s); where several threads work, wall-clock time counts. At least one step is made. Another run may end elsewhere:
    /// [`Shallow::replay`] repeats a frame exactly.
    ///
    /// # Errors
    /// As [`Shallow::step`]; also when the budget is not positive.
    pub fn step_within(&mut self, ctx: &Context, dt: f64, budget: f64) -> Result<Report> {
        ensure(budget > 0.0, format_args!("a budget of {budget} s is not positive"))?;
        let clock = Clock::start(self.flow.divide(&self.columns, ctx.pool().threads()));
        let next = |progress: &FrameProgress| {
            (progress.steps == 0 || clock.seconds() < budget).then(|| time_step::next_length(progress))
        };
        self.frame(ctx, dt, None, next)
    }

    /// A frame of given steps (s), as listed by [`Shallow::last_steps`].
    ///
    /// # Errors
    /// As [`Shallow::step`].
    pub fn replay(&mut self, ctx: &Context, steps: &[f64]) -> Result<Report> {
        if let Some(step) = steps.iter().find(|step| !LENGTHS.contains(*step)) {
            return Err(out_of_range("step", *step));
        }
        let next = |progress: &FrameProgress| steps.get(progress.steps as usize).copied();
        self.frame(ctx, steps.iter().sum(), Some(steps.len()), next)
    }

    /// A frame; `count` is the number of its steps, if known.
    fn frame(
        &mut self,
        ctx: &Context,
        dt: f64,
        count: Option<usize>,
        next: impl Fn(&FrameProgress) -> Option<f64> + Send,
    ) -> Result<Report> {
        check_length(dt)?;
        let running = ctx.begin_light();
        if ctx.is_cancelled() {
            return Err(Error::Cancelled);
        }
        let cancel = running.latch();
        if self.flow.divide(&self.columns, ctx.pool().threads()) {
            let threads = ctx.pool().threads();
            ctx.pool().install(|| {
                with_spinning_threads(threads, || self.frame_or_rollback(dt, count, next, cancel))
            })
        } else {
            let _flush = FlushDenormals::begin();
            self.frame_or_rollback(dt, count, next, cancel)
        }
    }

    /// Makes all steps, or restores the liquid.
    fn frame_or_rollback(
        &mut self,
        dt: f64,
        count: Option<usize>,
        next: impl Fn(&FrameProgress) -> Option<f64>,
        cancel: &AtomicBool,
    ) -> Result<Report> {
        if !self.may_take_long(dt, count) {
            return self.run_thickened(dt, next, &Stop::NEVER);
        }
        self.save_rollback();
        let result = self.run_thickened(dt, next, &Stop::when(cancel));
        if result.is_err() {
            self.roll_back();
        }
        result
    }

    /// Whether a frame may take so long that it should be cancellable; `count` is the number of its steps, if known.
    pub(super) fn may_take_long(&mut self, dt: f64, count: Option<usize>) -> bool {
        let steps = match (count, self.params.pace) {
            // Given steps may be so long that columns fill up during the frame; the number of exact steps is only known at the end.
            (Some(_), _) | (None, TimeStepping::Exact) => return true,
            (None, TimeStepping::Realtime(longest)) => (dt / longest).max(1.0),
        };
        let [wet, full] = self.flow.work(&self.columns).map(|count| count as f64);
        steps * (STEP_COST + wet + FULL_COST * full) > LONG_FRAME
    }

    fn save_rollback(&mut self) {
        let mut saved = std::mem::take(&mut self.rollback);
        // The maximum size, so that no more memory is needed when the liquid spreads.
        saved.state.clear();
        saved.state.reserve(self.max_save_size());
        self.save_into(&mut saved.state);
        saved.steps.clone_from(&self.steps);
        self.rollback = saved;
    }

    fn roll_back(&mut self) {
        let saved = std::mem::take(&mut self.rollback);
        self.put_back(&saved.state);
        self.steps.clone_from(&saved.steps);
        self.rollback = saved;
    }

    /// Makes the steps of a frame, with the viscosities that follow from the scalars at its beginning.
    fn run_thickened(
        &mut self,
        dt: f64,
        next: impl Fn(&FrameProgress) -> Option<f64>,
        stop: &Stop,
    ) -> Result<Report> {
        let Self { params, thick, columns, flow, pipes, .. } = &mut *self;
        let Some(law) = params.thickening else { return self.run_steps(dt, next, stop) };
        thick.begin(&law, columns, flow, pipes)?;
        let report = self.run_steps(dt, next, stop);
        self.thick.end(&mut self.pipes);
        report
    }

    fn run_steps(
        &mut self,
        dt: f64,
        next: impl Fn(&FrameProgress) -> Option<f64>,
        stop: &Stop,
    ) -> Result<Report> {
        let measures: Measures = self.measures();
        let mut report = Report::default();
        let halvings = self.begin_frame(dt, &measures, &next);
        while report.seconds < dt {
            let left = dt - report.seconds;
            let state = self.progress(&measures, left, report.steps, halvings);
            let Some(length) = next(&state) else { break };
            if report.steps == 0 && left / length > f64::from(MAX_STEPS) || report.steps >= MAX_STEPS {
                return Err(too_many_steps(dt, report.seconds, length));
            }
            self.advance(&measures, length, &mut report, stop);
            if stop.is_requested() {
                return Err(Error::Cancelled);
            }
            report.seconds = if length >= left { dt } else { report.seconds + length };
        }
        report.deepest = measures.unit * f64::from(self.flow.bands.deepest());
        Ok(report)
    }
}
