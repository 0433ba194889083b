//! What `frazil preview` draws of .vdb files.

use std::path::Path;

use frazil::base::Points;
use frazil::scene::{changes_since, partial};
use frazil::vdb::{FloatGrid, file, points};

/// What is drawn of a file.
pub enum Content {
    /// A level set.
    Surface(FloatGrid),
    /// A fog volume.
    Fog(FloatGrid),
    /// Points.
    Points(Points),
}

/// The grid that is preferred among fog volumes.
const DENSITY: &str = "density";

/// Reads the first level set of a file; else its fog volume, one called "density" before others; else its points. Grids of
/// vectors are left alone.
pub fn read(path: &Path) -> frazil::Result<Content> {
    let grids = file::describe(path)?;
    let of_type = |start: &'static str| grids.iter().filter(move |grid| grid.value_type.starts_with(start));
    if of_type("Tree_float").next().is_none() && of_type("Tree_ptdataidx32").next().is_some() {
        if let Some(since) = changes_since(path)? {
            log::warn!("{}: {}", path.display(), partial(since));
        }
        return points::read(path, None).map(Content::Points);
    }
    if of_type("Tree_float").any(|grid| grid.class == "level set") {
        return file::read_named(path, None).map(Content::Surface);
    }
    let has_density = of_type("Tree_float").any(|grid| grid.name == DENSITY);
    file::read_named(path, has_density.then_some(DENSITY)).map(Content::Fog)
}
