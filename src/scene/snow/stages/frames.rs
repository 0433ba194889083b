//! Base layers of frames that are done, and what files say of their frame.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::run::Stored;
use crate::snow::base_layer::Grids;
use crate::vdb::{MetaValue, file};

/// The layer after a frame: from its own file, or from the last whole one and the changes since.
///
/// # Errors
/// A missing frame; a file that is not what was written.
pub(in crate::scene::snow) fn grids(ctx: &Context, done: &Stored, frame: i32) -> Result<Grids> {
    let mut frames = done.frames_to(frame)?;
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
    done: &Stored,
    grids: &mut Grids,
    frame: i32,
) -> Result<()> {
    ctx.check()?;
    grids.apply_delta(ctx, &read_grids(done, frame)?)
}

pub(in crate::scene::snow::stages) fn read_grids(done: &Stored, frame: i32) -> Result<Grids> {
    let path = done.state_file(frame)?;
    Grids::from_named(file::read_own(&path)?).map_err(|error| match error {
        Error::Argument(what) => Error::file(path, what),
        other => other,
    })
}

/// Metadata of every .vdb file of a shot.
pub(in crate::scene::snow) fn metadata(
    scene: &Scene,
    frame: i32,
    made_from: &str,
) -> Vec<(String, MetaValue)> {
    let fps = scene.shot.fps;
    let text = |text: &str| MetaValue::Text(text.into());
    vec![
        ("frazil:frame".into(), MetaValue::Int(frame.into())),
        ("frazil:fps".into(), MetaValue::Double(fps)),
        ("frazil:seconds".into(), MetaValue::Double(f64::from(frame) / fps)),
        ("frazil:units".into(), text("metres")),
        ("frazil:up".into(), text("y")),
        ("frazil:version".into(), text(env!("CARGO_PKG_VERSION"))),
        ("frazil:inputs".into(), text(made_from)),
    ]
}
