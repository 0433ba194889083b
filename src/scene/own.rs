//! Which files of an output folder are its own: nothing else there is ever written over or removed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::stored::STAGE;
use super::{FrameChoice, Ground, Layer, Scene};
use crate::error::{Error, Result};
use crate::io::sequence::Pattern;
use crate::io::{atomic, hash, sealed};

/// Folders of what frames have, with the extensions of their files.
const KINDS: [(&str, &[&str]); 3] =
    [("base", &["vdb"]), ("removed", &["vdb"]), ("objects", &["usda", "ply"])];
/// The scene with its defaults.
pub(super) const SCENE: &str = "scene.toml";
/// The shot for programs that read USD.
pub(super) const SHOT: &str = "shot.usda";
/// What the clips of `objects/` share.
pub(super) const OBJECTS: &str = "objects/objects.manifest.usda";

/// What a folder's runs have written besides the records of frames: `state/files.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Files {
    /// First and last of the frames that runs have begun to write.
    frames: Option<[i32; 2]>,
    /// Hashes of the files that belong to no frame, by path: the content of now, then the one before while it is replaced.
    files: BTreeMap<String, Vec<String>>,
}

/// The files of a folder that are its own.
pub(super) struct Own {
    folder: PathBuf,
    record: Files,
    written: Option<Files>,
}

impl Own {
    /// Reads what a folder says of itself. A folder of an earlier frazil, with a record of its stage but none of its
    /// files, holds only its own: those of the scene's frames, where there is one.
    ///
    /// # Errors
    /// A record that is damaged.
    pub fn read(folder: &Path, scene: Option<&Scene>) -> Result<Self> {
        let folder = folder.to_path_buf();
        let written: Option<Files> = sealed::read(&path(&folder))?;
        let record = match &written {
            Some(files) => files.clone(),
            None if folder.join("state").join(format!("{STAGE}.json")).is_file() => {
                let there = [SCENE, SHOT, OBJECTS].into_iter().filter_map(|name| {
                    Some((name.to_string(), vec![hash::of_file(&folder.join(name)).ok()?]))
                });
                let frames = scene.map(|scene| [scene.shot.frames.first, scene.shot.frames.last]);
                Files { frames, files: there.collect() }
            }
            None => Files::default(),
        };
        Ok(Self { folder, record, written })
    }

    /// Refuses to begin frames, or to write files that belong to no frame, over files that are not the folder's own;
    /// inputs of the scene are not.
    ///
    /// # Errors
    /// The file that stands in the way.
    pub fn refuse_foreign(&self, scene: &Scene, frames: &FrameChoice) -> Result<()> {
        for input in inputs(scene) {
            if input.parent().is_some_and(|folder| self.holds(folder, &input)) {
                let what = "is an input of the scene and would be written over: choose another -o";
                return Err(Error::file(input, what));
            }
        }
        let new = hash::of_bytes(scene.to_toml_in(&self.folder).as_bytes());
        if is_same(&scene.path, &self.folder.join(SCENE)) && hash::of_file(&scene.path)? != new {
            let what = "is the scene that is read and would be written over: choose another -o";
            return Err(Error::file(&scene.path, what));
        }
        let output = &scene.output;
        let objects = output.usd && output.objects_usd;
        for (name, written) in [(SHOT, output.usd), (OBJECTS, objects)] {
            if written {
                self.refuse_changed(name, None)?;
            }
        }
        self.refuse_changed(SCENE, Some(&new))?;
        let asked = frames.first()..=frames.last();
        let known = |frame: i32| self.record.frames.is_some_and(|[low, high]| (low..=high).contains(&frame));
        let foreign = names(&self.folder)?
            .into_iter()
            .find(|(_, frame)| frame.is_some_and(|frame| asked.contains(&frame) && !known(frame)));
        foreign.map_or(Ok(()), |(path, _)| Err(self.foreign(&path)))
    }

    /// Refuses a file that is there and neither what was written nor, where given, what is to be written.
    fn refuse_changed(&self, name: &str, new: Option<&str>) -> Result<()> {
        let path = self.folder.join(name);
        if !path.exists() {
            return Ok(());
        }
        let there = hash::of_file(&path)?;
        let own = self.record.files.get(name).is_some_and(|hashes| hashes.contains(&there));
        if own || new == Some(there.as_str()) { Ok(()) } else { Err(self.foreign(name)) }
    }

    fn foreign(&self, name: &str) -> Error {
        let what = "is not what a run wrote here, or was changed since: move it away, or choose another -o";
        Error::file(self.folder.join(name), what)
    }

    /// Whether a path in a folder is one that runs write.
    fn holds(&self, folder: &Path, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        FOLDERS.into_iter().any(|kind| is_own(kind, &name) && is_same(folder, &self.folder.join(kind)))
    }

