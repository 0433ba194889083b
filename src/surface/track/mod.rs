//! The part of a step that does not change topology: advection, projection and fading of detail; also easing for display.

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
