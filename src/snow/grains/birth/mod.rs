//! Snow that was removed becomes grains.

pub(super) mod claims;
pub(super) mod removed_snow;
pub(super) mod sourcing;
