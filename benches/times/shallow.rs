//! Shallow: the simulation columns of the thesis' Table 4.1, its time-step study and its scaling, beside ours.

use frazil::Context;
use frazil::numeric::cpu::cpu_level;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::{Section, TimeStepping};
use frazil::shallow::pipes::Border;
use frazil::shallow::surface::heights::minimum_heights::{Distance, MinimumHeights};
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::rim::silhouette::Silhouette;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};

use crate::common::bodies::Dice;
use crate::common::rough_ground::{Kind, rough};
use crate::common::shallow::{context, covered, ground, source, waves};
use crate::shallow_speed::{Frames, stacked, thread_seconds};
use crate::surface::title;

/// A row of Table 4.1: name, cells along an edge, floors, step (s), cell (m), viscosity (m2/s), greatest and mean time of the simulation (ms).
type Example = (&'static str, usize, usize, f64, f64, f64, [f64; 2]);
/// Rows of Table 4.1.
const EXAMPLES: [Example; 6] = [
    ("Surgery (4.1)", 200, 5, 0.003, 0.0005, 4.0e-6, [5.43, 4.86]),
    ("Viscosity (4.13a)", 200, 1, 0.003, 0.0005, 0.0, [1.05, 0.61]),
    ("Viscosity (4.13b)", 200, 1, 0.003, 0.0005, 4.0e-6, [1.03, 0.62]),
    ("Viscosity (4.13c)", 200, 1, 0.003, 0.0005, 4.0e-5, [1.02, 0.60]),
    ("Viscosity (4.13d)", 200, 1, 0.003, 0.0005, 4.0e-1, [0.93, 0.60]),
    ("Three layers (4.15)", 100, 3, 0.009, 0.001, 4.0e-6, [0.68, 0.32]),
];
/// Frames of 1/60 s of each, in fifths.
const FRAMES: usize = 60;
/// Edge of the domain of the studies (m), and depth of its liquid.
const EDGE: f64 = 0.1;
const DEPTH: f64 = 0.002;

/// All tables.
pub fn tables() {
    title(
        &format!(
            "Shallow: milliseconds a frame of 1/60 s, on average and the longest of {} frames, thread CPU time on one core \
             ({:?}). The thesis' are of a GTX 970. Ours have as many cells, floors with holes where there are several, 1 mm \
             of liquid on all columns, or 2 ml/s from a source.",
            5 * FRAMES,
            cpu_level()
        ),
        "example | cells | step (ms) | nu (m2/s) | thesis: average, longest | ours, all wet: average, longest | from a source: average, longest | wet at the end (%)",
    );
    EXAMPLES.iter().for_each(example);
    steps();
    scaling();
    films();
    fitting();
}

fn example(&(name, edge, floors, step, cell, viscosity, [longest, mean]): &Example) {
    let solids = terrain(edge, floors, cell);
    let params =
        Params { liquid: Liquid::new(viscosity), pace: TimeStepping::Realtime(step), ..Params::default() };
    let mut all = covered(&context(), &solids, params.clone(), |[x, z], _| {
        1e-3 + 1e-4 * waves([2.0 * z, 2.0 * x], cell)
    });
    let all = Frames::timed(&mut all, FRAMES, |_| ());
    let mut poured = Shallow::new(&context(), &solids, params).expect("a liquid");
    // Above the highest floor, which may slope.
    let top = 0.01 * (floors + 1) as f64;
    let at = [-0.3 * edge as f64 * cell, top, 0.0];
    poured.set_flows(&[source(at, 3.0 * cell, 2.0e-6)], |_| "the source".into()).expect("a source");
    let from = Frames::timed(&mut poured, FRAMES, |_| ());
    let wet =
        poured.depths().iter().filter(|depth| **depth > 0).count() as f64 / poured.columns().count() as f64;
    println!(
        "| {name} | {edge} x {edge} x {floors} | {:.0} | {viscosity:e} | {mean:.2}, {longest:.2} | {:.3}, {:.3} | {:.3}, \
         {:.3} | {:.0} |",
        1e3 * step,
        all.milliseconds(),
        all.worst(),
        from.milliseconds(),
        from.worst(),
        100.0 * wet
    );
}

/// A slope as in Fig. 4.13, or floors with holes.
fn terrain(edge: usize, floors: usize, cell: f64) -> Solids {
    if floors > 1 {
        return stacked(edge, cell, floors, true);
    }
    ground([edge; 2], cell, [-0.01, 0.1], |at @ [x, _]| 0.01 - 0.1 * x + 1e-4 * waves(at, cell))
}

/// Fig. 4.12: the longest stable step by the count of cells across the same domain.
fn steps() {
    title(
        &format!(
            "The longest stable step (ms) of liquid {} mm deep without viscosity on {EDGE} m, by cells along an edge: found by \
             trial, and dx / (c sqrt 2), with the wetted section and with the thesis'.",
            1e3 * DEPTH
        ),
        "cells | wetted: found | bound | dx^2: found | bound",
    );
    for edge in [25, 50, 100, 200, 400] {
        let cell = EDGE / edge as f64;
        let row = [(Section::Wetted, DEPTH), (Section::Whole, cell)].map(|(section, height)| {
            let bound = cell / (2.0 * 9.81 * height).sqrt();
            format!("{:.4} | {:.4}", 1e3 * longest_stable(edge, section, bound), 1e3 * bound)
        });
        println!("| {edge} | {} | {} |", row[0], row[1]);
    }
}

/// The longest step (s) with which a rippled lake does not grow, within a thousandth of the bound.
fn longest_stable(edge: usize, section: Section, bound: f64) -> f64 {
    let (mut stable, mut unstable) = (0.25 * bound, 4.0 * bound);
    assert!(is_stable(edge, section, stable) && !is_stable(edge, section, unstable), "the bound is far off");
    while unstable - stable > 1e-3 * bound {
        let middle = 0.5 * (stable + unstable);
        if is_stable(edge, section, middle) { stable = middle } else { unstable = middle }
    }
    stable
}

/// Whether ripples of a ten-thousandth of the depth stay under a hundredth in 500 steps.
fn is_stable(edge: usize, section: Section, step: f64) -> bool {
    let (ctx, cell) = (context(), EDGE / edge as f64);
    let solids = ground([edge; 2], cell, [-0.01, 0.1], |_| 0.0);
    let params = Params {
        liquid: Liquid::new(0.0),
        kept: 1.0,
        pace: TimeStepping::Exact,
        section,
        ..Params::default()
    };
    let mut liquid = rippled(&ctx, &solids, params);
    liquid.replay(&ctx, &vec![step; 500]).expect("steps");
    let unit = solids.heights.unit;
    let off = |column: usize| (unit * f64::from(liquid.depths()[column]) - DEPTH).abs();
    liquid.columns().indices().all(|column| off(column) < 1e-2 * DEPTH)
}

fn rippled(ctx: &Context, solids: &Solids, params: Params) -> Shallow {
    let mut liquid = covered(ctx, solids, params, |_, _| DEPTH);
    let mut dice = Dice(12);
    for index in 0..liquid.columns().len() {
        if liquid.columns().is_column(index) {
            liquid.pour(index, DEPTH * dice.between(-1e-4, 1e-4));
        }
    }
    liquid
}

/// Fig. 4.17: the time of a frame by the count of cells.
fn scaling() {
    title(
        "Milliseconds a frame of 1/60 s in steps of 3 ms, all columns wet, by cells along an edge: thread CPU time on one core.",
        "cells | columns | average | longest | a million columns",
    );
    for edge in [50, 100, 150, 200, 250, 300, 400, 600, 1000] {
        let cell = 0.0005;
        let solids = terrain(edge, 1, cell);
        let params = Params { pace: TimeStepping::Realtime(0.003), ..Params::default() };
        let mut liquid = covered(&context(), &solids, params, |_, _| 1e-3);
        let frames = Frames::timed(&mut liquid, if edge > 300 { 3 } else { 20 }, |_| ());
        let (mean, columns) = (frames.milliseconds(), liquid.columns().count());
        println!(
            "| {edge} | {columns} | {mean:.3} | {:.3} | {:.2} |",
            frames.worst(),
            1e6 * mean / columns as f64
        );
    }
}

/// A fast film: blood from a source at the top of an incline, as exact steps and longer ones find it.
fn films() {
    const SLOPE: f64 = 0.35;
    const SECONDS: f64 = 3.0;
    title(
        "Blood, 1 ml/s for 3 s on an incline of 35 % of 200 x 200 cells of 0.5 mm, which it runs off: by the steps.",
        "steps | steps a frame | deepest on the lower half at the end (mm) | on the incline at the end (ml) | a frame (ms) | rows held back a frame",
    );
    for (name, pace) in [
        ("exact", TimeStepping::Exact),
        ("1 ms", TimeStepping::Realtime(1e-3)),
        ("3 ms", TimeStepping::Realtime(3e-3)),
    ] {
        let (cell, edge) = (0.0005, 200);
        let solids = ground([edge; 2], cell, [-0.05, 0.1], |[x, _]| 0.03 - SLOPE * x);
        let params = Params { liquid: Liquid::BLOOD, pace, border: Border::Absorbing, ..Params::default() };
        let (ctx, mut liquid) = (context(), Shallow::new(&context(), &solids, params).expect("a liquid"));
        let top = source([-0.04, 0.1, 0.0], 0.003, 1e-6);
        liquid.set_flows(&[top], |_| "the source".into()).expect("a source");
        let (mut steps, mut held, start) = (0, 0, thread_seconds());
        let frames = (SECONDS * 60.0) as u32;
        for _ in 0..frames {
            let report = liquid.step(&ctx, 1.0 / 60.0).expect("a frame");
            steps += report.steps;
            held += report.slowed;
        }
        let time = 1e3 * (thread_seconds() - start) / f64::from(frames);
        let columns = liquid.columns();
        let lower = columns.indices().filter(|&index| columns.cell(index)[0] >= edge / 2);
        let deepest = lower.map(|index| liquid.depths()[index]).max().unwrap_or(0);
        println!(
            "| {name} | {:.0} | {:.2} | {:.2} | {time:.2} | {:.0} |",
            f64::from(steps) / f64::from(frames),
            1e3 * f64::from(deepest) * solids.heights.unit,
            1e6 * liquid.balance().inside,
            held as f64 / f64::from(frames),
        );
    }
}

/// What the surface has to know of the ground's mesh.
fn fitting() {
    title(
        "Milliseconds, the least of five, thread CPU time on one core: what is found of a ground's mesh, once or where it has moved.",
        "cells | triangles | minimum heights | those near 40 x 40 cells | ledges",
    );
    for edge in [100, 200, 300] {
        let rough = rough(39, Kind { edge, ..Kind::of(39) });
        let (columns, positions, faces) = (&rough.columns, &rough.positions, &rough.faces);
        let (mut lifts, distance) = (MinimumHeights::default(), Distance::default());
        let (mut ledges, mut silhouette) = (Ledges::default(), Silhouette::default());
        let near = [edge / 2 - 20..edge / 2 + 20, edge / 2 - 20..edge / 2 + 20];
        let mut times = [f64::MAX; 3];
        for _ in 0..5 {
            let mut start = thread_seconds();
            let mut lap = || {
                let now = thread_seconds();
                1e3 * (now - std::mem::replace(&mut start, now))
            };
            lifts.find(columns, positions, faces, distance).expect("minimum heights");
            let all = lap();
            lifts.update(columns, positions, faces, distance, near.clone()).expect("minimum heights");
            let some = lap();
            silhouette.fit(&mut ledges, columns, positions, faces).expect("ledges");
            let laps = [all, some, lap()];
            times = std::array::from_fn(|at| times[at].min(laps[at]));
        }
        let [all, some, found] = times;
        println!("| {edge} x {edge} | {} | {all:.1} | {some:.1} | {found:.1} |", faces.len());
    }
}
