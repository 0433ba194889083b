//! Runs the stages of a scene into a folder, resuming where an earlier run stopped.

use std::fs::File;
use std::ops::RangeInclusive;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::ScopedJoinHandle;

use super::cache::{Cache, Request, check_request};
use super::done_frames::DoneFrames;
use super::going_back::resumable_from;
use super::own_files::OwnFiles;
use super::pass::{AnyStage, FrameDone, OnFrameDone, Pass, Shared, Work};
use super::pipeline::Pipeline;
use super::stage::Stage;
use super::{chain, own_files, usd};
use crate::context::{Context, release_freed_memory};
use crate::error::{Error, Result};
use crate::io::records::manifest::Manifest;
use crate::scene::FrameChoice;

/// A shot with its folder, ready to run.
pub struct Run<'a> {
    pipeline: &'a Pipeline<'a>,
    /// All stages, including those that are not to be made.
    stages: Vec<StageRun<'a>>,
    own: OwnFiles,
    /// Whether it makes a chunk, and so writes nothing but frames.
    is_chunk: bool,
    /// Held until the run is dropped.
    _lock: File,
}

/// The frames of a stage that a run will make.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToMake {
    /// The stage.
    pub stage: &'static str,
    /// The frames that are computed for each frame to be written, which is the last of them.
    pub frames: Vec<RangeInclusive<i32>>,
}

/// Who may write into a folder beside a run.
#[derive(Clone, Copy)]
enum Access {
    /// Nobody.
    Alone,
    /// Other runs that make chunks.
    Shared,
}

/// A stage in a run.
struct StageRun<'a> {
    stage: &'a dyn AnyStage,
    /// Its frames; `None` if it is not to be made in this run.
    cache: Option<Cache>,
    /// Wanted frames that are not done, ascending.
    todo: Vec<i32>,
    /// Number of wanted frames that are done.
    existing: usize,
    /// The pass, with the state loaded from which it starts; `None` if the upstream stages must run first.
    start: Option<Box<dyn Pass + 'a>>,
    /// Frames to remove, because upstream stages are made again.
    to_remove: Vec<Manifest>,
}

impl<'a> Run<'a> {
    /// Opens or creates the folder, finds the frames that are done, loads the states from which the stages start, and writes the resolved
    /// scene into the folder. The run makes the stages named in `only`, or all.
    ///
    /// With `from`, the frames before it are kept, whatever settings they were made with. All other frames of these
    /// stages, and such frames of stages downstream of them, are removed; these stages make those in `frames` again.
    ///
    /// # Errors
    /// A folder that cannot be written, that another run writes into, or whose frames were made with other settings or inputs; a damaged
    /// record or frame; a gap between frames, if a stage allows none. No frame is then changed.
    pub fn prepare(
        ctx: &Context,
        pipeline: &'a Pipeline<'a>,
        folder: &Path,
        only: &[String],
        frames: &FrameChoice,
        from: Option<i32>,
    ) -> Result<Self> {
        let chosen = pipeline.chosen(only)?;
        let asked = from;
        let from = asked.map(|from| going_back(pipeline, &chosen, folder, from)).transpose()?;
        let request = Request { first: pipeline.scene.shot.frames.first, frames, from };
        // Checked before the folder is created, so that a refused run leaves none behind, and again once no other run can write into it.
        let of_run = || chosen.iter().map(|position| &*pipeline.stages[*position] as &dyn Stage);
        for stage in of_run() {
            check_request(stage, request, &DoneFrames::read(folder, stage.name())?)?;
        }
        OwnFiles::read(folder, of_run())?.refuse_foreign(pipeline, frames)?;
        pipeline.refuse_stale(&chosen, folder)?;
        make_folders(of_run(), folder)?;
        let lock = lock(folder, Access::Alone)?;
        let own = OwnFiles::read(folder, of_run())?;
        own.remove_unfinished()?;
        own.refuse_foreign(pipeline, frames)?;
        pipeline.refuse_stale(&chosen, folder)?;
        if let (Some(asked), Some(from)) = (asked, from)
            && from < asked
        {
            log::warn!(
                "--from {asked} goes back to frame {from}: the folder keeps no exact state after frame {}",
                asked - 1
            );
        }
        let mut run = Self { pipeline, stages: Vec::new(), own, is_chunk: false, _lock: lock };
        let downstream = if from.is_some() { pipeline.downstream(&chosen) } else { Vec::new() };
        for (position, stage) in pipeline.stages.iter().enumerate() {
            let is_chosen = chosen.contains(&position);
            let remove_from = request.from.filter(|_| !is_chosen && downstream.contains(&position));
            let own_stage = run.open(&**stage, folder, request, is_chosen, remove_from)?;
            run.stages.push(own_stage);
        }
        run.load(ctx)?;
        // Validation is complete: commit.
        run.commit()?;
        Ok(run)
    }

