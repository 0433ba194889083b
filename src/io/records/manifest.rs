//! Manifests: records of a frame's output, written after it. A frame is done if its manifest exists and matches.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::checksummed;
use crate::error::{Error, Result};
use crate::io::files::hash;

/// A file of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Its path relative to the output folder, with `/`.
    pub path: String,
    /// Its length.
    pub bytes: u64,
    /// Hash of its contents.
    pub hash: String,
}

/// What another run can resume from after a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Keeps {
    /// Its file contains everything.
    Whole,
    /// Its file contains the changes since the frame before.
    Changes,
    /// A separate file contains everything, as long as it is kept.
    State,
}

/// Whether a file belongs to a shot and has the contents that its frame's record states; reads it.
pub fn is_recorded(path: &Path) -> bool {
    let of_record = || {
        let path = std::path::absolute(path).ok()?;
        let (kind, folder) = (path.parent()?.file_name()?.to_str()?, path.parent()?.parent()?);
        let name = path.file_name()?.to_str()?;
        let frame = name.split('.').rev().find_map(|part| part.parse::<i32>().ok())?;
        let relative = format!("{kind}/{name}");
        let has_it = |stage: &String| {
            let manifest = Manifest::read(folder, stage, frame).ok().flatten();
            let files = manifest.map(|manifest| manifest.files).unwrap_or_default();
            files.iter().any(|file| file.path == relative && file.is_whole(folder))
        };
        Some(stages(folder, frame)?.iter().any(has_it))
    };
    of_record().unwrap_or(false)
}

/// The stages that have a record of a frame in a folder.
fn stages(folder: &Path, frame: i32) -> Option<Vec<String>> {
    let entries = std::fs::read_dir(folder.join("state")).ok()?;
    let stage = |entry: std::fs::DirEntry| {
        let name = entry.file_name();
        let stage = name.to_str()?.strip_suffix(&format!(".{frame:04}.json"))?;
        is_word(stage).then(|| stage.to_string())
    };
    Some(entries.filter_map(|entry| stage(entry.ok()?)).collect())
}

/// The inputs of a frame, and its files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Number of the frame.
    pub frame: i32,
    /// Hash of all settings and inputs that it depends on, including those of the frames before it.
    pub inputs: String,
    /// What another run can resume from.
    pub keeps: Keeps,
    /// Its files.
    pub files: Vec<Written>,
    /// The separate file that holds everything, for [`Keeps::State`]; it may have been removed since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<Written>,
    /// Hash of the source of its velocities over the coming frame, if that is a file of the coming frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<String>,
}

impl Written {
    /// A file of these bytes.
    pub fn new(path: String, bytes: &[u8]) -> Self {
        Self { path, bytes: bytes.len() as u64, hash: hash::of_bytes(bytes) }
    }

    /// Whether the file exists with its length.
    pub fn is_there(&self, folder: &Path) -> bool {
        std::fs::metadata(folder.join(&self.path))
            .is_ok_and(|file| file.is_file() && file.len() == self.bytes)
    }

    /// Whether the file exists with its contents; reads it.
    pub fn is_whole(&self, folder: &Path) -> bool {
        self.fault(folder).is_none()
    }

    /// How the file differs from what was written; reads it.
    pub fn fault(&self, folder: &Path) -> Option<String> {
        let path = folder.join(&self.path);
        let Ok(file) = std::fs::metadata(&path) else { return Some("is missing".into()) };
        if !file.is_file() || file.len() != self.bytes {
            return Some(format!("has {} bytes, not the {} that were written", file.len(), self.bytes));
        }
        match hash::of_file(&path) {
            Err(error) => Some(error.to_string()),
            Ok(hash) if hash == self.hash => None,
            Ok(_) => Some("is not the file that was written".into()),
        }
    }
}

impl Manifest {
    /// Path of the manifest of a stage's frame: `state/base.0012.json`.
    pub fn path(folder: &Path, stage: &str, frame: i32) -> PathBuf {
        folder.join("state").join(format!("{stage}.{frame:04}.json"))
    }

    /// Reads a frame's manifest; none if there is none.
    ///
    /// # Errors
    /// A manifest that is damaged, of a newer version or of another frame, or that names files which no frame has: the files that a record
    /// names are removed when its frame is computed again.
    pub fn read(folder: &Path, stage: &str, frame: i32) -> Result<Option<Self>> {
        let path = Self::path(folder, stage, frame);
        let Some(manifest): Option<Self> = checksummed::read(&path)? else { return Ok(None) };
        if manifest.frame != frame {
            return Err(Error::file(path, format!("is the record of frame {}", manifest.frame)));
        }
        let foreign = manifest.files.iter().find(|file| !is_of_frame(&file.path, frame));
        let is_state = |path: &str| {
            let extension = path.strip_prefix(&format!("state/{stage}.{frame:04}."));
            extension.is_some_and(|extension| is_word(extension) && extension != "json")
        };
        match foreign.or(manifest.state.as_ref().filter(|file| !is_state(&file.path))) {
            Some(foreign) => {
                Err(Error::file(path, format!("names a file that no frame has: {:?}", foreign.path)))
            }
            None => Ok(Some(manifest)),
        }
    }

    /// Writes the manifest, which marks the frame as done.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn write(&self, folder: &Path, stage: &str) -> Result<()> {
        checksummed::write(&Self::path(folder, stage, self.frame), self)
    }

    /// Its files of a kind: those in the folder of that name.
    pub fn files_of(&self, kind: &str) -> impl Iterator<Item = &Written> {
        self.files.iter().filter(move |file| file.path.split('/').next() == Some(kind))
    }

    /// Whether all its files exist with their lengths.
    pub fn files_are_there(&self, folder: &Path) -> bool {
        self.files.iter().all(|file| file.is_there(folder))
    }
}

/// Whether a text is a single lower-case word, as names of stages and extensions are.
fn is_word(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|letter| letter.is_ascii_lowercase())
}

/// Whether a path has the form of a frame's files: `base/base.0012.vdb`.
fn is_of_frame(path: &str, frame: i32) -> bool {
    path.split_once('/').is_some_and(|(kind, name)| {
        let extension = name.strip_prefix(&format!("{kind}.{frame:04}."));
        is_word(kind) && extension.is_some_and(is_word)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_files_of_its_own_number_in_folders_of_their_own_kind() {
        assert!(is_of_frame("base/base.0012.vdb", 12) && is_of_frame("objects/objects.-003.usda", -3));
        for foreign in [
            "../base.0012.vdb",
            "base/../base.0012.vdb",
            "/base/base.0012.vdb",
            "base/base.0013.vdb",
            "base.0012.vdb",
            "base/base.0012.",
            "base/removed.0012.vdb",
            "base/base.0012.vdb/../x",
            "",
            "/",
            "../../etc/passwd",
        ] {
            assert!(!is_of_frame(foreign, 12), "{foreign}");
        }
    }
}
