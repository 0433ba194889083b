//! Gates of shallow's level of detail: nothing is lost while the near cells move about, and what a domain costs of which a quarter is near.

use frazil::base::cpu::cpu_level;
use frazil::shallow::flows::{FlowPoint, Kind, Pulse};
use frazil::shallow::pipes::Border;
use frazil::shallow::{Detail, Params};

use crate::common::bodies::Dice;
use crate::common::shallow::{context, covered, floors, ground, waves};
use crate::harness::{Harness, median};
use crate::shallow_speed::thread_seconds;

/// Steps of the run for mass.
const STEPS: u32 = 100_000;
const FRAME: f64 = 1.0 / 60.0;

/// Mass and cost.
pub fn run(h: &mut Harness) {
    if h.wants("shallow.detail_mass") {
        mass(h);
    }
    if h.wants("shallow.detail_cost") {
        cost(h);
    }
}

/// Most units that were missing after a frame, or too many.
fn mass(h: &mut Harness) {
    let ctx = context();
    let (cell, size) = (0.001, [60, 44]);
    let solids = floors(size, cell, [-0.02, 0.1], 2, |at @ [x, z], floor| {
        let top = 0.012 * floor as f64 + 2e-3 * waves(at, cell);
        (floor == 0 || x.abs().max(z.abs()) < 0.015).then_some([top - 0.003, top])
    });
    let params = Params { border: Border::Open, ..Params::default() };
    let mut detail = Detail::new(&ctx, &solids, params, [10..30, 8..24]).expect("a liquid");
    detail.fill(0.001);
    let pulse = Some(Pulse { frequency: 1.3, share: 0.5 });
    let point = |kind, at, rate| FlowPoint { kind, at, radius: 0.003, rate, pulse };
    let points = [
        point(Kind::Source, [0.0, 0.02, 0.0], 2e-6),
        point(Kind::Source, [-0.02, 0.01, 0.012], 2e-6),
        point(Kind::Drain, [0.02, 0.0, -0.01], 3e-6),
        point(Kind::Absorber(1e-4), [0.0, 0.0, 0.018], 1e-7),
    ];
    detail.set_flows(&points, |at| format!("point {at}")).expect("flow points");
    let mut dice = Dice(19);
    let (mut steps, mut frame, mut moves, mut worst) = (0, 0, 0, 0);
    while steps < STEPS {
        if frame % 3 == 0 {
            let mut side = |count: usize| {
                let first = 2 * dice.below(count / 2);
                first..first + 2 + 2 * dice.below((count - first) / 2)
            };
            let near = [side(size[0]), side(size[1])];
            detail.set_near(near).expect("near cells");
            moves += 1;
        }
        steps += detail.step(&ctx, FRAME).expect("a frame").steps;
        worst = worst.max(detail.balance().error.abs());
        frame += 1;
    }
    let all = detail.balance();
    let [poured, sourced, drained, absorbed, lost, inside] =
        [all.poured, all.sourced, all.drained, all.absorbed, all.lost, all.inside].map(|volume| 1e6 * volume);
    let note = format!(
        "{steps} steps, {moves} moves; ml poured {poured:.1}, sourced {sourced:.1}, drained {drained:.1}, absorbed \
         {absorbed:.1}, lost {lost:.1}, inside {inside:.1}"
    );
    h.gate("shallow.detail_mass", worst as f64, &note);
}

/// The time of a frame over that of all cells being fine, which takes turns.
fn cost(h: &mut Harness) {
    let ctx = context();
    let (cell, size) = (0.0005, [200; 2]);
    let solids = ground(size, cell, [-0.01, 0.1], |at @ [x, _]| 0.01 - 0.1 * x + 1e-4 * waves(at, cell));
    let mut fine = covered(&ctx, &solids, Params::default(), |_, _| 1e-3);
    // Strips of 16 cells begin at 48.
    let mut detail = Detail::new(&ctx, &solids, Params::default(), [48..144, 48..152]).expect("a liquid");
    for index in 0..100 * 100 {
        let [x, z] = [index % 100, index / 100].map(|at| -0.05 + 0.001 * (at as f64 + 0.5));
        detail.pour_at([x, 0.01 - 0.1 * x, z], 0.0004, 1e-9).expect("liquid");
    }
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..240 {
        let start = thread_seconds();
        fine.step(&ctx, FRAME).expect("a frame");
        let middle = thread_seconds();
        detail.step(&ctx, FRAME).expect("a frame");
        times[0].push(1e3 * (middle - start));
        times[1].push(1e3 * (thread_seconds() - middle));
    }
    let [fine, detail] = times.map(median);
    let note = format!("{:?} {detail:.3} of {fine:.3} ms", cpu_level());
    h.gate("shallow.detail_cost", detail / fine, &note);
}