    /// Notes that frames are begun.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn begin(&mut self, first: i32, last: i32) -> Result<()> {
        let [low, high] = self.record.frames.unwrap_or([first, last]);
        self.record.frames = Some([low.min(first), high.max(last)]);
        self.save()
    }

    /// Writes a file that belongs to no frame, if it is not there with this content.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let (path, new) = (self.folder.join(name), hash::of_bytes(bytes));
        let hashes = self.record.files.entry(name.to_string()).or_default();
        if hashes.first() != Some(&new) {
            // Killed at any moment, the folder knows what is there as its own.
            hashes.retain(|hash| *hash != new);
            hashes.insert(0, new.clone());
            self.save()?;
        }
        if hash::of_file(&path).is_ok_and(|there| there == new) {
            return Ok(());
        }
        atomic::write_bytes(&path, bytes)
    }

    /// Forgets what files held before they were replaced: the run is over.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn finish(&mut self) -> Result<()> {
        self.record.files.values_mut().for_each(|hashes| hashes.truncate(1));
        self.save()
    }

    fn save(&mut self) -> Result<()> {
        if self.written.as_ref() != Some(&self.record) {
            sealed::write(&path(&self.folder), &self.record)?;
            self.written = Some(self.record.clone());
        }
        Ok(())
    }

    /// What keeps the files that belong to no frame from being what was written, by path; and how many there are.
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
        (self.record.files.len(), self.record.files.iter().filter_map(fault).collect())
    }
}

/// Whether two paths lead to the same file or folder.
fn is_same(a: &Path, b: &Path) -> bool {
    let there = |path| std::fs::canonicalize(path).ok();
    there(a).is_some_and(|a| there(b) == Some(a))
}

fn path(folder: &Path) -> PathBuf {
    folder.join("state").join("files.json")
}

/// Folders that runs write into, from the output folder.
pub(super) const FOLDERS: [&str; 6] = ["", "state", "report", "base", "removed", "objects"];

/// Whether runs write files of this name into this one of [`FOLDERS`].
pub(super) fn is_own(folder: &str, name: &str) -> bool {
    let alone = match folder {
        "" => [SCENE, SHOT].contains(&name),
        "state" => name == "files.json" || name == format!("{STAGE}.json"),
        kind => format!("{kind}/{name}") == OBJECTS,
    };
    alone || frame_of(folder, name).is_some()
}

/// The frame of a file in one of [`FOLDERS`], where its name is one that runs give to a frame's.
fn frame_of(folder: &str, name: &str) -> Option<i32> {
    let (before, extensions): (&str, &[&str]) = match folder {
        "state" => (STAGE, &["json", "vdb"]),
        "report" => ("", &["json"]),
        kind => KINDS.iter().find(|(known, _)| *known == kind).copied()?,
    };
    let rest = if before.is_empty() { name } else { name.strip_prefix(before)?.strip_prefix('.')? };
    let (number, extension) = rest.rsplit_once('.')?;
    let frame = number.parse::<i32>().ok().filter(|frame| format!("{frame:04}") == number)?;
    extensions.contains(&extension).then_some(frame)
}

/// All files that are there with names that runs give, from the folder, with their frames.
///
/// # Errors
/// A folder that cannot be read.
pub(super) fn names(folder: &Path) -> Result<BTreeMap<String, Option<i32>>> {
    let mut out = BTreeMap::new();
    for kind in FOLDERS {
        let path = folder.join(kind);
        let entries = match std::fs::read_dir(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            other => other.map_err(|error| Error::io(&path, "read", error))?,
        };
        for entry in entries {
            let name = entry.map_err(|error| Error::io(&path, "read", error))?.file_name();
            if let Some(name) = name.to_str().filter(|name| is_own(kind, name)) {
                let path = if kind.is_empty() { name.to_string() } else { format!("{kind}/{name}") };
                out.insert(path, frame_of(kind, name));
            }
        }
    }
    Ok(out)
}

/// The files that a scene reads; of sequences those of its own frames.
fn inputs(scene: &Scene) -> Vec<PathBuf> {
    let mut out = Vec::new();
    if let Some(Ground::Mesh(path)) = &scene.snow.ground {
        out.push(path.clone());
    }
    if let Layer::Top(path) | Layer::Grid(path) = &scene.snow.layer {
        out.push(path.clone());
    }
    for object in &scene.objects {
        let first = f64::from(scene.shot.frames.first) - object.offset;
        out.push(match Pattern::parse(&object.file) {
            Some(pattern) => pattern.path(first.floor() as i32),
            None => object.file.clone(),
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_runs_give_are_their_own() {
        for (folder, name) in [
            ("", "scene.toml"),
            ("state", "base.0001.vdb"),
            ("state", "base.-001.json"),
            ("report", "0012.json"),
            ("base", "base.123456.vdb"),
            ("objects", "objects.0001.ply"),
            ("objects", "objects.manifest.usda"),
        ] {
            assert!(is_own(folder, name), "{folder}/{name}");
        }
        for (folder, name) in [
            ("", "film.mkv"),
            ("", "base.0001.vdb"),
            ("state", "base.1.vdb"),
            ("report", "a.json"),
            ("base", "base.0001.obj"),
            ("objects", "hero.0001.ply"),
        ] {
            assert!(!is_own(folder, name), "{folder}/{name}");
        }
    }
}
