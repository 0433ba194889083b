//! The output folder: which frames are done, with which settings they were made, where a run can go on.

use std::fs::File;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::chain::Chain;
use super::settings::{self, Settings};
use super::stored::{STAGE, Stored};
use super::{BaseMode, FrameChoice, Scene};
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
        before.into_iter().flat_map(|manifest| &manifest.files).for_each(|file| {
            hasher.add_text(&file.hash);
        });
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
    /// The frames that are done.
    pub stored: Stored,
    record: Record,
    chain: Chain,
    /// Held until the run ends, however it ends.
    _lock: File,
}

impl Cache {
    /// Opens or makes a folder for a scene. With `from`, frames before that one are kept as they are, and all others
    /// forgotten.
    ///
    /// # Errors
    /// A folder that cannot be made or written, that another run writes into, or that holds frames of other settings or
    /// inputs; a record that is damaged; no frame to go on from; frames that would leave a gap in a cache of changes.
    pub fn open(scene: &Scene, folder: &Path, frames: &FrameChoice, from: Option<i32>) -> Result<Self> {
        let settings = settings::of_base(scene)?;
        // What is refused leaves no folder behind; what another run did meanwhile is looked at again below.
        refuse_asked(scene, frames, from, &Stored::read(folder)?)?;
        make_folders(scene, folder)?;
        let lock = lock(folder)?;
        remove_unfinished(folder)?;
        let first = scene.shot.frames.first;
        let mut record: Record = sealed::read(&record_path(folder))?.unwrap_or_default();
        let mut stored = Stored::read(folder)?;
        refuse_asked(scene, frames, from, &stored)?;
        match from {
            Some(from) if from > first => {
                refuse_other_layer(folder, from, &record, &settings)?;
                stored.forget_from(from)?;
                record.segments.retain(|segment| segment.from < from);
                record.segments.push(Segment::new(from, settings, stored.manifest(from - 1)));
            }
            Some(_) => {
                stored.forget_from(first)?;
                record.segments = vec![Segment::new(first, settings, None)];
            }
            None => match record.segments.last() {
                Some(last) => {
                    let changed = settings::changed(&last.settings, &settings);
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
                "frame {gone} was made with other settings and is gone: choose another -o, or --from {first}"
            );
            return Err(Error::file(folder, what));
        }
        let chain = Chain::new(scene, last.from, &last.seed);
        sealed::write(&record_path(folder), &record)?;
        atomic::write_bytes(&folder.join("scene.toml"), scene.to_toml_in(folder).as_bytes())?;
        let mut cache = Self { stored, record, chain, _lock: lock };
        cache.check_inputs()?;
        Ok(cache)
    }

    /// First frame that was made with the settings of now.
    fn own_from(&self) -> i32 {
        self.record.segments.last().map_or(i32::MIN, |segment| segment.from)
    }

    /// Refuses frames whose inputs have changed since.
    fn check_inputs(&mut self) -> Result<()> {
        let own = self.own_from();
        for frame in self.stored.frames().filter(|frame| *frame >= own) {
            let made_from = self.stored.manifest(frame).map(|manifest| manifest.inputs.as_str());
            if made_from != Some(self.chain.at(frame)?) {
                let files = self.chain.files(frame);
                let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
                let what = format!(
                    "the inputs of frame {frame} have changed since it was made ({}): --from {frame} keeps the frames before it",
                    names.join(" or ")
                );
                return Err(Error::file(self.stored.folder(), what));
            }
        }
        Ok(())
    }

    /// Hash of what a frame is made from.
    ///
    /// # Errors
    /// A file of a sequence that cannot be read.
    pub fn inputs(&mut self, frame: i32) -> Result<String> {
        Ok(self.chain.at(frame)?.to_string())
    }
}

/// Keys that make the layer before the first frame: what was kept cannot go on as another layer.
const LAYER: [&str; 6] = ["shot.frames", "snow.ground", "snow.area", "snow.depth", "snow.top", "snow.cell"];

/// Refuses to keep frames of another layer.
fn refuse_other_layer(folder: &Path, from: i32, record: &Record, settings: &Settings) -> Result<()> {
    let Some(kept) = record.segments.iter().rev().find(|segment| segment.from < from) else { return Ok(()) };
    let of_layer = |all: &Settings| -> Settings {
        LAYER.iter().filter_map(|key| Some((key.to_string(), all.get(*key)?.clone()))).collect()
    };
    let changed = settings::changed(&of_layer(&kept.settings), &of_layer(settings));
    if changed.is_empty() {
        return Ok(());
    }
    let what = format!(
        "--from {from} cannot keep frames of another layer of snow ({}): choose another -o",
        changed.join(", ")
    );
    Err(Error::file(folder, what))
}

/// Refuses a `from` without the frame before it, and frames that changes could not be followed up to.
fn refuse_asked(scene: &Scene, frames: &FrameChoice, from: Option<i32>, stored: &Stored) -> Result<()> {
    let first = scene.shot.frames.first;
    if let Some(from) = from.filter(|from| *from > first && !stored.is_done(from - 1)) {
        let what = format!("--from {from} needs frame {}, which is not there", from - 1);
        return Err(Error::file(stored.folder(), what));
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
            log::warn!(
                "{}: cannot be locked ({error}): see to it that no other run writes into this folder",
                path.display()
            );
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

fn other_settings(folder: &Path, changed: &[String]) -> Error {
    let what = format!(
        "the folder holds frames made with other settings ({}): --from N keeps the frames before N, another -o starts anew",
        changed.join(", ")
    );
    Error::file(folder, what)
}
