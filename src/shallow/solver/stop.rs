//! Cancellation of a step before it is complete.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether a frame is to end at once. The results of the step are then invalid: the caller restores the liquid.
#[derive(Clone, Copy)]
pub struct Stop<'a>(Option<&'a AtomicBool>);

impl<'a> Stop<'a> {
    /// Never cancels.
    pub const NEVER: Self = Self(None);

    /// Cancels when a flag is set.
    pub fn when(flag: &'a AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether to stop.
    pub fn is_requested(&self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
