//! What a picture shows.

use frazil::geometry::DetailedMesh;
use frazil::geometry::Points;
use frazil::geometry::TriMesh;
use frazil::vdb::FloatGrid;
use std::path::PathBuf;

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
