//! A stage's pass over the frames: while one frame is computed, the files of the previous one are written.

use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use serde_json::{Map, Value, json};

use super::cache::Cache;
use super::chain::FrameHashes;
use super::done_frames::{CONTENTS, DoneFrames, Resumable};
use super::pace::{Clock, Pace};
use super::stage::{FrameFiles, Report, Stage, StepTarget, Stepped, Stepping};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::io::files::atomic;
use crate::io::records::checksummed;
use crate::io::records::manifest::{Keeps, Manifest};

/// A pass ends after this many consecutive frames that cannot be written: the disk is full or gone.
const MAX_FAILURES: usize = 3;
/// Maximum number of steps that wait for the writer, each a few MB.
const MAX_WAITING: usize = 2;
/// Number of exact states that are kept, unless a stage requires those of all frames.
const STATES_KEPT: i32 = 2;

/// Called for each frame whose files are written; from several threads.
pub type OnFrameDone<'a> = &'a (dyn Fn(&FrameDone<'_>) + Sync);

/// A frame whose files are written.
pub struct FrameDone<'a> {
    /// The stage.
    pub stage: &'static str,
    /// The frame.
    pub frame: i32,
    /// Its report.
    pub report: &'a Report,
    /// How its steps went.
    pub pace: Pace,
}

/// Shared by the passes of a run.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// Its thread pool, cancel flag and memory limit.
    pub ctx: &'a Context,
    /// The shot's first frame.
    pub first: i32,
    /// Set when a pass was cancelled or has panicked: the others stop after their current frame.
    pub stop: &'a AtomicBool,
    /// Called for each frame whose files are written.
    pub on_done: OnFrameDone<'a>,
}

/// A stage of any type: the associated types of [`Stepping`] are erased.
pub trait AnyStage: Stage {
    /// See [`Stepping::precheck`].
    #[doc(hidden)]
    fn precheck_frames(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()>;

    /// Prepares a pass that makes `frame`, and loads the state from which that takes the fewest steps.
    #[doc(hidden)]
    fn start_pass<'a>(
        &'a self,
        ctx: &Context,
        frame: i32,
        resumable: Resumable<'_>,
    ) -> Result<Box<dyn Pass + 'a>>;
}

impl<S: Stepping> AnyStage for S {
    fn precheck_frames(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()> {
        self.precheck(ctx, upstream, last)
    }

    fn start_pass<'a>(
        &'a self,
        ctx: &Context,
        frame: i32,
        resumable: Resumable<'_>,
    ) -> Result<Box<dyn Pass + 'a>> {
        Ok(Box::new(StagePass::before(self, ctx, frame, resumable)?))
    }
}

/// A pass that is ready to start.
pub trait Pass: Send {
    /// Makes frames.
    #[doc(hidden)]
    fn make(self: Box<Self>, work: Work<'_>) -> Result<()>;
}

/// The work of a pass: the frames to make.
pub struct Work<'a> {
    /// Shared with the other passes.
    pub shared: &'a Shared<'a>,
    /// Receives the records of the frames that were written, even if the pass fails.
    pub cache: &'a mut Cache,
    /// The frames of the stages upstream.
    pub upstream: &'a [DoneFrames],
    /// The frames to make, ascending.
    pub todo: &'a [i32],
    /// How often the exact state is kept: after every Nth frame from the first; 0 = only after the last ones.
    pub states_every: i32,
}

/// A stage with its state after a frame.
struct StagePass<'a, S: Stepping> {
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

/// A step.
struct Frame<T> {
    frame: i32,
    /// If the files are wanted.
    wanted: Option<Wanted>,
    stepped: Stepped<T>,
}

/// What is known of a frame whose files are wanted.
struct Wanted {
    hashes: FrameHashes,
    /// When it was computed.
    pace: Pace,
}

