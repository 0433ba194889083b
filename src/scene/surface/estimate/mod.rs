//! Memory and disk space of a mesh that follows a liquid.

#[cfg(feature = "vdb")]
pub(in crate::scene::surface) mod disk;
#[cfg(feature = "vdb")]
pub(in crate::scene::surface) mod memory;
