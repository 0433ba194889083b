//! Builds the C++ side of the bridge.
fn main() {}
