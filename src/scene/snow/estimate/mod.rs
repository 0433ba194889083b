//! Forecasts: memory and disk of each stage, before any of it is taken.

pub(in crate::scene::snow) mod disk;
pub(in crate::scene::snow) mod grains;
pub(in crate::scene::snow) mod memory;
pub(in crate::scene::snow) mod mist;
