//! How long steps take to return after a cancel through C, and that they left all as it was.

use std::time::{Duration, Instant};

use frazil::capi::frz_status;
use frazil::capi::runtime::context::*;

use crate::capi::host::{Threads, works};
use crate::harness::{Harness, median, timed};
use crate::snow::grains::Random;

/// Cancels that are measured.
const CANCELS: usize = 200;

/// Something that a host steps.
pub trait Steps {
    fn threads(&self) -> &Threads;
    fn step(&self) -> frz_status;
    /// All that the next step depends on.
    fn state(&self) -> Vec<u8>;
}

/// Gate of the time (s) from a cancel at any moment of a step to its return; `what` is stepped.
pub fn measure(h: &mut Harness, name: &'static str, host: &impl Steps, random: &mut Random, what: &str) {
    let (whole, noisy) = timed(|| works(host.step()));
    let mut before = host.state();
    let mut latencies = Vec::new();
    for attempt in 0..2 * CANCELS {
        let moment = Duration::from_secs_f64(whole * random.next());
        match latency(host.threads(), moment, || host.step()) {
            Some(latency) => latencies.push(latency),
            // The step ended first.
            None => before = host.state(),
        }
        assert!(attempt % 50 > 0 || host.state() == before, "a cancel changed {what}");
        if latencies.len() == CANCELS {
            break;
        }
    }
    latencies.sort_unstable_by(f64::total_cmp);
    let (p99, count) = (latencies[latencies.len() * 99 / 100], latencies.len());
    println!("# the slowest: {:.4?} s", &latencies[count - 5..]);
    let note = format!(
        "{count} cancels of a step of {whole:.2} s of {what}{noisy}; median {:.4} s",
        median(latencies)
    );
    h.gate(name, p99, &note);
}

/// Seconds from a cancel after `moment` to the return of a step; none when the step ended first.
pub fn latency(threads: &Threads, moment: Duration, step: impl FnOnce() -> frz_status) -> Option<f64> {
    let ctx = threads.ctx as usize;
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(moment);
        let now = Instant::now();
        // SAFETY: the context outlives this thread, which is joined.
        unsafe { frz_context_cancel(ctx as *mut frz_context) };
        now
    });
    let status = step();
    let ended = Instant::now();
    let asked = canceller.join().expect("the thread");
    threads.reset();
    (status == frz_status::FRZ_CANCELLED).then(|| ended.saturating_duration_since(asked).as_secs_f64())
}
