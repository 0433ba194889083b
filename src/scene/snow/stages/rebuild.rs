//! Whole layers from a cache of changes.

use std::path::Path;

use super::frames::LayerReader;
use crate::context::Context;
use crate::error::Result;
use crate::scene::run::DoneFrames;
use crate::snow::base_layer::Grids;

/// The whole layers of a cache, frame by frame.
pub struct Rebuild {
    stored: DoneFrames,
    layer: LayerReader,
}

impl Rebuild {
    /// Opens a cache.
    ///
    /// # Errors
    /// As [`DoneFrames::read`].
    pub fn open(folder: &Path) -> Result<Self> {
        Ok(Self { stored: DoneFrames::read(folder, "base")?, layer: LayerReader::default() })
    }

    /// The stored frames.
    pub fn stored(&self) -> &DoneFrames {
        &self.stored
    }

    /// The layer after a frame. If frames ascend from call to call, each call reads the frame's file, and those of skipped frames that it
    /// builds on.
    ///
    /// # Errors
    /// A missing frame; a file that is not what was written.
    pub fn layer(&mut self, ctx: &Context, frame: i32) -> Result<&Grids> {
        self.layer.after(ctx, &self.stored, frame)
    }
}
