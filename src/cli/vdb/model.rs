//! The parts of .vdb files that `frazil preview` draws.

use std::path::Path;

use frazil::geometry::Points;
use frazil::scene::{changes_since, partial};
use frazil::vdb::{FloatGrid, file, points};

/// The drawn part of a file.
pub enum Content {
    /// A level set.
    Surface(FloatGrid),
    /// Fog volumes, at least one.
    Fogs(Vec<FloatGrid>),
    /// Points.
    Points(Points),
}

/// Name of the fog volume that represents a file: others beside it are temperatures, fuels and the like.
const DENSITY: &str = "density";

/// Reads the first level set of a file; else its fog: the grid called "density", else all fog volumes, else its first grid
/// of floats; else its points. Grids of vectors are ignored.
///
/// # Errors
/// A file that cannot be read, or that holds none of these.
pub fn read(path: &Path) -> frazil::Result<Content> {
    let grids = file::describe(path)?;
    let of_type = |start: &'static str| grids.iter().filter(move |grid| grid.value_type.starts_with(start));
    let floats = || of_type("Tree_float");
    if floats().next().is_none() && of_type("Tree_ptdataidx32").next().is_some() {
        if let Some(since) = changes_since(path)? {
            log::warn!("{}: {}", path.display(), partial(since));
        }
        return points::read(path, None).map(Content::Points);
    }
    if floats().any(|grid| grid.class == "level set") {
        return file::read_named(path, None).map(Content::Surface);
    }
    let mut names: Vec<&str> = match floats().find(|grid| grid.name == DENSITY) {
        Some(_) => vec![DENSITY],
        None => floats().filter(|grid| grid.class == "fog volume").map(|grid| grid.name.as_str()).collect(),
    };
    // If several grids have the same name, the first is read.
    names.dedup();
    if names.is_empty() {
        return file::read_named(path, None).map(|grid| Content::Fogs(vec![grid]));
    }
    let fogs = names.into_iter().map(|name| file::read_named(path, Some(name)));
    fogs.collect::<frazil::Result<_>>().map(Content::Fogs)
}
