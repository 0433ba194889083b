//! Gates of shallow's states: how long one takes, in thread CPU time on one core, and that a liquid flows on from it to the same bytes.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::Shallow;
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::shallow::{Plan, Turn, busy, context, turnable};
use crate::harness::{Harness, median};
use crate::shallow::speed::{five_floors, thread_seconds};

const FRAME: f64 = 1.0 / 60.0;
/// States that are timed, one after a frame.
const STATES: usize = 101;
/// Random scenes that are continued, and frames of each.
const SCENES: u64 = 60;
const FRAMES: usize = 40;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure_all(["shallow.save", "shallow.restore"], times);
    h.measure("shallow.same_continued", || {
        let (mut saved, mut differ) = (0, Vec::new());
        for seed in 0..SCENES {
            let from = Dice(seed).below(FRAMES - 10);
            if !continues(&turnable(seed), [0, 0], from, &mut saved) {
                differ.push(format!("scene {seed} from frame {from}"));
            }
        }
        // Wide enough for more than one thread, which continue what one has begun, and the other way round.
        let wide = busy([517, 403]);
        for threads in [[0, 2], [2, 0]] {
            if !continues(&wide, threads, 17, &mut saved) {
                differ.push(format!("the wide scene on {threads:?} threads"));
            }
        }
        let note = format!("{} runs, {saved} bytes of states; differ: {differ:?}", SCENES + 2);
        (differ.is_empty(), note)
    });
}

/// Both times.
fn times() -> [(f64, String); 2] {
    let ctx = context();
    let (mut liquid, mut other) = (five_floors(), five_floors());
    let mut state = Vec::new();
    let [mut save, mut restore]: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for turn in 0..=STATES {
        // The arrays are where a frame leaves them.
        liquid.step(&ctx, FRAME).expect("a frame");
        let start = thread_seconds();
        liquid.save_into(&mut state);
        let saved = thread_seconds();
        other.restore(&state).expect("its own state");
        let restored = thread_seconds();
        // The first allocates.
        if turn > 0 {
            save.push(1e3 * (saved - start));
            restore.push(1e3 * (restored - saved));
        }
        if turn == STATES {
            assert_eq!(other.depths(), liquid.depths(), "what was restored is another liquid");
        }
    }
    let columns = liquid.columns().count();
    let note = |times: &[f64]| {
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        let worst = times.iter().copied().fold(0.0, f64::max);
        format!("{:?} {columns} columns, {} bytes; {least:.3} to {worst:.3} ms", cpu_level(), state.len())
    };
    [save, restore].map(|times| {
        let note = note(&times);
        (median(times), note)
    })
}

/// Whether a run that ends at a frame and another one, in columns made anew from its state, make the same bytes after each frame as the one
/// that went on. Liquid is poured and taken meanwhile.
fn continues(plan: &Plan, threads: [usize; 2], from: usize, saved: &mut usize) -> bool {
    let [ctx, other] = threads.map(|threads| Context::new(Pool::new(threads).expect("threads")));
    let mut straight = plan.make(&ctx, Turn::NONE);
    let mut dice = Dice(from as u64);
    let mut frame = |liquids: &mut [(&mut Shallow, &Context)]| {
        let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
        let depth = [-1.0, 1e-4, 0.0][dice.below(3)];
        let reports: Vec<_> = liquids
            .iter_mut()
            .map(|(liquid, ctx)| {
                plan.pour(liquid, Turn::NONE, corners, depth);
                liquid.step(ctx, FRAME).expect("a frame")
            })
            .collect();
        reports.windows(2).all(|pair| pair[0] == pair[1])
    };
    for _ in 0..from {
        frame(&mut [(&mut straight, &ctx)]);
    }
    let state = straight.save();
    *saved += state.len();
    let mut continued = plan.make(&other, Turn::NONE);
    continued.restore(&state).expect("a state of the same scene");
    (from..FRAMES).all(|_| {
        let is_same = frame(&mut [(&mut straight, &ctx), (&mut continued, &other)]);
        is_same && straight.save() == continued.save() && straight.balance() == continued.balance()
    })
}
