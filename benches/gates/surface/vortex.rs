//! Gates of the ball in a vortex (Enright et al. 2002): how far its mesh is from its start after a period, drawn out into a sheet and
//! back; of a mesh that is rebuilt, where the sheet tears and closes again, also how much of its volume is lost.

use std::time::Instant;

use frazil::geometry::check::deviation::{NearestTree, from_surface};
use frazil::geometry::check::topology::components;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Params, Particles, Tracker};

use crate::common::liquids::{context, numbered};
use crate::common::made_sets::Vortex;
use crate::common::shapes::welded;
use crate::harness::{Harness, spread};

/// About as many particles: with 100,000 the gate would take some minutes on one thread, not one.
const PARTICLES: usize = 16_000;
/// Squares along an edge of the mesh's six faces: edges of half a spacing.
const SQUARES: usize = 48;
/// Frames of a period: 24 a second.
const FRAMES: u32 = 72;
/// Steps in which positions are carried from frame to frame.
const STEPS: u32 = 4;
/// Every so many frames a line is printed.
const SHOWN: u32 = 6;
/// The same of a mesh that is rebuilt: 12 frames per second, and threads. Rebuilding a torn sheet takes a long time.
const REBUILT_FRAMES: u32 = 36;
const REBUILT_STEPS: u32 = 8;
const THREADS: usize = 2;

pub fn run(h: &mut Harness) {
    as_it_is(h);
    h.measure_all(["surface.vortex_rebuilt_volume", "surface.vortex_rebuilt_mean"], rebuilt);
}

/// The mesh keeps its triangles.
fn as_it_is(h: &mut Harness) {
    let name = "surface.vortex";
    // Not where only those are asked for whose names begin so.
    if !h.missing().contains(&name) {
        return;
    }
    let ctx = context(1);
    let start = Instant::now();
    let Vortex { spacing, positions, mesh } = Vortex::new(PARTICLES, SQUARES);
    let mut from = numbered(positions);
    let mut tracker = Tracker::new(&ctx, Params::for_spacing(spacing), &mesh, &from).expect("a tracker");
    let first = tracker.vertices().to_vec();
    let mut truth = first.clone();
    let (mut most_flagged, mut last_flagged) = (0.0f64, 0.0);
    for frame in 1..=FRAMES {
        let span = span(frame, FRAMES);
        let to = carried(&from, span, STEPS);
        tracker.step(&ctx, &from, &to, span[1] - span[0]).expect("a step");
        from = to;
        Vortex::carry(&mut truth, span, STEPS);
        let flagged = tracker.flags().iter().filter(|flag| **flag).count();
        last_flagged = 100.0 * flagged as f64 / truth.len() as f64;
        most_flagged = most_flagged.max(last_flagged);
        if frame.is_multiple_of(SHOWN) {
            let [mean, p95, most] = apart(tracker.vertices(), &truth, spacing);
            println!(
                "# vortex, frame {frame}: off by {mean:.3} r, p95 {p95:.3}, at most {most:.2}; {last_flagged:.2} % flagged"
            );
        }
    }
    let [mean, p95, most] = apart(tracker.vertices(), &first, spacing);
    let [round_mean, round_p95, round_most] = off_ball(tracker.vertices(), &first, spacing);
    let note = format!(
        "from where each vertex began, p95 {p95:.3} r, at most {most:.2}; off the ball by {round_mean:.3} r, p95 {round_p95:.3}, \
         at most {round_most:.2}; {last_flagged:.2} % flagged at the end, at most {most_flagged:.2} %; {} particles, {} triangles, \
         {:.0} s on one thread",
        from.positions.len(),
        mesh.triangles.len(),
        start.elapsed().as_secs_f64()
    );
    h.gate(name, mean, &note);
}

