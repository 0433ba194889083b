//! The swept volume.

pub mod band;
pub mod dense_union;
pub mod oracle;
pub mod pose_union;
pub mod spin;
pub mod walls;
