//! The keys of snow scenes: layer, grains, mist, objects and output.

pub(in crate::scene::snow) mod grains;
pub(in crate::scene::snow) mod mist;
pub(in crate::scene::snow) mod output;
pub(in crate::scene::snow) mod snow;
pub(in crate::scene::snow) mod volumes;
