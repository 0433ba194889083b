//! Steps that are cancelled when they take far longer than those before them, and how soon they then end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use frazil::capi::frz_status::{self, *};
use frazil::capi::runtime::context::*;
use serde::{Deserialize, Serialize};

use crate::capi::host::{Threads, clock};
use crate::shallow::speed::thread_seconds;
use crate::snow::grains::Random;

/// Steps of each function, in parts that run apart, each with settings of its own.
pub const STEPS: usize = PARTS * PART;
pub const PARTS: usize = 10;
const PART: usize = 1_000;
/// A step is cancelled after so many times the median of those before, but not earlier than this (s); and may then take so long (s).
const TIMES: f64 = 20.0;
const EARLIEST: f64 = 0.005;
const LONGEST: f64 = 0.2;
/// A step that takes so long has no end (s).
const ENDLESS: f64 = 60.0;

/// Cancels a context when a step has taken too long.
pub struct Watch {
    threads: Threads,
    /// When it is to cancel (microseconds of a clock); never, where it is the greatest number.
    due: Arc<AtomicU64>,
    ends: Arc<AtomicBool>,
    watcher: Option<std::thread::JoinHandle<()>>,
}

/// What became of the steps of a function.
pub struct Tried<'a> {
    watch: &'a Watch,
    pub random: Random,
    name: &'static str,
    /// CPU time of each (s), of this thread, which does all the work: what else the machine does is no step's fault.
    times: Vec<f64>,
    median: f64,
    cancelled: usize,
    /// CPU times of those that went on for too long (s).
    late: Vec<f64>,
    slowest: f64,
}

/// What is known of the steps of a part.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Judged {
    /// How many went on for too long.
    pub slow: usize,
    pub cancelled: usize,
    /// CPU time of a step in the middle (s).
    pub median: f64,
    /// The longest CPU time from a cancel to the end of its step (s).
    pub slowest: f64,
}

impl Judged {
    /// Of all parts, and a note on them.
    pub fn all(parts: &[Self]) -> (usize, String) {
        let mut medians: Vec<f64> = parts.iter().map(|part| part.median).collect();
        medians.sort_unstable_by(f64::total_cmp);
        let cancelled: usize = parts.iter().map(|part| part.cancelled).sum();
        let slowest = parts.iter().map(|part| part.slowest).fold(0.0, f64::max);
        let median = 1e3 * medians[medians.len() / 2];
        let note = format!(
            "{STEPS} steps, median {median:.2} ms; {cancelled} cancelled, which ended within {slowest:.3} s"
        );
        (parts.iter().map(|part| part.slow).sum(), note)
    }
}

impl Watch {
    pub fn new() -> Self {
        let threads = Threads::new(0);
        let (due, ends) = (Arc::new(AtomicU64::new(u64::MAX)), Arc::new(AtomicBool::new(false)));
        let (ctx, other_due, other_ends) = (threads.ctx as usize, due.clone(), ends.clone());
        let watcher = std::thread::spawn(move || {
            // The due time that was cancelled, and when.
            let mut cancelled = (u64::MAX, 0);
            while !other_ends.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(1));
                let (now, due) = (clock(), other_due.load(Ordering::SeqCst));
                if due == u64::MAX {
                    continue;
                }
                if cancelled.0 == due && now > cancelled.1 + (ENDLESS * 1e6) as u64 {
                    eprintln!("reliability.step_calls: a step does not end: cancelled {ENDLESS} s ago");
                    std::process::exit(1);
                } else if now >= due && cancelled.0 != due {
                    // SAFETY: the context is there until this thread was joined.
                    unsafe { frz_context_cancel(ctx as *mut frz_context) };
                    cancelled = (due, now);
                }
            }
        });
        Self { threads, due, ends, watcher: Some(watcher) }
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        self.watcher.take().into_iter().for_each(|watcher| watcher.join().expect("the watcher"));
    }
}

impl<'a> Tried<'a> {
    /// None yet, of a part of those of the function of a name.
    pub fn new(watch: &'a Watch, name: &'static str, part: usize) -> Self {
        let random = Random(0x9e37_79b9_7f4a_7c15 ^ (name.len() + 1000 * part) as u64);
        let (times, late) = (Vec::with_capacity(PART), Vec::new());
        Self { watch, random, name, times, median: 0.0, cancelled: 0, late, slowest: 0.0 }
    }

    /// What is known of them at the end.
    pub fn judged(&self) -> Judged {
        let Self { median, cancelled, .. } = *self;
        let slow = self.late.iter().filter(|took| **took > TIMES * median).count();
        Judged { slow, cancelled, median, slowest: self.slowest.max(0.0) }
    }

    /// The context that steps are made with.
    pub fn ctx(&self) -> *mut frz_context {
        self.watch.threads.ctx
    }

    /// Whether there were enough.
    pub fn is_done(&self) -> bool {
        self.times.len() >= PART
    }

    /// One step; whether it was made to its end.
    pub fn step(&mut self, step: impl FnOnce(*mut frz_context) -> frz_status) -> bool {
        let limit = (TIMES * self.median).max(EARLIEST);
        let (before, began) = (thread_seconds(), clock());
        self.watch.due.store(began + (limit * 1e6) as u64, Ordering::SeqCst);
        let status = step(self.ctx());
        self.watch.due.store(u64::MAX, Ordering::SeqCst);
        let took = thread_seconds() - before;
        // A cancel that came too late is of this step, too.
        if (clock() - began) as f64 > 0.5e6 * limit {
            std::thread::sleep(Duration::from_millis(3));
        }
        self.watch.threads.reset();
        match status {
            // Settings that it refuses are none.
            FRZ_ERROR_ARGUMENT | FRZ_ERROR_MEMORY => return false,
            FRZ_OK | FRZ_CANCELLED => {}
            other => panic!("{}: {other:?}", self.name),
        }
        self.cancelled += usize::from(status == FRZ_CANCELLED);
        // CPU time from the cancel on, at least.
        let after = took - limit;
        if after > LONGEST {
            self.late.push(took);
        }
        self.slowest = self.slowest.max(after);
        self.times.push(took);
        if self.times.len().is_multiple_of(100) {
            let mut sorted = self.times.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            self.median = sorted[sorted.len() / 2];
        }
        status == FRZ_OK
    }

    /// A number from one to another.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.next()
    }

    /// A number of any magnitude between.
    pub fn any(&mut self, low: f64, high: f64) -> f64 {
        libm::pow(10.0, self.between(libm::log10(low), libm::log10(high)))
    }

    /// A whole number below.
    pub fn below(&mut self, count: usize) -> usize {
        (self.random.next() * count as f64) as usize
    }

    /// With a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.random.next() < probability
    }
}
