//! Small amounts of liquid in real time: virtual pipes between columns, with the right viscosity (thesis chapter 4).
//!
//! Words: a *cell* is a square of the ground; a *column* the room for liquid above a solid of a cell, from its *base* to its *ceiling*; a *layer* the
//! place of a column from the bottom of its cell; a *pipe* joins columns of adjacent cells; a *flux* is what flows through it, a *transfer* what it moves
//! in a step; a *unit* is the smallest difference of heights and depths, which are integers, so that liquid is neither lost nor made;
//! an *amount* what a column holds of a scalar, an integer, too.

mod clock;
pub mod columns;
pub mod detail;
pub mod falls;
pub mod flow;
pub mod flows;
mod frame;
pub mod grid;
mod identity;
pub mod liquid;
pub mod loads;
pub mod pace;
pub mod params;
mod per_column;
pub mod pipes;
mod pour;
pub mod probe;
pub mod remap;
pub mod scalars;
pub mod snapshot;
mod stacks;
pub mod stains;
mod state;
pub mod surface;
pub mod system;
pub mod terrain;
mod thicken;

pub use detail::Detail;
pub use loads::Load;
pub use params::Params;
pub use probe::{Reading, View};
pub use remap::Moved;
pub use scalars::{Law, Scalar, ScalarBalance};
pub use snapshot::Snapshot;
pub use stains::{Staining, Stains};
pub use system::{Balance, Report, Shallow};
pub use thicken::Thickening;
