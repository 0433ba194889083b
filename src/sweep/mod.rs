//! The volume that moving meshes sweep.
pub mod chain;
pub mod distance;
pub mod lattice;
pub mod topology;
pub mod winding;
