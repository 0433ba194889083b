//! Memory and disk space of a liquid on a terrain.

pub(in crate::scene::shallow) mod disk;
pub(in crate::scene::shallow) mod memory;
