//! The volume that moving meshes sweep.
pub mod body;
pub mod chain;
pub mod distance;
pub mod lattice;
pub mod nearest;
pub mod refine;
pub mod topology;
pub mod voxelise;
pub mod winding;
