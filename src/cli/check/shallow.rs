//! Forecast of a scene with a liquid on a terrain: cells, heights, millilitres, memory, disk, and warnings.

use std::fmt::Write;

use frazil::geometry::DVec3;
use frazil::scene::Scene;
use frazil::scene::shallow::{Inputs, Report, check};

use super::{
    Args, frames_in_words, free_in_words, memory_in_words, print_forecast, refuse_preview, size,
    warn_of_space,
};
use crate::cli::session::{Failure, OrFailure, Session};

/// Checks the scene.
pub fn run(args: &Args, session: &Session, scene: &Scene) -> Result<(), Failure> {
    refuse_preview(args, "shallow")?;
    let limit = session.max_memory();
    // The check converts the terrain to columns, too.
    session.ctx.set_memory_limit(limit);
    let inputs = Inputs::load(&session.ctx, scene).or_refuse()?;
    let mut report = check(&session.ctx, scene, &inputs).or_refuse()?;
    if let Err(error) = report.check_memory(limit) {
        report.warnings.push(error.to_string());
    }
    let free = args.free_space();
    warn_of_space(&mut report.warnings, "may need", Some(report.disk_bytes), free);
    let ([x0, z0, x1, z1], [low, high]) = (report.area_m, report.heights_m);
    let seen = (DVec3::new(x0, low, z0), DVec3::new(x1, high, z1));
    print_forecast(args, (&report, &report.warnings), Some(seen), || in_words(&report, limit, free))
}

fn in_words(report: &Report, limit: u64, free: Option<u64>) -> String {
    let mut out = frames_in_words(report.frames, report.fps);
    let [width, height, depth] = report.size_m;
    let of = report.triangles.map_or(String::new(), |count| format!(", {count} triangles"));
    let many = if report.files > 1 { format!(" and {} more", report.files - 1) } else { String::new() };
    let _ = writeln!(out, "terrain   {}{many}{of}", report.terrain);
    let _ = writeln!(out, "          {width:.4} x {height:.4} x {depth:.4} m (x, y, z)");
    let ([across, along], [x0, z0, x1, z1]) = (report.cells, report.area_m);
    let _ = writeln!(
        out,
        "cells     {across} x {along} of {} m, {:.4} x {:.4} m",
        report.cell_m,
        x1 - x0,
        z1 - z0
    );
    let void = match report.void_cells {
        0 => String::new(),
        count => format!(", {count} cells without ground"),
    };
    let _ = writeln!(out, "columns   {} in up to {} layers{void}", report.columns, report.layers);
    let [low, high] = report.heights_m;
    let _ = writeln!(out, "heights   {low:.4} to {high:.4} m, in units of {:.2e} m", report.unit_m);
    let _ = writeln!(
        out,
        "liquid    {:.4} ml at the first frame, up to {:.6} m deep; {:.4} ml come later; viscosity {:e} m2/s",
        report.begins_with_ml, report.deepest_m, report.comes_ml, report.viscosity_m2_per_s
    );
    if report.falls {
        let _ = writeln!(out, "falls     freely over edges");
    }
    if !report.scalars.is_empty() {
        let _ = writeln!(out, "carries   {}", report.scalars.join(", "));
    }
    let _ = writeln!(
        out,
        "memory    {}",
        memory_in_words([report.memory_forecast_bytes, report.memory_bytes], "", limit)
    );
    let free = free_in_words(free);
    let each = size(report.frame_bytes);
    let _ = writeln!(out, "disk      at most {}{free}; {each} a frame", size(report.disk_bytes));
    out
}
