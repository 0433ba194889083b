//! The particles' surface: their implicit function, signed distances from its zero set, and the triangles of that set.

pub(in crate::surface) mod band;
pub(in crate::surface) mod implicit;
pub(in crate::surface) mod isosurface;
mod kernel;
#[cfg(feature = "vdb")]
pub(in crate::surface) mod openvdb;
pub(in crate::surface) mod sampler;
pub(in crate::surface) mod smooth;
mod thickness;

/// Radius within which particles count (spacings).
pub const SUPPORT: f64 = 4.0;
