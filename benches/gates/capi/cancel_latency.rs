//! How long steps take to return after a cancel through C, and that they left all as it was.

use std::time::{Duration, Instant};

use frazil::capi::frz_status;
use frazil::capi::runtime::context::*;

use crate::capi::host::{Threads, works};
use crate::harness::{median, timed};
use crate::snow::grains::Random;

/// Cancels that are measured.
const CANCELS: usize = 200;

/// The time (s) from a cancel on these threads at any moment of a step to its return; `state` is all that the next step depends on, and
/// `what` is stepped.
pub fn measure(
    threads: &Threads,
    step: impl Fn() -> frz_status,
    state: impl Fn() -> Vec<u8>,
    random: &mut Random,
    what: &str,
) -> (f64, String) {
    let (whole, noisy) = timed(|| works(step()));
    let mut before = state();
    let mut latencies = Vec::new();
    for attempt in 0..2 * CANCELS {
        let moment = Duration::from_secs_f64(whole * random.next());
        match latency(threads, moment, &step) {
            Some(latency) => latencies.push(latency),
            // The step ended first.
            None => before = state(),
        }
        assert!(attempt % 50 > 0 || state() == before, "a cancel changed {what}");
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
    (p99, note)
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
