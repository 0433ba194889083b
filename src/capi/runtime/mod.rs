//! The library, its threads, and the contexts of calls.

// In the order of the header.
pub mod library;

pub mod pool;

pub mod context;
