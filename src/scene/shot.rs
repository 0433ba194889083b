//! The frame loop: from one frame to the next, on from where an earlier run stopped.

use std::path::Path;
use std::sync::mpsc::{Receiver, sync_channel};

use super::cache::Cache;
use super::writer::{Job, Made, Step, Writer, vdb_bytes};
use super::{FrameChoice, Inputs, Scene, inputs, stage};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::io::manifest::Manifest;
use crate::snow::base_layer::{BaseLayer, Params, StepReport};

/// Steps that wait for the writer at most: a step's changes are a few MB.
const WAITING: usize = 2;

/// A shot with its folder, ready to run.
pub struct Run<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
    cache: Cache,
    /// Frames that are wanted and not done, ascending.
    todo: Vec<i32>,
    /// Frames that are wanted and done.
    there: usize,
    params: Params,
    /// The layer from which the first of them is reached.
    start: Option<LayerAt>,
}

impl<'a> Run<'a> {
    /// Opens or makes the folder, finds what is done, writes the resolved scene into it, and makes or loads the layer that
    /// the first frame starts from.
    ///
    /// `from` keeps the frames before it, whatever they were made with, and makes all others again.
    ///
    /// # Errors
    /// A folder that cannot be written, that another run writes into, or whose frames were made with other settings
    /// or inputs; a damaged record or frame; frames that would leave a gap in a cache of changes.
    pub fn prepare(
        ctx: &Context,
        scene: &'a Scene,
        inputs: &'a Inputs,
        folder: &Path,
        frames: &FrameChoice,
        from: Option<i32>,
    ) -> Result<Self> {
        let cache = Cache::open(scene, inputs, folder, frames, from)?;
        let (there, todo): (Vec<i32>, Vec<i32>) =
            frames.iter().partition(|frame| cache.stored.is_done(*frame));
        let noise = Some(scene.snow.noise).filter(|noise| noise.amplitude > 0.0);
        let params = Params { noise, tolerance: 0.02 };
        let mut run = Self { scene, inputs, cache, todo, there: there.len(), params, start: None };
        if let Some(&first) = run.todo.first() {
            run.start = Some(run.layer_before(ctx, first)?);
        }
        // All that can be refused was.
        run.cache.commit(scene, &run.todo)?;
        Ok(run)
    }

    /// Number of frames to be made.
    pub fn to_make(&self) -> usize {
        self.todo.len()
    }

    /// Number of frames that were wanted and are there.
    pub fn there(&self) -> usize {
        self.there
    }

    /// Makes the frames, and tells `done` when the files of one are written.
    ///
    /// # Errors
    /// What a step or a file reports; whole frames are left behind, from which another run goes on.
    pub fn make(mut self, ctx: &Context, done: impl FnMut(i32, &StepReport) + Send) -> Result<()> {
        let todo = std::mem::take(&mut self.todo);
        if let Some(start) = self.start.take() {
            self.make_frames(ctx, start, &todo, done)?;
        }
        if self.scene.output.usd {
            stage::write(self.scene, &self.inputs.bodies, &self.cache.stored, &mut self.cache.own)?;
        }
        self.cache.own.finish()
    }

    fn make_frames(
        &mut self,
        ctx: &Context,
        mut at: LayerAt,
        todo: &[i32],
        mut done: impl FnMut(i32, &StepReport) + Send,
    ) -> Result<()> {
        let half_width = at.layer.half_width();
        let mut writer =
            Writer::new(ctx, self.scene, &self.inputs.bodies, self.cache.stored.folder(), half_width);
        let (jobs, waiting) = sync_channel(WAITING);
        let (made, finished) = std::thread::scope(|scope| {
            let writing = scope.spawn(move || write_all(&mut writer, waiting, &mut done));
            let made = self.step_all(ctx, &mut at, todo, |job| jobs.send(job).is_ok());
            drop(jobs);
            (made, writing.join())
        });
        let (manifests, written) = finished.map_err(|_| Error::Internal("the writer stopped".into()))?;
        manifests.into_iter().for_each(|manifest| self.cache.stored.add(manifest));
        // What stopped the writer stopped the steps too, and is the reason to tell.
        written.and(made)
    }

