//! Small amounts of liquid in real time: virtual pipes between columns, with the right viscosity (thesis chapter 4).
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | cell | a square of the ground |
//! | column | the space for liquid above a solid of a cell, from its *base* to its *ceiling* |
//! | layer | index of a column within its cell, counted from the lowest |
//! | strip | 16 adjacent columns of one layer along x: the unit of SIMD loads |
//! | pipe | joins columns of adjacent cells; *regular* pipes join columns of one layer; *links* are all others, and also lead out of the domain |
//! | donor, receiver | the columns that liquid leaves and enters through a pipe |
//! | cliff, overflow edge | a drop where liquid may fall freely; a link over which it falls in a step |
//! | flux | volume per time through a pipe |
//! | transfer | what a flux moves in a step, in whole units; its *remainder* waits for the next step |
//! | unit | the resolution of heights and depths; these are integers, so that liquid is neither lost nor created |
//! | amount | how much of a scalar a column holds; also an integer |
//! | head | the height to which a column's liquid would rise: its surface or, if it is full to its ceiling, the equivalent of its pressure |
//! | rest, active | strips in which no step changes anything are skipped; all others are active |
//! | packet, rivulet | a parcel of liquid in the air; nearby overflow edges whose packets fall as one stream |
//! | near | the box of fine cells in a liquid with cells of two sizes (`two_level/`) |
//!
//! For the terms of the surface see `surface/mod.rs`.

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

pub use params::{Params, Thickening};
pub use readback::body_loads::Load;
pub use readback::probe::{Reading, View};
pub use readback::snapshot::Snapshot;
pub use remap::Moved;
pub use scalars::{Law, Scalar, ScalarBalance};
pub use stains::{Staining, Stains};
pub use system::{Balance, Report, Shallow};
pub use two_level::Detail;
