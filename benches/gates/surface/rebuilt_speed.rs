//! Gates of the time that rebuilding takes: where nothing, little and much of a mesh is flagged, of a whole step while liquid merges,
//! and with two threads.

use std::time::Instant;

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::mesh_repair::Source;
use frazil::surface::{Params, Particles, StepReport, Tracker};

use crate::common::liquids::{Ball, ball, context, numbered};
use crate::common::shapes::welded;
use crate::harness::{Harness, median};
use crate::surface::known_motion::{steps_with, time};
use crate::surface::rebuilt_sequences::{CELL, spot_drop};

/// Phases of a step that rebuild and improve the mesh.
const PHASES: [&str; 4] = ["flag", "match", "rebuild", "improve"];
const FRAME: f64 = 1.0 / 24.0;
/// The thesis' dragon: radius (spacings), squares along an edge of the mesh's six faces, detail (spacings).
const DRAGON: (f64, usize, f64) = (17.0, 146, 0.25);
/// Steps of which the middle one counts.
const STEPS: usize = 5;
/// Thickness of the layer that goes (spacings): more than the surface may jump.
const LAYER: f64 = 1.5;
/// A drop that falls onto the dragon: radius (spacings), squares; its centre at first, its way in a frame (spacings), frames.
const DROP: (f64, usize) = (3.0, 26);
const BEGIN: f64 = 22.5;
const WAY: f64 = 0.25;
const FRAMES: usize = 12;
/// Frames of `spot_drop` whose bytes are compared, and the one from which a run is resumed.
const COMPARED: usize = 20;
const RESUMED: usize = 10;

pub fn run(h: &mut Harness) {
    if h.wants("surface.rebuild_time") {
        rebuilding(h);
    }
    h.measure("surface.frame_dragon", merge);
    threads(h);
}

/// A ball whose mesh is closed by index.
fn closed_ball((radius, n, detail): (f64, usize, f64)) -> Ball {
    let ball = ball(radius, n, detail);
    Ball { mesh: welded(&ball.mesh), ..ball }
}

fn params(spacing: f64) -> Params {
    Params { rebuild: true, ..Params::for_spacing(spacing) }
}

/// The phases that rebuild and improve alone.
fn rebuilding(h: &mut Harness) {
    let (ctx, dragon) = (context(1), closed_ball(DRAGON));
    let triangles = dragon.mesh.triangles.len();
    let cpu = frazil::numeric::cpu::cpu_level();
    let note = format!("{triangles} triangles, threads=1 cpu={cpu:?} thesis=3.16 s");
    h.measure("surface.rebuild_time_0", || {
        let steps = steps_with(&ctx, &dragon, params(dragon.spacing), STEPS);
        let reports: Vec<StepReport> = steps.into_iter().map(|(_, report)| report).collect();
        let changes = reports.iter().filter_map(|report| report.change.as_ref());
        let flagged: usize = changes.map(|change| change.flagged_cells).sum();
        (middle(&reports), format!("{}; {flagged} cells flagged; {note}", of_phases(&reports)))
    });
    for (name, share) in [("surface.rebuild_time_2", 0.02), ("surface.rebuild_time_20", 0.2)] {
        h.measure(name, || {
            let reports = without_a_layer(&ctx, &dragon, share);
            let Some(change) = &reports[0].change else { return (f64::NAN, "nothing was flagged".into()) };
            let all = cells(&dragon.mesh, CELL * dragon.spacing);
            let whole = change.sources.iter().filter(|source| matches!(source, Source::Whole(_))).count();
            let what = format!(
                "{}; {:.1} % of {all} cells flagged, {} rebuilt, rung {}; {:.1} % of the triangles became {}; {note}",
                of_phases(&reports),
                100.0 * change.flagged_cells as f64 / all as f64,
                change.rebuilt_cells,
                change.rebuild_level,
                100.0 * (triangles - whole) as f64 / triangles as f64,
                change.made_triangles()
            );
            (middle(&reports), what)
        });
    }
}

/// What the phases of a step take together (s).
fn together(report: &StepReport) -> f64 {
    PHASES.iter().map(|phase| time(report, phase)).sum()
}

/// The median of what the phases take together (s).
fn middle(reports: &[StepReport]) -> f64 {
    median(reports.iter().map(together).collect())
}

/// The median of what each phase takes.
fn of_phases(reports: &[StepReport]) -> String {
    let one = |phase: &&str| {
        let seconds = median(reports.iter().map(|report| time(report, phase)).collect());
        format!("{phase} {seconds:.3} s")
    };
    PHASES.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The same step again and again: under a cap that is a share of a resting ball's surface a layer of its particles is gone, so that the
/// surface there lies deeper than vertices may be moved.
fn without_a_layer(ctx: &Context, ball: &Ball, share: f64) -> Vec<StepReport> {
    let is_kept = |position: &DVec3| {
        let far = position.norm();
        far < (DRAGON.0 - LAYER) * ball.spacing || position.y < (1.0 - 2.0 * share) * far
    };
    let from = numbered(ball.positions.clone());
    let (positions, ids): (Vec<DVec3>, Vec<i64>) = from
        .positions
        .iter()
        .copied()
        .zip(from.ids.iter().copied())
        .filter(|(position, _)| is_kept(position))
        .unzip();
    let to = Particles { positions, ids, velocities: Vec::new() };
    let tracker = Tracker::new(ctx, params(ball.spacing), &ball.mesh, &from).expect("a tracker");
    (0..STEPS).map(|_| tracker.clone().step(ctx, &from, &to, FRAME).expect("a step")).collect()
}

/// About how many cells of an edge (m) a mesh passes through: those of its vertices and of the middles of its triangles.
fn cells(mesh: &TriMesh, edge: f64) -> usize {
    let cell = |position: DVec3| [0, 1, 2].map(|axis| (position[axis] / edge).floor() as i32);
    let of_vertices = mesh.positions.iter().map(|position| cell(position.cast()));
    let of_triangles = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        cell((a + b + c) / 3.0)
    });
    let mut cells: Vec<[i32; 3]> = of_vertices.chain(of_triangles).collect();
    cells.sort_unstable();
    cells.dedup();
    cells.len()
}

