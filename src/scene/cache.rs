//! The output folder: which frames are done, with which settings they were made, where a run can go on.

use std::fs::File;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::chain::Chain;
use super::own::{self, Own};
use super::settings::{self, Settings};
use super::stored::{STAGE, Stored};
use super::writer::Made;
use super::{BaseMode, FrameChoice, Inputs, Scene};
use crate::error::{Error, Result};
use crate::io::hash::Hasher;
use crate::io::manifest::Manifest;
use crate::io::{atomic, sealed};

/// Frames from one on were made with these settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Segment {
    from: i32,
    settings: Settings,
    /// Hash of the settings, and of the frame before as it was then.
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

/// With which settings a folder's frames were made: `state/base.json`.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Record {
    segments: Vec<Segment>,
}

/// An output folder, held by one run at a time.
pub(super) struct Cache {
    /// The frames that are done, those left out that are to be made again.
    pub stored: Stored,
    /// The files that are the folder's own.
    pub own: Own,
    record: Record,
    chain: Chain,
    /// Frames that are to be made again, removed by [`Cache::commit`].
    forgotten: Vec<Manifest>,
    /// Held until the run ends, however it ends.
    _lock: File,
}

impl Cache {
    /// Opens or makes a folder for a scene. With `from`, frames before that one are kept as they are, and all others are
    /// to be forgotten. Nothing of the folder is changed before [`Cache::commit`].
    ///
    /// # Errors
    /// A folder that cannot be made or written, that another run writes into, or that holds frames of other settings or
    /// inputs; files that are not its own in the way; a record that is damaged; no frame to go on from; frames that would
    /// leave a gap in a cache of changes.
    pub fn open(
        scene: &Scene,
        inputs: &Inputs,
        folder: &Path,
        frames: &FrameChoice,
        from: Option<i32>,
    ) -> Result<Self> {
        let settings = settings::of_base(scene, &inputs.seen)?;
        // What is refused leaves no folder behind; what another run did meanwhile is looked at again below.
        refuse_asked(scene, frames, from, &Stored::read(folder)?)?;
        Own::read(folder, Some(scene))?.refuse_foreign(scene, frames)?;
        make_folders(scene, folder)?;
        let lock = lock(folder)?;
        remove_unfinished(folder)?;
        let first = scene.shot.frames.first;
        let mut record: Record = sealed::read(&record_path(folder))?.unwrap_or_default();
        let mut stored = Stored::read(folder)?;
        refuse_asked(scene, frames, from, &stored)?;
        let own = Own::read(folder, Some(scene))?;
        own.refuse_foreign(scene, frames)?;
        let mut forgotten = Vec::new();
        match from {
            Some(from) if from > first => {
                refuse_other_layer(folder, from, &record, &settings)?;
                forgotten = stored.leave_out_from(from);
                record.segments.retain(|segment| segment.from < from);
                record.segments.push(Segment::new(from, settings, stored.manifest(from - 1)));
            }
            Some(_) => {
                forgotten = stored.leave_out_from(first);
                record.segments = vec![Segment::new(first, settings, None)];
            }
            None => match record.segments.last() {
                Some(last) => {
                    let changed = settings::changed(&last.settings, &settings);
                    // A sealed record may still be one that no run wrote.
                    if last.from < first {
                        let what = format!(
                            "says that frames from {} on were made, before the shot's first",
                            last.from
                        );
                        return Err(Error::file(record_path(folder), what));
                    }
                    if !changed.is_empty() {
                        return Err(other_settings(folder, &changed));
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
        let chain = Chain::new(scene, &inputs.seen, last.from, &last.seed);
        let mut cache = Self { stored, own, record, chain, forgotten, _lock: lock };
        cache.check_inputs(frames)?;
        Ok(cache)
    }

    /// Removes the frames that are to be made again, and says in the folder what it is for and which frames are begun.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn commit(&mut self, scene: &Scene, todo: &[i32]) -> Result<()> {
        for manifest in std::mem::take(&mut self.forgotten) {
            self.stored.remove(&manifest)?;
        }
        if let [first, .., last] | [first @ last] = todo {
            self.own.begin(*first, *last)?;
        }
        let path = record_path(self.stored.folder());
        if sealed::read(&path)?.as_ref() != Some(&self.record) {
            sealed::write(&path, &self.record)?;
        }
        self.own.write(own::SCENE, scene.to_toml_in(self.stored.folder()).as_bytes())
    }

    /// First frame that was made with the settings of now.
    pub fn own_from(&self) -> i32 {
        self.record.segments.last().map_or(i32::MIN, |segment| segment.from)
    }

    /// Refuses frames whose inputs have changed since. A last frame whose velocities can now be had from the frame after
    /// it is to be made again, if it is asked for.
    fn check_inputs(&mut self, asked: &FrameChoice) -> Result<()> {
        let own = self.own_from();
        let frames: Vec<i32> = self.stored.frames().filter(|frame| *frame >= own).collect();
        for frame in frames {
            let Some(manifest) = self.stored.manifest(frame).cloned() else { continue };
            if manifest.inputs != self.chain.at(frame)? {
                return Err(self.changed_inputs(frame, self.chain.files(frame)));
            }
            if manifest.next == self.chain.next(frame)? {
                continue;
            }
            match (self.stored.is_done(frame + 1), &manifest.next) {
                (false, _) if asked.contains(frame) => self.stored.leave_out(frame),
                // An earlier frazil did not look.
                (false, _) | (true, None) => {}
                (true, Some(_)) => return Err(self.changed_inputs(frame, self.chain.next_files(frame))),
            }
        }
        Ok(())
    }

    fn changed_inputs(&self, frame: i32, files: Vec<PathBuf>) -> Error {
        let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        let what = format!(
            "the inputs of frame {frame} have changed since it was made ({}): --from {frame} keeps the frames before it",
            names.join(" or ")
        );
        Error::file(self.stored.folder(), what)
    }

    /// Hash of what a frame is made from, and of what its velocities are besides.
    ///
    /// # Errors
    /// A file of a sequence that cannot be read.
    pub fn inputs(&mut self, frame: i32) -> Result<Made> {
        Ok(Made { from: self.chain.at(frame)?.to_string(), next: self.chain.next(frame)? })
    }
}

/// Refuses to keep frames of another layer.
fn refuse_other_layer(folder: &Path, from: i32, record: &Record, settings: &Settings) -> Result<()> {
    let Some(kept) = record.segments.iter().rev().find(|segment| segment.from < from) else { return Ok(()) };
    let changed = settings::changed(&settings::of_layer(&kept.settings), &settings::of_layer(settings));
    if changed.is_empty() {
        return Ok(());
    }
    let what = format!(
        "--from {from} cannot keep frames of another layer of snow ({}): choose another -o",
        changed.join(", ")
    );
    Err(Error::file(folder, what))
}

/// Refuses a `from` that cannot go on from the frame before it or that the asked frames have no part in, and frames that
/// changes could not be followed up to.
fn refuse_asked(scene: &Scene, frames: &FrameChoice, from: Option<i32>, stored: &Stored) -> Result<()> {
    let first = scene.shot.frames.first;
    if let Some(from) = from {
        refuse_from(frames, first, from, stored)?;
    }
    if !scene.output.base || scene.output.base_mode == BaseMode::Full {
        return Ok(());
    }
    let is_there = |frame: i32| stored.is_done(frame) && from.is_none_or(|from| frame < from);
    match (first..frames.last()).find(|frame| !is_there(*frame) && !frames.contains(*frame)) {
        None => Ok(()),
        Some(gap) => {
            let what = format!(
                "base_mode = \"delta\" needs every frame, but frame {gap} is neither there nor asked for"
            );
            Err(Error::file(stored.folder(), what))
        }
    }
}

fn refuse_from(frames: &FrameChoice, first: i32, from: i32, stored: &Stored) -> Result<()> {
    let refused = |what: String| Err(Error::file(stored.folder(), what));
    if frames.last() < from {
        let (low, high) = (frames.first(), frames.last());
        return refused(format!(
            "--from {from} makes nothing of --frames {low}-{high}: ask for frames from {from} on"
        ));
    }
    if from <= first {
        return Ok(());
    }
    let before = from - 1;
    if !stored.is_done(before) {
        return refused(format!("--from {from} needs frame {before}, which is not there"));
    }
    if stored.latest_layer(before..=before).is_none() {
        let kept: Vec<String> = stored
            .frames()
            .filter(|frame| stored.latest_layer(*frame..=*frame).is_some())
            .map(|frame| format!("--from {}", i64::from(frame) + 1))
            .collect();
        let ways = if kept.is_empty() { String::new() } else { format!("{}, ", kept.join(", ")) };
        return refused(format!(
            "--from {from} needs the exact layer after frame {before}, which the folder does not keep (`half` and \
             `base = []` keep the last ones only): {ways}--from {first} or another -o"
        ));
    }
    match frames.iter().find(|frame| *frame < from && !stored.is_done(*frame)) {
        Some(gap) => refused(format!(
            "frame {gap} is not there, and --from {from} keeps the frames before {from} as they are: ask for --frames from \
             {from} on"
        )),
        None => Ok(()),
    }
}

fn record_path(folder: &Path) -> PathBuf {
    folder.join("state").join(format!("{STAGE}.json"))
}

fn make_folders(scene: &Scene, folder: &Path) -> Result<()> {
    let output = &scene.output;
    let kinds = [
        ("base", output.base),
        ("removed", output.removed),
        ("objects", output.objects_usd || output.objects_ply),
    ];
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
            let why = Error::io(&path, "lock", error);
            log::warn!("{why}; nothing keeps another run from writing into this folder");
            Ok(file)
        }
        Ok(()) => Ok(file),
    }
}

/// Removes what a killed run had begun to write; the lock says that nobody writes now.
fn remove_unfinished(folder: &Path) -> Result<()> {
    for name in own::FOLDERS {
        // Folders of kinds that are not written need not be there.
        let Ok(entries) = std::fs::read_dir(folder.join(name)) else { continue };
        for entry in entries.filter_map(|entry| entry.ok()) {
            let part = entry.file_name();
            let finished = part.to_str().and_then(atomic::finished_name);
            if finished.is_some_and(|finished| own::is_own(name, finished)) {
                let path = entry.path();
                std::fs::remove_file(&path).map_err(|error| Error::io(path, "remove", error))?;
            }
        }
    }
    Ok(())
}

fn other_settings(folder: &Path, changed: &[String]) -> Error {
    let what = format!(
        "the folder holds frames made with other settings ({}): --from N keeps the frames before N, another -o starts anew",
        changed.join(", ")
    );
    Error::file(folder, what)
}
