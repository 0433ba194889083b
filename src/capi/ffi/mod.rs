//! The C boundary itself: statuses, handles, views of a host's memory, saved states.

// In the order of the header.
pub(in crate::capi) mod guard;

pub(in crate::capi) mod views;

pub(in crate::capi) mod handle;

pub(in crate::capi) mod saved;

pub(in crate::capi) mod fields;
