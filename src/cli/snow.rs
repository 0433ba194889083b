//! `frazil snow`: objects press into a layer of snow, frame by frame.

use std::path::PathBuf;
use std::sync::Mutex;

use frazil::scene::shot::Run;
use frazil::scene::{FrameChoice, Inputs, Override, Scene, check_memory, snow};

use super::exit::{Failure, Phase};
use super::output;
use super::progress::FrameProgress;
use super::session::Session;

/// Press moving objects into a layer of snow.
///
/// Writes base/base.%04d.vdb (surface, compression, touched), removed/removed.%04d.vdb, grains/ and objects/ where the scene asks for
/// it, report/base.%04d.json, shot.usda and scene.toml, the scene with every default filled in. Frames that are there
/// and match are not made again; a folder with frames of other settings is refused.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil snow walker.toml -o cache/
  frazil snow walker.toml -o cache/ --from 40 --set snow.noise.seed=2
  frazil snow walker.toml -o look/ --preview 3 --frames 1-24")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Folder for the output; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Make these stages of the scene only (base, grains, objects); all without it.
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    stage: Vec<String>,
    /// Write these frames only; frames before them are computed when no file has them.
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Keep the frames before N, whatever they were made with, and make all others of these stages again.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    from: Option<i32>,
    /// Put a setting over the scene's, for instance snow.noise.seed=2 or object.1.file=hero.glb.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Make the cells N times as large: a quick look, into a folder of its own.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=100))]
    preview: Option<u16>,
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let mut scene = Scene::read_with(&args.scene, &args.set).before()?;
    if let Some(factor) = args.preview {
        scene.coarsen(factor.into()).before()?;
    }
    let shot_frames = scene.shot().frames;
    let frames = args.frames.unwrap_or_else(|| shot_frames.into());
    if frames.first() < shot_frames.first || frames.last() > shot_frames.last {
        return Err(Failure::refused(format!(
            "--frames {}-{} is not within the shot's {shot_frames}",
            frames.first(),
            frames.last()
        )));
    }
    if let Some(from) = args.from.filter(|from| !shot_frames.contains(*from)) {
        return Err(Failure::refused(format!("--from {from} is not within the shot's {shot_frames}")));
    }
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = Inputs::load(&scene).before()?;
    check_memory(&scene, &inputs, session.max_memory()).before()?;
    let plan = snow::plan(&scene, &inputs);
    let run = Run::prepare(&session.ctx, &plan, &args.output, &args.stage, &frames, args.from).before()?;
    output::check_folder(&args.output).before()?;
    let (made, there) = (run.to_make(), run.there());
    let progress = Mutex::new(FrameProgress::new(&session.ctx, made, there, session.is_quiet()));
    let removed = Mutex::new(0.0);
    run.make(&session.ctx, |stage, frame, report| {
        let of_frame = report.results.get("removed_m3").and_then(|value| value.as_f64());
        *removed.lock().expect("nobody panics with this lock") += of_frame.unwrap_or(0.0);
        progress.lock().expect("nobody panics with this lock").finished(stage, frame);
    })
    .during()?;
    session.record("frames", made.into());
    session.record("frames_there", there.into());
    session.record("removed_m3", removed.into_inner().expect("nobody panics with this lock").into());
    Ok(())
}
