//! The library, its threads, and contexts to call it with.

// In the header's order.
pub mod library;

pub mod pool;

pub mod context;
