//! Gates of surface: a mesh that follows liquids whose motion is known.

use std::time::Instant;

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::surface::{Params, Particles, StepReport, Tracker};

use crate::common::liquids::{
    Ball, Errors, Random, ball, context, filled, follow, numbered, once_around, own_surface, turned,
};
use crate::harness::{Harness, median};

const FRAME: f64 = 1.0 / 24.0;

pub fn run(h: &mut Harness) {
    known_motions(h);
    still(h);
    h.measure("surface.far", far);
    h.measure_all(["surface.pool_mean", "surface.pool_p95"], pool);
    h.measure("surface.half_space", half_space);
    speed(h);
}

/// Rigid motion, stretch and shear: where vertices are, against where they should be.
fn known_motions(h: &mut Harness) {
    let ctx = context(2);
    let stretch = |position: DVec3, frame: usize| {
        // 1.5 times as long in 20 frames, with the same volume.
        let by = libm::exp(libm::log(1.5) / 20.0 * frame as f64);
        DVec3::new(position.x * by, position.y / by.sqrt(), position.z / by.sqrt())
    };
    let shear = |position: DVec3, frame: usize| {
        DVec3::new(position.x + 0.025 * frame as f64 * position.y, position.y, position.z)
    };
    let mut flagged = None;
    let mut measure =
        |h: &mut Harness, name: &str, detail: f64, frames: usize, motion: &dyn Fn(DVec3, usize) -> DVec3| {
            let names = ["mean", "p95", "max"].map(|part| format!("surface.{name}_{part}"));
            if !names.iter().any(|name| h.wants(name)) && !h.wants("surface.flagged_none") {
                return;
            }
            let ball = ball(10.0, 40, detail);
            let (_, errors) = follow(&ctx, &ball, Params::for_spacing(ball.spacing), frames, motion);
            let Errors { mean, p95, most, flagged: count } = errors;
            *flagged.get_or_insert(0) += count;
            for (name, value) in names.iter().zip([mean, p95, most]) {
                if h.wants(name) {
                    h.gate(name, value, &format!("{frames} frames, {} particles", ball.positions.len()));
                }
            }
        };
    measure(h, "rigid", 0.25, 100, &once_around);
    measure(h, "stretch", 0.0, 20, &stretch);
    measure(h, "shear", 0.0, 20, &shear);
    if let Some(count) = flagged.filter(|_| h.wants("surface.flagged_none")) {
        h.gate("surface.flagged_none", count as f64, "in all of these frames");
    }
}

fn moved(ball: &Ball, angle: f64, by: DVec3) -> Particles {
    numbered(ball.positions.iter().map(|position| turned(*position, angle, by)).collect())
}

/// Nothing moves; particles in another order; one and two threads.
fn still(h: &mut Harness) {
    let names = ["surface.still", "surface.order", "surface.same_bytes_threads"];
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let ball = ball(8.0, 30, 0.25);
    let frames = [moved(&ball, 0.0, DVec3::zeros()), moved(&ball, 0.1, DVec3::new(0.02, 0.01, 0.0))];
    let walk = |threads: usize, frames: &[Particles]| {
        let ctx = context(threads);
        let params = Params::for_spacing(ball.spacing);
        let mut tracker = Tracker::new(&ctx, params, &ball.mesh, &frames[0]).expect("a tracker");
        for pair in frames.windows(2) {
            tracker.step(&ctx, &pair[0], &pair[1], FRAME).expect("a step");
        }
        tracker.vertices().to_vec()
    };
    if h.wants("surface.still") {
        let [first, _] = &frames;
        let rested = walk(2, &[first.clone(), first.clone(), first.clone()]);
        let begun: Vec<DVec3> = ball.mesh.positions.iter().map(|position| position.cast()).collect();
        h.holds("surface.still", rested == begun, "two frames of the same particles");
    }
    let two = walk(2, &frames);
    if h.wants("surface.order") {
        let turned = frames.each_ref().map(|frame| {
            let mut frame = frame.clone();
            frame.positions.reverse();
            frame.ids.reverse();
            frame.positions.rotate_left(11);
            frame.ids.rotate_left(11);
            frame
        });
        h.holds("surface.order", walk(2, &turned) == two, "particles from the last to the first");
    }
    if h.wants("surface.same_bytes_threads") {
        h.holds("surface.same_bytes_threads", walk(1, &frames) == two, "1 and 2 threads");
    }
}

/// The same liquid 1 km from the origin, its particles in 32 bits as files hold them.
fn far() -> (f64, &'static str) {
    let ctx = context(2);
    // Spacing 0.1 m; a whole number of cells away.
    let near = ball(8.0, 30, 0.25);
    let scale = 0.1 / near.spacing;
    let by = DVec3::new(1000.0, 0.0, -1000.0);
    let run = |by: DVec3| {
        let at = |frame: f64| {
            let position = |position: &DVec3| {
                let position =
                    turned(*position * scale, 0.05 * frame, DVec3::new(0.03, 0.02, 0.0) * frame) + by;
                position.map(|x| f64::from(x as f32))
            };
            numbered(near.positions.iter().map(position).collect())
        };
        let mut mesh = near.mesh.clone();
        mesh.positions.iter_mut().for_each(|p| *p = (p.cast::<f64>() * scale + by).cast());
        let mut tracker = Tracker::new(&ctx, Params::for_spacing(0.1), &mesh, &at(0.0)).expect("a tracker");
        for frame in 0..10 {
            let (from, to) = (at(f64::from(frame)), at(f64::from(frame + 1)));
            tracker.step(&ctx, &from, &to, FRAME).expect("a step");
        }
        tracker.vertices().iter().map(|vertex| vertex - by).collect::<Vec<_>>()
    };
    let off = run(DVec3::zeros()).iter().zip(run(by)).map(|(a, b)| (a - b).norm()).sum::<f64>();
    (off / near.mesh.positions.len() as f64 / 0.1, "mean after 10 frames")
}

