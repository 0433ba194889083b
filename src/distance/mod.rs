//! Exact signs and distances from triangles, on the voxel lattice.
//!
//! Coordinates are integers ([`lattice`]), so that the number of times that a line passes through a surface is found without rounding
//! ([`winding`]); distances are computed block by block, eight voxels at a time ([`nearest`], [`triangle`]).

pub mod lattice;
pub mod nearest;
pub mod region;
pub mod scanlines;
pub mod signs;
pub mod triangle;
pub mod vectors;
pub mod winding;

use lattice::Fixed;

/// An oriented triangle of a surface: the winding number is larger by `coef` behind it than in front of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Corners, counter-clockwise seen from outside.
    pub v: [Fixed; 3],
    /// Coefficient: how many layers of the volume end here; positive.
    pub coef: i32,
}
