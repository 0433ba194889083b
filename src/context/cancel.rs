//! The cancel of a context: requested at any time, and latched by the running call.
//!
//! Work that has begun to skip pieces must not continue as if complete: a call that was cancelled stays cancelled to its
//! end, even if the request is cleared meanwhile. So there are two flags: the request, until it is cleared, and the latch
//! of the running call, until the next call begins.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The request and the latch.
#[derive(Default)]
pub(super) struct Cancel {
    /// Sticky until it is cleared.
    requested: Arc<AtomicBool>,
    /// The flag of the running call: never cleared before the call has ended.
    latched: Arc<AtomicBool>,
    /// Number of running calls, one within another.
    running: AtomicUsize,
}

/// A running call of a context; it ends when this is dropped.
///
/// Calls within it are part of it: they see the same cancel.
#[must_use]
pub struct Running(Arc<Cancel>);

impl Cancel {
    /// Begins a call; the outermost one latches a cancel that is still requested.
    pub(super) fn begin(self: &Arc<Self>) -> Running {
        if self.running.fetch_add(1, Ordering::SeqCst) == 0 {
            // In this order a concurrent cancel is seen either through its own store to the latch, or by this load.
            self.latched.store(false, Ordering::SeqCst);
            if self.requested.load(Ordering::SeqCst) {
                self.latched.store(true, Ordering::SeqCst);
            }
        }
        Running(self.clone())
    }

    /// Cancels the running call and all later ones; takes no lock, so that signal handlers may call it.
    pub(super) fn request(&self) {
        for flag in self.flags() {
            flag.store(true, Ordering::SeqCst);
        }
    }

    /// Clears a cancel, except for the running call.
    pub(super) fn clear(&self) {
        self.requested.store(false, Ordering::SeqCst);
    }

    /// Whether a call is running.
    pub(super) fn is_running(&self) -> bool {
        self.running.load(Ordering::SeqCst) > 0
    }

    /// Whether the running call is cancelled; between calls, whether the next one will be.
    pub(super) fn is_requested(&self) -> bool {
        let running = self.running.load(Ordering::Relaxed) > 0;
        let flag = if running { &self.latched } else { &self.requested };
        flag.load(Ordering::Relaxed)
    }

    /// The flags that a cancel sets, in the order in which it must set them.
    pub(super) fn flags(&self) -> [&Arc<AtomicBool>; 2] {
        [&self.requested, &self.latched]
    }

    /// The flag that a running call checks.
    pub(super) fn latch(&self) -> &AtomicBool {
        &self.latched
    }
}

impl Running {
    /// The flag that is set once the call is cancelled, until it has ended.
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
        cancel.request();
        cancel.clear();
        assert!(cancel.is_requested());
        let inner = cancel.begin();
        assert!(inner.latch().load(Ordering::Relaxed), "a call within the call is part of it");
        drop(inner);
        assert!(cancel.is_requested());
        drop(outer);
        assert!(!cancel.is_requested());
        let next = cancel.begin();
        assert!(!cancel.is_requested() && !next.latch().load(Ordering::Relaxed));
    }

    #[test]
    fn a_cancel_between_calls_holds_for_all_later_ones_until_it_is_cleared() {
        let cancel = Arc::new(Cancel::default());
        cancel.request();
        for _ in 0..2 {
            assert!(cancel.is_requested());
            let call = cancel.begin();
            assert!(cancel.is_requested() && call.latch().load(Ordering::Relaxed));
        }
        cancel.clear();
        assert!(!cancel.is_requested());
        assert!(!cancel.begin().latch().load(Ordering::Relaxed));
    }
}
