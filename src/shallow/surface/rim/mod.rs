//! Where the surface ends: at walls, at the rim of films, over ledges.

pub(super) mod boundary;
pub(super) mod hem;
pub mod ledges;
pub mod silhouette;
pub(super) mod skirts;
