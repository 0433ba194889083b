//! Meshes, and their repair.

// In the header's order.
pub mod triangles;

pub mod repair;
