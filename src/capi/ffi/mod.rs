//! The C boundary itself: statuses, handles, views of a host's memory, saved states. Re-exports what most files of the interface need.

// In the order of the header.
pub(in crate::capi) mod guard;
pub(in crate::capi) use guard::*;

pub(in crate::capi) mod views;
pub(in crate::capi) use views::*;

pub(in crate::capi) mod handle;
pub(in crate::capi) use handle::*;

pub(in crate::capi) mod lists;
pub(in crate::capi) use lists::*;

pub(in crate::capi) mod saved;

pub(in crate::capi) mod fields;
pub(in crate::capi) use fields::*;