impl<'a, S: Stepping> StagePass<'a, S> {
    fn before(stage: &'a S, ctx: &Context, frame: i32, resumable: Resumable<'_>) -> Result<Self> {
        let Resumable { first, own_from, done } = resumable;
        if !stage.has_memory() {
            return Ok(Self { stage, frame: frame - 1, state: stage.load(ctx, done, None)? });
        }
        let latest = done.latest_state(first..=frame - 1);
        if own_from > first && latest.is_none_or(|latest| latest < own_from - 1) {
            let what = format!(
                "the state of the {} after frame {}, from which the frames with the present settings continue, is gone: choose another -o, or --from {first}",
                stage.noun(),
                own_from - 1
            );
            return Err(Error::file(done.folder(), what));
        }
        Ok(Self { stage, frame: latest.unwrap_or(first - 1), state: stage.load(ctx, done, latest)? })
    }

    /// Steps to every wanted frame; `send` passes a job to the writing thread and returns whether that still receives jobs.
    fn step_all(
        mut self,
        work: &mut Work<'_>,
        computed: &AtomicUsize,
        send: impl Fn(Job<S>) -> bool,
    ) -> Result<()> {
        let Work { shared, upstream, todo, .. } = *work;
        let (stage, ctx, cache) = (self.stage, shared.ctx, &mut *work.cache);
        // Whether the writer's state is that from which the next step starts.
        let mut is_writer_current = false;
        let mut clock = Clock::default();
        for &wanted in todo {
            let is_nearer = || cache.stored.latest_state(self.frame + 1..=wanted - 1).is_some();
            if self.frame < wanted - 1 && (!stage.has_memory() || is_nearer()) {
                self = Self::before(stage, ctx, wanted, cache.resumable(shared.first))?;
                is_writer_current = false;
            }
            while self.frame < wanted {
                if shared.stop.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let frame = self.frame + 1;
                if !is_writer_current {
                    let start = Job::Start(stage.writer(ctx, &self.state)?);
                    if !clock.wait(|| send(start)) {
                        return Ok(());
                    }
                }
                is_writer_current = true;
                let hashes = if frame == wanted { Some(cache.hashes(stage, frame, upstream)?) } else { None };
                let made_from = hashes.as_ref().map(|hashes| &hashes.inputs[..]);
                let stepped = stage.step(ctx, &mut self.state, &StepTarget { frame, made_from, upstream })?;
                self.frame = frame;
                let wanted = hashes.map(|hashes| Wanted { hashes, pace: clock.lap() });
                computed.fetch_add(usize::from(wanted.is_some()), Ordering::Relaxed);
                let step = Job::Step(Box::new(Frame { frame, wanted, stepped }));
                if !clock.wait(|| send(step)) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

impl<S: Stepping> Pass for StagePass<'_, S> {
    fn make(self: Box<Self>, mut work: Work<'_>) -> Result<()> {
        let folder = work.cache.stored.folder().to_path_buf();
        let Work { shared, states_every, .. } = work;
        let computed = AtomicUsize::new(0);
        let writer = FrameWriter {
            stage: self.stage,
            folder: &folder,
            first: shared.first,
            states_every,
            computed: &computed,
        };
        let (jobs, waiting) = sync_channel(MAX_WAITING);
        let (made, finished) = std::thread::scope(|scope| {
            let writing = scope.spawn(|| writer.write_all(waiting, shared.on_done));
            let made = self.step_all(&mut work, &computed, |job| jobs.send(job).is_ok());
            drop(jobs);
            (made, writing.join())
        });
        let (manifests, written) = finished.unwrap_or_else(|why| resume_unwind(why));
        manifests.into_iter().for_each(|manifest| work.cache.stored.add(manifest));
        // An error of the writer also ended the steps, and is the one to report.
        written.and(made)
    }
}

/// Writes the files of a stage's frames.
struct FrameWriter<'a, S> {
    stage: &'a S,
    folder: &'a Path,
    first: i32,
    /// As in [`Work`].
    states_every: i32,
    /// Number of wanted frames that were computed so far.
    computed: &'a AtomicUsize,
}

impl<S: Stepping> FrameWriter<'_, S> {
    /// Writes until there are no more jobs or a frame cannot be written; if the stage's frames can be written independently, until
    /// [`MAX_FAILURES`] consecutive frames cannot be written. Also returns the records of the frames that were written.
    fn write_all(&self, waiting: Receiver<Job<S>>, on_done: OnFrameDone<'_>) -> (Vec<Manifest>, Result<()>) {
        let mut manifests = Vec::new();
        let mut writer = None;
        let (mut first_error, mut failures_in_a_row): (Option<Error>, usize) = (None, 0);
        let mut received = 0;
        let may_skip = self.stage.writes_frames_independently() && self.stage.needs_every_frame().is_none();
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
            received += usize::from(frame.wanted.is_some());
            match self.write(writer, *frame, received, on_done) {
                Ok(manifest) => {
                    manifests.extend(manifest);
                    failures_in_a_row = 0;
                }
                Err(error @ Error::Io { .. }) if may_skip && failures_in_a_row + 1 < MAX_FAILURES => {
                    log::warn!("frame {number} is not written: {error}");
                    first_error.get_or_insert(error);
                    failures_in_a_row += 1;
                }
                Err(error) => return (manifests, Err(first_error.unwrap_or(error))),
            }
        }
        (manifests, first_error.map_or(Ok(()), Err))
    }

