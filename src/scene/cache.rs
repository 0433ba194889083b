//! The output folder: which frames are done, with which settings they were made, where a run can go on.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::chain::Chain;
use super::settings::{self, Settings};
use super::{BaseMode, Inputs, Scene};
use crate::error::{Error, Result};
use crate::io::hash::Hasher;
use crate::io::manifest::{Manifest, Written};
use crate::io::{atomic, sealed};
use crate::snow::base_layer::Grids;
use crate::vdb::file;

/// The stage that is cached.
pub(super) const STAGE: &str = "base";

/// Frames from one on were made with these settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Segment {
    from: i32,
    settings: Settings,
}

/// With which settings a folder's frames were made: `state/base.json`.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Record {
    segments: Vec<Segment>,
}

/// An output folder, held by one run at a time.
pub(super) struct Cache<'a> {
    scene: &'a Scene,
    folder: PathBuf,
    record: Record,
    chain: Chain,
    /// Frames that are done, with their manifests.
    done: BTreeMap<i32, Manifest>,
    /// Held until the run ends, however it ends.
    _lock: File,
}

impl<'a> Cache<'a> {
    /// Opens or makes a folder for a scene. With `from`, frames before that one are kept as they are, and all others
    /// forgotten.
    ///
    /// # Errors
    /// A folder that cannot be made or written, that another run writes into, or that holds frames of other settings or
    /// inputs; a record that is damaged; no frame to go on from.
    pub fn open(scene: &'a Scene, inputs: &Inputs, folder: &Path, from: Option<i32>) -> Result<Self> {
        let settings = settings::of_base(scene, inputs)?;
        make_folders(scene, folder)?;
        let lock = lock(folder)?;
        remove_unfinished(folder)?;
        let first = scene.shot.frames.first;
        let mut record: Record = sealed::read(&record_path(folder))?.unwrap_or_default();
        let mut done = manifests(folder)?;
        match from {
            Some(from) if from > first => {
                if !done.get(&(from - 1)).is_some_and(|manifest| manifest.files_are_there(folder)) {
                    let what = format!("--from {from} needs frame {}, which is not there", from - 1);
                    return Err(Error::file(folder, what));
                }
                forget_from(folder, from, &mut done)?;
                record.segments.retain(|segment| segment.from < from);
                record.segments.push(Segment { from, settings });
            }
            Some(_) => {
                forget_from(folder, first, &mut done)?;
                record.segments = vec![Segment { from: first, settings }];
            }
            None => match record.segments.last() {
                Some(last) => {
                    let changed = settings::changed(&last.settings, &settings);
                    if !changed.is_empty() {
                        return Err(other_settings(folder, &changed));
                    }
                }
                None => record.segments.push(Segment { from: first, settings }),
            },
        }
        let last = record.segments.last().ok_or_else(|| Error::Internal("a record has no segment".into()))?;
        let chain = Chain::new(scene, last.from, &seed(last, done.get(&(last.from - 1))));
        sealed::write(&record_path(folder), &record)?;
        atomic::write_bytes(&folder.join("scene.toml"), scene.to_toml().as_bytes())?;
        let mut cache = Self { scene, folder: folder.to_path_buf(), record, chain, done, _lock: lock };
        cache.check_inputs()?;
        Ok(cache)
    }

    /// First frame that was made with the settings of now.
    fn own_from(&self) -> i32 {
        self.record.segments.last().map_or(i32::MIN, |segment| segment.from)
    }

    /// Refuses frames whose inputs have changed since; forgets those whose files are gone.
    fn check_inputs(&mut self) -> Result<()> {
        self.done.retain(|_, manifest| manifest.files_are_there(&self.folder));
        let frames: Vec<i32> = self.done.range(self.own_from()..).map(|(frame, _)| *frame).collect();
        for frame in frames {
            if self.done[&frame].inputs != *self.chain.at(frame)? {
                let files = self.chain.files(frame);
                let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
                let what = format!(
                    "the inputs of frame {frame} have changed since it was made ({}): --from {frame} keeps the frames before it",
                    names.join(" or ")
                );
                return Err(Error::file(&self.folder, what));
            }
        }
        Ok(())
    }

    /// Where it is.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether a frame is done.
    pub fn is_done(&self, frame: i32) -> bool {
        self.done.contains_key(&frame)
    }

    /// The frames that are done and hold a kind of file, ascending, with their files' paths.
    pub fn files(&self, kind: &str) -> Vec<(i32, String)> {
        let of_kind = |written: &&Written| written.path.starts_with(&format!("{kind}/"));
        self.done
            .iter()
            .filter_map(|(frame, manifest)| Some((*frame, manifest.files.iter().find(of_kind)?.path.clone())))
            .collect()
    }

    /// Adds a frame that a writer has finished.
    pub fn add(&mut self, manifest: Manifest) {
        self.done.insert(manifest.frame, manifest);
    }

    /// Hash of what a frame is made from.
    ///
    /// # Errors
    /// A file of a sequence that cannot be read.
    pub fn inputs(&mut self, frame: i32) -> Result<String> {
        Ok(self.chain.at(frame)?.to_string())
    }

    /// The latest frame in a range whose grids can be loaded.
    pub fn latest_state(&self, frames: std::ops::RangeInclusive<i32>) -> Option<i32> {
        if frames.is_empty() {
            return None;
        }
        let first = self.scene.shot.frames.first;
        match (self.scene.output.base_restarts(), self.scene.output.base_mode) {
            (true, BaseMode::Full) => self.done.range(frames).next_back().map(|(frame, _)| *frame),
            (true, BaseMode::Delta) => {
                let whole = (first..=*frames.end()).take_while(|frame| self.is_done(*frame)).last();
                whole.filter(|frame| frames.contains(frame))
            }
            (false, _) => frames.rev().find(|frame| {
                self.done.contains_key(frame) && state_path(&self.folder, *frame).is_file()
            }),
        }
    }

