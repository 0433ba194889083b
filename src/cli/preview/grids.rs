//! The parts of .vdb files that a picture shows.

use std::path::Path;

use super::parts::Part;
use frazil::vdb::changes::{changes_since, partial};
use frazil::vdb::{file, points};

/// Name of the fog volume to draw: other fog volumes in the same file are temperatures, fuels and the like.
const DENSITY: &str = "density";

/// Reads the first level set of a file; else its fog: the grid called "density", else all fog volumes, else its first grid
/// of floats; else its points. Grids of vectors are ignored.
///
/// # Errors
/// A file that cannot be read, or that holds none of these.
pub fn parts_of_vdb(path: &Path) -> frazil::Result<Vec<Part>> {
    let grids = file::describe(path)?;
    let grids_of_type =
        |start: &'static str| grids.iter().filter(move |grid| grid.value_type.starts_with(start));
    let floats = || grids_of_type("Tree_float");
    let fog = |grid| Part::Fog(path.to_path_buf(), grid);
    if floats().next().is_none() && grids_of_type("Tree_ptdataidx32").next().is_some() {
        if let Some(since) = changes_since(path)? {
            log::warn!("{}: {}", path.display(), partial(since));
        }
        return Ok(vec![Part::Points(path.to_path_buf(), points::read(path, None)?)]);
    }
    if floats().any(|grid| grid.class == "level set") {
        return Ok(vec![Part::Surface(file::read_named(path, None)?)]);
    }
    let mut names: Vec<&str> = match floats().find(|grid| grid.name == DENSITY) {
        Some(_) => vec![DENSITY],
        None => floats().filter(|grid| grid.class == "fog volume").map(|grid| grid.name.as_str()).collect(),
    };
    // If several grids have the same name, the first is read.
    names.dedup();
    if names.is_empty() {
        return Ok(vec![fog(file::read_named(path, None)?)]);
    }
    names.into_iter().map(|name| file::read_named(path, Some(name)).map(fog)).collect()
}
