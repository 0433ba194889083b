//! The frames of a stage that are done, and the files from which the state after one of them can be read.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::io::records::checksummed;
use crate::io::records::manifest::{Keeps, Manifest, Written};

/// Key of a frame's report: the contents of its files, by kind, then by name of the prim or grid.
pub(super) const CONTENTS: &str = "contents";

/// The frames of a stage that are done in a folder, with their records.
pub struct DoneFrames {
    folder: PathBuf,
    stage: String,
    done: BTreeMap<i32, Manifest>,
}

impl DoneFrames {
    /// Reads the records of a stage in a folder. Frames whose files are missing or have another length are not done; a folder without
    /// records has no frames.
    ///
    /// # Errors
    /// A folder that cannot be read; a record that is damaged or of a newer version.
    pub fn read(folder: &Path, stage: &str) -> Result<Self> {
        let mut done = BTreeMap::new();
        for name in file_names(&folder.join("state"))? {
            let Some((_, frame)) = parse_record_name(&name).filter(|(of, _)| *of == stage) else { continue };
            let manifest = Manifest::read(folder, stage, frame)?;
            let manifest = manifest.filter(|manifest| manifest.files_are_there(folder));
            done.extend(manifest.map(|manifest| (frame, manifest)));
        }
        Ok(Self { folder: folder.to_path_buf(), stage: stage.to_string(), done })
    }

    /// Their folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether a frame is done.
    pub fn is_done(&self, frame: i32) -> bool {
        self.done.contains_key(&frame)
    }

