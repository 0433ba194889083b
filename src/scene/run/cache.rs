//! The frames of a stage in the output folder, the settings that they were made with, and which of them must be made again.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::chain::{FrameHashes, HashChain};
use super::done_frames::{DoneFrames, Resumable};
use super::settings::{self, Settings};
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::io::files::hash::Hasher;
use crate::io::records::checksummed;
use crate::io::records::input_hashes::InputHashes;
use crate::io::records::manifest::Manifest;
use crate::scene::FrameChoice;

/// The settings of all frames from `from` on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Segment {
    from: i32,
    settings: Settings,
    /// Hash of the settings, and of the files of the frame before `from` when the segment began.
    seed: String,
}

impl Segment {
    fn new(from: i32, settings: Settings, before: Option<&Manifest>) -> Self {
        let mut hasher = Hasher::default();
        settings.iter().for_each(|(key, value)| {
            hasher.add_text(key).add_text(value);
        });
        before.into_iter().flat_map(|manifest| manifest.files.iter().chain(&manifest.state)).for_each(
            |file| {
                hasher.add_text(&file.hash);
            },
        );
        Self { from, settings, seed: hasher.finish() }
    }
}

/// The settings that a stage's frames were made with: `state/base.json`.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Record {
    segments: Vec<Segment>,
}

/// The frames that a run is asked for.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    /// The shot's first frame.
    pub first: i32,
    /// The wanted frames.
    pub frames: &'a FrameChoice,
    /// The first frame to be made again; frames before it are kept as they are.
    pub from: Option<i32>,
}

impl Request<'_> {
    /// The request for a stage. `from` does not apply to a stage without memory that has no frames: all wanted frames are made.
    fn for_stage(self, stage: &dyn Stage, stored: &DoneFrames) -> Self {
        let is_new = !stage.has_memory() && stored.frames().next().is_none();
        Self { from: self.from.filter(|_| !is_new), ..self }
    }
}

/// The frames of a stage; only one run holds them at a time.
pub struct Cache {
    /// The frames that are done, except those to be made again.
    pub stored: DoneFrames,
    record: Record,
    chain: HashChain,
    /// Frames to be made again, which [`Cache::commit`] removes.
    to_remove: Vec<Manifest>,
}

impl Cache {
    /// Opens the frames of a stage. Changes nothing in the folder before [`Cache::commit`].
    ///
    /// # Errors
    /// A folder that cannot be read or that holds frames of other settings; a damaged record; no frame to resume from; a gap between
    /// frames, if the stage allows none.
    pub fn open(
        stage: &dyn Stage,
        input_hashes: &Arc<InputHashes>,
        folder: &Path,
        request: Request<'_>,
    ) -> Result<Self> {
        let settings = stage.settings()?;
        let path = record_path(folder, stage);
        let mut record: Record = checksummed::read(&path)?.unwrap_or_default();
        let mut stored = DoneFrames::read(folder, stage.name())?;
        check_request(stage, request, &stored)?;
        let Request { first, frames, from } = request.for_stage(stage, &stored);
        let from = if stage.is_outdated(&stored)? { Some(first) } else { from };
        let mut to_remove = Vec::new();
        match from {
            Some(from) if from > first => {
                refuse_other_start(stage, folder, from, &record, &settings)?;
                to_remove = stored.leave_out_from(from);
                record.segments.retain(|segment| segment.from < from);
                record.segments.push(Segment::new(from, settings, stored.manifest(from - 1)));
            }
            Some(_) => {
                to_remove = stored.leave_out_from(first);
                record.segments = vec![Segment::new(first, settings, None)];
            }
            // Without frames, a record is that of a run that ended before its first frame.
            None if stored.frames().next().is_none() => {
                record.segments = vec![Segment::new(first, settings, None)];
            }
            None => match record.segments.last() {
                Some(last) => {
                    let changed = settings::changed(&last.settings, &settings);
                    // No run writes such a record, but its checksum may be valid.
                    if last.from < first {
                        let what = format!(
                            "says that frames from {} on were made, before the shot's first",
                            last.from
                        );
                        return Err(Error::file(path, what));
                    }
                    if !changed.is_empty() {
                        return Err(other_settings(stage, folder, &changed));
                    }
                }
                None => record.segments.push(Segment::new(first, settings, None)),
            },
        }
        let last = record.segments.last().ok_or_else(|| Error::Internal("a record has no segment".into()))?;
        if let Some(gone) = frames.iter().find(|frame| *frame < last.from && !stored.is_done(*frame)) {
            let what = format!(
                "frame {gone} is gone or was never made, and the frames before {} were made with other settings: \
                 ask for --frames from {} on, choose another -o, or --from {first}",
                last.from, last.from
            );
            return Err(Error::file(folder, what));
        }
        let chain = HashChain::new(input_hashes, last.from, &last.seed);
        Ok(Self { stored, record, chain, to_remove })
    }

