//! Forecast of a scene with a mesh that follows a liquid: counts, sizes, disk, and warnings.

use std::fmt::Write;

use frazil::geometry::DVec3;
use frazil::scene::Scene;
use frazil::scene::surface::{Inputs, Report, check};

use super::{
    Args, frames_in_words, free_in_words, memory_in_words, print_forecast, refuse_preview, size,
    warn_of_space,
};
use crate::cli::session::{Failure, OrFailure, Session};

/// Checks the scene.
pub fn run(args: &Args, session: &Session, scene: &Scene) -> Result<(), Failure> {
    refuse_preview(args, "surface")?;
    // A mesh may have to be repaired.
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = Inputs::load(&session.ctx, scene).or_refuse()?;
    session.ctx.set_memory_limit(u64::MAX);
    let mut report = check(&session.ctx, scene, &inputs).or_refuse()?;
    let limit = session.max_memory();
    if let Err(error) = report.check_memory(limit) {
        // This is only a warning, as a run does not know the particles of later frames either.
        let what =
            format!("{error}; a run starts nevertheless, and ends when one part of its work needs more");
        report.warnings.push(what);
    }
    let free = args.free_space();
    warn_of_space(&mut report.warnings, "need about", Some(report.disk_bytes), free);
    let [low, high] = report.particles_bounds_m.map(DVec3::from);
    print_forecast(args, (&report, &report.warnings), Some((low, high)), || in_words(&report, limit, free))
}

fn in_words(report: &Report, limit: u64, free: Option<u64>) -> String {
    let mut out = frames_in_words(report.frames, report.fps);
    let [min, max] = report.particles;
    let counts = if min == max { min.to_string() } else { format!("{min} to {max}") };
    let motion = match (report.has_ids, report.has_velocities) {
        (true, true) => "ids and velocities",
        (true, false) => "ids, no velocities",
        (false, true) => "no ids, velocities",
        (false, false) => "neither ids nor velocities",
    };
    let _ = writeln!(
        out,
        "liquid    {} files of {counts} particles, {:.6} m apart; {motion}",
        report.files, report.spacing_m
    );
    let [low, high] = report.particles_bounds_m.map(|p| format!("({:.2}, {:.2}, {:.2})", p[0], p[1], p[2]));
    let _ = writeln!(out, "          from {low} to {high} over the shot");
    let [width, height, depth] = report.size_m;
    let _ = writeln!(
        out,
        "mesh      {} vertices, {} triangles, edges of {:.5} m",
        report.vertices, report.triangles, report.edge_m
    );
    let _ = writeln!(out, "          {width:.3} x {height:.3} x {depth:.3} m (x, y, z) at the first frame");
    let free = free_in_words(free);
    let _ = writeln!(
        out,
        "memory    {}",
        memory_in_words([report.memory_forecast_bytes, report.memory_bytes], "", limit)
    );
    let each = size(report.frame_bytes);
    let _ = writeln!(out, "disk      about {}{free}; {each} a frame", size(report.disk_bytes));
    out
}
