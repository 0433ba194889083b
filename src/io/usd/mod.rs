//! USD: the output of a shot for any program that reads it, as text (.usda) or as a binary crate (.usdc, .usd).

pub(in crate::io) mod binary;
mod file;
pub(in crate::io) mod layer;
pub mod materials;
mod mesh;
pub mod points;
pub mod primvars;
pub(in crate::io) mod read;
mod stage;
mod text;
mod transforms;
mod volumes;

pub use file::{BINARY, Contents, ContentsByName, File, Format, Units};
pub use mesh::{MeshFrame, MeshPrim, Shading, clip};
pub use stage::{
    ClipPrims, Clips, SAMPLES, StageTime, StillMeshes, clip_manifest, manifest_path, samples, stage,
    still_path,
};
pub use text::prim_name;
pub use volumes::{Field, Holds, VolumeFile, VolumeFiles};

use crate::geometry::{DVec3, Vec3};

/// Positions as 32-bit floats.
pub fn to_floats(positions: &[DVec3]) -> Vec<Vec3> {
    positions.iter().map(|position| position.cast()).collect()
}