    /// The grids after a frame.
    ///
    /// # Errors
    /// A file that is not what its manifest says.
    pub fn load(&self, ctx: &crate::Context, frame: i32) -> Result<Grids> {
        if !self.scene.output.base_restarts() {
            return read_grids(&state_path(&self.folder, frame));
        }
        match self.scene.output.base_mode {
            BaseMode::Full => self.load_file(frame),
            BaseMode::Delta => {
                let first = self.scene.shot.frames.first;
                let mut grids = self.load_file(first)?;
                for later in first + 1..=frame {
                    ctx.check()?;
                    grids.apply_delta(ctx, &self.load_file(later)?)?;
                }
                Ok(grids)
            }
        }
    }

    fn load_file(&self, frame: i32) -> Result<Grids> {
        let written = self.done.get(&frame).and_then(|manifest| {
            manifest.files.iter().find(|written| written.path.starts_with("base/"))
        });
        let written = written.ok_or_else(|| Error::Internal(format!("frame {frame} has no base")))?;
        let path = self.folder.join(&written.path);
        if !written.is_whole(&self.folder) {
            return Err(Error::file(path, "is not the file that was written: remove it, and it is made again"));
        }
        read_grids(&path)
    }
}

fn read_grids(path: &Path) -> Result<Grids> {
    Grids::from_named(file::read(path)?).map_err(|error| match error {
        Error::Argument(what) => Error::file(path, what),
        other => other,
    })
}

/// The exact grids of a frame whose own files cannot be gone on from.
pub(super) fn state_path(folder: &Path, frame: i32) -> PathBuf {
    folder.join("state").join(format!("{STAGE}.{frame:04}.vdb"))
}

fn record_path(folder: &Path) -> PathBuf {
    folder.join("state").join(format!("{STAGE}.json"))
}

fn make_folders(scene: &Scene, folder: &Path) -> Result<()> {
    let output = &scene.output;
    let kinds = [("base", output.base), ("removed", output.removed), ("objects", output.objects)];
    let wanted = kinds.iter().filter(|(_, written)| *written).map(|(name, _)| *name);
    for name in ["", "state", "report"].into_iter().chain(wanted) {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    }
    Ok(())
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join("state").join(format!("{STAGE}.lock"));
    let file = File::options().create(true).append(true).open(&path);
    let file = file.map_err(|error| Error::io(&path, "write", error))?;
    match file.try_lock() {
        Err(std::fs::TryLockError::WouldBlock) => {
            Err(Error::file(folder, "another run writes into this folder: wait for it, or choose another -o"))
        }
        // A file system without locks is no reason to stop.
        Err(std::fs::TryLockError::Error(error)) => {
            log::debug!("{}: no lock ({error})", path.display());
            Ok(file)
        }
        Ok(()) => Ok(file),
    }
}

/// Removes what a killed run had begun to write; the lock says that nobody writes now.
fn remove_unfinished(folder: &Path) -> Result<()> {
    for name in ["", "state", "report", "base", "removed", "objects"] {
        // Folders of kinds that are not written need not be there.
        let Ok(entries) = std::fs::read_dir(folder.join(name)) else { continue };
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        for path in paths.filter(|path| path.extension().is_some_and(|extension| extension == atomic::PART)) {
            std::fs::remove_file(&path).map_err(|error| Error::io(path, "remove", error))?;
        }
    }
    Ok(())
}

/// The manifests of a folder, by frame.
fn manifests(folder: &Path) -> Result<BTreeMap<i32, Manifest>> {
    let state = folder.join("state");
    let entries = std::fs::read_dir(&state).map_err(|error| Error::io(&state, "read", error))?;
    let mut out = BTreeMap::new();
    for entry in entries {
        let name = entry.map_err(|error| Error::io(&state, "read", error))?.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix("base.")?.strip_suffix(".json"));
        let Some(frame) = number.and_then(|number| number.parse::<i32>().ok()) else { continue };
        if let Some(manifest) = Manifest::read(folder, STAGE, frame)? {
            if manifest.frame != frame {
                let path = Manifest::path(folder, STAGE, frame);
                return Err(Error::file(path, format!("is the record of frame {}", manifest.frame)));
            }
            out.insert(frame, manifest);
        }
    }
    Ok(out)
}

/// Removes the frames from one on: first what says that they are done, then their files.
fn forget_from(folder: &Path, from: i32, done: &mut BTreeMap<i32, Manifest>) -> Result<()> {
    for (frame, manifest) in done.split_off(&from) {
        let files = manifest.files.iter().map(|file| folder.join(&file.path));
        let state = state_path(folder, frame);
        for path in std::iter::once(Manifest::path(folder, STAGE, frame)).chain(files).chain([state]) {
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::io(path, "remove", error));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

/// What the first frame of a segment depends on: its settings, and the frame before it.
fn seed(segment: &Segment, before: Option<&Manifest>) -> String {
    let mut hasher = Hasher::default();
    segment.settings.iter().for_each(|(key, value)| {
        hasher.add_text(key).add_text(value);
    });
    before.into_iter().flat_map(|manifest| &manifest.files).for_each(|file| {
        hasher.add_text(&file.hash);
    });
    hasher.finish()
}

fn other_settings(folder: &Path, changed: &[String]) -> Error {
    let what = format!(
        "the folder holds frames made with other settings ({}): --from N keeps the frames before N, another -o starts anew",
        changed.join(", ")
    );
    Error::file(folder, what)
}