    /// A run that makes some frames of a stage whose frames do not depend on one another, and writes nothing else, so that many may be at
    /// work at once. A run has prepared the folder for these frames before ([`Run::prepare`] is enough).
    ///
    /// # Errors
    /// As [`Run::prepare`]; a stage whose frames depend on one another; a folder that was not prepared, or for other frames.
    pub fn chunk(
        ctx: &Context,
        pipeline: &'a Pipeline<'a>,
        folder: &Path,
        stage: &str,
        frames: &FrameChoice,
    ) -> Result<Self> {
        let chosen = pipeline.chosen(&[stage.to_string()])?;
        let [position] = chosen[..] else {
            return Err(Error::Internal("a name is that of one stage".into()));
        };
        let own_stage: &dyn Stage = &*pipeline.stages[position];
        if own_stage.has_memory() {
            let what = format!(
                "stage {stage} cannot be made in chunks: each of its frames continues the one before"
            );
            return Err(Error::argument(what));
        }
        let own = OwnFiles::read(folder, std::iter::once(own_stage))?;
        own.refuse_unprepared(stage, frames)?;
        let lock = lock(folder, Access::Shared)?;
        let mut run = Self { pipeline, stages: Vec::new(), own, is_chunk: true, _lock: lock };
        let request = Request { first: pipeline.scene.shot.frames.first, frames, from: None };
        for (other, stage) in pipeline.stages.iter().enumerate() {
            let of_stage = run.open(&**stage, folder, request, other == position, None)?;
            run.stages.push(of_stage);
        }
        run.load(ctx)?;
        Ok(run)
    }

