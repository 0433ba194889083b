//! Advection: along which paths values are carried, and the mass that it keeps.

pub(in crate::flow) mod advect;
pub(in crate::flow) mod conserve;
pub(in crate::flow) mod paths;
