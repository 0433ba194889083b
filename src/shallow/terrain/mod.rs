//! What the liquid flows over: for each cell the solid parts of the vertical line through its centre (thesis 4.1.1).
//!
//! From triangles ([`triangles`]), a height field ([`height`]), signed distances ([`sampler`]), and moving shapes ([`shapes`]).

mod crossings;
pub mod facing;
pub mod ground;
pub mod height;
pub(super) mod identity;
mod lines;
mod piles;
pub mod sampler;
pub mod shapes;
pub mod solids;
pub mod triangles;

pub use solids::Solids;
