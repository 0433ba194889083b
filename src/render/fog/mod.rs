//! Fog: a grid of densities, drawn as a medium that scatters and absorbs light.
//!
//! `blocks.rs` keeps the densities that are not 0 in blocks of 8 x 8 x 8 voxels, `traversal.rs` finds the blocks along a ray,
//! `light.rs` computes once how much of the sun and the sky reaches each part of the fog, and `march.rs` follows view
//! rays. Units: a ray is measured in metres, positions inside a fog in voxels, whose centres lie at whole numbers;
//! *extinction* is the share of the light that is lost per metre, over short paths.

mod blocks;
mod light;
mod march;
mod traversal;

pub use blocks::{Fog, Part, Placement};
pub(super) use light::LitFogs;
pub(super) use march::Veil;
