//! Where the surface ends: at walls, at the rim of films, over ledges.

pub(in crate::shallow::surface) mod boundary;
pub mod ledges;
mod silhouette;
pub(in crate::shallow::surface) mod skirts;
