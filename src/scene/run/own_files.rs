//! Knows which files of an output folder were written by runs; all others are never overwritten or removed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::done_frames::{file_names, parse_record_name};
use super::pipeline::Pipeline;
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::io::files::{atomic, hash};
use crate::io::records::checksummed;
use crate::io::usd;
use crate::scene::{FrameChoice, System};

/// The scene with its defaults.
pub(super) const SCENE: &str = "scene.toml";
/// File of a [`FolderRecord`].
const FILES: &str = "files.json";

/// What runs have written into a folder besides the records of frames: `state/files.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct FolderRecord {
    /// The stages that runs have started, by name.
    stages: BTreeMap<String, StartedStage>,
    /// Hashes of the files that belong to no frame, by path: the current content, then the previous one while it is being replaced.
    files: BTreeMap<String, Vec<String>>,
}

/// A stage that runs have started.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct StartedStage {
    /// Its folders, with the extensions of their files.
    kinds: BTreeMap<String, Vec<String>>,
    /// Extension of its exact states.
    state: String,
    /// First and last frame that runs have started to write.
    frames: Option<[i32; 2]>,
}

impl StartedStage {
    fn of(stage: &dyn Stage) -> Self {
        let extensions = |all: &[&str]| all.iter().map(|extension| extension.to_string()).collect();
        let kinds = stage.kinds().iter().map(|kind| (kind.name.to_string(), extensions(kind.extensions)));
        Self { kinds: kinds.collect(), state: stage.state_extension().to_string(), frames: None }
    }

    fn has_started(&self, frame: i32) -> bool {
        self.frames.is_some_and(|[low, high]| (low..=high).contains(&frame))
    }
}

/// The files of an output folder that runs have written.
pub(super) struct OwnFiles {
    folder: PathBuf,
    /// The folder's record, with the stages of the current run.
    known: FolderRecord,
    /// The record as it is on disk.
    written: Option<FolderRecord>,
}

