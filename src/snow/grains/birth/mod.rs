//! Snow that was removed becomes grains.

pub(in crate::snow::grains) mod claims;
pub(in crate::snow::grains) mod removed_snow;
pub(in crate::snow::grains) mod sourcing;
