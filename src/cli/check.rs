//! `frazil check`: every input of every frame, before a night on the farm.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use frazil::scene::shot::verify::{Verified, verify};
use frazil::scene::snow::check::{ObjectReport, Report, check};
use frazil::scene::{Inputs, Override, Scene, check_memory};

use super::exit::{Failure, Phase};
use super::session::Session;
use super::{machine, output};

/// Read every input of every frame of a scene, and print its sizes, memory and disk; nothing is computed.
///
/// Of an output folder: read every file that a run wrote there, and name those that are not what was written.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  frazil check walker.toml -o cache/\n  frazil check cache/")]
pub struct Args {
    /// Scene file (TOML), or an output folder.
    scene: PathBuf,
    /// Where the output is to go: its free space is printed too.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Put a setting over the scene's, for instance snow.noise.seed=2 or object.1.file=hero.glb.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    if args.scene.is_dir() {
        return check_folder(args, session);
    }
    let scene = Scene::read_with(&args.scene, &args.set).before()?;
    let inputs = Inputs::load(&scene).before()?;
    let mut report = check(&session.ctx, &scene, &inputs).before()?;
    let limit = session.max_memory();
    if let Err(error) = check_memory(&scene, &inputs, limit) {
        report.warnings.push(error.to_string());
    }
    let free = args.output.as_deref().and_then(free_space);
    if let (Some(free), Some(needed)) = (free, report.disk_bytes.filter(|needed| Some(*needed) > free)) {
        let (needed, free) = (size(needed), size(free));
        report.warnings.push(format!("the files need about {needed}, but only {free} are free"));
    }
    let text = if args.json {
        format!("{:#}\n", serde_json::to_value(&report).expect("plain values become JSON"))
    } else {
        in_words(&report, limit, free)
    };
    output::print(&text).during()
}

/// Compares an output folder with what was written into it.
fn check_folder(args: &Args, session: &Session) -> Result<(), Failure> {
    if args.output.is_some() || !args.set.is_empty() {
        return Err(Failure::refused("-o and --set are of no use with an output folder"));
    }
    let verified = verify(&session.ctx, &args.scene).before()?;
    let text = if args.json {
        format!("{:#}\n", serde_json::to_value(&verified).expect("plain values become JSON"))
    } else {
        verified_in_words(&verified)
    };
    output::print(&text).during()?;
    session.record("frames", verified.frames.into());
    match &verified.damaged[..] {
        [] => Ok(()),
        [first, rest @ ..] => {
            let more = if rest.is_empty() { String::new() } else { format!(", and {} more", rest.len()) };
            let path = args.scene.join(&first.file);
            Err(Failure::failed(format!("{}: {}{more}", path.display(), first.what)))
        }
    }
}

fn verified_in_words(verified: &Verified) -> String {
    let mut out = format!("{} frames, {} files, {}\n", verified.frames, verified.files, size(verified.bytes));
    verified.damaged.iter().for_each(|damage| {
        let _ = writeln!(out, "damaged   {}: {}", damage.file, damage.what);
    });
    verified.unknown.iter().for_each(|file| {
        let _ = writeln!(out, "unknown   {file}: no record names it");
    });
    if verified.damaged.is_empty() {
        out.push_str("all of them are what was written\n");
    }
    out
}

/// Free bytes where a folder is, or is to be.
fn free_space(folder: &Path) -> Option<u64> {
    let absolute = std::path::absolute(folder).ok()?;
    let there = absolute.ancestors().find(|folder| folder.exists())?;
    machine::free_space(there)
}

fn size(bytes: u64) -> String {
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let bytes = bytes as f64;
    match units.iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes / unit),
        None => format!("{bytes} B"),
    }
}

fn in_words(report: &Report, limit: u64, free: Option<u64>) -> String {
    let mut out = String::new();
    let [first, last] = report.frames;
    let count = i64::from(last) - i64::from(first) + 1;
    let seconds = count as f64 / report.fps;
    let _ = writeln!(out, "frames    {first}-{last}: {count}, {seconds:.2} s at {} a second", report.fps);
    let area = report.area_m.map_or(String::new(), |[x0, z0, x1, z1]| {
        let columns = [(x1 - x0) / report.cell_m, (z1 - z0) / report.cell_m].map(|cells| cells.round());
        format!("{:.2} x {:.2} m, {} x {} columns, ", x1 - x0, z1 - z0, columns[0], columns[1])
    });
    let _ = writeln!(out, "snow      {area}cells of {} m", report.cell_m);
    report.objects.iter().for_each(|object| describe_object(&mut out, report, object));
    let _ = writeln!(out, "memory    about {} of {}", size(report.memory_bytes), size(limit));
    if let Some(disk) = report.disk_bytes {
        let free = free.map_or(String::new(), |free| format!(" of {} free", size(free)));
        let _ = writeln!(out, "disk      about {}{free}", size(disk));
    }
    report.warnings.iter().for_each(|warning| {
        let _ = writeln!(out, "warning   {warning}");
    });
    out
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
            "          walks at {speed:.2} m/s, {:.2} m a round of {:.2} s; its feet slip at {:.2} m/s",
            walk.stride_m, walk.round_s, walk.slips_m_per_s
        );
    }
    if let Some([first, last]) = object.touches {
        let _ = writeln!(out, "          in reach of the snow in frames {first}-{last}");
    }
}
