//! A hash of the inputs of each frame of a stage: of the settings, of every file that it reads, of the upstream frames and, for stages with
//! memory ([`Stage::has_memory`]), of the frames before it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::done_frames::DoneFrames;
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::io::files::hash::Hasher;
use crate::io::records::input_hashes::InputHashes;
use crate::io::records::manifest::{Manifest, Written};

/// Hashes of consecutive frames.
pub(super) struct HashChain {
    first: i32,
    /// The hash of the seed, then that of each frame requested so far.
    links: Vec<String>,
    input_hashes: Arc<InputHashes>,
}

/// Hashes of a frame's inputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameHashes {
    /// The settings, the files and upstream frames that it reads, and the frames before it.
    pub inputs: String,
    /// The files of the coming frame that it reads, if they exist; `None` if it reads no such files.
    pub next: Option<String>,
}

impl HashChain {
    /// A chain whose first link is for frame `first` and depends on `seed`.
    pub fn new(input_hashes: &Arc<InputHashes>, first: i32, seed: &str) -> Self {
        let mut start = Hasher::default();
        start.add_text(seed).add(&first.to_le_bytes());
        Self { first, links: vec![start.finish()], input_hashes: input_hashes.clone() }
    }

    /// The hashes of a frame; those of a frame before the first depend on the seed alone. If an upstream frame no longer exists, the hash in
    /// the stage's own record counts.
    ///
    /// # Errors
    /// A file that cannot be read; a frame that is neither done nor has all its inputs.
    pub fn at(
        &mut self,
        stage: &dyn Stage,
        frame: i32,
        own: &DoneFrames,
        upstream: &[DoneFrames],
    ) -> Result<FrameHashes> {
        let inputs = if stage.has_memory() {
            let wanted = (i64::from(frame) - i64::from(self.first)).max(-1) + 1;
            while (self.links.len() as i64) <= wanted {
                let next = self.first + (self.links.len() - 1) as i32;
                let before = self.links[self.links.len() - 1].clone();
                self.links.push(self.link(&before, stage, next, own, upstream)?);
            }
            self.links[wanted as usize].clone()
        } else {
            self.link(&self.links[0], stage, frame, own, upstream)?
        };
        Ok(FrameHashes { inputs, next: self.next(&stage.reads(frame).ahead)? })
    }

    fn link(
        &self,
        before: &str,
        stage: &dyn Stage,
        frame: i32,
        own: &DoneFrames,
        upstream: &[DoneFrames],
    ) -> Result<String> {
        let mut link = Hasher::default();
        link.add_text(before);
        for (name, stored) in stage.upstream().iter().zip(upstream) {
            let Some(manifest) = stored.manifest(frame) else {
                let recorded = own.manifest(frame).map(|manifest| manifest.inputs.clone());
                return recorded.ok_or_else(|| missing(stage, frame, name, stored.folder()));
            };
            // A file of changes depends on the frames before it, which the links of stages with memory already cover.
            if !stage.has_memory() {
                link.add_text(&manifest.inputs);
            }
            manifest.files.iter().chain(&manifest.state).for_each(|file| {
                link.add_text(&file.hash);
            });
        }
        for file in &stage.reads(frame).files {
            link.add_text(&self.input_hashes.hash(file)?);
        }
        Ok(link.finish())
    }

    fn next(&self, files: &[PathBuf]) -> Result<Option<String>> {
        if files.is_empty() {
            return Ok(None);
        }
        let mut hasher = Hasher::default();
        for file in files {
            let hash = if file.is_file() { self.input_hashes.hash(file)? } else { String::new() };
            hasher.add_text(&hash);
        }
        Ok(Some(hasher.finish()))
    }
}

/// The error for a stage's frame whose upstream frame, or a file of it, is missing.
pub(super) fn missing(stage: &dyn Stage, frame: i32, upstream: &str, folder: &Path) -> Error {
    let name = stage.name();
    let files = Manifest::read(folder, upstream, frame).ok().flatten().map(|manifest| manifest.files);
    let is_other = |file: &&Written| folder.join(&file.path).exists() && !file.is_there(folder);
    if let Some(file) = files.iter().flatten().find(is_other) {
        let fault = file.fault(folder).unwrap_or_default();
        let what = format!(
            "is not the file that was made, which frame {frame} of stage {name} needs (it {fault}): make stage {upstream} too"
        );
        return Error::file(folder.join(&file.path), what);
    }
    let what = format!(
        "frame {frame} of stage {name} needs that of stage {upstream}, which does not exist: make it too"
    );
    Error::file(folder, what)
}
