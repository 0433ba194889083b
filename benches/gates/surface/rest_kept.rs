//! Gates of meshes that change no more than they must, with the settings that scenes have by default: whether one at rest keeps its
//! triangles while the particles tremble, and whether easing makes one cross itself.

use frazil::Context;
use frazil::geometry::check::faults::meeting_pairs;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Outlook, Params, Tracker};

use crate::common::liquids::{Random, ball, context, filled, own_surface};
use crate::common::shapes::welded;
use crate::harness::Harness;
use crate::surface::rebuilt_sequences::{Sequence, made, spot_drop};
use crate::worst::Worst;

/// Frames in which a mesh comes to know that it rests, and those at rest in which its triangles are counted.
const SETTLING: usize = 8;
const RESTING: usize = 40;
/// How far particles at rest tremble around where they are (spacings).
const TREMBLE: f64 = 0.02;
/// Frames ahead that changes are eased in, and parts with fewer particles that are taken away, as scenes have it.
const AHEAD: usize = 4;
const MIN_DROP: usize = 8;
/// Initial distance between particles (m), and time between frames (s).
const SPACING: f64 = 0.01;
const DT: f64 = 1.0 / 24.0;
/// The frames for which the made sets move before they rest: while they are drawn out, about to tear, or one.
const MOVING: [usize; 4] = [14, 30, 30, 20];

pub fn run(h: &mut Harness) {
    let names @ [of_rest, of_easing] = ["surface.rest_kept_made", "surface.rest_kept_crossings"];
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let ctx = context(2);
    let spot = spot_drop();
    if spot.is_none() {
        println!("# spot_drop is skipped: no data");
    }
    h.measure(of_easing, || {
        let (mut more, mut frames) = (Worst::default(), 0);
        for sequence in spot.iter().chain(&made(&ctx)) {
            frames += crossings(&ctx, sequence, &mut more);
        }
        (more.value(), format!("{frames} frames that are eased; {}", more.note()))
    });
    h.measure(of_rest, || {
        let mut all = Worst::default();
        let mut settling = 0;
        // Liquids that were drawn out, tore or met before they come to rest.
        let stopped = made(&ctx).into_iter().zip(MOVING);
        let stopped = stopped.map(|(mut sequence, moving)| {
            sequence.frames = moving + 1;
            sequence
        });
        for calming in [pool(&ctx), uneven()].into_iter().chain(stopped).chain(spot) {
            let made = made_at_rest(&ctx, &calming);
            settling += made[..SETTLING].iter().sum::<usize>();
            all.see(made[SETTLING..].iter().sum::<usize>() as f64, || calming.name.into());
        }
        let note = format!("{}; {settling} in all of them in the {SETTLING} frames before", all.note());
        (all.value(), note)
    });
}

/// Pairs of triangles that meet more often in any frame as it is shown than in the mesh without easing; how many frames are eased.
fn crossings(ctx: &Context, sequence: &Sequence, more: &mut Worst) -> usize {
    let params = Params { min_drop: MIN_DROP, ..sequence.params() };
    let mut from = sequence.at(0);
    let mut tracker = Tracker::new(ctx, params, &sequence.mesh, &from).expect("a tracker");
    let (mut outlook, mut frames) = (Outlook::default(), 0);
    for frame in 0..sequence.frames - 1 {
        let coming = (frame + 1..sequence.frames.min(frame + AHEAD + 2)).map(|frame| sequence.at(frame));
        outlook.look(ctx, &tracker, from.clone(), coming.collect(), sequence.dt).expect("steps");
        let shown = outlook.eased(ctx, &tracker, AHEAD).expect("places");
        if shown != tracker.vertices() {
            let pairs = |places: &[DVec3]| {
                let positions = places.iter().map(|place| place.cast()).collect();
                meeting_pairs(&TriMesh { positions, triangles: tracker.triangles().to_vec() }).len() as f64
            };
            more.see(pairs(&shown) - pairs(tracker.vertices()), || sequence.title(frame));
            frames += 1;
        }
        let to = sequence.at(frame + 1);
        tracker = outlook.take(&from, &to, sequence.dt).expect("the step that was made").0;
        from = to;
    }
    frames
}

/// The triangles that are made in each frame after the last one of a sequence, where its liquid rests, those before it is known among them.
fn made_at_rest(ctx: &Context, calming: &Sequence) -> Vec<usize> {
    let moving = calming.frames - 1;
    let mut random = Random(5);
    let mut tremble = |frame: usize| {
        let mut particles = calming.at(frame.min(moving));
        for position in &mut particles.positions {
            let by = loop {
                let by = random.vector(1.0);
                if by.norm() <= 1.0 {
                    break by;
                }
            };
            *position += by * (TREMBLE * calming.spacing);
        }
        particles
    };
    let mut from = tremble(0);
    let params = Params { min_drop: MIN_DROP, ..calming.params() };
    let mut tracker = Tracker::new(ctx, params, &calming.mesh, &from).expect("a tracker");
    let mut made = Vec::new();
    for frame in 1..=moving + SETTLING + RESTING {
        let to = tremble(frame);
        let report = tracker.step(ctx, &from, &to, DT).expect("a step");
        from = to;
        if frame > moving {
            made.push(report.change.map_or(0, |change| change.made_triangles()));
        }
    }
    made
}

/// A pool under its own surface, whose triangles are as uneven as those of marching cubes, with ripples.
fn pool(ctx: &Context) -> Sequence {
    let positions = filled(SPACING, 0.1, 12.0 * SPACING, |position| position.y.abs() < 4.0 * SPACING);
    let mut mesh = own_surface(ctx, &positions, SPACING);
    for position in &mut mesh.positions {
        let wave = libm::sin(f64::from(position.x) / (0.8 * SPACING))
            * libm::sin(f64::from(position.z) / (0.7 * SPACING));
        position.y += (0.25 * SPACING * wave) as f32;
    }
    Sequence::at_rest("a pool", SPACING, mesh, positions)
}

/// A ball at rest under a mesh whose vertices lie anywhere along its surface, up to half an edge from even.
fn uneven() -> Sequence {
    let mut ball = ball(8.0, 40, 0.25);
    let mut random = Random(9);
    ball.mesh = welded(&ball.mesh);
    let edge = 8.0 * SPACING * std::f64::consts::FRAC_PI_2 / 40.0;
    for position in &mut ball.mesh.positions {
        let long = position.norm();
        let by: DVec3 = random.vector(0.3 * edge);
        *position = (*position + by.cast::<f32>()).normalize() * long;
    }
    Sequence::at_rest("an uneven ball", ball.spacing, ball.mesh, ball.positions)
}
