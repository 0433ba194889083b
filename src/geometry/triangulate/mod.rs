//! Triangulation of polygons.

pub(crate) mod ear_clipping;
pub(crate) mod monotone;
