//! Small amounts of liquid in real time: virtual pipes between columns, with the right viscosity (thesis chapter 4).
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | cell | a square of the ground |
//! | column | the room for liquid above a solid of a cell, from its *base* to its *ceiling* |
//! | layer | which column of its cell one is, counted from the lowest |
//! | strip | 16 columns of one layer, neighbours in a row: what SIMD loads work on |
//! | pipe | joins columns of adjacent cells; *regular* pipes join columns of one layer, *links* all others, and lead out of the domain |
//! | cliff, overflow edge | where liquid may fall freely; a link that it falls from (`Lips` in the code) |
//! | flux | volume per time through a pipe |
//! | transfer | what a flux moves in a step, in whole units |
//! | unit | the smallest difference of heights and depths, which are integers, so that liquid is neither lost nor made |
//! | amount | what a column holds of a scalar, an integer, too |
//! | head | the height to which a column's liquid would rise: its surface, or, if it is full up to its ceiling, what its pressure stands for |
//! | rest, active | strips where no step changes anything are passed over; all others are active |
//! | packet, rivulet | liquid in the air; overflow edges close to each other whose packets fall as one thread |
//! | near | the box of fine cells of a liquid in cells of two sizes (`two_level/`) |
//!
//! The surface has words of its own (`surface/mod.rs`).

mod clock;
pub mod columns;
mod frame;
pub mod free_fall;
pub mod material;
pub mod params;
pub mod pipes;
pub mod readback;
pub mod remap;
mod saved_state;
pub mod scalars;
pub mod solver;
pub mod sources;
pub mod stains;
pub mod surface;
pub mod system;
pub mod terrain;
pub mod time_step;
pub mod two_level;

pub use params::Params;
pub use readback::body_loads::Load;
pub use readback::probe::{Reading, View};
pub use readback::snapshot::Snapshot;
pub use remap::Moved;
pub use scalars::{Law, Scalar, ScalarBalance};
pub use solver::viscosity_by_scalar::Thickening;
pub use stains::{Staining, Stains};
pub use system::{Balance, Report, Shallow};
pub use two_level::Detail;
