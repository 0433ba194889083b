//! Moving bodies, and level sets of them and of meshes and particles.

// In the header's order.
pub mod body;

pub mod tools;
