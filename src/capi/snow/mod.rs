//! Snow: the layer, bodies that press into it, grains and mist.

// In the order of the header.
pub mod layer;

pub mod base_layer;

pub mod grains_params;

pub mod grains;

pub mod grains_points;

pub mod mist_params;

pub mod mist;

pub mod mist_points;