    /// Steps to every wanted frame; `send` gives the work to the writer and says whether it still listens.
    fn step_all(
        &mut self,
        ctx: &Context,
        at: &mut LayerAt,
        todo: &[i32],
        mut send: impl FnMut(Job) -> bool,
    ) -> Result<()> {
        let mut follows = !Writer::follows(self.scene);
        for &wanted in todo {
            if at.frame < wanted - 1 && self.cache.stored.latest_layer(at.frame + 1..=wanted - 1).is_some() {
                *at = self.layer_before(ctx, wanted)?;
                follows = !Writer::follows(self.scene);
            }
            while at.frame < wanted {
                let frame = at.frame + 1;
                if !follows && !send(Job::Start(Box::new(at.layer.grids().deep_copy()?))) {
                    return Ok(());
                }
                follows = true;
                let report = self.step(ctx, &mut at.layer, frame)?;
                let inputs = if frame == wanted { Some(self.cache.inputs(frame)?) } else { None };
                let changes = at.layer.take_changes()?;
                at.frame = frame;
                let whole = self.whole_base(&at.layer, frame, inputs.as_ref())?;
                if !send(Job::Step(Box::new(Step { frame, changes, report, inputs, whole }))) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// The base's file at the first frame of a cache of changes: no copy of the layer is needed for it.
    fn whole_base(&self, layer: &BaseLayer, frame: i32, made: Option<&Made>) -> Result<Option<Vec<u8>>> {
        match made {
            Some(made) if frame == self.scene.shot.frames.first && !Writer::follows(self.scene) => {
                vdb_bytes(self.scene, frame, &layer.grids().list(), &made.from).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn step(&self, ctx: &Context, layer: &mut BaseLayer, frame: i32) -> Result<StepReport> {
        let time = |frame: i32| f64::from(frame) / self.scene.shot.fps;
        // The first frame's poses are cut out; nothing has moved yet.
        let from = if frame == self.scene.shot.frames.first { frame } else { frame - 1 };
        let report = layer.step(ctx, &self.inputs.bodies, time(from), time(frame), frame);
        let report = report.map_err(|error| match error {
            Error::Argument(what) => Error::file(&self.scene.path, format!("frame {frame}: {what}")),
            other => other,
        })?;
        log_step(frame, &report);
        Ok(report)
    }

    /// The layer from which a frame can be reached in the fewest steps.
    fn layer_before(&self, ctx: &Context, frame: i32) -> Result<LayerAt> {
        let params = self.params;
        let first = self.scene.shot.frames.first;
        let (own, latest) = (self.cache.own_from(), self.cache.stored.latest_layer(first..=frame - 1));
        if own > first && latest.is_none_or(|latest| latest < own - 1) {
            let what = format!(
                "the layer after frame {}, from which these settings go on, is gone: choose another -o, or --from {first}",
                own - 1
            );
            return Err(Error::file(self.cache.stored.folder(), what));
        }
        let initial = self.inputs.layer(ctx, self.scene.snow.cell);
        let initial = initial.map_err(|error| match (error, self.inputs.far_static(self.scene)) {
            (Error::Argument(_), Some((index, far))) => {
                Error::file(&self.scene.path, inputs::too_far(self.scene, index, far))
            }
            (other, _) => other,
        })?;
        let mut at = match latest {
            None => LayerAt { frame: first - 1, layer: BaseLayer::new(ctx, initial, params)? },
            Some(state) => {
                let grids = self.cache.stored.layer(ctx, state)?;
                LayerAt { frame: state, layer: BaseLayer::resume(ctx, initial, grids, params)? }
            }
        };
        at.layer.set_min_crumb(self.scene.snow.min_crumb);
        log::info!(
            "snow: {} active voxels, {:.1} MB, {:.6} m3; goes on after frame {}",
            at.layer.surface().active_voxels(),
            at.layer.surface().memory_bytes() as f64 / 1e6,
            at.layer.volume(),
            at.frame
        );
        Ok(at)
    }
}

/// A layer as it is after a frame.
struct LayerAt {
    frame: i32,
    layer: BaseLayer,
}

/// Writes until there is no more work or a file fails; gives what was written besides.
fn write_all(
    writer: &mut Writer,
    waiting: Receiver<Job>,
    done: &mut impl FnMut(i32, &StepReport),
) -> (Vec<Manifest>, Result<()>) {
    let mut manifests = Vec::new();
    for job in waiting {
        match writer.work(job) {
            Ok(None) => {}
            Ok(Some((manifest, report))) => {
                done(manifest.frame, &report);
                manifests.push(manifest);
            }
            Err(error) => return (manifests, Err(error)),
        }
    }
    (manifests, Ok(()))
}

fn log_step(frame: i32, report: &StepReport) {
    let phase = |phase: &PhaseTime| format!("{} {:.1} ms", phase.name, phase.time.as_secs_f64() * 1e3);
    let phases: Vec<String> = report.phases.iter().map(phase).collect();
    log::info!(
        "frame {frame}: {:.6} m3 removed, {} faces, {} blocks; {}",
        report.removed_volume,
        report.sweep_faces,
        report.touched_blocks,
        phases.join(", ")
    );
}
