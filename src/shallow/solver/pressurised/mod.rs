//! Columns that are full to their ceiling: they push with a head instead of a surface.

pub(super) mod edges;
mod gradients;
mod heads;
pub(super) mod network;
mod nodes;
