//! Meshes, and their repair.

// In the order of the header.
pub mod triangles;

pub mod repair;