impl OwnFiles {
    /// Reads a folder's own record; `stages` are those of the current run.
    ///
    /// # Errors
    /// A damaged record.
    pub fn read<'s>(folder: &Path, stages: impl Iterator<Item = &'s dyn Stage>) -> Result<Self> {
        let folder = folder.to_path_buf();
        let written: Option<FolderRecord> = checksummed::read(&folder.join("state").join(FILES))?;
        let mut known = written.clone().unwrap_or_default();
        for stage in stages {
            let frames = known.stages.remove(stage.name()).and_then(|started| started.frames);
            let started = StartedStage { frames, ..StartedStage::of(stage) };
            known.stages.insert(stage.name().to_string(), started);
        }
        Ok(Self { folder, known, written })
    }

    /// A folder without a record.
    pub fn unknown(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), known: FolderRecord::default(), written: None }
    }

    /// Its path.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The files that belong to no frame, by path relative to the folder.
    pub fn shot_files(&self) -> impl Iterator<Item = &str> {
        self.known.files.keys().map(String::as_str)
    }

    /// Fails if the run would overwrite a file that no run wrote, or an input of the scene, or if the folder holds a shot of another system.
    ///
    /// # Errors
    /// The file that would be overwritten; the other system.
    pub fn refuse_foreign(&self, pipeline: &Pipeline, frames: &FrameChoice) -> Result<()> {
        let system = pipeline.scene.system();
        let systems = self.known.stages.keys().filter_map(|stage| System::of_stage(stage));
        if let Some(other) = systems.into_iter().find(|other| *other != system) {
            let what = format!(
                "holds a shot of [{}], and this is one of [{}]: choose another -o",
                other.name(),
                system.name()
            );
            return Err(Error::file(&self.folder, what));
        }
        for input in pipeline.scene.files() {
            if input.parent().is_some_and(|folder| self.writes_to(folder, &input)) {
                let what = "is an input of the scene and would be overwritten: choose another -o";
                return Err(Error::file(input, what));
            }
        }
        let scene = pipeline.scene;
        let new = hash::of_bytes(scene.to_toml_in(&self.folder).as_bytes());
        if is_same(&scene.path, &self.folder.join(SCENE)) && hash::of_file(&scene.path)? != new {
            let what = "is the scene that is read and would be overwritten: choose another -o";
            return Err(Error::file(&scene.path, what));
        }
        if scene.output.usd {
            self.refuse_changed(SHOT_USD, None)?;
            self.refuse_changed(usd::SAMPLES, None)?;
            let kinds = pipeline.stages().flat_map(|stage| stage.usd_kinds());
            let of_kind = |kind| [usd::manifest_path(kind), usd::still_path(kind)];
            kinds.flat_map(of_kind).try_for_each(|name| self.refuse_changed(&name, None))?;
        }
        self.refuse_changed(SCENE, Some(&new))?;
        let requested = frames.first()..=frames.last();
        let is_foreign = |own: &FrameFile| {
            let is_started =
                self.known.stages.get(&own.stage).is_some_and(|started| started.has_started(own.frame));
            requested.contains(&own.frame) && !is_started
        };
        let names = self.names()?;
        let foreign = names.iter().find(|(_, frame)| frame.as_ref().is_some_and(is_foreign));
        foreign.map_or(Ok(()), |(path, _)| Err(self.foreign(path)))
    }

    /// Fails if a file exists that is neither what a run wrote nor `new`, the hash of what is about to be written.
    fn refuse_changed(&self, name: &str, new: Option<&str>) -> Result<()> {
        let path = self.folder.join(name);
        if !path.exists() {
            return Ok(());
        }
        let found = hash::of_file(&path)?;
        let own = self.known.files.get(name).is_some_and(|hashes| hashes.contains(&found));
        if own || new == Some(found.as_str()) { Ok(()) } else { Err(self.foreign(name)) }
    }

    fn foreign(&self, name: &str) -> Error {
        let what = "is not what a run wrote here, or was changed since: move it away, or choose another -o";
        Error::file(self.folder.join(name), what)
    }

    /// Whether runs write to a path in a folder.
    fn writes_to(&self, folder: &Path, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mut folders = self.folders().into_iter();
        folders.any(|kind| self.is_own(&kind, &name) && is_same(folder, &self.folder.join(kind)))
    }

    /// Fails unless a run has recorded that it will write these frames of a stage.
    ///
    /// # Errors
    /// The first frame that no run has begun.
    pub fn refuse_unprepared(&self, stage: &str, frames: &FrameChoice) -> Result<()> {
        let started = self.written.as_ref().and_then(|written| written.stages.get(stage));
        let is_new = |frame: &i32| !started.is_some_and(|started| started.has_started(*frame));
        match frames.iter().find(is_new) {
            None => Ok(()),
            Some(frame) => {
                let what = format!(
                    "was not prepared for frame {frame} of stage {stage}: run the same command with --prepare first"
                );
                Err(Error::file(&self.folder, what))
            }
        }
    }

    /// Records that frames of a stage will be written.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn record_started(&mut self, stage: &str, first: i32, last: i32) -> Result<()> {
        let started = self.known.stages.entry(stage.to_string()).or_default();
        let [low, high] = started.frames.unwrap_or([first, last]);
        started.frames = Some([low.min(first), high.max(last)]);
        self.save()
    }

    /// Writes a file that belongs to no frame, unless it already exists with this content.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let (path, new) = (self.folder.join(name), hash::of_bytes(bytes));
        let hashes = self.known.files.entry(name.to_string()).or_default();
        if hashes.first() != Some(&new) {
            // Recorded first, so that the file is recognised even if the run is killed after writing it.
            hashes.retain(|hash| *hash != new);
            hashes.insert(0, new.clone());
            self.save()?;
        }
        if hash::of_file(&path).is_ok_and(|found| found == new) {
            return Ok(());
        }
        atomic::write_bytes(&path, bytes)
    }

    /// Forgets the previous contents of replaced files, at the end of a run.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn finish(&mut self) -> Result<()> {
        self.known.files.values_mut().for_each(|hashes| hashes.truncate(1));
        self.save()
    }

    fn save(&mut self) -> Result<()> {
        if self.written.as_ref() != Some(&self.known) {
            checksummed::write(&self.folder.join("state").join(FILES), &self.known)?;
            self.written = Some(self.known.clone());
        }
        Ok(())
    }

    /// The number of files that belong to no frame, and the paths and faults of those that differ from what was written.
    pub fn faults(&self) -> (usize, Vec<(String, String)>) {
        let fault = |(name, hashes): (&String, &Vec<String>)| {
            let path = self.folder.join(name);
            match hash::of_file(&path) {
                _ if !path.exists() => None,
                Ok(hash) if hashes.contains(&hash) => None,
                Ok(_) => Some((name.clone(), "is not the file that was written".to_string())),
                Err(error) => Some((name.clone(), error.to_string())),
            }
        };
        (self.known.files.len(), self.known.files.iter().filter_map(fault).collect())
    }

    /// Folders that runs write into, relative to the output folder, which itself is "".
    fn folders(&self) -> Vec<String> {
        let kinds = self.known.stages.values().flat_map(|started| started.kinds.keys().cloned());
        ["", "state", "report"].into_iter().map(String::from).chain(kinds).collect()
    }

    /// Whether runs write files of this name into a folder.
    fn is_own(&self, folder: &str, name: &str) -> bool {
        let is_shot_file = match folder {
            "" => [SCENE, SHOT_USD, usd::SAMPLES].contains(&name) || self.known.files.contains_key(name),
            "state" => name == FILES || name.strip_suffix(".json").is_some_and(|name| self.has_stage(name)),
            kind => self.known.files.contains_key(&format!("{kind}/{name}")),
        };
        is_shot_file || self.frame_of(folder, name).is_some()
    }

    fn has_stage(&self, name: &str) -> bool {
        self.known.stages.contains_key(name)
    }

    /// The stage and frame of a file in a folder, if it is named like a frame's file.
    fn frame_of(&self, folder: &str, name: &str) -> Option<FrameFile> {
        let (before, rest) = name.split_once('.')?;
        let (number, extension) = rest.rsplit_once('.')?;
        let frame = number.parse::<i32>().ok().filter(|frame| format!("{frame:04}") == number)?;
        let stage = match folder {
            "state" => {
                let started = self.known.stages.get(before)?;
                (extension == "json" || extension == started.state).then_some(before)?
            }
            "report" => (extension == "json" && self.has_stage(before)).then_some(before)?,
            kind if kind == before => {
                let writes = |started: &StartedStage| {
                    started.kinds.get(kind).is_some_and(|known| known.iter().any(|known| known == extension))
                };
                self.known.stages.iter().find(|(_, started)| writes(started))?.0
            }
            _ => return None,
        };
        Some(FrameFile { stage: stage.to_string(), frame })
    }

    /// All existing files that are named like those of runs, by path relative to the folder; with the stage and frame of each that belongs to a frame.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn names(&self) -> Result<BTreeMap<String, Option<FrameFile>>> {
        let mut out = BTreeMap::new();
        for kind in self.folders() {
            for name in file_names(&self.folder.join(&kind))? {
                if self.is_own(&kind, &name) {
                    let path = if kind.is_empty() { name.clone() } else { format!("{kind}/{name}") };
                    out.insert(path, self.frame_of(&kind, &name));
                }
            }
        }
        Ok(out)
    }

    /// As [`OwnFiles::names`], with the records of these stages even if the folder's record does not list the stages.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn names_of(&self, stages: &[String]) -> Result<BTreeSet<String>> {
        let is_of = |name: &String| {
            parse_record_name(name).is_some_and(|(stage, _)| stages.iter().any(|known| known == stage))
        };
        let records = file_names(&self.folder.join("state"))?.into_iter().filter(is_of);
        Ok(self.names()?.into_keys().chain(records.map(|name| format!("state/{name}"))).collect())
    }

    /// Removes files that a killed run left unfinished; no other run may be writing.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn remove_unfinished(&self) -> Result<()> {
        for kind in self.folders() {
            for part in file_names(&self.folder.join(&kind))? {
                if atomic::finished_name(&part).is_some_and(|finished| self.is_own(&kind, finished)) {
                    let path = self.folder.join(&kind).join(&part);
                    std::fs::remove_file(&path).map_err(|error| Error::io(path, "remove", error))?;
                }
            }
        }
        Ok(())
    }

    /// The stages that `files.json` lists, and all others that have records of frames in `state/`.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn recorded_stages(&self) -> Result<Vec<String>> {
        let names = file_names(&self.folder.join("state"))?;
        let of_records = names.iter().filter_map(|name| Some(parse_record_name(name)?.0.to_string()));
        let all: BTreeSet<String> = self.known.stages.keys().cloned().chain(of_records).collect();
        Ok(all.into_iter().collect())
    }
}

