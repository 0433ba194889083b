//! Gate of the ball in a vortex (Enright et al. 2002): how far its mesh is from its start after a period, drawn out into a sheet and
//! back.

use std::time::Instant;

use frazil::base::DVec3;
use frazil::surface::{Params, Particles, Tracker};

use crate::common::liquids::{context, numbered};
use crate::common::made_sets::Vortex;
use crate::harness::Harness;

/// About as many particles: with 100,000 the gate would take some minutes on one thread, not one.
const PARTICLES: usize = 16_000;
/// Squares along an edge of the mesh's six faces: edges of half a spacing.
const SQUARES: usize = 48;
/// Frames of a period: 24 a second.
const FRAMES: u32 = 72;
/// Steps in which places are carried from frame to frame.
const STEPS: u32 = 4;
/// Every so many frames a line is printed.
const SHOWN: u32 = 6;

pub fn run(h: &mut Harness) {
    let name = "surface.vortex";
    if !h.wants(name) {
        return;
    }
    let ctx = context(1);
    let start = Instant::now();
    let Vortex { spacing, places, mesh } = Vortex::new(PARTICLES, SQUARES);
    let mut from = numbered(places);
    let mut tracker = Tracker::new(&ctx, Params::for_spacing(spacing), &mesh, &from).expect("a tracker");
    let first = tracker.vertices().to_vec();
    let mut truth = first.clone();
    let (mut most_flagged, mut last_flagged) = (0.0f64, 0.0);
    for frame in 1..=FRAMES {
        let span = [frame - 1, frame].map(|frame| Vortex::PERIOD * f64::from(frame) / f64::from(FRAMES));
        let to = carried(&from, span);
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
        from.places.len(),
        mesh.triangles.len(),
        start.elapsed().as_secs_f64()
    );
    h.gate(name, mean, &note);
}

/// The particles at the end of a time (s).
fn carried(particles: &Particles, span: [f64; 2]) -> Particles {
    let mut out = particles.clone();
    Vortex::carry(&mut out.places, span, STEPS);
    out
}

/// How far places are from others, one by one: mean, 95th percentile and greatest (spacings).
fn apart(places: &[DVec3], others: &[DVec3], spacing: f64) -> [f64; 3] {
    spread(places.iter().zip(others).map(|(a, b)| (a - b).norm() / spacing).collect())
}

/// How much farther from the ball's centre places are than others, or nearer.
fn off_ball(places: &[DVec3], others: &[DVec3], spacing: f64) -> [f64; 3] {
    let far = |place: &DVec3| (place - DVec3::repeat(Vortex::CENTRE)).norm();
    spread(places.iter().zip(others).map(|(a, b)| (far(a) - far(b)).abs() / spacing).collect())
}

fn spread(mut off: Vec<f64>) -> [f64; 3] {
    off.sort_unstable_by(f64::total_cmp);
    [off.iter().sum::<f64>() / off.len() as f64, off[off.len() * 95 / 100], off[off.len() - 1]]
}
