//! A deep layer of snow that objects move through (thesis chapter 3).

#[cfg(feature = "vdb")]
pub mod base_layer;
#[cfg(feature = "vdb")]
mod bounds;
pub mod grain_cohesion;
pub mod grain_friction;
#[cfg(feature = "vdb")]
pub mod grains;
pub mod mist;
mod noise;
#[cfg(feature = "vdb")]
pub mod render_volumes;

pub use noise::NoiseParams;
