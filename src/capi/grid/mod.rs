//! Sparse grids: made, sampled, lent and saved.

// In the header's order.
pub mod sparse;

pub mod create;

pub mod leaves;

pub mod sample;

pub mod bytes;

pub mod guarded;
