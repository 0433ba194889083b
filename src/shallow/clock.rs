//! The clock that a frame's time budget is measured by.

use std::time::Instant;

use rustix::time::{ClockId, Timespec, clock_gettime};

/// A clock that counts from its start.
pub enum Clock {
    /// CPU time of the thread that started it: being pre-empted by another process does not shorten a frame.
    Thread(Timespec),
    /// Wall-clock time, where several threads work.
    Wall(Instant),
}

impl Clock {
    /// Starts a clock.
    pub fn start(is_multithreaded: bool) -> Self {
        if is_multithreaded {
            Self::Wall(Instant::now())
        } else {
            Self::Thread(clock_gettime(ClockId::ThreadCPUTime))
        }
    }

    /// Seconds since its start.
    pub fn seconds(&self) -> f64 {
        match self {
            Self::Thread(start) => {
                let now = clock_gettime(ClockId::ThreadCPUTime);
                (now.tv_sec - start.tv_sec) as f64 + (now.tv_nsec - start.tv_nsec) as f64 * 1e-9
            }
            Self::Wall(start) => start.elapsed().as_secs_f64(),
        }
    }
}
