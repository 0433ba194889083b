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
pub(in crate::scene::snow) fn grids(ctx: &Context, done: &DoneFrames, frame: i32) -> Result<Grids> {
    let mut frames = done.frames_of_state(frame)?;
    let whole = frames.next().unwrap_or(frame);
    let mut grids = read_grids(done, whole)?;
    for later in frames {
        follow(ctx, done, &mut grids, later)?;
    }
    Ok(grids)
}

/// Updates a layer from the frame before to a frame that stores its changes.
pub(in crate::scene::snow) fn follow(
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
    /// The layer after a frame.
    at: Option<(i32, Grids)>,
}

impl LayerReader {
    /// The layer after a frame. Frames in ascending order cost one file each; skipped frames that store changes are read too.
    ///
    /// # Errors
    /// As [`grids`].
    pub fn after(&mut self, ctx: &Context, done: &DoneFrames, frame: i32) -> Result<&Grids> {
        let follows =
            |before: i32| before <= frame && (before + 1..=frame).all(|between| done.keeps_changes(between));
        let layer = match self.at.take() {
            Some((before, mut layer)) if follows(before) => {
                (before + 1..=frame).try_for_each(|next| follow(ctx, done, &mut layer, next))?;
                layer
            }
            _ => grids(ctx, done, frame)?,
        };
        Ok(&self.at.insert((frame, layer)).1)
    }
}
