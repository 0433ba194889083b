//! Spatial queries for triangles.

pub mod bvh;
pub(in crate::geometry) mod near_pairs;
