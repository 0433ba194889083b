//! The volume that moving meshes sweep.