    /// The frames that are done, ascending.
    pub fn frames(&self) -> impl Iterator<Item = i32> + '_ {
        self.done.keys().copied()
    }

    /// The record of a frame that is done.
    pub(super) fn manifest(&self, frame: i32) -> Option<&Manifest> {
        self.done.get(&frame)
    }

    /// Adds a frame that was written.
    pub(super) fn add(&mut self, manifest: Manifest) {
        self.done.insert(manifest.frame, manifest);
    }

    /// The files of a kind, ascending by frame, with their paths relative to the folder.
    pub fn files(&self, kind: &str) -> Vec<(i32, String)> {
        let of_frame = |(frame, manifest): (&i32, &Manifest)| -> Vec<(i32, String)> {
            manifest.files_of(kind).map(|written| (*frame, written.path.clone())).collect()
        };
        self.done.iter().flat_map(of_frame).collect()
    }

    /// Leaves out the frames from `from` on, as if they were not done; their files remain.
    pub(super) fn leave_out_from(&mut self, from: i32) -> Vec<Manifest> {
        self.done.split_off(&from).into_values().collect()
    }

    /// Leaves out a frame.
    pub(super) fn leave_out(&mut self, frame: i32) {
        self.done.remove(&frame);
    }

    /// Removes the files of a frame that was left out, its record first.
    ///
    /// # Errors
    /// What the operating system reports.
    pub(super) fn remove(&self, manifest: &Manifest) -> Result<()> {
        let files = manifest.files.iter().map(|file| self.folder.join(&file.path));
        let state = manifest.state.iter().map(|state| self.folder.join(&state.path));
        let record = Manifest::path(&self.folder, &self.stage, manifest.frame);
        for path in std::iter::once(record).chain(files).chain(state) {
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::io(path, "remove", error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The latest frame in a range whose state can be read.
    pub fn latest_state(&self, frames: RangeInclusive<i32>) -> Option<i32> {
        if frames.is_empty() {
            return None;
        }
        let (mut latest, mut previous) = (None, None);
        for (&frame, manifest) in self.done.range(..=frames.end()) {
            let is_readable = match manifest.keeps {
                Keeps::Whole => true,
                Keeps::Changes => previous == Some(frame - 1),
                Keeps::State => manifest.state.as_ref().is_some_and(|state| state.is_there(&self.folder)),
            };
            if is_readable {
                previous = Some(frame);
                latest = previous.filter(|frame| frames.contains(frame)).or(latest);
            }
        }
        latest
    }

    /// Whether a frame stores only its changes.
    pub fn keeps_changes(&self, frame: i32) -> bool {
        self.done.get(&frame).is_some_and(|manifest| manifest.keeps == Keeps::Changes)
    }

    /// The frames whose files make up the state after a frame: the last whole one, and those after it, which store changes.
    ///
    /// # Errors
    /// A missing frame.
    pub fn frames_of_state(&self, frame: i32) -> Result<RangeInclusive<i32>> {
        let whole = (0..).map(|back| frame - back).find(|&frame| !self.keeps_changes(frame));
        let whole = whole.filter(|whole| self.is_done(*whole));
        let missing = || Error::file(&self.folder, format!("frame {frame} cannot be read from its files"));
        Ok(whole.ok_or_else(missing)?..=frame)
    }

    /// The report of a frame that is done; `None` if it is gone.
    ///
    /// # Errors
    /// A report that differs from what was written.
    pub fn report(&self, frame: i32) -> Result<Option<Value>> {
        let path = self.folder.join("report").join(format!("{}.{frame:04}.json", self.stage));
        let bytes = match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            other => other.map_err(|error| Error::io(&path, "read", error))?,
        };
        let report = serde_json::from_slice(&bytes).ok().filter(|_| checksummed::is_stamped(&bytes));
        report.map(Some).ok_or_else(|| Error::file(path, "is not the report that was written"))
    }

    /// The contents of a frame's files of a kind, by prim or grid, from the frame's report. `None` if it has none, as in reports of frazil 0.1.
    ///
    /// # Errors
    /// As [`DoneFrames::report`].
    pub fn contents(&self, frame: i32, kind: &str) -> Result<Option<Value>> {
        let report = self.report(frame)?;
        Ok(report.and_then(|report| Some(report.get(CONTENTS)?.get(kind)?.clone())))
    }

    /// The file with the state after a frame, or with the frame's changes; its content is verified.
    ///
    /// # Errors
    /// A missing frame; a file that differs from what was written.
    pub fn state_file(&self, frame: i32) -> Result<PathBuf> {
        let missing = || Error::file(&self.folder, format!("frame {frame} does not exist"));
        let manifest = self.done.get(&frame).ok_or_else(missing)?;
        let written: Option<&Written> = match manifest.keeps {
            Keeps::State => manifest.state.as_ref(),
            Keeps::Whole | Keeps::Changes => manifest.files_of(&self.stage).next(),
        };
        self.verified(written.ok_or_else(missing)?)
    }

    /// Resumes from the exact state after a frame.
    ///
    /// # Errors
    /// As [`DoneFrames::state_file`]; errors of `resume`, with the name of the file.
    pub fn resume<T>(&self, frame: i32, resume: impl FnOnce(&[u8]) -> Result<T>) -> Result<T> {
        let path = self.state_file(frame)?;
        let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
        resume(&bytes).map_err(|error| Error::file(path, error.to_string()))
    }

    /// A frame's file of a kind; its content is verified.
    ///
    /// # Errors
    /// A missing frame or one without such a file; a file that differs from what was written.
    pub fn file(&self, frame: i32, kind: &str) -> Result<PathBuf> {
        self.find(frame, kind, None)
    }

    /// A frame's file of a kind with an extension; its content is verified.
    ///
    /// # Errors
    /// As [`DoneFrames::file`].
    pub fn file_with(&self, frame: i32, kind: &str, extension: &str) -> Result<PathBuf> {
        self.find(frame, kind, Some(extension))
    }

    /// Whether a frame has a file of a kind with an extension.
    pub fn has_file(&self, frame: i32, kind: &str, extension: &str) -> bool {
        let manifest = self.done.get(&frame);
        manifest
            .is_some_and(|manifest| manifest.files_of(kind).any(|written| has_extension(written, extension)))
    }

    fn find(&self, frame: i32, kind: &str, extension: Option<&str>) -> Result<PathBuf> {
        let is_wanted = |written: &&Written| extension.is_none_or(|wanted| has_extension(written, wanted));
        let manifest = self.done.get(&frame);
        let written = manifest.and_then(|manifest| manifest.files_of(kind).find(is_wanted));
        let missing = || {
            let of = extension.map_or(String::new(), |extension| format!(".{extension} "));
            Error::file(&self.folder, format!("frame {frame} has no {of}file in {kind}/"))
        };
        self.verified(written.ok_or_else(missing)?)
    }

    /// The path of a file, after its content was compared with what was written.
    fn verified(&self, written: &Written) -> Result<PathBuf> {
        let path = self.folder.join(&written.path);
        match written.fault(&self.folder) {
            Some(fault) => Err(Error::file(path, format!("{fault}: remove it, and it is made again"))),
            None => Ok(path),
        }
    }
}

/// Names of the files in a folder; none if it does not exist.
///
/// # Errors
/// A folder that cannot be read.
pub(super) fn file_names(folder: &Path) -> Result<Vec<String>> {
    let refused = |error| Error::io(folder, "read", error);
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(refused)?,
    };
    let mut out = Vec::new();
    for entry in entries {
        out.extend(entry.map_err(refused)?.file_name().into_string().ok());
    }
    Ok(out)
}

/// The stage and frame of a record by its file name in `state/`, such as `base.0012.json`.
pub(super) fn parse_record_name(name: &str) -> Option<(&str, i32)> {
    let (stage, number) = name.strip_suffix(".json")?.split_once('.')?;
    Some((stage, number.parse().ok()?))
}

/// The frames that a stage can resume from.
#[derive(Clone, Copy)]
pub struct Resumable<'a> {
    /// The shot's first frame.
    pub first: i32,
    /// First frame of those made with the current settings.
    pub own_from: i32,
    /// The frames that are done.
    pub done: &'a DoneFrames,
}

fn has_extension(written: &Written, extension: &str) -> bool {
    Path::new(&written.path).extension().is_some_and(|own| own == extension)
}
