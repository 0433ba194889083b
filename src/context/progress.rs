//! What a context is doing, and how much of it is done.

use std::sync::Mutex;

use super::locking::lock;

/// What is being done, for a progress display.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// Name of the running phase; empty between phases.
    pub phase: &'static str,
    /// Phases finished since the context was made or reset.
    pub phases_done: usize,
    /// Fraction of the running phase that is done, 0 to 1; none if unknown.
    pub part: Option<f32>,
    /// Fraction of the running step that is done, 0 to 1, with equal weights for all its phases; none outside of
    /// [`super::Context::step`]. It never decreases within a step.
    pub fraction: Option<f32>,
}

/// The state that progress is computed from.
#[derive(Default)]
pub(super) struct State {
    pub(super) phase: &'static str,
    pub(super) phases_done: usize,
    /// The running step: the phases done before it, and the number of its phases.
    step: Option<(usize, usize)>,
}

impl State {
    pub(super) fn progress(&self, part: Option<f32>) -> Progress {
        let &Self { phase, phases_done, step } = self;
        let fraction = step.map(|(before, phases)| {
            let done = phases_done.saturating_sub(before) as f32 + part.unwrap_or(0.0);
            (done / phases.max(1) as f32).min(1.0)
        });
        Progress { phase, phases_done, part, fraction }
    }
}

/// A running step; when this is dropped, the one around it continues.
pub(super) struct Planned<'a> {
    state: &'a Mutex<State>,
    outer: Option<(usize, usize)>,
}

impl<'a> Planned<'a> {
    /// Begins a step of this many phases.
    pub(super) fn new(state: &'a Mutex<State>, phases: usize) -> Self {
        let mut own = lock(state);
        let step = Some((own.phases_done, phases));
        Self { state, outer: std::mem::replace(&mut own.step, step) }
    }
}

impl Drop for Planned<'_> {
    fn drop(&mut self) {
        lock(self.state).step = self.outer;
    }
}
