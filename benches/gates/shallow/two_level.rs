//! Gates of shallow's level of detail: nothing is lost while the near cells move about, and what a domain costs of which a quarter is near.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind, Pulse};
use frazil::shallow::two_level::Cells;
use frazil::shallow::{Detail, Params};

use crate::common::bodies::Dice;
use crate::common::shallow::{context, covered, floors, ground, waves};
use crate::harness::{Harness, median};
use crate::shallow::ground::fate;
use crate::shallow::speed::thread_seconds;

/// Steps of the run for mass.
const STEPS: u32 = 100_000;
const FRAME: f64 = 1.0 / 60.0;

/// Mass and cost.
pub fn run(h: &mut Harness) {
    h.measure("shallow.detail_mass", mass);
    // Strips of 16 cells begin at the near cells' sides.
    for (name, edge, near) in [
        ("shallow.detail_cost", 1000, [240..752, 256..744]),
        ("shallow.detail_cost_small", 200, [48..144, 48..152]),
    ] {
        h.measure(name, || cost(edge, near));
    }
}

/// Most units that were missing after a frame, or too many.
fn mass() -> (f64, String) {
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
        point(Kind::Drain, [-0.018, 0.0, 0.012], 1e-6),
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
    let note = format!("{steps} steps, {moves} moves; {}", fate(&detail.balance()));
    (worst as f64, note)
}

/// The time of a frame over that of all cells being fine, in turns: on a domain of so many cells along an edge, of which a quarter is near.
fn cost(edge: usize, near: Cells) -> (f64, String) {
    let ctx = context();
    let cell = 0.0005;
    let low = -0.5 * edge as f64 * cell;
    let height = move |x: f64| 0.01 + 0.05 * (-low - x);
    let solids = ground([edge; 2], cell, [-0.01, 0.1], |at @ [x, _]| height(x) + 1e-4 * waves(at, cell));
    let mut fine = covered(&ctx, &solids, Params::default(), |_, _| 1e-3);
    let share = [0, 1].map(|axis| near[axis].len()).iter().product::<usize>() as f64 / (edge * edge) as f64;
    let mut detail = Detail::new(&ctx, &solids, Params::default(), near).expect("a liquid");
    let half = edge / 2;
    for index in 0..half * half {
        let [x, z] = [index % half, index / half].map(|at| low + 2.0 * cell * (at as f64 + 0.5));
        detail.pour_at([x, height(x), z], 0.8 * cell, 4e-3 * cell * cell).expect("liquid");
    }
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..if edge < 500 { 240 } else { 60 } {
        let start = thread_seconds();
        fine.step(&ctx, FRAME).expect("a frame");
        let middle = thread_seconds();
        detail.step(&ctx, FRAME).expect("a frame");
        times[0].push(1e3 * (middle - start));
        times[1].push(1e3 * (thread_seconds() - middle));
    }
    let [fine, detail] = times.map(median);
    let note = format!(
        "{:?} {detail:.3} of {fine:.3} ms, {edge} x {edge} cells, {:.1} % near",
        cpu_level(),
        100.0 * share
    );
    (detail / fine, note)
}
