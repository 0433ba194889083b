//! A detailed mesh follows the particles of a liquid: `cargo run --release --example follow_liquid DIR`.
//!
//! Two balls of particles meet and become one. The mesh begins as the surface of the particles of the first frame, and keeps its vertices
//! except where the liquid merges; DIR/liquid.NNNN.ply are the frames. A mesh of your own that fits the first frame's particles carries its
//! detail along.

use std::path::Path;

use frazil::geometry::DVec3;
use frazil::io::mesh;
use frazil::surface::{Implicit, Isosurface, Params, Particles, Tracker};
use frazil::{Context, Error, Pool, Result};

/// Initial distance between particles (m); a ball's radius (spacings); how far it moves in a frame (spacings).
const SPACING: f64 = 0.01;
const RADIUS: i32 = 5;
const SPEED: f64 = 0.25;
const FRAMES: i32 = 24;
const DT: f64 = 1.0 / 24.0;

/// The particles at a frame: replace this by reading a cache (`frazil::io::particles::read`).
fn particles(frame: i32) -> Particles {
    let mut all = Particles::default();
    for side in [-1.0, 1.0] {
        // They stop when they overlap by half.
        let apart = (7.0 - SPEED * f64::from(frame)).max(0.5 * f64::from(RADIUS));
        for index in 0..(2 * RADIUS + 1).pow(3) {
            let edge = 2 * RADIUS + 1;
            let at =
                [index % edge, index / edge % edge, index / (edge * edge)].map(|n| f64::from(n - RADIUS));
            let at = DVec3::from(at);
            if at.norm() <= f64::from(RADIUS) {
                all.positions.push(SPACING * (at + DVec3::new(side * apart, 0.0, 0.0)));
            }
        }
    }
    all.ids = (0..all.positions.len() as i64).collect();
    all
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/follow_liquid".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    let ctx = Context::new(Pool::all_cores()?);

    let mut from = particles(0);
    let phi = Implicit::new(&ctx, &from.positions, SPACING, 0.5 * SPACING)?;
    let first = Isosurface::new(&phi).mesh(&phi);
    let params = Params { rebuild: true, ..Params::for_spacing(SPACING) };
    let mut tracker = Tracker::new(&ctx, params, &first, &from)?;
    for frame in 1..=FRAMES {
        let to = particles(frame);
        let report = tracker.step(&ctx, &from, &to, DT)?;
        println!(
            "frame {frame}: {} triangles, changed: {}",
            tracker.triangles().len(),
            report.change.is_some()
        );
        mesh::write(&folder.join(format!("liquid.{frame:04}.ply")), &tracker.mesh())?;
        from = to;
    }
    Ok(())
}
