//! The stages of a scene with snow, and their files.

pub(in crate::scene::snow) mod base;
mod frames;
pub(in crate::scene::snow) mod grain_files;
pub(in crate::scene::snow) mod grain_reader;
pub(in crate::scene::snow) mod grains;
pub(in crate::scene::snow) mod mist;
pub(in crate::scene::snow) mod rebuild;
mod settings;
pub(in crate::scene::snow) mod volumes;
