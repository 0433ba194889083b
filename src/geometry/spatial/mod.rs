//! Triangles found by where they are.

pub mod bvh;
pub(in crate::geometry) mod near_pairs;
