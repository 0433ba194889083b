//! Hashes of a run's input files when they were read: the files must not change until the run ends.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use crate::error::{Error, Result};
use crate::io::files::hash;

/// Hashes of files by path, each of the bytes that were first used.
#[derive(Default)]
pub struct InputHashes(Mutex<HashMap<PathBuf, String>>);

impl InputHashes {
    /// Reads a file for use.
    ///
    /// # Errors
    /// What the operating system reports; other bytes than when this file was read before.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let bytes = crate::io::files::source::read(path)?;
        self.record(path, hash::of_bytes(&bytes))?;
        Ok(bytes)
    }

    /// Records the hash of a file that was read by other means.
    ///
    /// # Errors
    /// Another hash than when this file was read before.
    pub fn record(&self, path: &Path, hash: String) -> Result<()> {
        let mut known = self.0.lock().expect("no panic while it is locked");
        match known.get(path) {
            Some(before) if *before != hash => {
                Err(Error::file(path, "was changed while it was in use: run again when it stays as it is"))
            }
            Some(_) => Ok(()),
            None => {
                known.insert(path.to_path_buf(), hash);
                Ok(())
            }
        }
    }

    /// Runs a reader that opens the file itself: its content must be the same before and after.
    ///
    /// # Errors
    /// As [`InputHashes::record`]; errors of the reader.
    pub fn read_with<T>(&self, path: &Path, read: impl FnOnce() -> Result<T>) -> Result<T> {
        self.hash(path)?;
        let read = read()?;
        self.record(path, hash::of_file(path)?)?;
        Ok(read)
    }

    /// The hash of a file: of the bytes that were used, or of its current bytes, which then must be used.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn hash(&self, path: &Path) -> Result<String> {
        if let Some(hash) = self.0.lock().expect("no panic while it is locked").get(path) {
            return Ok(hash.clone());
        }
        let hash = hash::of_file(path)?;
        self.record(path, hash.clone())?;
        Ok(hash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_changes_between_two_reads_is_named() {
        let folder = std::env::temp_dir().join(format!("frazil-seen-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.obj");
        let hashes = InputHashes::default();
        std::fs::write(&path, "one").unwrap();
        let hash = hashes.hash(&path).unwrap();
        assert_eq!(hashes.read(&path).unwrap(), b"one");
        std::fs::write(&path, "two").unwrap();
        assert_eq!(hashes.hash(&path).unwrap(), hash, "what was used counts");
        let error = hashes.read(&path).unwrap_err().to_string();
        assert!(error.contains("a.obj") && error.contains("changed"), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
