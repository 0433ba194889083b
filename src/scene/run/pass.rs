//! A stage's pass over the frames: while one frame is computed, the files of the previous one are written.

use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use serde_json::json;

use super::cache::Cache;
use super::chain::Made;
use super::done_frames::{DoneFrames, Resumable};
use super::stage::{FrameFiles, Report, Stage, StepTarget, Stepped, Stepping};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::io::files::atomic;
use crate::io::records::checksummed;
use crate::io::records::manifest::{Keeps, Manifest};

/// If this many consecutive frames cannot be written, the cause is not a single file name: the disk is full or gone.
const FAILURES: usize = 3;
/// Maximum steps that wait for the writer: a step's changes are a few MB.
const WAITING: usize = 2;
/// Exact states kept of a stage that cannot resume from its own files and that no other stage reads.
const STATES_KEPT: i32 = 2;

/// Called for each frame whose files are written, with the stage, the frame and its report; from several threads.
pub type Done<'a> = &'a (dyn Fn(&'static str, i32, &Report) + Sync);

/// Shared by the passes of a run.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// Threads and cancel.
    pub ctx: &'a Context,
    /// The shot's first frame.
    pub first: i32,
    /// Set when a pass has failed: the others stop after their current frame.
    pub stop: &'a AtomicBool,
    /// Called for each frame.
    pub done: Done<'a>,
}

/// A stage of any type, with the pass that makes its frames.
pub trait AnyStage: Stage {
    /// See [`Stepping::precheck`].
    #[doc(hidden)]
    fn precheck_frames(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()>;

    /// The state from which a frame is reached in the fewest steps.
    #[doc(hidden)]
    fn before<'a>(&'a self, ctx: &Context, frame: i32, kept: Resumable<'_>) -> Result<Box<dyn Pass + 'a>>;
}

impl<S: Stepping> AnyStage for S {
    fn precheck_frames(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()> {
        self.precheck(ctx, upstream, last)
    }

    fn before<'a>(&'a self, ctx: &Context, frame: i32, kept: Resumable<'_>) -> Result<Box<dyn Pass + 'a>> {
        Ok(Box::new(At::before(self, ctx, frame, kept)?))
    }
}

/// A pass that is ready to start.
pub trait Pass: Send {
    /// Makes frames.
    #[doc(hidden)]
    fn make(self: Box<Self>, work: Work<'_>) -> Result<()>;
}

/// The frames that a pass makes.
pub struct Work<'a> {
    /// Shared with the other passes.
    pub shared: &'a Shared<'a>,
    /// Gets the records of the frames that were written, even if the pass fails.
    pub cache: &'a mut Cache,
    /// The frames of the stages upstream.
    pub upstream: &'a [DoneFrames],
    /// The frames to make, ascending.
    pub todo: &'a [i32],
    /// Whether the exact states of all frames are kept, as another stage reads them.
    pub every_state: bool,
}

/// A stage's state after a frame.
struct At<'a, S: Stepping> {
    stage: &'a S,
    frame: i32,
    state: S::State,
}

/// Messages to the writing thread, in the order of the frames.
enum Job<S: Stepping> {
    /// The state that the next steps start from.
    Start(S::Writer),
    /// A completed step.
    Step(Box<Frame<S::Step>>),
}

/// A step, with the hash of its frame's inputs if its files are wanted.
struct Frame<T> {
    frame: i32,
    made: Option<Made>,
    stepped: Stepped<T>,
}

impl<'a, S: Stepping> At<'a, S> {
    fn before(stage: &'a S, ctx: &Context, frame: i32, kept: Resumable<'_>) -> Result<Self> {
        let Resumable { first, own_from, done } = kept;
        if !stage.has_memory() {
            return Ok(Self { stage, frame: frame - 1, state: stage.load(ctx, done, None)? });
        }
        let latest = done.latest_state(first..=frame - 1);
        if own_from > first && latest.is_none_or(|latest| latest < own_from - 1) {
            let what = format!(
                "the {} after frame {}, from which these settings resume, is gone: choose another -o, or --from {first}",
                stage.noun(),
                own_from - 1
            );
            return Err(Error::file(done.folder(), what));
        }
        Ok(Self { stage, frame: latest.unwrap_or(first - 1), state: stage.load(ctx, done, latest)? })
    }

    /// Steps to every wanted frame; `send` passes the work to the writing thread and returns whether that still listens.
    fn step_all(mut self, work: &mut Work<'_>, send: impl Fn(Job<S>) -> bool) -> Result<()> {
        let Work { shared, upstream, todo, .. } = *work;
        let (stage, ctx, cache) = (self.stage, shared.ctx, &mut *work.cache);
        let mut follows = false;
        for &wanted in todo {
            let is_nearer = || cache.stored.latest_state(self.frame + 1..=wanted - 1).is_some();
            if self.frame < wanted - 1 && (!stage.has_memory() || is_nearer()) {
                self = Self::before(stage, ctx, wanted, cache.kept(shared.first))?;
                follows = false;
            }
            while self.frame < wanted {
                if shared.stop.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let frame = self.frame + 1;
                if !follows && !send(Job::Start(stage.writer(ctx, &self.state)?)) {
                    return Ok(());
                }
                follows = true;
                let made = if frame == wanted { Some(cache.inputs(stage, frame, upstream)?) } else { None };
                let made_from = made.as_ref().map(|made| &made.from[..]);
                let stepped = stage.step(ctx, &mut self.state, &StepTarget { frame, made_from, upstream })?;
                self.frame = frame;
                if !send(Job::Step(Box::new(Frame { frame, made, stepped }))) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

impl<S: Stepping> Pass for At<'_, S> {
    fn make(self: Box<Self>, mut work: Work<'_>) -> Result<()> {
        let folder = work.cache.stored.folder().to_path_buf();
        let Work { shared, every_state, .. } = work;
        let files = Files { stage: self.stage, folder: &folder, first: shared.first, every_state };
        let (jobs, waiting) = sync_channel(WAITING);
        let (made, finished) = std::thread::scope(|scope| {
            let writing = scope.spawn(|| files.write_all(waiting, shared.done));
            let made = self.step_all(&mut work, |job| jobs.send(job).is_ok());
            drop(jobs);
            (made, writing.join())
        });
        let (manifests, written) = finished.unwrap_or_else(|why| resume_unwind(why));
        manifests.into_iter().for_each(|manifest| work.cache.stored.add(manifest));
        // A writer's error also stopped the steps, and is the one to report.
        written.and(made)
    }
}

/// The files of a stage's frames.
struct Files<'a, S> {
    stage: &'a S,
    folder: &'a Path,
    first: i32,
    /// Whether the exact states of all frames are kept, as another stage reads them.
    every_state: bool,
}

impl<S: Stepping> Files<'_, S> {
    /// Writes until there is no more work or a file cannot be written; if the stage's frames can be written independently, until
    /// [`FAILURES`] consecutive frames could not. Also returns the records of what was written.
    fn write_all(&self, waiting: Receiver<Job<S>>, done: Done<'_>) -> (Vec<Manifest>, Result<()>) {
        let mut manifests = Vec::new();
        let mut writer = None;
        // The first error, and the number of consecutive frames that could not be written.
        let (mut failed, mut on_end): (Option<Error>, usize) = (None, 0);
        let goes_on = self.stage.writes_frames_independently() && self.stage.needs_every_frame().is_none();
        for job in waiting {
            let frame = match job {
                Job::Start(start) => {
                    writer = Some(start);
                    continue;
                }
                Job::Step(frame) => frame,
            };
            let Some(writer) = &mut writer else {
                return (manifests, Err(Error::Internal("a step came before its start".into())));
            };
            let number = frame.frame;
            match self.write(writer, *frame, done) {
                Ok(manifest) => {
                    manifests.extend(manifest);
                    on_end = 0;
                }
                Err(error @ Error::Io { .. }) if goes_on && on_end + 1 < FAILURES => {
                    log::warn!("frame {number} is not written: {error}");
                    failed.get_or_insert(error);
                    on_end += 1;
                }
                Err(error) => return (manifests, Err(failed.unwrap_or(error))),
            }
        }
        (manifests, failed.map_or(Ok(()), Err))
    }

    /// Writes a frame, or only passes through it.
    fn write(
        &self,
        writer: &mut S::Writer,
        frame: Frame<S::Step>,
        done: Done<'_>,
    ) -> Result<Option<Manifest>> {
        let Frame { frame, made, stepped: Stepped { step, report } } = frame;
        let Some(made) = made else {
            self.stage.write(writer, step, None)?;
            return Ok(None);
        };
        let mut files = FrameFiles::new(self.folder, self.stage, frame, &made.from);
        self.stage.write(writer, step, Some(&mut files))?;
        let (files, state) = files.written();
        self.write_report(frame, &report)?;
        let keeps = self.stage.keeps(frame);
        let manifest = Manifest { frame, inputs: made.from, keeps, files, state, next: made.next };
        manifest.write(self.folder, self.stage.name())?;
        if keeps == Keeps::State && !self.every_state {
            self.remove_states_before(frame);
        }
        done(self.stage.name(), frame, &report);
        Ok(Some(manifest))
    }

    /// Removes exact states that are no longer needed to resume, and those that a killed run did not remove. One that cannot be removed
    /// does no harm.
    fn remove_states_before(&self, frame: i32) {
        let (stage, extension) = (self.stage.name(), self.stage.state_extension());
        let path = |old: i32| self.folder.join("state").join(format!("{stage}.{old:04}.{extension}"));
        let mut passed = (self.first..=frame - STATES_KEPT).rev();
        while passed.next().is_some_and(|old| std::fs::remove_file(path(old)).is_ok()) {}
    }

    fn write_report(&self, frame: i32, report: &Report) -> Result<()> {
        let time = |time: &PhaseTime| json!({ "name": time.name, "seconds": time.time.as_secs_f64() });
        let mut text = report.results.clone();
        text.insert("check".into(), checksummed::UNSTAMPED.into());
        text.insert("frame".into(), frame.into());
        text.insert("phases".into(), report.phases.iter().map(time).collect());
        let text = serde_json::Value::Object(text);
        let path = self.folder.join("report").join(format!("{}.{frame:04}.json", self.stage.name()));
        atomic::write_bytes(&path, checksummed::stamp(&format!("{text:#}\n")).as_bytes())
    }
}
