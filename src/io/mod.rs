//! File formats other than .vdb.

pub mod files;
#[cfg(feature = "vdb")]
pub mod geometry;
#[cfg(feature = "cli")]
pub mod image;
pub mod mesh;
pub mod particles;
pub mod records;
pub mod usd;
