//! Small amounts of liquid in cells of two sizes.

// In the order of the header.
pub mod liquid;

pub mod ground;

pub mod scalars;