/// The whole step, while a drop merges with a large ball.
fn merge() -> (f64, String) {
    let (ctx, dragon, drop) = (context(1), closed_ball(DRAGON), closed_ball((DROP.0, DROP.1, 0.0)));
    let spacing = dragon.spacing;
    let by = |frame: usize| DVec3::new(0.0, (BEGIN - WAY * frame as f64) * spacing, 0.0);
    let at = |frame: usize| {
        let fallen = drop.positions.iter().map(|position| position + by(frame));
        numbered(dragon.positions.iter().copied().chain(fallen).collect())
    };
    let mut above = drop.mesh.clone();
    above.positions.iter_mut().for_each(|position| *position = (position.cast::<f64>() + by(0)).cast());
    let mut mesh = dragon.mesh.clone();
    mesh.append(&above);
    let mut from = at(0);
    let mut tracker = Tracker::new(&ctx, params(spacing), &mesh, &from).expect("a tracker");
    let (mut seconds, mut meshing, mut flagged) = (Vec::new(), Vec::new(), 0);
    for frame in 1..=FRAMES {
        let to = at(frame);
        let start = Instant::now();
        let report = tracker.step(&ctx, &from, &to, FRAME).expect("a step");
        let took = start.elapsed().as_secs_f64();
        from = to;
        if let Some(change) = report.change.as_ref().filter(|change| change.flagged_cells > 0) {
            seconds.push(took);
            meshing.push(together(&report));
            flagged += change.flagged_cells;
        }
    }
    if seconds.is_empty() {
        return (f64::NAN, "nothing merged".into());
    }
    let note = format!(
        "{} steps of {FRAMES} with {} cells flagged each, rebuilding {:.2} s of it; {} particles, {} triangles, threads=1 cpu={:?} \
         thesis=11.55 s",
        seconds.len(),
        flagged / seconds.len(),
        median(meshing),
        from.positions.len(),
        mesh.triangles.len(),
        frazil::numeric::cpu::cpu_level()
    );
    (median(seconds), note)
}

/// The first frames of `spot_drop` on one and two threads, and resumed.
fn threads(h: &mut Harness) {
    let names @ [gain, same] = ["surface.rebuilt_threads", "surface.rebuilt_same"];
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let Some(sequence) = spot_drop() else {
        names.into_iter().for_each(|name| h.skipped(name, "no data"));
        return;
    };
    let frames: Vec<Particles> = (0..COMPARED).map(|frame| sequence.at(frame)).collect();
    let contexts = [1, 2].map(context);
    let mut trackers = contexts
        .each_ref()
        .map(|ctx| Tracker::new(ctx, sequence.params(), &sequence.mesh, &frames[0]).expect("a tracker"));
    let (mut seconds, mut changes, mut others) = ([0.0; 2], 0, Vec::new());
    let mut resumed: Option<Tracker> = None;
    for (index, pair) in (1..).zip(frames.windows(2)) {
        let step = |tracker: &mut Tracker, ctx: &Context| {
            tracker.step(ctx, &pair[0], &pair[1], sequence.dt).expect("a step")
        };
        for ((tracker, ctx), seconds) in trackers.iter_mut().zip(&contexts).zip(&mut seconds) {
            let start = Instant::now();
            let report = step(tracker, ctx);
            *seconds += start.elapsed().as_secs_f64();
            changes += usize::from(report.change.is_some());
        }
        let saved = trackers[0].save();
        if saved != trackers[1].save() {
            others.push(format!("{} with two threads", sequence.title(index)));
        }
        if let Some(tracker) = &mut resumed {
            step(tracker, &contexts[1]);
            if tracker.save() != saved {
                others.push(format!("{} resumed", sequence.title(index)));
            }
        }
        if index == RESUMED {
            resumed = Tracker::resume(sequence.params(), &sequence.mesh, &saved).ok();
        }
    }
    h.measure(gain, || {
        let [one, two] = seconds;
        let note = format!(
            "{one:.2} s and {two:.2} s, {} changes in {} steps alone, without easing, arrays and files",
            changes / 2,
            COMPARED - 1
        );
        (one / two, note)
    });
    h.measure(same, || {
        let note = match others.first() {
            Some(first) => format!("{} differ, the first is {first}", others.len()),
            None => format!("{COMPARED} frames on 1 and 2 threads, and resumed after step {RESUMED}"),
        };
        (others.is_empty() && resumed.is_some(), note)
    });
}