    /// Opens a stage's frames and checks them against their inputs.
    fn open(
        &self,
        stage: &'a dyn AnyStage,
        folder: &Path,
        request: Request<'_>,
        is_chosen: bool,
        remove_from: Option<i32>,
    ) -> Result<StageRun<'a>> {
        let mut run = StageRun {
            stage,
            cache: None,
            todo: Vec::new(),
            existing: 0,
            start: None,
            to_remove: Vec::new(),
        };
        if !is_chosen {
            if let Some(from) = remove_from {
                run.to_remove = DoneFrames::read(folder, stage.name())?.leave_out_from(from);
            }
            return Ok(run);
        }
        let mut cache = Cache::open(stage, self.pipeline.input_hashes, folder, request)?;
        let upstream = self.upstream(stage, folder)?;
        cache.check_inputs(stage, request.frames, &upstream)?;
        let (existing, todo): (Vec<i32>, Vec<i32>) =
            request.frames.iter().partition(|frame| cache.stored.is_done(*frame));
        self.refuse_missing(stage, &cache.stored, &todo, &upstream)?;
        (run.existing, run.todo, run.cache) = (existing.len(), todo, Some(cache));
        Ok(run)
    }

    /// Fails if an upstream frame that a step reads neither exists nor will be made.
    fn refuse_missing(
        &self,
        stage: &dyn Stage,
        own: &DoneFrames,
        todo: &[i32],
        upstream: &[DoneFrames],
    ) -> Result<()> {
        let first = self.pipeline.scene.shot.frames.first;
        for (name, stored) in stage.upstream().iter().zip(upstream) {
            let made = self.stages.iter().find(|run| run.stage.name() == *name).map(|run| &run.todo[..]);
            let is_there = |frame: &i32| {
                stored.is_done(*frame) || made.is_some_and(|made| made.binary_search(frame).is_ok())
            };
            if let Some(frame) = computed(stage, own, todo, first).flatten().find(|frame| !is_there(frame)) {
                return Err(chain::missing(stage, frame, name, stored.folder()));
            }
        }
        Ok(())
    }

    /// The frames of a stage's upstream stages that are done, in the order of [`Stage::upstream`], except those that this run still has to
    /// make.
    fn upstream(&self, stage: &dyn Stage, folder: &Path) -> Result<Vec<DoneFrames>> {
        let of = |name: &&str| {
            let mut stored = DoneFrames::read(folder, name)?;
            if let Some(run) = self.stages.iter().find(|run| run.stage.name() == *name) {
                run.todo.iter().for_each(|frame| stored.leave_out(*frame));
            }
            Ok(stored)
        };
        stage.upstream().iter().map(of).collect()
    }

    /// Loads the state before the first frame to be made, for stages whose upstream frames all exist.
    fn load(&mut self, ctx: &Context) -> Result<()> {
        let first = self.pipeline.scene.shot.frames.first;
        for position in 0..self.stages.len() {
            let run = &self.stages[position];
            if let ([frame, ..], Some(cache), false) = (&run.todo[..], &run.cache, self.is_waiting(run)) {
                let upstream = self.upstream(run.stage, self.own.folder())?;
                let last = run.todo.last().copied().unwrap_or(*frame);
                run.stage.precheck_frames(ctx, &upstream, last)?;
                self.stages[position].start =
                    Some(run.stage.start_pass(ctx, *frame, cache.resumable(first))?);
            }
        }
        Ok(())
    }

    /// Removes the frames to be made again, downstream stages first, and writes the settings, the range of frames to be written and the scene
    /// to the folder.
    fn commit(&mut self) -> Result<()> {
        for run in self.stages.iter_mut().rev() {
            let stored = DoneFrames::read(self.own.folder(), run.stage.name())?;
            run.to_remove.drain(..).try_for_each(|manifest| stored.remove(&manifest))?;
            if let [first, .., last] | [first @ last] = run.todo[..] {
                self.own.record_started(run.stage.name(), first, last)?;
            }
            if let Some(cache) = &mut run.cache {
                cache.commit(run.stage)?;
            }
        }
        self.own.write(own_files::SCENE, self.pipeline.scene.to_toml_in(self.own.folder()).as_bytes())
    }

    /// Whether a stage upstream of this one still has frames to make.
    fn is_waiting(&self, run: &StageRun<'_>) -> bool {
        let mut busy = self.stages.iter().filter(|other| !other.todo.is_empty());
        busy.any(|other| run.stage.upstream().contains(&other.stage.name()))
    }

    /// The stages that have frames to make, with these frames.
    pub fn to_make(&self) -> Vec<ToMake> {
        let first = self.pipeline.scene.shot.frames.first;
        let of = |run: &StageRun<'_>| {
            let stored = &run.cache.as_ref()?.stored;
            let frames: Vec<_> = computed(run.stage, stored, &run.todo, first).collect();
            (!frames.is_empty()).then(|| ToMake { stage: run.stage.name(), frames })
        };
        self.stages.iter().filter_map(of).collect()
    }

    /// Number of wanted frames that exist, over all stages.
    pub fn existing(&self) -> usize {
        self.stages.iter().map(|run| run.existing).sum()
    }

    /// Makes the frames. Calls `on_done` with the stage, the frame and its report when a frame's files are written, from several threads if
    /// stages are independent.
    ///
    /// If a stage fails, those that do not depend on it are still made.
    ///
    /// # Errors
    /// The error of the first step or file that fails; complete frames remain, from which another run resumes.
    pub fn make(mut self, ctx: &Context, on_done: impl Fn(&FrameDone<'_>) + Sync) -> Result<()> {
        let mut first_error = None;
        while let Some(ready) = self.ready() {
            let results = self.make_stages(ctx, &ready, &on_done)?;
            // So that the next stages do not add to what these have freed.
            release_freed_memory();
            for (position, result) in ready.into_iter().zip(results) {
                let Err(error) = result else { continue };
                if matches!(error, Error::Cancelled) {
                    return Err(error);
                }
                self.abandon(position, &error);
                first_error.get_or_insert(error);
            }
        }
        if let Some(error) = first_error {
            return Err(error);
        }
        if self.is_chunk {
            return Ok(());
        }
        if self.pipeline.scene.output.usd {
            let folder = self.own.folder().to_path_buf();
            let stored: Vec<DoneFrames> = self
                .pipeline
                .stages()
                .map(|stage| DoneFrames::read(&folder, stage.name()))
                .collect::<Result<_>>()?;
            usd::write(ctx, self.pipeline, self.pipeline.stages().zip(&stored), &mut self.own)?;
        }
        self.own.finish()
    }

    /// Indices of the stages that have frames to make and wait for no other; `None` if all is done.
    fn ready(&self) -> Option<Vec<usize>> {
        let is_ready = |run: &StageRun<'_>| !run.todo.is_empty() && !self.is_waiting(run);
        let ready: Vec<usize> = (0..self.stages.len()).filter(|at| is_ready(&self.stages[*at])).collect();
        (!ready.is_empty()).then_some(ready)
    }

    /// Gives up the stages downstream of one that failed.
    fn abandon(&mut self, position: usize, error: &Error) {
        let abandoned = self.pipeline.downstream(&[position]);
        let others_remain =
            self.stages.iter().enumerate().any(|(n, run)| !abandoned.contains(&n) && !run.todo.is_empty());
        if others_remain {
            let name = self.stages[position].stage.name();
            log::warn!("stage {name} ends: {error}; stages that need nothing of it go on");
        }
        abandoned.into_iter().for_each(|n| self.stages[n].todo.clear());
    }

    /// Makes the frames of some stages in parallel; returns the result of each.
    fn make_stages(
        &mut self,
        ctx: &Context,
        ready: &[usize],
        on_done: OnFrameDone<'_>,
    ) -> Result<Vec<Result<()>>> {
        let stop = AtomicBool::new(false);
        let shared = Shared { ctx, first: self.pipeline.scene.shot.frames.first, stop: &stop, on_done };
        let folder = self.own.folder().to_path_buf();
        let upstream: Vec<Vec<DoneFrames>> = ready
            .iter()
            .map(|position| self.upstream(self.stages[*position].stage, &folder))
            .collect::<Result<_>>()?;
        let pipeline = self.pipeline;
        let runs = self.stages.iter_mut().enumerate().filter(|(position, _)| ready.contains(position));
        Ok(std::thread::scope(|scope| {
            let threads: Vec<_> = runs
                .zip(&upstream)
                .map(|((_, run), upstream)| {
                    let states_every = pipeline.states_kept_every(run.stage);
                    scope.spawn(move || {
                        let stop = StopOthers(shared.stop);
                        let result = run.make(&shared, upstream, states_every);
                        if !matches!(result, Err(Error::Cancelled)) {
                            std::mem::forget(stop);
                        }
                        result
                    })
                })
                .collect();
            let joined =
                |thread: ScopedJoinHandle<'_, _>| thread.join().unwrap_or_else(|why| resume_unwind(why));
            threads.into_iter().map(joined).collect()
        }))
    }
}

