//! A moving mesh as the chain needs it: topology, poses, and the points that its surface passes.

pub(in crate::sweep) mod body;
pub(in crate::sweep) mod passages;
mod refine;
pub(in crate::sweep) mod topology;
