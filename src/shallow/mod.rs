//! Small amounts of liquid in real time: virtual pipes between columns, with the right viscosity (thesis chapter 4).
//!
//! Words: a *cell* is a square of the ground; a *column* the room for liquid above a solid of a cell, from its *base* to its *ceiling*; a *layer* the
//! place of a column from the bottom of its cell; a *pipe* joins columns of adjacent cells; a *flux* is what flows through it, a *transfer* what it moves
//! in a step; a *unit* is the smallest difference of heights and depths, which are integers, so that liquid is neither lost nor made;
//! an *amount* what a column holds of a scalar, an integer, too.

mod clock;
pub mod columns;
mod frame;
pub mod free_fall;
pub mod grid;
mod identity;
pub mod loads;
pub mod material;
pub mod params;
mod per_column;
pub mod pipes;
mod pour;
pub mod probe;
pub mod remap;
mod saved_state;
pub mod scalars;
pub mod snapshot;
pub mod solver;
pub mod sources;
mod stacks;
pub mod stains;
pub mod surface;
pub mod system;
pub mod terrain;
mod thickening;
pub mod time_step;
pub mod two_level;

pub use loads::Load;
pub use params::Params;
pub use probe::{Reading, View};
pub use remap::Moved;
pub use scalars::{Law, Scalar, ScalarBalance};
pub use snapshot::Snapshot;
pub use stains::{Staining, Stains};
pub use system::{Balance, Report, Shallow};
pub use thickening::Thickening;
pub use two_level::Detail;