/// Dropped if a pass is cancelled or panics: stops the others after their current frame.
struct StopOthers<'a>(&'a AtomicBool);

impl Drop for StopOthers<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl StageRun<'_> {
    fn make(&mut self, shared: &Shared<'_>, upstream: &[DoneFrames], states_every: i32) -> Result<()> {
        let todo = std::mem::take(&mut self.todo);
        let Some(cache) = &mut self.cache else { return Ok(()) };
        let start = match self.start.take() {
            Some(start) => start,
            None => {
                // Upstream frames were made only in this run, so that the checks of `load` are still due.
                cache.check_inputs(self.stage, &FrameChoice::none(), upstream)?;
                self.stage.precheck_frames(shared.ctx, upstream, todo[todo.len() - 1])?;
                self.stage.start_pass(shared.ctx, todo[0], cache.resumable(shared.first))?
            }
        };
        start.make(Work { shared, cache, upstream, todo: &todo, states_every })
    }
}

/// The frames that are computed for each wanted one: the steps start from the latest state that is kept, and pass through all frames between.
fn computed(
    stage: &dyn Stage,
    own: &DoneFrames,
    todo: &[i32],
    first: i32,
) -> impl Iterator<Item = RangeInclusive<i32>> {
    let mut at = first - 1;
    todo.iter().map(move |&wanted| {
        let before = std::mem::replace(&mut at, wanted);
        let from = || own.latest_state(before + 1..=wanted - 1).unwrap_or(before);
        (if stage.has_memory() { from() + 1 } else { wanted })..=wanted
    })
}

/// The frame from which the chosen stages of a folder are made again.
fn going_back(pipeline: &Pipeline, chosen: &[usize], folder: &Path, from: i32) -> Result<i32> {
    let done = |position: &usize| {
        let stage: &dyn Stage = &*pipeline.stages[*position];
        Ok((stage, DoneFrames::read(folder, stage.name())?))
    };
    let stages: Vec<_> = chosen.iter().map(done).collect::<Result<_>>()?;
    Ok(resumable_from(&stages, from, pipeline.scene.output.keep_states))
}

fn make_folders<'s>(stages: impl Iterator<Item = &'s dyn Stage>, folder: &Path) -> Result<()> {
    let written = stages.flat_map(|stage| {
        let kinds = stage.kinds().iter().map(|kind| kind.name);
        kinds.filter(|kind| stage.writes(kind)).collect::<Vec<_>>()
    });
    for name in ["", "state", "report"].into_iter().chain(written) {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    }
    Ok(())
}

/// Prevents other runs from writing into a folder, except those that the access allows.
fn lock(folder: &Path, access: Access) -> Result<File> {
    let path = folder.join("state").join("run.lock");
    let file = File::options().create(true).append(true).open(&path);
    let file = file.map_err(|error| Error::io(&path, "write", error))?;
    let locked = match access {
        Access::Alone => file.try_lock(),
        Access::Shared => file.try_lock_shared(),
    };
    match locked {
        Err(std::fs::TryLockError::WouldBlock) => Err(Error::Busy(folder.to_path_buf())),
        // File systems without locks are allowed.
        Err(std::fs::TryLockError::Error(error)) => {
            let why = Error::io(&path, "lock", error);
            log::warn!("{why}; nothing keeps another run from writing into this folder");
            Ok(file)
        }
        Ok(()) => Ok(file),
    }
}
