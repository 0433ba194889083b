//! Moving bodies, and level sets of bodies, meshes and particles.

// In the order of the header.
pub mod body;

pub mod tools;