    /// Fails if a stage's frames, which this run reads but does not make, were made with other settings or inputs. `upstream` has the frames
    /// that they were made from.
    ///
    /// # Errors
    /// The changed settings, or the frame whose inputs have changed; a damaged record; an input that cannot be read.
    pub fn refuse_stale(
        stage: &dyn Stage,
        input_hashes: &Arc<InputHashes>,
        folder: &Path,
        reader: &str,
        upstream: &[DoneFrames],
    ) -> Result<()> {
        let stored = DoneFrames::read(folder, stage.name())?;
        let record: Record = checksummed::read(&record_path(folder, stage))?.unwrap_or_default();
        // Missing frames are reported elsewhere.
        let Some(last) = record.segments.last().filter(|_| stored.frames().next().is_some()) else {
            return Ok(());
        };
        let changed = settings::changed(&last.settings, &stage.settings()?);
        if !changed.is_empty() {
            return Err(stale(stage, folder, reader, &format!("other settings ({})", changed.join(", "))));
        }
        let chain = HashChain::new(input_hashes, last.from, &last.seed);
        let mut cache = Self { stored, record, chain, to_remove: Vec::new() };
        match cache.first_changed(stage, &FrameChoice::none(), upstream)? {
            None => Ok(()),
            Some(frame) => {
                let what = format!("other inputs from frame {frame} on ({})", input_names(stage, frame));
                Err(stale(stage, folder, reader, &what))
            }
        }
    }

    /// Removes the frames to be made again, and records the settings in the folder.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn commit(&mut self, stage: &dyn Stage) -> Result<()> {
        for manifest in std::mem::take(&mut self.to_remove) {
            self.stored.remove(&manifest)?;
        }
        let path = record_path(self.stored.folder(), stage);
        if checksummed::read(&path)?.as_ref() != Some(&self.record) {
            checksummed::write(&path, &self.record)?;
        }
        Ok(())
    }

    /// First frame of those made with the current settings.
    pub fn own_from(&self) -> i32 {
        self.record.segments.last().map_or(i32::MIN, |segment| segment.from)
    }

    /// The frames that the stage can resume from, in a shot that begins at frame `first`.
    pub fn resumable(&self, first: i32) -> Resumable<'_> {
        Resumable { first, own_from: self.own_from(), done: &self.stored }
    }

    /// Fails if the inputs of a frame have changed since it was made. If only the files of the coming frame that it reads have changed or
    /// appeared, and the frame is requested, it is left out, and so made again.
    ///
    /// # Errors
    /// The changed frame; a file that cannot be read.
    pub fn check_inputs(
        &mut self,
        stage: &dyn Stage,
        requested: &FrameChoice,
        upstream: &[DoneFrames],
    ) -> Result<()> {
        let Some(frame) = self.first_changed(stage, requested, upstream)? else { return Ok(()) };
        let what = format!(
            "the inputs of frame {frame} have changed since it was made ({}): --from {frame} keeps the frames before it",
            input_names(stage, frame)
        );
        Err(Error::file(self.stored.folder(), what))
    }

    /// The first frame with the current settings whose inputs have changed since it was made. Requested frames before it of which only the
    /// files of the coming frame have changed are left out.
    fn first_changed(
        &mut self,
        stage: &dyn Stage,
        requested: &FrameChoice,
        upstream: &[DoneFrames],
    ) -> Result<Option<i32>> {
        let own = self.own_from();
        // A frame whose upstream frames are not all done cannot be compared. If they are made in this run, it is compared afterwards.
        let is_comparable =
            |frame: &i32| *frame >= own && upstream.iter().all(|upstream| upstream.is_done(*frame));
        let frames: Vec<i32> = self.stored.frames().filter(is_comparable).collect();
        for frame in frames {
            let hashes = self.hashes(stage, frame, upstream)?;
            let Some(manifest) = self.stored.manifest(frame) else { continue };
            if manifest.inputs != hashes.inputs {
                return Ok(Some(frame));
            }
            if manifest.next != hashes.next && requested.contains(frame) {
                self.stored.leave_out(frame);
            }
        }
        Ok(None)
    }

    /// Hashes of a frame's inputs.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn hashes(&mut self, stage: &dyn Stage, frame: i32, upstream: &[DoneFrames]) -> Result<FrameHashes> {
        self.chain.at(stage, frame, &self.stored, upstream)
    }
}

