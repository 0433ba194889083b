//! How fast the frames of a pass are made, for forecasts of the time that is left.

use std::time::{Duration, Instant};

/// How the steps to a frame went.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Pace {
    /// The time from when the frame before it was computed, or from when the pass began, until its own was.
    pub took: Duration,
    /// The part of it in which the steps waited for files to be written.
    pub waited: Duration,
    /// Number of further frames that were computed when its files were written.
    pub ahead: usize,
}

/// Measures the pace of the steps.
pub(super) struct Clock {
    begun: Instant,
    waited: Duration,
}

impl Default for Clock {
    fn default() -> Self {
        Self { begun: Instant::now(), waited: Duration::ZERO }
    }
}

impl Clock {
    /// Waits for the writer.
    pub fn wait<T>(&mut self, for_writer: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = for_writer();
        self.waited += start.elapsed();
        result
    }

    /// A frame is computed: the pace since the one before.
    pub fn lap(&mut self) -> Pace {
        let Self { begun, waited } = std::mem::take(self);
        Pace { took: self.begun - begun, waited, ahead: 0 }
    }
}
