//! Memory and disk space of a mesh that follows a liquid.

pub(in crate::scene::surface) mod costs;
pub(in crate::scene::surface) mod disk;
pub(in crate::scene::surface) mod memory;
