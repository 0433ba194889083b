//! What each frame was made from: a hash of the settings and of every file that it and the frames before it read.

use std::collections::HashMap;
use std::path::PathBuf;

use super::{Role, Scene};
use crate::error::Result;
use crate::io::hash::{self, Hasher};
use crate::io::sequence::Pattern;

/// Hashes of the frames from a start on, each made from the one before it.
pub(super) struct Chain {
    first: i32,
    links: Vec<String>,
    sequences: Vec<(Pattern, f64)>,
    contents: HashMap<PathBuf, String>,
}

impl Chain {
    /// A chain whose first link is for frame `first` and depends on `seed`.
    pub fn new(scene: &Scene, first: i32, seed: &str) -> Self {
        let moving = scene.objects.iter().filter(|object| object.role == Role::Collide);
        let sequences =
            moving.filter_map(|object| Some((Pattern::parse(&object.file)?, object.offset))).collect();
        let mut start = Hasher::default();
        start.add_text(seed).add(&first.to_le_bytes());
        Self { first, links: vec![start.finish()], sequences, contents: HashMap::new() }
    }

    /// The hash of a frame; frames before the first have none.
    ///
    /// # Errors
    /// A file of a sequence that cannot be read.
    pub fn at(&mut self, frame: i32) -> Result<&str> {
        let wanted = (i64::from(frame) - i64::from(self.first)).max(0) as usize + 1;
        while self.links.len() <= wanted {
            let next = self.first + self.links.len() as i32 - 1;
            let mut link = Hasher::default();
            link.add_text(&self.links[self.links.len() - 1]);
            for file in self.files(next) {
                let content = match self.contents.get(&file) {
                    Some(content) => content.clone(),
                    None => hash::of_file(&file)?,
                };
                link.add_text(&content);
                self.contents.insert(file, content);
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
}
