//! Forecasts: memory and disk space of each stage, before any is used.

pub(in crate::scene::snow) mod costs;
pub(in crate::scene::snow) mod disk;
pub(in crate::scene::snow) mod grains;
pub(in crate::scene::snow) mod memory;
pub(in crate::scene::snow) mod mist;
pub(in crate::scene::snow) mod peak;
pub(in crate::scene::snow) mod removed;
