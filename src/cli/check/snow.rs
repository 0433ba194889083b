//! Forecast of a scene: sizes, speeds, memory, disk, and warnings.

use std::fmt::Write;

use frazil::geometry::DVec3;
use frazil::scene::snow::MistForecast;
use frazil::scene::snow::check::{ObjectReport, Report, check};
use frazil::scene::{Inputs, Scene, System, check_memory};

use super::{
    Args, frames_in_words, free_in_words, memory_in_words, print_forecast, size, surface, warn_of_space,
};
use crate::cli::session::{Failure, OrFailure, Session};

/// Checks the scene.
pub fn run(args: &Args, session: &Session, mut scene: Scene) -> Result<(), Failure> {
    if scene.system() == System::Surface {
        return surface::run(args, session, &scene);
    }
    if let Some(factor) = args.preview {
        scene.coarsen(factor.into()).or_refuse()?;
    }
    let inputs = Inputs::load(&scene).or_refuse()?;
    let mut report = check(&session.ctx, &scene, &inputs, args.output.as_deref()).or_refuse()?;
    let limit = session.max_memory();
    let close = report.grains.as_ref().and_then(|grains| grains.warning(&scene));
    let too_many = report.grains.as_ref().and_then(|grains| grains.check(&scene, limit).err());
    report.warnings.extend(close);
    report.warnings.extend(too_many.map(|error| error.to_string()));
    if let Err(error) = check_memory(&scene, &inputs, limit) {
        report.warnings.push(error.to_string());
    }
    let too_much = report.mist.as_ref().and_then(|mist| mist.check(limit).err());
    report.warnings.extend(too_much.map(|error| error.to_string()));
    let free = args.free_space();
    let mist_bytes = report.mist.as_ref().map_or(0, |mist| mist.disk_bytes);
    let needed = report.disk_bytes.map(|bytes| bytes.saturating_add(mist_bytes));
    warn_of_space(&mut report.warnings, "need about", needed, free);
    print_forecast(args, (&report, &report.warnings), seen(&report), || in_words(&report, limit, free))
}

/// The corners of a box around the objects over the shot, as far as they are above the snow or in it (m).
fn seen(report: &Report) -> Option<(DVec3, DVec3)> {
    let corners = report.objects.iter().map(|object| object.bounds_m.map(DVec3::from));
    let [low, high] = corners.reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])])?;
    let [x0, z0, x1, z1] = report.area_m.unwrap_or([low.x, low.z, high.x, high.z]);
    let low = DVec3::new(low.x.max(x0), low.y, low.z.max(z0));
    let high = DVec3::new(high.x.min(x1), high.y, high.z.min(z1));
    (low.x < high.x && low.z < high.z).then_some((low, high))
}

fn in_words(report: &Report, limit: u64, free: Option<u64>) -> String {
    let mut out = frames_in_words(report.frames, report.fps);
    let area = report.area_m.map_or(String::new(), |[x0, z0, x1, z1]| {
        let columns = [(x1 - x0) / report.cell_m, (z1 - z0) / report.cell_m].map(|cells| cells.round());
        format!("{:.2} x {:.2} m, {} x {} columns, ", x1 - x0, z1 - z0, columns[0], columns[1])
    });
    let _ = writeln!(out, "snow      {area}cells of {} m", report.cell_m);
    report.objects.iter().for_each(|object| describe_object(&mut out, report, object));
    describe_grains(&mut out, report);
    if let Some(mist) = &report.mist {
        describe_mist(&mut out, mist, limit);
    }
    let has_mist = report.mist.is_some();
    let [memory_of, disk_of] = if has_mist { [" without mist", ", without mist"] } else { [""; 2] };
    let memory = [report.memory_forecast_bytes, report.memory_bytes];
    let _ = writeln!(out, "memory    {}", memory_in_words(memory, memory_of, limit));
    if let Some(disk) = report.disk_bytes {
        let _ = writeln!(out, "disk      about {}{}{}", size(disk), free_in_words(free), disk_of);
    }
    out
}

