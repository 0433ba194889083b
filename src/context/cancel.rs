//! The cancel of a context: asked for at any time, and latched by the call that runs.
//!
//! What has begun to skip its work must not go on as if nothing had been: a call that was cancelled stays cancelled to
//! its end, also when the cancel is forgotten meanwhile. So there are two flags: what was asked for, until it is
//! forgotten, and what the running call has seen, until the next call begins.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What was asked for, and what the running call has seen of it.
#[derive(Default)]
pub(super) struct Cancel {
    /// Sticky until it is forgotten.
    asked: Arc<AtomicBool>,
    /// The running call's: nobody takes it back before the call has ended.
    latched: Arc<AtomicBool>,
    /// Calls that run, one within another.
    running: AtomicUsize,
}

/// A call that runs with a context; it ends when this is dropped.
///
/// Calls within it are part of it: they see the same cancel.
#[must_use]
pub struct Running(Arc<Cancel>);

impl Cancel {
    /// Begins a call; the outermost one looks whether a cancel is still asked for.
    pub(super) fn begin(self: &Arc<Self>) -> Running {
        if self.running.fetch_add(1, Ordering::SeqCst) == 0 {
            // In this order a cancel at this moment is seen by its own store to the latch, or by this load.
            self.latched.store(false, Ordering::SeqCst);
            if self.asked.load(Ordering::SeqCst) {
                self.latched.store(true, Ordering::SeqCst);
            }
        }
        Running(self.clone())
    }

    /// Cancels the running call and all later ones; takes no lock, as a signal handler wants it.
    pub(super) fn ask(&self) {
        for flag in self.flags() {
            flag.store(true, Ordering::SeqCst);
        }
    }

    /// Forgets a cancel, but for the running call.
    pub(super) fn forget(&self) {
        self.asked.store(false, Ordering::SeqCst);
    }

    /// Whether a call runs.
    pub(super) fn is_running(&self) -> bool {
        self.running.load(Ordering::SeqCst) > 0
    }

    /// Whether the running call is cancelled; between calls, whether the next one will be.
    pub(super) fn is_asked(&self) -> bool {
        let running = self.running.load(Ordering::Relaxed) > 0;
        let flag = if running { &self.latched } else { &self.asked };
        flag.load(Ordering::Relaxed)
    }

    /// The flags that a cancel raises, in the order in which it must raise them.
    pub(super) fn flags(&self) -> [&Arc<AtomicBool>; 2] {
        [&self.asked, &self.latched]
    }

    /// The flag that a running call looks at.
    pub(super) fn latch(&self) -> &AtomicBool {
        &self.latched
    }
}

impl Running {
    /// The flag that is up once the call is cancelled, and stays up until it has ended.
    pub fn latch(&self) -> &AtomicBool {
        self.0.latch()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.0.running.fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_call_keeps_its_cancel_and_the_next_one_is_free_of_it() {
        let cancel = Arc::new(Cancel::default());
        let outer = cancel.begin();
        cancel.ask();
        cancel.forget();
        assert!(cancel.is_asked());
        let inner = cancel.begin();
        assert!(inner.latch().load(Ordering::Relaxed), "a call within the call is part of it");
        drop(inner);
        assert!(cancel.is_asked());
        drop(outer);
        assert!(!cancel.is_asked());
        let next = cancel.begin();
        assert!(!cancel.is_asked() && !next.latch().load(Ordering::Relaxed));
    }

    #[test]
    fn a_cancel_between_calls_holds_for_all_later_ones_until_it_is_forgotten() {
        let cancel = Arc::new(Cancel::default());
        cancel.ask();
        for _ in 0..2 {
            assert!(cancel.is_asked());
            let call = cancel.begin();
            assert!(cancel.is_asked() && call.latch().load(Ordering::Relaxed));
        }
        cancel.forget();
        assert!(!cancel.is_asked());
        assert!(!cancel.begin().latch().load(Ordering::Relaxed));
    }
}
