//! Gates of meshes that change no more than they must, with the settings that scenes have by default: whether one at rest keeps its
//! triangles while the particles tremble, and whether easing makes one cross itself.

use frazil::Context;
use frazil::geometry::check::faults::meeting_pairs;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Outlook, Params, Particles, Tracker};

use crate::common::liquids::{Random, ball, context, filled, numbered, own_surface};
use crate::common::made_sets::{Set, sets};
use crate::common::shapes::welded;
use crate::harness::Harness;
use crate::surface::rebuilt_sequences::{Sequence, made, spot_drop};
use crate::worst::Worst;

const NAMES: [&str; 2] = ["surface.rest_kept_made", "surface.rest_kept_crossings"];
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

/// A liquid that comes to rest, and the mesh that it begins with.
struct Calming {
    name: &'static str,
    spacing: f64,
    mesh: TriMesh,
    /// The frame, counted from 0, after which nothing moves.
    moving: usize,
    particles: Box<dyn Fn(usize) -> Particles>,
}

pub fn run(h: &mut Harness) {
    let wanted = NAMES.map(|name| h.wants(name));
    if wanted == [false; 2] {
        return;
    }
    let ctx = context(2);
    let spot = spot_drop();
    if spot.is_none() {
        println!("# spot_drop is skipped: no data");
    }
    if wanted[1] {
        let (mut more, mut frames) = (Worst::default(), 0);
        for sequence in spot.iter().chain(&made(&ctx)) {
            frames += crossings(&ctx, sequence, &mut more);
        }
        h.gate(NAMES[1], more.value(), &format!("{frames} frames that are eased; {}", more.note()));
    }
    if wanted[0] {
        let mut all = Worst::default();
        let mut settling = 0;
        for calming in [pool(&ctx), uneven()].into_iter().chain(stopped(&ctx)).chain(spot.map(still)) {
            let made = calming.made(&ctx);
            settling += made[..SETTLING].iter().sum::<usize>();
            all.see(made[SETTLING..].iter().sum::<usize>() as f64, || calming.name.into());
        }
        let note = format!("{}; {settling} in all of them in the {SETTLING} frames before", all.note());
        h.gate(NAMES[0], all.value(), &note);
    }
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

impl Calming {
    /// The triangles that are made in each frame at rest, those before it is known among them.
    fn made(&self, ctx: &Context) -> Vec<usize> {
        let mut random = Random(5);
        let mut tremble = |frame: usize| {
            let mut particles = (self.particles)(frame.min(self.moving));
            for position in &mut particles.positions {
                let by = loop {
                    let by = random.vector(1.0);
                    if by.norm() <= 1.0 {
                        break by;
                    }
                };
                *position += by * (TREMBLE * self.spacing);
            }
            particles
        };
        let mut from = tremble(0);
        let params = Params { rebuild: true, min_drop: MIN_DROP, ..Params::for_spacing(self.spacing) };
        let mut tracker = Tracker::new(ctx, params, &self.mesh, &from).expect("a tracker");
        let mut made = Vec::new();
        for frame in 1..=self.moving + SETTLING + RESTING {
            let to = tremble(frame);
            let report = tracker.step(ctx, &from, &to, DT).expect("a step");
            from = to;
            if frame > self.moving {
                made.push(report.change.map_or(0, |change| change.made_triangles()));
            }
        }
        made
    }
}

/// A pool under its own surface, whose triangles are as uneven as those of marching cubes, with ripples.
fn pool(ctx: &Context) -> Calming {
    let positions = filled(SPACING, 0.1, 12.0 * SPACING, |position| position.y.abs() < 4.0 * SPACING);
    let mut mesh = own_surface(ctx, &positions, SPACING);
    for position in &mut mesh.positions {
        let wave = libm::sin(f64::from(position.x) / (0.8 * SPACING))
            * libm::sin(f64::from(position.z) / (0.7 * SPACING));
        position.y += (0.25 * SPACING * wave) as f32;
    }
    Calming {
        name: "a pool",
        spacing: SPACING,
        mesh,
        moving: 0,
        particles: Box::new(move |_| numbered(positions.clone())),
    }
}

/// A ball at rest under a mesh whose vertices lie anywhere along its surface, up to half an edge from even.
fn uneven() -> Calming {
    let mut ball = ball(8.0, 40, 0.25);
    let mut random = Random(9);
    ball.mesh = welded(&ball.mesh);
    let edge = 8.0 * SPACING * std::f64::consts::FRAC_PI_2 / 40.0;
    for position in &mut ball.mesh.positions {
        let long = position.norm();
        let by: DVec3 = random.vector(0.3 * edge);
        *position = (*position + by.cast::<f32>()).normalize() * long;
    }
    let positions = ball.positions;
    Calming {
        name: "an uneven ball",
        spacing: ball.spacing,
        mesh: ball.mesh,
        moving: 0,
        particles: Box::new(move |_| numbered(positions.clone())),
    }
}

/// Liquids that were drawn out, tore or met before they come to rest.
fn stopped(ctx: &Context) -> Vec<Calming> {
    let one = |(set, moving): (Set, usize)| {
        let Set { name, positions, motion } = set;
        let at = move |frame: usize| {
            numbered(positions.iter().map(|position| motion(*position, frame as f64) * SPACING).collect())
        };
        let mesh = own_surface(ctx, &at(0).positions, SPACING);
        Calming { name, spacing: SPACING, mesh, moving, particles: Box::new(at) }
    };
    sets().into_iter().zip(MOVING).map(one).collect()
}

/// A cache that goes on moving in its last frame, stopped there.
fn still(cache: Sequence) -> Calming {
    let (name, spacing, mesh) = (cache.name, cache.spacing, cache.mesh.clone());
    Calming {
        name,
        spacing,
        mesh,
        moving: cache.frames - 1,
        particles: Box::new(move |frame| cache.at(frame)),
    }
}