/// A file of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FrameFile {
    /// The stage that writes it.
    pub stage: String,
    /// Which frame.
    pub frame: i32,
}

/// Whether two paths lead to the same file or folder.
fn is_same(a: &Path, b: &Path) -> bool {
    let canonical = |path| std::fs::canonicalize(path).ok();
    canonical(a).is_some_and(|a| canonical(b) == Some(a))
}

/// Name of the file that describes the shot to programs that read USD.
pub(in crate::scene::run) const SHOT_USD: &str = "shot.usda";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_own_if_named_like_those_of_runs() {
        let started = |kinds: &[(&str, &[&str])], state: &str| StartedStage {
            kinds: kinds
                .iter()
                .map(|(kind, all)| (kind.to_string(), all.iter().map(|name| name.to_string()).collect()))
                .collect(),
            state: state.into(),
            frames: None,
        };
        let stages = BTreeMap::from([
            ("base".to_string(), started(&[("base", &["vdb"])], "vdb")),
            ("objects".to_string(), started(&[("objects", &["usda", "ply"])], "txt")),
        ]);
        let files = BTreeMap::from([("objects/objects.manifest.usda".to_string(), Vec::new())]);
        let own = OwnFiles { folder: PathBuf::new(), known: FolderRecord { stages, files }, written: None };
        for (folder, name) in [
            ("", "scene.toml"),
            ("state", "files.json"),
            ("state", "base.json"),
            ("state", "base.0001.vdb"),
            ("state", "base.-001.json"),
            ("state", "objects.0001.txt"),
            ("report", "base.0012.json"),
            ("base", "base.123456.vdb"),
            ("objects", "objects.0001.ply"),
            ("objects", "objects.manifest.usda"),
        ] {
            assert!(own.is_own(folder, name), "{folder}/{name}");
        }
        for (folder, name) in [
            ("", "film.mkv"),
            ("", "base.0001.vdb"),
            ("state", "grains.json"),
            ("state", "base.1.vdb"),
            ("state", "objects.0001.vdb"),
            ("report", "a.json"),
            ("report", "0012.json"),
            ("base", "base.0001.obj"),
            ("objects", "hero.0001.ply"),
            ("objects", "objects.other.usda"),
        ] {
            assert!(!own.is_own(folder, name), "{folder}/{name}");
        }
    }
}