    /// Writes a frame, the wanted one of number `received`, or only updates the writer if its files are not wanted.
    fn write(
        &self,
        writer: &mut S::Writer,
        frame: Frame<S::Step>,
        received: usize,
        on_done: OnFrameDone<'_>,
    ) -> Result<Option<Manifest>> {
        let Frame { frame, wanted, stepped: Stepped { step, report } } = frame;
        let Some(Wanted { hashes, pace }) = wanted else {
            self.stage.write(writer, step, None)?;
            return Ok(None);
        };
        let mut files = FrameFiles::new(self.folder, self.stage, frame, &hashes.inputs);
        self.stage.write(writer, step, Some(&mut files))?;
        let (files, state, contents) = files.into_written();
        self.write_report(frame, &report, contents)?;
        let keeps = self.stage.keeps(frame);
        let manifest = Manifest { frame, inputs: hashes.inputs, keeps, files, state, next: hashes.next };
        manifest.write(self.folder, self.stage.name())?;
        if keeps == Keeps::State && self.states_every != 1 {
            self.remove_states_before(frame);
        }
        let pace = Pace { ahead: self.computed.load(Ordering::Relaxed) - received, ..pace };
        on_done(&FrameDone { stage: self.stage.name(), frame, report: &report, pace });
        Ok(Some(manifest))
    }

    /// Removes exact states that are no longer needed to resume, also those that a killed run left behind; errors are ignored.
    fn remove_states_before(&self, frame: i32) {
        let (stage, extension) = (self.stage.name(), self.stage.state_extension());
        let path = |old: i32| self.folder.join("state").join(format!("{stage}.{old:04}.{extension}"));
        let every = i64::from(self.states_every);
        let is_kept = |old: &i32| every > 0 && (i64::from(*old) - i64::from(self.first)) % every == 0;
        let mut passed = (self.first..=frame - STATES_KEPT).rev().filter(|old| !is_kept(old));
        while passed.next().is_some_and(|old| std::fs::remove_file(path(old)).is_ok()) {}
    }

    fn write_report(&self, frame: i32, report: &Report, contents: Map<String, Value>) -> Result<()> {
        let time = |time: &PhaseTime| json!({ "name": time.name, "seconds": time.time.as_secs_f64() });
        let mut text = report.results.clone();
        text.insert("check".into(), checksummed::UNSTAMPED.into());
        if !contents.is_empty() {
            text.insert(CONTENTS.into(), contents.into());
        }
        text.insert("frame".into(), frame.into());
        text.insert("phases".into(), report.phases.iter().map(time).collect());
        let text = Value::Object(text);
        let path = self.folder.join("report").join(format!("{}.{frame:04}.json", self.stage.name()));
        atomic::write_bytes(&path, checksummed::stamp(&format!("{text:#}\n")).as_bytes())
    }
}
