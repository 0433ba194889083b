//! The C interface.

pub mod calls;
pub mod cancel;
pub mod cancel_latency;
pub mod host;
