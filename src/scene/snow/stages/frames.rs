//! Base layers of frames that are done.

use crate::context::Context;
use crate::error::Result;
use crate::scene::run::DoneFrames;
use crate::snow::base_layer::Grids;
use crate::vdb::file;

/// The layer after a frame: from its own file, or from the last whole one and the changes since.
///
/// # Errors
/// A missing frame; a file that is not what was written.
pub(in crate::scene::snow) fn layer_at(ctx: &Context, done: &DoneFrames, frame: i32) -> Result<Grids> {
    let mut frames = done.frames_of_state(frame)?;
    let whole = frames.next().unwrap_or(frame);
    let mut grids = read_grids(done, whole)?;
    for later in frames {
        apply_changes(ctx, done, &mut grids, later)?;
    }
    Ok(grids)
}

/// Applies the changes that a frame stores to the layer of the frame before.
pub(in crate::scene::snow) fn apply_changes(
    ctx: &Context,
    done: &DoneFrames,
    grids: &mut Grids,
    frame: i32,
) -> Result<()> {
    ctx.check()?;
    grids.apply_delta(ctx, &read_grids(done, frame)?)
}

fn read_grids(done: &DoneFrames, frame: i32) -> Result<Grids> {
    let path = done.state_file(frame)?;
    Grids::from_named(file::read_own(&path)?).map_err(|error| error.in_file(path))
}

/// Reads base layers frame by frame, and keeps the last one, so that the next frame reads only its changes.
#[derive(Default)]
pub struct LayerReader {
    /// The frame that was read last, and the layer after it.
    last: Option<(i32, Grids)>,
}

impl LayerReader {
    /// The layer after a frame. If frames ascend from call to call, each call reads the frame's file, and those of skipped frames that it
    /// builds on.
    ///
    /// # Errors
    /// As [`layer_at`].
    pub fn after(&mut self, ctx: &Context, done: &DoneFrames, frame: i32) -> Result<&Grids> {
        let follows =
            |before: i32| before <= frame && (before + 1..=frame).all(|between| done.keeps_changes(between));
        let layer = match self.last.take() {
            Some((before, mut layer)) if follows(before) => {
                (before + 1..=frame).try_for_each(|next| apply_changes(ctx, done, &mut layer, next))?;
                layer
            }
            _ => layer_at(ctx, done, frame)?,
        };
        Ok(&self.last.insert((frame, layer)).1)
    }
}