/// Fails if the frames to be kept began with another first state.
fn refuse_other_start(
    stage: &dyn Stage,
    folder: &Path,
    from: i32,
    record: &Record,
    settings: &Settings,
) -> Result<()> {
    let Some(last_kept) = record.segments.iter().rev().find(|segment| segment.from < from) else {
        return Ok(());
    };
    let changed = settings::changed(
        &stage.first_state_settings(&last_kept.settings),
        &stage.first_state_settings(settings),
    );
    if changed.is_empty() {
        return Ok(());
    }
    let what = format!(
        "--from {from} cannot keep frames of another {} ({}): choose another -o",
        stage.noun(),
        changed.join(", ")
    );
    Err(Error::file(folder, what))
}

/// Checks a request.
///
/// # Errors
/// A `from` that cannot resume after the frame before it, or that lies beyond all requested frames; a gap between frames, if the stage
/// allows none.
pub(super) fn check_request(stage: &dyn Stage, request: Request<'_>, stored: &DoneFrames) -> Result<()> {
    let Request { first, frames, from } = request.for_stage(stage, stored);
    if let Some(from) = from {
        check_from(stage, frames, first, from, stored)?;
    }
    let Some(why) = stage.needs_every_frame() else { return Ok(()) };
    let is_there = |frame: i32| stored.is_done(frame) && from.is_none_or(|from| frame < from);
    match (first..frames.last()).find(|frame| !is_there(*frame) && !frames.contains(*frame)) {
        None => Ok(()),
        Some(gap) => {
            let what = format!("{why} needs every frame, but frame {gap} is neither there nor asked for");
            Err(Error::file(stored.folder(), what))
        }
    }
}

fn check_from(
    stage: &dyn Stage,
    frames: &FrameChoice,
    first: i32,
    from: i32,
    stored: &DoneFrames,
) -> Result<()> {
    let refused = |what: String| Err(Error::file(stored.folder(), what));
    if frames.last() < from {
        let (low, high) = (frames.first(), frames.last());
        return refused(format!(
            "--from {from} leaves nothing to make of --frames {low}-{high}: ask for frames from {from} on"
        ));
    }
    if from <= first {
        return Ok(());
    }
    let before = from - 1;
    if stage.has_memory() && !stored.is_done(before) {
        return refused(format!("--from {from} needs frame {before}, which does not exist"));
    }
    if stage.has_memory() && stored.latest_state(before..=before).is_none() {
        let kept: Vec<String> = stored
            .frames()
            .filter(|frame| *frame < frames.last() && stored.latest_state(*frame..=*frame).is_some())
            .map(|frame| format!("--from {}", i64::from(frame) + 1))
            .collect();
        let alternatives = if kept.is_empty() { String::new() } else { format!("{}, ", kept.join(", ")) };
        return refused(format!(
            "--from {from} needs the exact {} after frame {before}, which the folder does not keep ({}): \
             {alternatives}--from {first} or another -o",
            stage.noun(),
            stage.why_states_are_missing()
        ));
    }
    match frames.iter().find(|frame| *frame < from && !stored.is_done(*frame)) {
        Some(gap) => refused(format!(
            "frame {gap} does not exist, and --from {from} keeps the frames before {from} as they are: ask for --frames from \
             {from} on"
        )),
        None => Ok(()),
    }
}

fn record_path(folder: &Path, stage: &dyn Stage) -> PathBuf {
    folder.join("state").join(format!("{}.json", stage.name()))
}

/// Names of a frame's inputs, for messages.
fn input_names(stage: &dyn Stage, frame: i32) -> String {
    let mut names: Vec<String> =
        stage.reads(frame).files.iter().map(|file| file.display().to_string()).collect();
    names.extend(stage.upstream().iter().map(|upstream| format!("stage {upstream}")));
    names.join(" or ")
}

fn stale(stage: &dyn Stage, folder: &Path, reader: &str, made_with: &str) -> Error {
    let name = stage.name();
    let what = format!(
        "stage {reader} reads frames of stage {name} that were made with {made_with}: --stage {name},{reader} --from N \
         makes both again from frame N on, another -o starts anew"
    );
    Error::file(folder, what)
}

fn other_settings(stage: &dyn Stage, folder: &Path, changed: &[String]) -> Error {
    let what = format!(
        "the folder holds frames of stage {} made with other settings ({}): --from N keeps the frames before N, another \
         -o starts anew",
        stage.name(),
        changed.join(", ")
    );
    Error::file(folder, what)
}
