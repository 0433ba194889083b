//! The volume that moving meshes sweep in an interval of time.
//!
//! [`chain`] is exact up to a tolerance: signed space-time tetrahedra (`chain.rs`), poses dense enough
//! for arcs (`body.rs`), edges cut where their ends move differently (`refine.rs`), order in time where a skin folds
//! inside out (`folds.rs`, `passages.rs`), winding numbers by exact line crossings (`winding.rs`, `exposure.rs`), the
//! parts of faces that bound the volume (`cells.rs`, `surface.rs`; `patch.rs` where many sheets nearly coincide), then
//! exact distances in the narrow band (`nearest.rs`, `depth.rs`, `voxelise.rs`).
//! [`samples`] is the thesis' way (section 3.2): the union of N + 1 poses, dilated and smoothed.

mod body;
mod cells;
mod chain;
mod columns;
mod depth;
mod distance;
mod exposure;
mod folds;
mod lattice;
mod lists;
mod nearest;
mod passages;
mod patch;
mod prism;
mod refine;
mod region;
#[cfg(feature = "vdb")]
mod samples;
mod signs;
mod surface;
mod topology;
mod voxelise;
mod winding;

pub use body::{Body, Shape};
pub use chain::{Face, Weights, Window, boundary};
pub use lattice::{Fixed, Lattice, REACH, UNITS, too_far};
pub use nearest::Scratch;
#[cfg(feature = "vdb")]
pub use samples::{SamplesSettings, samples};
pub use topology::Topology;
pub use voxelise::{ALL, Band, Piece, Voxeliser};

use crate::error::{Error, Result};

/// How a swept volume is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Cell size (m).
    pub voxel: f64,
    /// Half width of the narrow band (cells), at least 3.
    pub half_width: f32,
    /// Largest error against true arcs and flat moving triangles (cells), 0.001..=1.
    pub tolerance: f64,
}

impl Settings {
    /// Half width 3 and a tolerance of 0.02 cell.
    pub fn new(voxel: f64) -> Self {
        Self { voxel, half_width: 3.0, tolerance: 0.02 }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field and its range.
    pub fn validate(&self) -> Result<()> {
        let ranges = [
            ("cell", self.voxel, 1e-6, 1e3, "m"),
            ("half width", f64::from(self.half_width), 3.0, 64.0, "cells"),
            ("tolerance", self.tolerance, 0.001, 1.0, "cells"),
        ];
        for (name, value, low, high, unit) in ranges {
            if !(low..=high).contains(&value) {
                return Err(Error::argument(format!(
                    "{name} = {value} is not within {low} to {high} {unit}"
                )));
            }
        }
        Ok(())
    }
}

/// Memory (bytes) that a level set of a surface of `area` m2 takes while it is made.
pub fn surface_bytes(area: f64, cell: f64) -> u64 {
    // A band of six voxels crosses 1.6 blocks of 8 voxels on average, of four bytes and a bit each; a surface that is
    // not level crosses more; a file in the making takes as much again.
    (area / (cell * cell) * 128.0).min(1.0e18) as u64
}

#[cfg(feature = "vdb")]
mod grid;
#[cfg(feature = "vdb")]
pub use grid::{chain, fill, voxelise};
