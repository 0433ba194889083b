//! Columns that are full to their ceiling: they push with a head instead of a surface.

pub(in crate::shallow::solver) mod edges;
mod gradients;
mod heads;
pub(in crate::shallow::solver) mod network;
mod nodes;
