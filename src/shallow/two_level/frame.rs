//! Frames of a liquid in cells of two sizes; both liquids take the same steps.

use std::sync::atomic::AtomicBool;

use super::Detail;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::cpu::FlushDenormals;
use crate::shallow::Shallow;
use crate::shallow::frame::{check_length, too_many_steps};
use crate::shallow::solver::rows::bands::with_spinning_threads;
use crate::shallow::solver::stop::Stop;
use crate::shallow::system::Report;
use crate::shallow::time_step::{self, MAX_STEPS};

impl Detail {
    /// One frame of `dt` (s).
    ///
    /// # Errors
    /// As [`Shallow::step`].
    pub fn step(&mut self, ctx: &Context, dt: f64) -> Result<Report> {
        check_length(dt)?;
        let running = ctx.begin_light();
        if ctx.is_cancelled() {
            return Err(Error::Cancelled);
        }
        let cancel = running.latch();
        let threads = ctx.pool().threads();
        let divided =
            [&mut self.fine, &mut self.coarse].map(|liquid| liquid.flow.divide(&liquid.columns, threads));
        if divided.contains(&true) {
            ctx.pool().install(|| with_spinning_threads(threads, || self.step_or_restore(dt, cancel)))
        } else {
            let _flush = FlushDenormals::begin();
            self.step_or_restore(dt, cancel)
        }
    }

    /// Makes the frame; if it fails, restores the state before it.
    fn step_or_restore(&mut self, dt: f64, cancel: &AtomicBool) -> Result<Report> {
        // All steps are as short as the liquid with the shorter steps needs.
        let may_take_long = [&mut self.fine, &mut self.coarse].map(|liquid| liquid.may_take_long(dt, None));
        if !may_take_long.contains(&true) {
            return self.steps(dt, &Stop::NEVER);
        }
        let mut saved = std::mem::take(&mut self.rollback);
        self.save_rollback(&mut saved);
        let result = self.steps(dt, &Stop::when(cancel));
        if result.is_err() {
            self.put_back(&saved);
        }
        self.rollback = saved;
        result
    }

    fn steps(&mut self, dt: f64, stop: &Stop) -> Result<Report> {
        let Self { fine, coarse, seam, remainders, .. } = self;
        let measures = [fine.measures(), coarse.measures()];
        let mut report = Report::default();
        let halvings = [&mut *fine, &mut *coarse]
            .into_iter()
            .zip(&measures)
            .map(|(liquid, measures)| {
                liquid.begin_frame(dt, measures, |progress| Some(time_step::next_length(progress)))
            })
            .fold(0, u32::max);
        while report.seconds < dt {
            let left = dt - report.seconds;
            let steps = report.steps;
            let next = |liquid: &Shallow, at: usize| {
                time_step::next_length(&liquid.progress(&measures[at], left, steps, halvings))
            };
            let length = next(fine, 0).min(next(coarse, 1));
            if steps == 0 && left / length > f64::from(MAX_STEPS) || steps >= MAX_STEPS {
                return Err(too_many_steps(dt, report.seconds, length));
            }
            seam.begin_step(fine, coarse, &measures[0], length);
            fine.advance(&measures[0], length, &mut report, stop);
            coarse.advance(&measures[1], length, &mut report, stop);
            if stop.is_requested() {
                return Err(Error::Cancelled);
            }
            seam.end_step(fine, coarse, remainders);
            report.steps = steps + 1;
            report.seconds = if length >= left { dt } else { report.seconds + length };
        }
        report.deepest =
            measures[0].unit * f64::from(fine.flow.bands.deepest().max(coarse.flow.bands.deepest()));
        Ok(report)
    }
}
