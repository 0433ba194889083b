//! A moving mesh, prepared for the chain: topology, poses, and the points that its surface passes.

pub(in crate::sweep) mod body;
pub(in crate::sweep) mod passages;
mod refine;
pub(in crate::sweep) mod topology;
