//! Grains that are there from the start: points of a file.

use std::path::Path;

use super::grain_files::{changes_since, partial};
use crate::base::DVec3;
use crate::base::points::Values;
use crate::error::{Error, Result};
use crate::io::mesh::extension;
use crate::io::points_ply;
use crate::io::seen::Seen;
use crate::scene::Scene;
use crate::vdb::points;

/// Loose grains of a file.
pub struct Drift {
    /// Places (m).
    pub places: Vec<DVec3>,
    /// Velocities (m/s), of the attribute `v`; none where there is no such attribute.
    pub velocities: Vec<[f32; 3]>,
}

/// The file of a scene's first grains.
pub fn file(scene: &Scene) -> Option<&Path> {
    scene.values.get("grains.initial").and_then(|value| value.path())
}

impl Drift {
    /// Those of a scene.
    ///
    /// # Errors
    /// A file that is missing, cut or damaged; a `v` that is no vector.
    pub fn of(scene: &Scene, seen: &Seen) -> Result<Option<Self>> {
        let Some(path) = file(scene) else { return Ok(None) };
        seen.hash(path)?;
        let (places, attributes) = if extension(path) == "ply" {
            let cloud = points_ply::read(path)?;
            (cloud.places, cloud.attributes)
        } else {
            if let Some(since) = changes_since(path)? {
                return Err(Error::file(path, partial(since)));
            }
            let points = points::read(path, None)?;
            ((0..points.count()).map(|index| points.position(index)).collect(), points.attributes)
        };
        let velocity = attributes.iter().find(|attribute| attribute.name == "v");
        let velocities = match velocity.map(|attribute| &attribute.values) {
            Some(Values::Vector(column)) => (0..places.len()).map(|index| column.get(index)).collect(),
            Some(_) => return Err(Error::file(path, "has an attribute v that is no vector")),
            None => Vec::new(),
        };
        Ok(Some(Self { places, velocities }))
    }
}
