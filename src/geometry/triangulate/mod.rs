//! Polygons cut into triangles.

pub(crate) mod ear_clipping;
pub(crate) mod monotone;
