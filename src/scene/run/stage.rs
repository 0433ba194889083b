//! The traits of a stage, by which the frame loop makes its frames.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::done_frames::DoneFrames;
use super::settings::Settings;
use crate::context::{Context, PhaseTime};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::io::files::atomic;
use crate::io::mesh::Carried;
use crate::io::records::manifest::{Keeps, Written};
use crate::io::usd::{self, Clips, Field};

/// A kind of files of a stage, which have a folder of their own: `base/base.0012.vdb`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileKind {
    /// Name of the folder and of the files in it, lower-case letters.
    pub name: &'static str,
    /// Extensions of the files, lower-case letters.
    pub extensions: &'static [&'static str],
}

/// The files that a stage reads for a frame.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reads {
    /// Required files.
    pub files: Vec<PathBuf>,
    /// Files of the coming frame, which may not exist yet: when they appear, the frame is made again.
    pub ahead: Vec<PathBuf>,
}

/// A stage's description: names, settings and inputs.
pub trait Stage: Sync {
    /// Its name, lower-case letters: `--stage base`, `state/base.0012.json`, `report/base.0012.json`.
    fn name(&self) -> &'static str;

    /// Noun for its state in messages.
    fn noun(&self) -> &'static str {
        "state"
    }

    /// Why a folder may lack the exact state after a frame, for messages: which states are kept.
    fn why_states_are_missing(&self) -> &'static str {
        "state/ keeps those of the last two frames; `output.keep_states` keeps more"
    }

    /// Its kinds of files. With [`Keeps::Whole`] or [`Keeps::Changes`], the kind with the stage's own name holds the state.
    fn kinds(&self) -> &'static [FileKind];

    /// Whether this scene has files of a kind.
    fn writes(&self, _kind: &str) -> bool {
        true
    }

    /// Extension of its exact states, lower-case letters but not `json`: `state/base.0012.vdb`.
    fn state_extension(&self) -> &'static str {
        "vdb"
    }

    /// The kinds of its USD files that this scene has. Those of a kind share a manifest, which belongs to no single frame.
    fn usd_kinds(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// The settings that its frames depend on.
    ///
    /// # Errors
    /// An input that cannot be read.
    fn settings(&self) -> Result<Settings>;

    /// Those of its settings that determine the state before the first frame. If one of them changes, no frame can be kept.
    fn first_state_settings(&self, _settings: &Settings) -> Settings {
        Settings::new()
    }

    /// The stages whose frames it reads, all earlier in the scene's order.
    fn upstream(&self) -> &'static [&'static str] {
        &[]
    }

    /// Whether the exact states of all its frames are kept, so that a run can resume after any.
    fn keeps_every_state(&self) -> bool {
        false
    }

    /// Whether it reads the exact states of an upstream stage, not only its files: the states of all frames are then kept.
    fn reads_state_of(&self, _upstream: &str) -> bool {
        true
    }

    /// Whether its frames were written in another way by an earlier version, so that they must be made again.
    ///
    /// # Errors
    /// A damaged report.
    fn is_outdated(&self, _done: &DoneFrames) -> Result<bool> {
        Ok(false)
    }

    /// Whether a frame depends on the frames before it.
    fn has_memory(&self) -> bool {
        true
    }

    /// The files that it reads for a frame.
    fn reads(&self, _frame: i32) -> Reads {
        Reads::default()
    }

    /// What a later run can resume from after a frame.
    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::State
    }

    /// The setting that requires all frames to be made without gaps, if one does.
    fn needs_every_frame(&self) -> Option<&'static str> {
        None
    }

    /// Its volumes for `shot.usda`.
    fn volumes(&self) -> Vec<Volume> {
        Vec::new()
    }

    /// Its moving meshes or points for `shot.usda`, without frames.
    fn clips(&self) -> Vec<Clips<'_>> {
        Vec::new()
    }

    /// Its meshes that never change, for `shot.usda`.
    ///
    /// # Errors
    /// Files that can no longer be read; cancel.
    fn still_meshes(&self, _ctx: &Context) -> Result<Option<usd::StillMeshes>> {
        Ok(None)
    }
}

/// How a stage goes from frame to frame.
pub trait Stepping: Stage {
    /// The state that it carries from frame to frame.
    type State: Send;
    /// The result of a step, passed to the thread that writes its files.
    type Step: Send;
    /// The state that the writing thread carries from frame to frame.
    type Writer: Send;

    /// Checks the inputs of all frames up to `last` before the first is made; the frames of the upstream stages exist.
    ///
    /// # Errors
    /// Why the frames cannot be made.
    fn precheck(&self, _ctx: &Context, _upstream: &[DoneFrames], _last: i32) -> Result<()> {
        Ok(())
    }