fn describe_grains(out: &mut String, report: &Report) {
    let Some(grains) = &report.grains else {
        if report.settings.contains_key("grains.radius") {
            out.push_str(
                "grains    how many is known when the base exists: make it, then check with -o DIR\n",
            );
        }
        return;
    };
    let (removed, share) = (grains.removed_m3, grains.compression);
    let last = report.frames[1];
    let by = match grains.base_to_frame {
        None => ", by the poses of objects".to_string(),
        Some(frame) if frame == last => String::new(),
        Some(frame) if frame == grains.to_frame => {
            format!(" up to frame {frame} of {last}, as far as the base exists")
        }
        Some(frame) => format!(", by the poses of objects after frame {frame}, the base's last"),
    };
    let _ = writeln!(out, "grains    {}{by}", grains.count());
    let _ = writeln!(out, "          from {removed:.6} m3 of snow, compression {share}");
}

fn describe_mist(out: &mut String, mist: &MistForecast, limit: u64) {
    let size_of_million = |bytes: u64| size(1_000_000 * bytes);
    let (memory, disk) =
        (size_of_million(mist.memory_bytes_per_cell), size_of_million(mist.disk_bytes_per_cell));
    let _ = writeln!(
        out,
        "mist      cells of {:.6} m; a million take {memory} of memory, and {disk} in a frame's files",
        mist.cell_m
    );
    let from = match mist.made_to_frame {
        Some(frame) if mist.cells == 0 => format!("none was raised up to frame {frame}"),
        Some(frame) => format!("as made up to frame {frame}"),
        None => {
            out.push_str(
                "          how far it spreads is known when it is made: make some frames, or a --preview, then check with -o DIR\n",
            );
            "in the boxes that objects pass while it lasts".to_string()
        }
    };
    let (cells, air) = (mist.cells, mist.air_m3);
    let _ = writeln!(
        out,
        "          {from}: {cells} cells at once, {air:.3} m3; memory about {}, disk at most {}",
        size(mist.memory_bytes),
        size(mist.disk_bytes)
    );
    if limit < u64::MAX {
        let max_cells = mist.max_cells(limit);
        let air = max_cells as f64 * mist.cell_m.powi(3);
        let _ = writeln!(
            out,
            "          --max-memory refuses a step of more than {max_cells} cells, {air:.3} m3"
        );
    }
}

fn describe_object(out: &mut String, report: &Report, object: &ObjectReport) {
    let [width, height, depth] = object.size_m;
    let loops = match (object.holes, object.closed_loops) {
        (0, 0) => String::new(),
        (0, count) => format!(", {count} open loops closed"),
        (1, _) => ", 1 hole closed".to_string(),
        (count, _) => format!(", {count} holes closed"),
    };
    let _ = writeln!(out, "object    {}: {} triangles{loops}", object.file, object.triangles);
    let _ = writeln!(out, "          {width:.3} x {height:.3} x {depth:.3} m (x, y, z) at the first frame");
    let [low, high] = object.bounds_m.map(|p| format!("({:.2}, {:.2}, {:.2})", p[0], p[1], p[2]));
    let cells = object.fastest_m_per_s / report.fps / report.cell_m;
    let _ = writeln!(
        out,
        "          from {low} to {high} over the shot; at most {:.2} m/s, {cells:.1} cells, at frame {}",
        object.fastest_m_per_s, object.fastest_frame
    );
    if let Some(deep) = &object.deepest {
        let part = |metres: f64, one: &str, other: &str| {
            format!("{:.3} m {}", metres.abs(), if metres < 0.0 { other } else { one })
        };
        let _ = writeln!(
            out,
            "          lowest at frame {}: {}, {}",
            deep.frame,
            part(deep.below_top_m, "deep in the snow", "above the snow"),
            part(deep.above_ground_m, "above the ground", "below the ground")
        );
    }
    if let Some(walk) = &object.walk {
        let speed = walk.stride_m / walk.round_s;
        let _ = writeln!(
            out,
            "          walks at {speed:.2} m/s, {:.2} m in each cycle of {:.2} s; its feet slip at {:.2} m/s",
            walk.stride_m, walk.round_s, walk.slips_m_per_s
        );
    }
    if let Some([first, last]) = object.touches {
        let _ = writeln!(out, "          in reach of the snow in frames {first}-{last}");
    }
}
