//! Gate of sets that merge, split, tear and close: how many frames after the particles' own surface changes a vertex is flagged.

use frazil::Context;
use frazil::base::{DVec3, TriMesh};
use frazil::surface::{Implicit, Isosurface, Params, Tracker};

use crate::common::liquids::{context, filled, numbered};
use crate::harness::Harness;
use crate::spot::parts;

/// Initial distance between particles (m), and time between frames (s).
const SPACING: f64 = 0.01;
const FRAME: f64 = 1.0 / 24.0;
/// Most frames of a set.
const FRAMES: usize = 60;

/// A set: its name, its particles, and where a place of the first frame is in another (both in spacings).
struct Set {
    name: &'static str,
    places: Vec<DVec3>,
    motion: fn(DVec3, f64) -> DVec3,
}

fn sets() -> [Set; 4] {
    let within = |size: f64, is_inside: &dyn Fn(DVec3) -> bool| filled(1.0, 0.1, size, is_inside);
    let ball = |at: f64| move |p: DVec3| (p - DVec3::new(at, 0.0, 0.0)).norm() < 5.0;
    [
        Set {
            name: "two balls meet",
            places: within(13.0, &|p| ball(-7.0)(p) || ball(7.0)(p)),
            motion: |p, t| p - DVec3::new(0.15 * t * p.x.signum(), 0.0, 0.0),
        },
        Set {
            name: "a dumbbell pinches",
            places: within(14.0, &|p| {
                ball(-8.0)(p) || ball(8.0)(p) || p.x.abs() < 8.0 && p.yz().norm() < 2.5
            }),
            // Drawn out between the balls, which keep their shape.
            motion: |p, t| {
                let long = libm::exp(0.04 * t);
                let (inner, thin) = (p.x.clamp(-5.0, 5.0), 1.0 / long.sqrt());
                let share = (1.0 - (p.x.abs() - 3.0) / 3.0).clamp(0.0, 1.0);
                let width = 1.0 + (thin - 1.0) * share;
                DVec3::new(p.x + inner * (long - 1.0), p.y * width, p.z * width)
            },
        },
        Set {
            name: "a sheet tears",
            places: within(14.0, &|p| p.y.abs() < 1.6),
            motion: |p, t| {
                let wide = libm::exp(0.03 * t);
                DVec3::new(p.x * wide, p.y / (wide * wide), p.z * wide)
            },
        },
        Set {
            name: "a bubble closes",
            places: within(12.0, &|p| (5.5..12.0).contains(&p.norm())),
            motion: |p, t| {
                let cube = p.norm().powi(3);
                p * ((cube - (4.0 * t).min(cube)) / cube).max(0.0).cbrt()
            },
        },
    ]
}

pub fn run(h: &mut Harness) {
    let name = "surface.early";
    if !h.wants(name) {
        return;
    }
    let ctx = context(2);
    let mut lags = Vec::new();
    for set in sets() {
        let (change, flag) = frames(&ctx, &set);
        println!(
            "# {}: the particles' surface changes at frame {change:?}, the first flag is at {flag:?}",
            set.name
        );
        lags.push(match (change, flag) {
            (Some(change), Some(flag)) => flag.saturating_sub(change) as f64,
            (None, _) => 0.0,
            (Some(_), None) => FRAMES as f64,
        });
    }
    let worst = lags.iter().copied().fold(0.0, f64::max);
    h.gate(name, worst, &format!("balls, dumbbell, sheet, bubble: {lags:?}"));
}

fn surface(ctx: &Context, places: &[DVec3]) -> TriMesh {
    let phi = Implicit::new(ctx, places, SPACING, 0.5 * SPACING).expect("a surface");
    Isosurface::new(&phi).mesh(&phi)
}

/// The first frame at which the particles' own surface has other parts or handles, and the first with a flag.
fn frames(ctx: &Context, set: &Set) -> (Option<usize>, Option<usize>) {
    let at = |frame: usize| {
        numbered(set.places.iter().map(|place| (set.motion)(*place, frame as f64) * SPACING).collect())
    };
    let kind = |surface: &TriMesh| (parts(surface), surface.euler_characteristic());
    let first = surface(ctx, &at(0).places);
    let begin = kind(&first);
    let mut tracker = Tracker::new(ctx, Params::for_spacing(SPACING), &first, &at(0)).expect("a tracker");
    let (mut change, mut flag) = (None, None);
    for frame in 1..FRAMES {
        let (from, to) = (at(frame - 1), at(frame));
        if change.is_none() && kind(&surface(ctx, &to.places)) != begin {
            change = Some(frame);
        }
        let report = tracker.step(ctx, &from, &to, FRAME).expect("a step");
        if flag.is_none() && report.jumped + report.lost > 0 {
            flag = Some(frame);
        }
        if change.is_some() && flag.is_some() {
            break;
        }
    }
    (change, flag)
}
