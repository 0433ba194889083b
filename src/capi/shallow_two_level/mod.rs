//! Small amounts of liquid in cells of two sizes.

// In the header's order.
pub mod liquid;

pub mod ground;

pub mod scalars;
