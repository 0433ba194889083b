//! `frazil snow`: objects press into a layer of snow, frame by frame.

use std::path::PathBuf;

use frazil::scene::{FrameChoice, Inputs, Scene, check_memory, shot};

use super::exit::{Failure, Phase};
use super::output;
use super::progress::FrameProgress;
use super::session::Session;

/// Press moving objects into a layer of snow.
///
/// Writes base/base.%04d.vdb (surface, compression, touched), removed/removed.%04d.vdb, report/%04d.json
/// and scene.toml, the scene with every default filled in.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil snow walker.toml -o cache/ --frames 1-24")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Folder for the output; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Parts to make.
    #[arg(long, value_enum, default_value = "base")]
    stage: Stage,
    /// Write these frames only; the frames before them are still computed.
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Stage {
    /// The base layer.
    Base,
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let Stage::Base = args.stage;
    let scene = Scene::read(&args.scene).before()?;
    let shot_frames = scene.shot.frames;
    let frames = args.frames.unwrap_or_else(|| shot_frames.into());
    if frames.first() < shot_frames.first || frames.last() > shot_frames.last {
        return Err(Failure::refused(format!(
            "--frames {}-{} is not within the shot's {shot_frames}",
            frames.first(),
            frames.last()
        )));
    }
    let inputs = Inputs::load(&scene).before()?;
    check_memory(&scene, &inputs, session.max_memory()).before()?;
    shot::prepare(&scene, &args.output).before()?;
    output::check_folder(&args.output).before()?;
    let mut progress = FrameProgress::new(frames.count(), session.is_quiet());
    progress.begin(frames.first());
    let mut removed = 0.0;
    shot::run(&session.ctx, &scene, &inputs, &args.output, &frames, |frame, report| {
        removed += report.removed_volume;
        progress.finished(frame);
        if frame < frames.last() {
            progress.begin(frame + 1);
        }
    })
    .during()?;
    session.record("frames", frames.count().into());
    session.record("removed_m3", removed.into());
    Ok(())
}
