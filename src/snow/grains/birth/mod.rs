//! Snow that was removed becomes grains.

pub(in crate::snow::grains) mod claims;
pub(in crate::snow::grains) mod removal;
pub(in crate::snow::grains) mod sourcing;
