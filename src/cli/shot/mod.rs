//! Shared by the commands that make shots.

pub(in crate::cli) mod progress;
pub(in crate::cli) mod shallow;
#[cfg(feature = "vdb")]
pub(in crate::cli) mod snow;
#[cfg(feature = "vdb")]
pub(in crate::cli) mod surface;

use std::path::PathBuf;
use std::sync::Mutex;

use frazil::scene::run::{Pipeline, Report, Run};
use frazil::scene::{FrameChoice, Override, Scene};

use super::output;
use super::session::{Failure, OrFailure, Session};
use progress::FrameProgress;

/// The output of a shot, and the part of it to make.
#[derive(clap::Args)]
pub struct ShotArgs {
    /// Folder for the output; created if it does not exist.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Write only these frames; earlier frames are computed if no file has them.
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    pub frames: Option<FrameChoice>,
    /// Keep the frames before N, whatever settings they were made with, and make those from N on again, in the stages that run.
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub from: Option<i32>,
    /// Override a setting of the scene, for instance snow.noise.seed=2 or object.1.file=hero.glb.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<Override>,
}

impl ShotArgs {
    /// The requested frames.
    pub fn frames(&self, scene: &Scene) -> Result<FrameChoice, Failure> {
        let shot_frames = scene.shot().frames;
        let frames = self.frames.clone().unwrap_or_else(|| shot_frames.into());
        if frames.first() < shot_frames.first || frames.last() > shot_frames.last {
            return Err(Failure::refused(format!(
                "--frames {}-{} is not within the shot's {shot_frames}",
                frames.first(),
                frames.last()
            )));
        }
        if let Some(from) = self.from.filter(|from| !shot_frames.contains(*from)) {
            return Err(Failure::refused(format!("--from {from} is not within the shot's {shot_frames}")));
        }
        Ok(frames)
    }

    /// Makes the frames of a pipeline; `on_report` is called with the report of each, by one thread at a time.
    pub fn make(
        &self,
        session: &Session,
        pipeline: &Pipeline<'_>,
        stages: &[String],
        frames: &FrameChoice,
        on_report: impl FnMut(&Report) + Send,
    ) -> Result<(), Failure> {
        let run =
            Run::prepare(&session.ctx, pipeline, &self.output, stages, frames, self.from).or_refuse()?;
        output::check_folder(&self.output).or_refuse()?;
        let (to_make, existing) = (run.to_make(), run.existing());
        let display =
            Mutex::new((FrameProgress::new(&session.ctx, to_make, existing, session.is_quiet()), on_report));
        run.make(&session.ctx, |stage, frame, report| {
            let mut display = display.lock().expect("no panic holds this lock");
            (display.1)(report);
            display.0.finished(stage, frame);
        })
        .or_fail()?;
        session.record("frames", to_make.into());
        session.record("frames_there", existing.into());
        Ok(())
    }
}
