//! Where the surface ends: at walls, and at ledges, where skirts close it.

pub(super) mod boundary;
pub mod ledges;
pub mod silhouette;
pub(super) mod skirt_vertex;
pub(super) mod skirts;
