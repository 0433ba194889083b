//! Plain data that every room shares; knows no file format and no OpenVDB.

pub mod arrays;
pub mod blocks;
pub mod bvh;
pub mod bytes;
#[doc(hidden)]
pub mod cpu;
pub mod deviation;
#[doc(hidden)]
pub mod digits;
pub mod doubles;
pub(crate) mod ears;
pub mod edges;
pub mod faults;
#[doc(hidden)]
pub mod lanes;
pub mod meeting;
pub mod mesh;
pub(crate) mod monotone;
mod near;
pub mod orient;
pub mod orientation;
pub mod packed;
pub mod points;
pub mod polygons;
pub mod topology;
pub mod uvs;
pub mod weld;

/// A point, direction or velocity in 32 bits: fields and mesh vertices (m, m/s).
pub type Vec3 = nalgebra::Vector3<f32>;
/// A point or direction in 64 bits: poses, transforms, conserved sums.
pub type DVec3 = nalgebra::Vector3<f64>;

pub use arrays::{DetailedMesh, MeshArray};
pub use mesh::TriMesh;
pub use points::Points;
pub use polygons::PolygonMesh;
pub use uvs::Uvs;