/// The mesh is rebuilt where the sheet is too thin for its particles, and where it closes again.
fn rebuilt() -> [(f64, String); 2] {
    let ctx = context(THREADS);
    let start = Instant::now();
    let Vortex { spacing, positions, mesh } = Vortex::new(PARTICLES, SQUARES);
    let first = welded(&mesh);
    let params = Params { rebuild: true, ..Params::for_spacing(spacing) };
    let mut from = moving(numbered(positions), 0.0);
    let mut tracker = Tracker::new(&ctx, params, &first, &from).expect("a tracker");
    let lost = |mesh: &TriMesh| 100.0 * (1.0 - mesh.volume() / first.volume());
    let (mut changes, mut most) = (0, 0);
    for frame in 1..=REBUILT_FRAMES {
        let span = span(frame, REBUILT_FRAMES);
        let to = moving(carried(&from, span, REBUILT_STEPS), span[1]);
        let report = match tracker.step(&ctx, &from, &to, span[1] - span[0]) {
            Ok(report) => report,
            Err(error) => {
                let note = format!("frame {frame} of {REBUILT_FRAMES}: {error}");
                return [(f64::NAN, note.clone()), (f64::NAN, note)];
            }
        };
        from = to;
        let cells = report.change.as_ref().map_or(0, |change| change.flagged_cells);
        changes += usize::from(cells > 0);
        most = most.max(tracker.triangles().len());
        if frame.is_multiple_of(SHOWN) {
            println!(
                "# vortex, rebuilt, frame {frame}: {:.2} % lost, {} triangles in {} bodies, {cells} cells flagged, {:.0} s",
                lost(&tracker.mesh()),
                tracker.triangles().len(),
                components(tracker.triangles()).len(),
                start.elapsed().as_secs_f64()
            );
        }
    }
    let last = tracker.mesh();
    let off = |from: &TriMesh, to: &TriMesh| {
        from_surface(from, &NearestTree::new(to))
            .map_or([f64::NAN; 3], |off| [off.mean, off.p95, off.max].map(|far| far / spacing))
    };
    let (there, back) = (off(&last, &first), off(&first, &last));
    let note = format!(
        "{} particles, {REBUILT_FRAMES} frames, {changes} of which changed cells; {} triangles at first, at most {most}, {} at the end \
         in {} bodies; {:.0} s on {THREADS} threads",
        from.positions.len(),
        first.triangles.len(),
        last.triangles.len(),
        components(&last.triangles).len(),
        start.elapsed().as_secs_f64()
    );
    let gone = lost(&last);
    let [to_mean, to_p95, to_most] = there;
    let [back_mean, back_p95, back_most] = back;
    let ways = format!(
        "the larger of both ways: to the ball {to_mean:.3} r, p95 {to_p95:.3}, at most {to_most:.2}; from it {back_mean:.3}, p95 \
         {back_p95:.3}, at most {back_most:.2}"
    );
    let of_volume = format!("{gone:.2} % lost; {note}");
    [(gone.abs(), of_volume), (to_mean.max(back_mean), format!("{ways}; {note}"))]
}

/// The time (s) of a frame out of so many in a period.
fn span(frame: u32, of: u32) -> [f64; 2] {
    [frame - 1, frame].map(|frame| Vortex::PERIOD * f64::from(frame) / f64::from(of))
}

/// The particles at the end of a time (s), carried in so many steps.
fn carried(particles: &Particles, span: [f64; 2], steps: u32) -> Particles {
    let mut out = particles.clone();
    Vortex::carry(&mut out.positions, span, steps);
    out
}

/// Particles with their velocities at a time (s): in few frames their ways are no lines.
fn moving(mut particles: Particles, time: f64) -> Particles {
    let speed = |position: &DVec3| Vortex::velocity(*position, time).cast::<f32>().into();
    particles.velocities = particles.positions.iter().map(speed).collect();
    particles
}

/// How far positions are from others, one by one: mean, 95th percentile and greatest (spacings).
fn apart(positions: &[DVec3], others: &[DVec3], spacing: f64) -> [f64; 3] {
    spread(positions.iter().zip(others).map(|(a, b)| (a - b).norm() / spacing).collect())
}

/// How much farther from the ball's centre positions are than others, or nearer.
fn off_ball(positions: &[DVec3], others: &[DVec3], spacing: f64) -> [f64; 3] {
    let far = |position: &DVec3| (position - DVec3::repeat(Vortex::CENTRE)).norm();
    spread(positions.iter().zip(others).map(|(a, b)| (far(a) - far(b)).abs() / spacing).collect())
}
