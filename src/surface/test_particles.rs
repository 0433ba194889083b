//! Helpers shared by unit tests: balls of particles one spacing apart, which is 1 m, and their surface.

use super::{Implicit, Isosurface, Params, Particles, Tracker};
use crate::context::{Context, Pool};
use crate::geometry::{DVec3, TriMesh};

/// A context of this many threads; 0: everything runs on the caller's thread.
pub fn context(threads: usize) -> Context {
    Context::new(Pool::new(threads).unwrap())
}

/// Positions of a lattice between two distances (m) from its centre; with `from` = 0 they are a ball.
pub fn shell(centre: DVec3, from: f64, to: f64) -> Vec<DVec3> {
    let reach = to.ceil() as i32;
    let on = || (-reach..=reach).map(f64::from);
    let all = on().flat_map(|x| on().flat_map(move |y| on().map(move |z| DVec3::new(x, y, z))));
    all.filter(|position| (from..=to).contains(&position.norm())).map(|position| position + centre).collect()
}

/// Particles at these positions, with ids from 0 on, without velocities.
pub fn numbered(positions: Vec<DVec3>) -> Particles {
    Particles { ids: (0..positions.len() as i64).collect(), velocities: Vec::new(), positions }
}

/// Two balls, whose centres lie at `centre` and at `-centre` (m).
pub fn two_balls(radius: f64, centre: DVec3) -> Particles {
    numbered([shell(centre, 0.0, radius), shell(-centre, 0.0, radius)].concat())
}

/// The surface of the particles themselves, in cells of half a spacing.
pub fn own_surface(ctx: &Context, positions: &[DVec3]) -> TriMesh {
    let phi = Implicit::new(ctx, positions, 1.0, 0.5).unwrap();
    Isosurface::new(&phi).mesh(&phi)
}

/// A tracker of the particles' own surface, which is rebuilt where it no longer fits.
pub fn rebuilt(ctx: &Context, particles: &Particles) -> Tracker {
    let params = Params { rebuild: true, ..Params::for_spacing(1.0) };
    Tracker::new(ctx, params, &own_surface(ctx, &particles.positions), particles).unwrap()
}
