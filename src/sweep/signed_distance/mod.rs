//! From the boundary of a chain to signed distances of voxels.

pub(in crate::sweep) mod bins;
mod depth;
pub(in crate::sweep) mod exposure;
pub(in crate::sweep) mod voxelise;
