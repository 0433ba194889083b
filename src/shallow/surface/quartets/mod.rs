//! Quartets: groups of four linked columns of neighbouring cells, from which triangles are made (thesis 4.2.2).

pub(in crate::shallow) mod cells;
pub(in crate::shallow) mod divide;
pub(in crate::shallow::surface) mod full;
pub(in crate::shallow::surface) mod links;
pub(in crate::shallow) mod odd;
pub(in crate::shallow::surface) mod strips;
mod wall;
