//! Gates of shallow's threads: wall-clock time of frames on two over one.

use std::time::Instant;

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::Shallow;
use frazil::{Context, Pool};

use crate::harness::{Harness, timed};
use crate::shallow::speed::waving;

const FRAME: f64 = 1.0 / 60.0;
/// Depth of the liquid (m).
const DEPTH: f64 = 1e-3;

/// Both gates.
pub fn run(h: &mut Harness) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    if cores < 2 {
        for name in ["shallow.threads_gain", "shallow.threads_few"] {
            if h.wants(name) {
                h.skipped(name, "one core");
            }
        }
        return;
    }
    h.measure("shallow.threads_gain", || {
        let (gains, note) = gains(&[(450, 50, 12), (1500, 15, 4)], |[one, two]| one / two);
        (gains.into_iter().fold(f64::INFINITY, f64::min), note)
    });
    h.measure("shallow.threads_few", || {
        // Below the count of columns from which on a step is divided, and just above.
        let sizes = [(200, 40, 60), (310, 40, 30), (330, 40, 30)];
        let (shares, note) = gains(&sizes, |[one, two]| two / one);
        (shares.into_iter().fold(0.0, f64::max), note)
    });
}

/// For each count of cells along an edge a ratio of the best frame on one thread and on two; in so many turns of so many frames.
fn gains(sizes: &[(usize, usize, usize)], ratio: impl Fn([f64; 2]) -> f64) -> (Vec<f64>, String) {
    let mut ratios = Vec::new();
    let mut note = format!("{:?}", cpu_level());
    for &(edge, turns, frames) in sizes {
        let mut best = [f64::INFINITY; 2];
        let (_, noisy) = timed(|| best = both(edge, turns, frames));
        let ratio = ratio(best);
        note += &format!(
            " {edge} x {edge}: {ratio:.3}, {:.3} and {:.3} ms{noisy};",
            1e3 * best[0],
            1e3 * best[1]
        );
        ratios.push(ratio);
    }
    (ratios, note)
}

/// The shortest frame (s) on one thread and on two, which take turns.
fn both(edge: usize, turns: usize, frames: usize) -> [f64; 2] {
    let contexts = [1, 2].map(|threads| Context::new(Pool::new(threads).expect("threads")));
    let mut liquids: [Shallow; 2] = [(); 2].map(|()| waving(edge, DEPTH));
    let mut best = [f64::INFINITY; 2];
    let mut steps = [0; 2];
    for turn in 0..turns {
        for which in 0..2 {
            for _ in 0..frames {
                let start = Instant::now();
                let report = liquids[which].step(&contexts[which], FRAME).expect("a frame");
                let seconds = start.elapsed().as_secs_f64();
                // The first turn warms up.
                if turn > 0 {
                    best[which] = best[which].min(seconds);
                }
                steps[which] += report.steps;
            }
        }
    }
    assert!(steps[0] == steps[1] && liquids[0].depths() == liquids[1].depths(), "they did other work");
    best
}
