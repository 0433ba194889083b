//! The border itself: statuses, handles, views of a host's memory, saved states.

// In the header's order.
pub(in crate::capi) mod guard;

pub(in crate::capi) mod views;

pub(in crate::capi) mod handle;

pub(in crate::capi) mod saved;
