//! Advection: the paths that values are carried along, and conservation of mass.

pub(in crate::flow) mod advect;
pub(in crate::flow) mod conserve;
pub(in crate::flow) mod paths;
pub(in crate::flow) mod scheme;
