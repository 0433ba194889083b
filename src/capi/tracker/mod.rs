//! A detailed mesh that follows the particles of a liquid.

// In the order of the header.
pub mod params;

pub mod handle;

pub mod mesh;

pub mod eased;

pub mod edits;

pub mod rest_position;

pub mod sculpt;
