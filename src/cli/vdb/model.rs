//! What `frazil preview` draws of .vdb files.

use std::path::Path;

use frazil::base::Points;
use frazil::render::Model;
use frazil::scene::{changes_since, partial};
use frazil::vdb::{GridClass, file, points};
use frazil::{Context, Error};

/// The level set of a file, or its fog volume.
pub fn of_file(path: &Path, ctx: &Context) -> frazil::Result<Model> {
    let grid = file::read_named(path, None)?;
    if grid.class() == GridClass::LevelSet {
        return Model::level_set(ctx, &grid);
    }
    let (model, density) = Model::fog(ctx, &grid)?;
    if model.bounds().is_none() {
        return Err(Error::file(path, format!("grid \"{}\" has no density above 0 to draw", grid.name())));
    }
    log::warn!(
        "{}: grid \"{}\" is not a level set: it is drawn where its values are {density}, half of the greatest",
        path.display(),
        grid.name()
    );
    Ok(model)
}

/// The points of a file that has no grid of floats.
pub fn points_of(path: &Path) -> frazil::Result<Option<Points>> {
    let grids = file::describe(path)?;
    let has = |start: &str| grids.iter().any(|grid| grid.value_type.starts_with(start));
    if has("Tree_float") || !has("Tree_ptdataidx32") {
        return Ok(None);
    }
    if let Some(since) = changes_since(path)? {
        log::warn!("{}: {}", path.display(), partial(since));
    }
    points::read(path, None).map(Some)
}
