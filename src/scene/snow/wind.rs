//! Reads the wind that carries a scene's mist from a .vdb file.

use std::path::Path;

use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::vdb::{AnyGrid, VectorGrid, file};

/// The file of a scene's wind, if it is a grid.
pub(in crate::scene::snow) fn wind_file(scene: &Scene) -> Option<&Path> {
    scene.values.table("mist").value("wind")?.path()
}

/// The wind of a file: its first grid of vectors.
///
/// # Errors
/// A file that cannot be read, or that has no such grid.
pub(in crate::scene::snow) fn wind(path: &Path) -> Result<VectorGrid> {
    let grids = file::describe(path)?;
    let vectors = grids.iter().find(|grid| grid.value_type.starts_with("Tree_vec3s"));
    let name = vectors.map(|grid| grid.name.clone()).ok_or_else(|| {
        let names: Vec<String> =
            grids.iter().map(|grid| format!("\"{}\" ({})", grid.name, grid.value_type)).collect();
        Error::file(path, format!("has no grid of vectors for the wind, only {}", names.join(", ")))
    })?;
    match file::read_any(path, Some(&name))? {
        AnyGrid::Vectors(grid) => Ok(grid),
        AnyGrid::Floats(_) => Err(Error::file(path, format!("grid \"{name}\" does not hold vectors"))),
    }
}
