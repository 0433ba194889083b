//! Gates of what a pool at rest costs: thread CPU time of a frame of it, as part of the same one's while it was stirred; and that nothing depends on
//! whether it sleeps.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::{Params, Shallow};

use crate::common::shallow::{context, covered, ground, waves};
use crate::harness::{Harness, median};
use crate::shallow::speed::thread_seconds;

const FRAME: f64 = 1.0 / 60.0;
const CELL: f64 = 0.0005;
/// Frames after which a pool rests, at 60 a second.
const SETTLED: usize = 900;

/// A resting domain, and one of which nine tenths rest.
pub fn run(h: &mut Harness) {
    h.measure_all(["shallow.sleeping", "shallow.sleeping_stream", "shallow.same_asleep"], || {
        let [all, stream] = [false, true].map(part);
        let is_same = f64::from(all.2 && stream.2);
        [(all.0, all.1), (stream.0, stream.1), (is_same, "states after 1,130 frames".into())]
    });
}

/// What a frame at rest takes (% of one while it was stirred), and whether nothing depends on whether it sleeps.
fn part(has_stream: bool) -> (f64, String, bool) {
    let [mut pool, mut other] = [(); 2].map(|()| pool(has_stream));
    other.set_sleepless(true);
    let awake = milliseconds(&mut pool, 30);
    milliseconds(&mut other, 30);
    for liquid in [&mut pool, &mut other] {
        milliseconds(liquid, SETTLED);
    }
    let [asleep, sleepless] = [&mut pool, &mut other].map(|liquid| milliseconds(liquid, 200));
    let level = cpu_level();
    let note = format!("{level:?} {asleep:.4} of {awake:.3} ms; {sleepless:.3} ms where nothing sleeps");
    (100.0 * asleep / awake, note, pool.save() == other.save())
}

/// Blood with waves in a basin of 200 x 200 cells; beyond a wall, on a tenth of it, a stream runs down a slope, if it is asked for.
fn pool(has_stream: bool) -> Shallow {
    let wall = 0.04;
    let solids = ground([200; 2], CELL, [-0.01, 0.1], |at @ [x, z]| match z {
        z if !has_stream || z < wall - 2.0 * CELL => 3e-4 * waves(at, CELL),
        z if z < wall => 0.02,
        _ => 0.003 - 0.05 * x,
    });
    let mut liquid = covered(&context(), &solids, Params { rest: 1e-6, ..Params::default() }, |[x, z], _| {
        let depth = 1e-3 + 3e-4 * waves([2.0 * z, 2.0 * x], CELL);
        if !has_stream || z < wall - 2.0 * CELL { depth } else { 0.0 }
    });
    if has_stream {
        let point =
            |kind, x, rate| FlowPoint { kind, at: [x, 0.003, 0.045], radius: 0.004, rate, pulse: None };
        let points = [point(Kind::Source, -0.045, 1e-6), point(Kind::Drain, 0.045, 1e-4)];
        liquid.set_flows(&points, |at| format!("point {at}")).expect("flow points");
    }
    liquid
}

/// The median time of so many frames (ms).
fn milliseconds(liquid: &mut Shallow, frames: usize) -> f64 {
    let ctx = context();
    let mut times: Vec<f64> = Vec::with_capacity(frames);
    for _ in 0..frames {
        let start = thread_seconds();
        liquid.step(&ctx, FRAME).expect("a frame");
        times.push(1e3 * (thread_seconds() - start));
    }
    median(times)
}
