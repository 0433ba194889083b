//! The particles: neighbour search, paths, fits to displacements, attributes.

pub(in crate::surface) mod affine_fit;
pub(in crate::surface) mod agreement;
pub(in crate::surface) mod grid;
pub(in crate::surface) mod paths;
pub(in crate::surface) mod rest_position;
pub(in crate::surface) mod spacing;
pub(in crate::surface) mod specks;
pub(in crate::surface) mod transfer;
