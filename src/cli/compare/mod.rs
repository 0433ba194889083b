//! `frazil compare`: a frame of two output folders side by side, and the numbers in which their reports differ.

mod reports;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::io::files::atomic;
use frazil::io::mesh::extension;
use frazil::render::Picture;
use serde_json::{Map, Value, json};

use super::output;
use super::preview::drawing::{Drawing, Look};
use super::preview::sources::Sources;
use super::preview::{CameraOptions, FOG_DENSITY};
use super::session::{Failure, OrFailure, Session};
use reports::{Difference, differences};

/// Draw a frame of two output folders side by side, seen from one camera, and print the numbers in which they differ.
///
/// A is drawn on the left, B on the right, each in the size of --size. The lines below name the numbers in the reports of that frame that
/// differ, as stage, key, value in A, value in B; - stands for none. Items of lists count from 1. Times are left out.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil compare cache/ seed2/cache/ -o both.png
  frazil compare cache/ seed2/cache/ --frame 24 -o both.png --size 640x360 --eye 1,1.5,2 --target 0,0,1")]
pub struct Args {
    /// Output folder of `frazil snow`, `surface` or `shallow`.
    a: PathBuf,
    /// The folder to compare A with.
    b: PathBuf,
    /// Frame [default: the last one that both folders have].
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    frame: Option<i32>,
    /// The picture (.png).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    camera: CameraOptions,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let look = args.look()?;
    if extension(&args.output) != "png" && !atomic::is_stream(&args.output) {
        return Err(Failure::of_file(&args.output, "a comparison is a .png file"));
    }
    #[cfg(feature = "vdb")]
    session.ctx.set_memory_limit(session.max_memory());
    let folders = [&args.a, &args.b];
    let mut sources = [open(&args.a)?, open(&args.b)?];
    let frame = args.frame_of(&sources)?;
    let at = Some(f64::from(frame));
    sources.iter().try_for_each(|folder| folder.refuse_missing(at)).or_refuse()?;
    output::check_writable(&args.output).or_refuse()?;
    let found = differences(folders.map(PathBuf::as_path), frame).or_refuse()?;
    let [a, b] = &mut sources;
    let drawings = [a, b].map(|folder| draw(&session.ctx, &look, folder, at));
    let [a, b] = drawings;
    let focus = sources.each_mut().map(|folder| look.wanted_focus(folder));
    let picture = join(&session.ctx, &look, [a.or_refuse()?, b.or_refuse()?], focus)?;
    picture.write(&args.output).or_fail()?;
    session.record("frame", frame.into());
    session.record("differences", in_json(&found));
    output::print(&args.in_words(frame, &found)).or_fail()
}

impl Args {
    fn look(&self) -> Result<Look, Failure> {
        Ok(Look {
            size: self.camera.size,
            camera: self.camera.camera()?,
            light: self.camera.light(),
            color: None,
            tint: None,
            cut: None,
            fog_density: FOG_DENSITY,
        })
    }

    /// The frame to draw.
    fn frame_of(&self, sources: &[Sources; 2]) -> Result<i32, Failure> {
        if let Some(frame) = self.frame {
            return Ok(frame);
        }
        let [a, b] = sources.each_ref().map(|folder| folder.frames().unwrap_or_default());
        let last = a.into_iter().rev().find(|frame| b.contains(frame));
        last.ok_or_else(|| {
            let [a, b] = [&self.a, &self.b].map(|folder| folder.display().to_string());
            Failure::refused(format!("{a} and {b} have no frame in common"))
        })
    }

    fn in_words(&self, frame: i32, found: &[Difference]) -> String {
        let [file, a, b] = [&self.output, &self.a, &self.b].map(|path| path.display());
        let mut out = format!("{file}: frame {frame} of {a} (left) and {b} (right)\n");
        for Difference { key, values } in found {
            let [a, b] =
                values.each_ref().map(|value| value.as_ref().map_or("-".into(), ToString::to_string));
            let _ = writeln!(out, "{key} {a} {b}");
        }
        if found.is_empty() {
            out += "the numbers in their reports are the same\n";
        }
        out
    }
}

/// Opens an output folder.
fn open(folder: &Path) -> Result<Sources, Failure> {
    if !folder.is_dir() {
        let what = if folder.exists() { "is a file, not the folder of a shot" } else { "does not exist" };
        return Err(Failure::of_file(folder, what));
    }
    Sources::open(&[folder.to_path_buf()], None, None).or_refuse()
}

/// Prepares a frame to be drawn.
fn draw(ctx: &Context, look: &Look, folder: &mut Sources, frame: Option<f64>) -> frazil::Result<Drawing> {
    look.build(ctx, folder.read(ctx, frame)?)
}

/// Draws two frames, with one camera that sees the focus of both, or all of both.
fn join(
    ctx: &Context,
    look: &Look,
    drawings: [Drawing; 2],
    focus: [Option<[DVec3; 2]>; 2],
) -> Result<Picture, Failure> {
    let [a, b] = focus;
    let both = a.zip(b).map(|([a, b], [c, d])| [a.inf(&c), b.sup(&d)]);
    let view = look.view(&drawings, both)?;
    let draw = |drawing| view.draw(ctx, drawing).or_fail();
    draw(&drawings[0])?.beside(&draw(&drawings[1])?).or_fail()
}

fn in_json(found: &[Difference]) -> Value {
    let pair = |Difference { key, values }: &Difference| (key.clone(), json!(values));
    Value::Object(found.iter().map(pair).collect::<Map<String, Value>>())
}