    /// The state after a frame of `done`; with `None`, the state before the first frame.
    ///
    /// # Errors
    /// Files that differ from what was written; inputs from which the first state cannot be made.
    fn load(&self, ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<Self::State>;

    /// Advances the state to a frame from the one before it.
    ///
    /// # Errors
    /// Anything that prevents the frame from being made; cancel.
    fn step(
        &self,
        ctx: &Context,
        state: &mut Self::State,
        to: &StepTarget<'_>,
    ) -> Result<Stepped<Self::Step>>;

    /// The writer's initial state, for a state from which steps will follow.
    ///
    /// # Errors
    /// Errors of copying the state.
    fn writer(&self, ctx: &Context, state: &Self::State) -> Result<Self::Writer>;

    /// Whether a frame can be written even if the one before could not, because the writer carries nothing that depends on it.
    fn writes_frames_independently(&self) -> bool {
        false
    }

    /// Writes the result of a step; without `files` the frame is not wanted, and only updates the writer.
    ///
    /// # Errors
    /// Errors of the operating system or a library; the frame is then not done.
    fn write(
        &self,
        writer: &mut Self::Writer,
        step: Self::Step,
        files: Option<&mut FrameFiles>,
    ) -> Result<()>;
}

/// The frame that a step leads to.
#[derive(Clone, Copy)]
pub struct StepTarget<'a> {
    /// The frame.
    pub frame: i32,
    /// Hash of everything that the frame depends on; `None`: its files are not wanted.
    pub made_from: Option<&'a str>,
    /// The frames of the stages upstream, in the order of [`Stage::upstream`].
    pub upstream: &'a [DoneFrames],
}

/// The result of a step.
pub struct Stepped<T> {
    /// For the writing thread.
    pub step: T,
    /// The frame's report.
    pub report: Report,
}

/// The report of a frame: `report/base.0012.json`.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Results by name; names include units.
    pub results: Map<String, Value>,
    /// Durations of its phases.
    pub phases: Vec<PhaseTime>,
}

impl Report {
    /// A report of results, which must be a JSON object.
    pub(in crate::scene) fn new(results: Value, phases: Vec<PhaseTime>) -> Self {
        let Value::Object(results) = results else { unreachable!("results are a JSON object") };
        Self { results, phases }
    }
}

/// The files of a frame while they are being written.
pub struct FrameFiles<'a> {
    folder: &'a Path,
    stage: &'static str,
    state_extension: &'static str,
    /// The frame.
    pub frame: i32,
    /// Hash of everything that it depends on.
    pub made_from: &'a str,
    files: Vec<Written>,
    state: Option<Written>,
    /// Contents of the files, for the report: by kind, then by name of the prim or grid.
    contents: Map<String, Value>,
}

impl<'a> FrameFiles<'a> {
    /// No files yet, for a frame of a stage.
    pub(super) fn new(folder: &'a Path, stage: &dyn Stage, frame: i32, made_from: &'a str) -> Self {
        let (stage, state_extension) = (stage.name(), stage.state_extension());
        let (files, contents) = (Vec::new(), Map::new());
        Self { folder, stage, state_extension, frame, made_from, files, state: None, contents }
    }

    /// Writes a file of a kind atomically.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn save(&mut self, kind: &str, extension: &str, bytes: &[u8]) -> Result<()> {
        let path = format!("{kind}/{kind}.{:04}.{extension}", self.frame);
        atomic::write_bytes(&self.folder.join(&path), bytes)?;
        self.files.push(Written::new(path, bytes));
        Ok(())
    }

    /// Writes the USD file of a kind, with one mesh, at `fps` frames per second.
    ///
    /// # Errors
    /// What the operating system reports.
    pub(in crate::scene) fn save_clip(
        &mut self,
        kind: &str,
        fps: f64,
        mesh: &TriMesh,
        carried: &Carried<'_>,
    ) -> Result<()> {
        let mesh = usd::MeshFrame::of(kind, mesh, carried, usd::Shading::Smooth);
        self.save_usd(kind, usd::clip(kind, self.frame, fps, usd::Units::OWN, &[mesh]))
    }

    /// Writes a USD file of a kind.
    ///
    /// # Errors
    /// What the operating system reports.
    pub(in crate::scene) fn save_usd(&mut self, kind: &str, file: usd::File) -> Result<()> {
        self.describe(kind, file.contents());
        self.save(kind, usd::BINARY, &file.bytes(usd::Format::Binary)?)
    }

    /// Adds the contents of the files of a kind to the frame's report.
    pub(in crate::scene) fn describe(&mut self, kind: &str, contents: &[(String, usd::Contents)]) {
        let of_kind = self.contents.entry(kind).or_insert_with(|| Map::new().into());
        let Value::Object(of_kind) = of_kind else { unreachable!("an object was inserted") };
        for (name, usd::Contents { points, faces, extent }) in contents {
            let mut entry = Map::new();
            for (count, name) in [(points, "points"), (faces, "faces")] {
                count.iter().for_each(|count| _ = entry.insert(name.into(), (*count).into()));
            }
            entry.insert("extent_m".into(), serde_json::json!(extent));
            of_kind.insert(name.clone(), entry.into());
        }
    }

    /// Writes the exact state after the frame atomically.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn save_state(&mut self, bytes: &[u8]) -> Result<()> {
        let path = format!("state/{}.{:04}.{}", self.stage, self.frame, self.state_extension);
        atomic::write_bytes(&self.folder.join(&path), bytes)?;
        self.state = Some(Written::new(path, bytes));
        Ok(())
    }

    /// The files that were written, the exact state, and the contents of the files.
    pub(super) fn into_written(self) -> (Vec<Written>, Option<Written>, Map<String, Value>) {
        (self.files, self.state, self.contents)
    }
}

/// A volume in the files of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// The kind.
    pub kind: &'static str,
    /// Name of the prim.
    pub prim: &'static str,
    /// Its fields, each a grid in every file.
    pub fields: &'static [Field],
    /// Whether it is a guide: to be viewed, not rendered.
    pub is_guide: bool,
}
