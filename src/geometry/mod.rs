//! Plain data shared by all modules; independent of file formats and of OpenVDB.

pub mod check;
pub mod coords;
pub mod fans;
pub mod lists;
pub mod marching_cubes;
pub mod mesh;
pub mod points;
pub mod shape;
pub mod spatial;
#[cfg(test)]
pub(crate) mod test_meshes;
pub(crate) mod triangulate;

/// A point, direction or velocity in 32 bits: fields and mesh vertices (m, m/s).
pub type Vec3 = nalgebra::Vector3<f32>;
/// A point or direction in 64 bits: poses, transforms, conserved sums.
pub type DVec3 = nalgebra::Vector3<f64>;
/// Coordinates of a cell of a grid.
pub type Coord = [i32; 3];

pub use mesh::TriMesh;
pub use mesh::attributes::{DetailedMesh, MeshArray};
pub use mesh::polygons::PolygonMesh;
pub use mesh::uvs::Uvs;
pub use points::Points;