/// A pool at rest whose particles tremble by up to 0.02 spacings: how far vertices move from frame to frame.
fn pool() -> [(f64, &'static str); 2] {
    let ctx = context(2);
    let ball = ball(8.0, 30, 0.25);
    let mut random = Random(5);
    let mut tremble = || {
        let one = |position: &DVec3| loop {
            let by = random.vector(1.0);
            if by.norm() <= 1.0 {
                return position + by * (0.02 * ball.spacing);
            }
        };
        numbered(ball.positions.iter().map(one).collect())
    };
    let mut from = tremble();
    let mut tracker =
        Tracker::new(&ctx, Params::for_spacing(ball.spacing), &ball.mesh, &from).expect("a tracker");
    let mut ways = Vec::new();
    for _ in 0..20 {
        let to = tremble();
        let before = tracker.vertices().to_vec();
        tracker.step(&ctx, &from, &to, FRAME).expect("a step");
        ways.extend(tracker.vertices().iter().zip(&before).map(|(a, b)| (a - b).norm() / ball.spacing));
        from = to;
    }
    ways.sort_unstable_by(f64::total_cmp);
    [(ways.iter().sum::<f64>() / ways.len() as f64, "20 frames"), (ways[ways.len() * 95 / 100], "20 frames")]
}

/// Where the surface of a half-space lies above its outermost particles.
fn half_space() -> (f64, &'static str) {
    let ctx = context(2);
    let positions = filled(1.0, 0.0, 12.0, |position| position.y < 0.0);
    let mesh = own_surface(&ctx, &positions, 1.0);
    let middle = mesh.positions.iter().filter(|p| p.x.abs() < 4.0 && p.z.abs() < 4.0 && p.y > -5.0);
    let most = middle.map(|p| f64::from((p.y + 0.5 - 0.48).abs())).fold(0.0, f64::max);
    (most, "from 0.48 spacings above the outermost centres")
}

/// Times of the phases, on one thread, with as many particles and triangles as the thesis' dragon and its falling objects.
fn speed(h: &mut Harness) {
    let phases = ["advect", "phi", "distance", "project"];
    let names = phases.map(|phase| format!("surface.time_{phase}"));
    let cpu = frazil::numeric::cpu::cpu_level();
    if names.iter().any(|name| h.wants(name)) {
        let reports = steps(&context(1), &ball(17.0, 146, 0.25));
        for ((name, phase), thesis) in names.iter().zip(phases).zip([1.17, 3.01, 1.39, 1.24]) {
            if h.wants(name) {
                let note = format!("threads=1 cpu={cpu:?} thesis={thesis} s");
                h.gate(name, median(reports.iter().map(|(_, report)| time(report, phase)).collect()), &note);
            }
        }
    }
    if h.wants("surface.time_260k") {
        let reports = steps(&context(1), &ball(39.5, 176, 0.25));
        let each = |(_, report): &(f64, StepReport)| phases.iter().map(|phase| time(report, phase)).sum();
        let note = format!("threads=1 cpu={cpu:?} thesis=48 s without meshing");
        h.gate("surface.time_260k", median(reports.iter().map(each).collect()), &note);
    }
    if h.wants("surface.threads") {
        let ball = ball(39.5, 176, 0.25);
        let [one, two] = [1, 2]
            .map(|threads| median(steps(&context(threads), &ball).iter().map(|(time, _)| *time).collect()));
        h.gate("surface.threads", one / two, &format!("{one:.2} s and {two:.2} s"));
    }
}

/// Wall clock and report of five steps, after one that warms up.
fn steps(ctx: &Context, ball: &Ball) -> Vec<(f64, StepReport)> {
    steps_with(ctx, ball, Params::for_spacing(ball.spacing), 5)
}

/// Wall clock and report of some steps, after one that warms up.
pub fn steps_with(ctx: &Context, ball: &Ball, params: Params, count: usize) -> Vec<(f64, StepReport)> {
    let at = |frame: usize| moved(ball, 0.02 * frame as f64, DVec3::new(0.001, 0.0, 0.0) * frame as f64);
    let mut tracker = Tracker::new(ctx, params, &ball.mesh, &at(0)).expect("a tracker");
    let mut out = Vec::new();
    for frame in 0..=count {
        let (from, to) = (at(frame), at(frame + 1));
        let start = Instant::now();
        let report = tracker.step(ctx, &from, &to, FRAME).expect("a step");
        out.push((start.elapsed().as_secs_f64(), report));
    }
    out.remove(0);
    out
}

/// Seconds of a phase of a step.
pub fn time(report: &StepReport, phase: &str) -> f64 {
    report.phases.iter().find(|time| time.name == phase).map_or(0.0, |time| time.time.as_secs_f64())
}
