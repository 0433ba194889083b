//! What a picture shows.

use std::path::{Path, PathBuf};

use frazil::geometry::{DetailedMesh, Points, TriMesh};
#[cfg(feature = "vdb")]
use frazil::vdb::FloatGrid;
use frazil::{Error, Result, io};

#[cfg(feature = "vdb")]
use crate::cli::vdb::model::{self, Content};

/// A part of a picture, as read.
pub enum Part {
    /// A mesh with its arrays.
    Mesh(DetailedMesh),
    /// The surface of a liquid, with its opacities `alpha`, and the kind of liquid.
    Liquid(DetailedMesh, Wet),
    /// The ground below a liquid, with the stains on its vertices, 0 to 1, and the liquid that left them; stains are optional.
    Ground(TriMesh, Vec<f64>, Wet),
    /// A tool or an obstacle in a liquid.
    Obstacle(TriMesh),
    /// A static mesh in a liquid.
    Cloth(TriMesh),
    /// Points, and the file that they came from.
    Points(PathBuf, Points),
    /// A level set.
    #[cfg(feature = "vdb")]
    Surface(FloatGrid),
    /// A fog volume, and its file.
    #[cfg(feature = "vdb")]
    Fog(PathBuf, FloatGrid),
}

/// The look of a liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wet {
    Water,
    Blood,
    Paint,
    Honey,
    /// Looks that only dyes have.
    Milk,
    Coffee,
}

impl Wet {
    /// The liquid of a name; blood if the name is unknown.
    pub fn of(name: &str) -> Self {
        match name {
            "water" => Self::Water,
            "paint" => Self::Paint,
            "honey" => Self::Honey,
            _ => Self::Blood,
        }
    }
}

/// Reads a .vdb file.
///
/// # Errors
/// A file that cannot be read, or that holds nothing to draw.
#[cfg(feature = "vdb")]
pub fn of_vdb(path: &Path) -> Result<Vec<Part>> {
    Ok(match model::read(path)? {
        Content::Surface(grid) => vec![Part::Surface(grid)],
        Content::Fogs(grids) => grids.into_iter().map(|grid| Part::Fog(path.to_path_buf(), grid)).collect(),
        Content::Points(points) => vec![Part::Points(path.to_path_buf(), points)],
    })
}

/// Reads points of a file other than .vdb.
///
/// # Errors
/// A file that cannot be read.
pub fn points_of(path: &Path) -> Result<Part> {
    let cloud = io::particles::read(path)?;
    let voxel = cloud.voxel_size.unwrap_or(0.01);
    let points = cloud.into_points(Some(voxel)).map_err(|error| Error::file(path, error.to_string()))?;
    Ok(Part::Points(path.to_path_buf(), points))
}
