//! What each frame was made from: a hash of the settings and of every file that it and the frames before it read.

use std::path::PathBuf;
use std::sync::Arc;

use super::{Role, Scene};
use crate::error::Result;
use crate::io::hash::Hasher;
use crate::io::seen::Seen;
use crate::io::sequence::Pattern;

/// Hashes of the frames from a start on, each made from the one before it.
pub(super) struct Chain {
    first: i32,
    links: Vec<String>,
    sequences: Vec<(Pattern, f64)>,
    /// Whether velocities are written.
    looks_ahead: bool,
    seen: Arc<Seen>,
}

impl Chain {
    /// A chain whose first link is for frame `first` and depends on `seed`.
    pub fn new(scene: &Scene, seen: &Arc<Seen>, first: i32, seed: &str) -> Self {
        let moving = scene.objects.iter().filter(|object| object.role == Role::Collide);
        let sequences: Vec<(Pattern, f64)> =
            moving.filter_map(|object| Some((Pattern::parse(&object.file)?, object.offset))).collect();
        let mut start = Hasher::default();
        start.add_text(seed).add(&first.to_le_bytes());
        let looks_ahead = scene.output.objects_usd || scene.output.objects_ply;
        Self { first, links: vec![start.finish()], sequences, looks_ahead, seen: seen.clone() }
    }

    /// The hash of a frame; frames before the first have none.
    ///
    /// # Errors
    /// A file of a sequence that cannot be read.
    pub fn at(&mut self, frame: i32) -> Result<&str> {
        let wanted = (i64::from(frame) - i64::from(self.first)).max(0) as usize + 1;
        while self.links.len() <= wanted {
            let next = self.first + (self.links.len() - 1) as i32;
            let mut link = Hasher::default();
            link.add_text(&self.links[self.links.len() - 1]);
            for file in self.files(next) {
                link.add_text(&self.seen.hash(&file)?);
            }
            self.links.push(link.finish());
        }
        Ok(&self.links[wanted])
    }

    /// The files of sequences that a frame's step reads: all it needs for its interval of time.
    pub fn files(&self, frame: i32) -> Vec<PathBuf> {
        let mut out = Vec::new();
        for (pattern, offset) in &self.sequences {
            let at = |frame: i32| f64::from(frame) - offset;
            let from = if frame == self.first { at(frame) } else { at(frame - 1) };
            out.extend((from.floor() as i32..=at(frame).ceil() as i32).map(|number| pattern.path(number)));
        }
        out
    }

    /// Hash of the files that only a frame's velocities over the coming frame read, those counted that are there; none
    /// where nothing reads them.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn next(&self, frame: i32) -> Result<Option<String>> {
        if !self.looks_ahead || self.sequences.is_empty() {
            return Ok(None);
        }
        let mut hasher = Hasher::default();
        for file in self.next_files(frame) {
            if file.is_file() {
                hasher.add_text(&self.seen.hash(&file)?)
            } else {
                hasher.add_text("")
            };
        }
        Ok(Some(hasher.finish()))
    }

    /// The files of sequences that only a frame's velocities read.
    pub fn next_files(&self, frame: i32) -> Vec<PathBuf> {
        let number = |offset: &f64| (f64::from(frame) + 1.0 - offset).ceil() as i32;
        self.sequences.iter().map(|(pattern, offset)| pattern.path(number(offset))).collect()
    }
}
