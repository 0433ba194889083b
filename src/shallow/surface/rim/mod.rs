//! Where the surface ends: at walls, at the rim of films, over ledges.

pub(in crate::shallow::surface) mod boundary;
pub(in crate::shallow::surface) mod hem;
pub mod ledges;
pub mod silhouette;
pub(in crate::shallow::surface) mod skirts;
