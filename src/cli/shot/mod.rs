//! Shared by the commands that make shots.

pub(in crate::cli) mod progress;
pub(in crate::cli) mod remaining;
pub(in crate::cli) mod shallow;
#[cfg(feature = "vdb")]
pub(in crate::cli) mod snow;
#[cfg(feature = "vdb")]
pub(in crate::cli) mod surface;

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use frazil::Error;
use frazil::scene::run::{FrameCosts, Pipeline, Report, Run, ToMake};
use frazil::scene::{FrameChoice, Override, Scene};

use super::output;
use super::session::{Failure, OrFailure, Session};
use progress::{FrameProgress, ProgressFormat};
use remaining::Remaining;

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
    /// Only prepare the folder: write the scene, and record which frames will be made.
    #[arg(long, conflicts_with_all = ["chunk", "finish"])]
    pub prepare: bool,
    /// Make --frames of one --stage as one of many processes at once, in a folder that --prepare has prepared; for stages whose frames
    /// depend on no other.
    #[arg(long, requires = "frames", conflicts_with_all = ["from", "finish"])]
    pub chunk: bool,
    /// Only finish the shot: all frames must be there; writes shot.usda.
    #[arg(long, conflicts_with = "from")]
    pub finish: bool,
    /// Wait up to this long (s) for another run to leave the folder, instead of ending with 75 at once.
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = waiting_time)]
    pub wait: Duration,
    /// How progress is shown on stderr: for people, or for programs as a line of JSON for each frame.
    #[arg(long, value_name = "HOW", default_value = "text", value_enum)]
    pub progress: ProgressFormat,
}

/// A time that `--wait` accepts: up to a year.
fn waiting_time(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "it must be a number of seconds")?;
    let is_valid = (0.0..=3.2e7).contains(&seconds);
    if is_valid { Ok(Duration::from_secs_f64(seconds)) } else { Err("it must lie in 0 to 3.2e7 s".into()) }
}

/// Time between two looks at whether another run has left the folder.
const LOOK_AGAIN: Duration = Duration::from_millis(200);

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

    /// Makes the frames of a pipeline. `costs` estimates their costs, for the time left; `on_report` is called with the report of each, by
    /// one thread at a time.
    pub fn make(
        &self,
        session: &Session,
        pipeline: &Pipeline<'_>,
        stages: &[String],
        frames: &FrameChoice,
        costs: impl FnOnce(&[ToMake]) -> frazil::Result<FrameCosts>,
        on_report: impl FnMut(&Report) + Send,
    ) -> Result<(), Failure> {
        if self.finish && !self.output.join("state").is_dir() {
            let what = "was not prepared: run the same command with --prepare first";
            return Err(Failure::of_file(&self.output, what));
        }
        let run = self.prepare(session, pipeline, stages, frames)?;
        output::check_folder(&self.output).or_refuse()?;
        let (existing, to_make) = (run.existing(), run.to_make());
        let count: usize = to_make.iter().map(|of_stage| of_stage.frames.len()).sum();
        session.record("frames", count.into());
        session.record("frames_there", existing.into());
        if self.prepare {
            return Ok(());
        }
        if self.finish && count > 0 {
            let of = |to_make: &ToMake| format!("{} of stage {}", to_make.frames.len(), to_make.stage);
            let counts: Vec<String> = to_make.iter().map(of).collect();
            let what = format!("{}: frames are missing: {}", self.output.display(), counts.join(", "));
            return Err(Failure::failed(what));
        }
        let format = self.progress.unless(session.is_quiet());
        // An input that cannot be read fails the frame that reads it, not the frames before.
        let costs = match format.map(|_| costs(&to_make)) {
            Some(Err(error @ Error::Cancelled)) => return Err(error).or_fail(),
            Some(Err(error)) => {
                log::debug!("the time left is estimated without a forecast: {error}");
                FrameCosts::default()
            }
            Some(Ok(costs)) => costs,
            None => FrameCosts::default(),
        };
        let remaining = Remaining::of(&to_make, &costs, Instant::now());
        let display = FrameProgress::new(&session.ctx, remaining, existing, format);
        let display = Mutex::new((display, on_report));
        run.make(&session.ctx, |frame| {
            let mut display = display.lock().expect("no panic holds this lock");
            (display.1)(frame.report);
            display.0.finished(frame.stage, frame.frame, frame.pace);
        })
        .or_fail()
    }

    /// Prepares the run, if need be once another run has left the folder.
    fn prepare<'a>(
        &self,
        session: &Session,
        pipeline: &'a Pipeline<'a>,
        stages: &[String],
        frames: &FrameChoice,
    ) -> Result<Run<'a>, Failure> {
        let (start, mut has_said) = (Instant::now(), false);
        loop {
            let prepared = match (self.chunk, stages) {
                (true, [stage]) => Run::chunk(&session.ctx, pipeline, &self.output, stage, frames),
                (true, _) => return Err(Failure::refused("--chunk makes one stage: name it with --stage")),
                (false, _) => Run::prepare(&session.ctx, pipeline, &self.output, stages, frames, self.from),
            };
            match prepared {
                Err(Error::Busy(_)) if start.elapsed() < self.wait => {
                    if !std::mem::replace(&mut has_said, true) {
                        log::info!("{}: waiting for another run to end", self.output.display());
                    }
                    session.ctx.check().or_fail()?;
                    std::thread::sleep(LOOK_AGAIN);
                }
                prepared => return prepared.or_refuse(),
            }
        }
    }
}
