//! A step of the mesh while the topology of its liquid stays: it is carried along, projected, fades, and is shown eased.

pub(in crate::surface) mod advect;
pub(in crate::surface) mod deep_detail;
pub(in crate::surface) mod easing;
pub(in crate::surface) mod easing_limit;
mod empty;
pub(in crate::surface) mod fade;
pub(in crate::surface) mod lookahead;
pub(in crate::surface) mod prefetch;
pub(in crate::surface) mod project;
mod resculpt;
