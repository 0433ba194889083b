//! The ground: for each cell, the solid parts of the vertical line through its centre (thesis 4.1.1).
//!
//! They come from triangles ([`triangles`]), a height field ([`height`]), signed distances ([`sampler`]), and moving shapes ([`shapes`]).

mod cell_crossings;
mod crossings;
pub mod facing;
pub mod ground;
pub mod height;
pub(super) mod identity;
mod lines;
pub mod sampler;
pub mod shapes;
pub mod solids;
pub mod triangles;

pub use solids::Solids;
