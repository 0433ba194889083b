//! `frazil check`: reads every input of every frame before an overnight run; every file of a folder after it.

mod shallow;
#[cfg(feature = "vdb")]
mod snow;
#[cfg(feature = "vdb")]
mod surface;

use std::fmt::Write;
use std::path::PathBuf;

use frazil::geometry::DVec3;
use frazil::render::{Camera, Size};
use frazil::scene::run::verify::{Verified, verify};
use frazil::scene::{Override, Scene, System};
use serde::Serialize;
use serde_json::{Value, json};

use super::output;
use super::session::{Failure, OrFailure, Session};

/// Read every input of every frame of a scene, and print its sizes, memory and disk, without simulating anything.
///
/// For an output folder: read every file that a run wrote there, and name those that are damaged or missing.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  frazil check walker.toml -o cache/\n  frazil check cache/")]
pub struct Args {
    /// Scene file (TOML), or an output folder.
    scene: PathBuf,
    /// Output folder: also prints its free space, how many grains the base in it yields, and how far the mist in it spread.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Override a setting of the scene, for instance snow.noise.seed=2 or object.1.file=hero.glb.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Check the scene with cells N times as large, as for `frazil snow --preview N`.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=100))]
    preview: Option<u16>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// The size of picture that a camera is proposed for: the default of `frazil preview`.
const SIZE: Size = Size { width: 1280, height: 720 };

impl Args {
    /// Free bytes on the disk of the output.
    #[cfg(feature = "vdb")]
    fn free_space(&self) -> Option<u64> {
        let absolute = std::path::absolute(self.output.as_deref()?).ok()?;
        let existing = absolute.ancestors().find(|folder| folder.exists())?;
        super::session::machine::free_space(existing)
    }

    /// Unknown.
    #[cfg(not(feature = "vdb"))]
    fn free_space(&self) -> Option<u64> {
        None
    }
}

/// Refuses `--preview` for a scene that cannot be made coarser.
fn refuse_preview(args: &Args, table: &str) -> Result<(), Failure> {
    match args.preview {
        Some(_) => Err(Failure::of_file(&args.scene, format!("--preview is for snow, not for [{table}]"))),
        None => Ok(()),
    }
}

/// The frames of a shot, and their time.
fn frames_in_words([first, last]: [i32; 2], fps: f64) -> String {
    let count = i64::from(last) - i64::from(first) + 1;
    let seconds = count as f64 / fps;
    format!("frames    {first}-{last}: {count}, {seconds:.2} s at {fps} frames per second\n")
}

/// The free space, if it is known.
fn free_in_words(free: Option<u64>) -> String {
    free.map_or(String::new(), |free| format!(" of {} free", size(free)))
}

/// The memory that a run is expected to take, and the most that it may take, of `what` if that is not all of it (bytes).
fn memory_in_words([expected, bound]: [u64; 2], what: &str, limit: u64) -> String {
    format!("about {} expected,{what} at most {}, of {}", size(expected), size(bound), size(limit))
}

fn warnings_in_words(warnings: &[String]) -> String {
    warnings.iter().map(|warning| format!("warning   {warning}\n")).collect()
}

/// Warns if the files need more than the free space; `how` is the verb, such as "need about".
fn warn_of_space(warnings: &mut Vec<String>, how: &str, needed: Option<u64>, free: Option<u64>) {
    if let (Some(needed), Some(free)) = (needed, free)
        && needed > free
    {
        warnings.push(format!("the files {how} {}, but only {} are free", size(needed), size(free)));
    }
}

/// Prints a report, in words or as JSON.
fn print(args: &Args, report: &impl Serialize, in_words: impl FnOnce() -> String) -> Result<(), Failure> {
    let text = if args.json { in_json(to_json(report)) } else { in_words() };
    output::print(&text).or_fail()
}

/// Prints the forecast of a scene, as [`print`] does, with a camera that sees a box (m) around what the shot shows, if that is known, and
/// with warnings.
fn print_forecast(
    args: &Args,
    (report, warnings): (&impl Serialize, &[String]),
    seen: Option<(DVec3, DVec3)>,
    in_words: impl FnOnce() -> String,
) -> Result<(), Failure> {
    let camera = seen.map(|seen| Camera::framing(Camera::surroundings(seen), SIZE));
    let text = if args.json {
        let mut report = to_json(report);
        report["camera"] = camera.map_or(Value::Null, |Camera { eye, target, fov_deg }| {
            json!({ "eye_m": eye.as_slice(), "target_m": target.as_slice(), "fov_deg": fov_deg })
        });
        in_json(report)
    } else {
        let camera = camera.map_or(String::new(), |camera| camera_in_words(&camera));
        in_words() + &camera + &warnings_in_words(warnings)
    };
    output::print(&text).or_fail()
}

fn to_json(report: &impl Serialize) -> Value {
    serde_json::to_value(report).expect("plain values become JSON")
}

fn in_json(report: Value) -> String {
    format!("{report:#}\n")
}

/// The options of `frazil preview` for a camera.
fn camera_in_words(camera: &Camera) -> String {
    let point = |at: DVec3| {
        let [x, y, z] = [at.x, at.y, at.z].map(|x| format!("{x:.3}"));
        format!("{x},{y},{z}")
    };
    let (eye, target) = (point(camera.eye), point(camera.target));
    format!("camera    --eye={eye} --target={target} --fov {} sees all of the shot\n", camera.fov_deg)
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    if args.scene.is_dir() {
        return check_folder(args, session);
    }
    let scene = Scene::read_with(&args.scene, &args.set).or_refuse()?;
    if scene.system() == System::Shallow {
        return shallow::run(args, session, &scene);
    }
    #[cfg(feature = "vdb")]
    return snow::run(args, session, scene);
    #[cfg(not(feature = "vdb"))]
    super::needs_openvdb(&args.scene).or_refuse()
}

/// Compares an output folder with what was written into it.
fn check_folder(args: &Args, session: &Session) -> Result<(), Failure> {
    if args.output.is_some() || !args.set.is_empty() || args.preview.is_some() {
        return Err(Failure::refused("-o, --set and --preview cannot be used with an output folder"));
    }
    let verified = verify(&session.ctx, &args.scene).or_refuse()?;
    print(args, &verified, || verified_in_words(&verified))?;
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
        out.push_str("all of them are as they were written\n");
    }
    out
}

fn size(bytes: u64) -> String {
    let units = [(1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let bytes = bytes as f64;
    match units.iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes / unit),
        None => format!("{bytes} B"),
    }
}
