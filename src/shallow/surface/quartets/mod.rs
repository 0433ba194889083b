//! Quartets: the columns of 2 x 2 cells. Groups of linked columns among them become triangles (thesis 4.2.2).

pub(in crate::shallow) mod cells;
pub(in crate::shallow) mod divide;
pub(super) mod full;
pub(super) mod links;
pub(in crate::shallow) mod odd;
pub(super) mod strips;
mod wall;
