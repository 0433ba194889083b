//! Sparse grids: created, sampled, lent and saved.

// In the order of the header.
pub mod sparse;

pub mod create;

pub mod leaves;

pub mod sample;

pub mod bytes;

pub mod listing;

pub mod guarded;
