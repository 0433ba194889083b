//! Whole layers from a cache of changes.

use std::path::Path;

use super::frames;
use crate::context::Context;
use crate::error::Result;
use crate::scene::run::Stored;
use crate::snow::base_layer::Grids;

/// The whole layers of a cache, frame by frame.
pub struct Rebuild {
    stored: Stored,
    at: Option<(i32, Grids)>,
}

impl Rebuild {
    /// Opens a cache.
    ///
    /// # Errors
    /// As [`Stored::read`].
    pub fn open(folder: &Path) -> Result<Self> {
        Ok(Self { stored: Stored::read(folder, "base")?, at: None })
    }

    /// The stored frames.
    pub fn stored(&self) -> &Stored {
        &self.stored
    }

    /// The layer after a frame. Frames in ascending order cost one file each; skipped frames that store changes are read too.
    ///
    /// # Errors
    /// A missing frame; a file that is not what was written.
    pub fn layer(&mut self, ctx: &Context, frame: i32) -> Result<&Grids> {
        let follows = |before: i32| {
            before <= frame && (before + 1..=frame).all(|between| self.stored.keeps_changes(between))
        };
        let grids = match self.at.take() {
            Some((before, mut grids)) if follows(before) => {
                (before + 1..=frame)
                    .try_for_each(|next| frames::follow(ctx, &self.stored, &mut grids, next))?;
                grids
            }
            _ => frames::grids(ctx, &self.stored, frame)?,
        };
        Ok(&self.at.insert((frame, grids)).1)
    }
}
