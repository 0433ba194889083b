//! The volume that moving meshes sweep in an interval of time.
//!
//! [`chain`] is exact up to a tolerance: signed space-time tetrahedra (`chain/mod.rs`), poses dense enough for arcs (`moving_mesh/body.rs`),
//! edges split where their ends move differently (`moving_mesh/refine.rs`), passages ordered in time where a surface folds inside out
//! (`chain/folds.rs`, `moving_mesh/passages.rs`), winding numbers from exact line crossings (room `distance`,
//! `signed_distance/exposure.rs`), the parts of faces that bound the volume (`signed_distance/bins.rs`, `chain/facets.rs`; `chain/patch.rs`
//! where many sheets nearly coincide), then exact distances in the narrow band (room `distance`, `signed_distance/depth.rs`,
//! `signed_distance/voxelise.rs`). [`samples`] is the thesis' method (section 3.2): the union of N + 1 poses, dilated and smoothed.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | cell | the grid spacing, as a unit of length |
//! | voxel, block | a sample of the grid; 8 x 8 x 8 voxels |
//! | lattice, unit | the positions of voxels, relative to an origin voxel; 1/4096 cell, the step of fixed-point coordinates |
//! | pose, level, step | all vertices at one time; a pose in fixed point; the interval from one level to the next |
//! | chain | the solid at the first pose plus the tetrahedra that the surface sweeps outward, each counted with its sign |
//! | winding number | how many times the chain covers a point; the *volume* is where it is at least 1 |
//! | face, coefficient | a triangle of the chain's boundary; how many layers of the chain end there |
//! | open, buried | of a point on a face: the volume lies behind it and not in front of it; any other point |
//! | facet | a triangle of the volume's surface: an open part of a face, or part of a patch; *sure* if known to be open throughout |
//! | line, crossing | a line through voxels parallel to an axis; a point where it passes through a face |
//! | meeting, spot | a crossing at which the line enters or leaves the volume; a meeting together with its line |
//! | exposed | of a face: the outermost one at a meeting |
//! | bin | the unit cube around a voxel, with the faces that may pass through it; a block with few faces is a single bin |
//! | sheet, bundle, stack | adjoining faces; nearly coincident sheets; so many of them that the surface consists only of patches |
//! | patch | a piece of the plane of an exposed face, around a spot |
//! | passage | a tetrahedron through which the surface passes in a step |

mod chain;
mod moving_mesh;
#[cfg(feature = "vdb")]
mod samples;
mod signed_distance;
mod window;

pub use crate::distance::lattice::{REACH, too_far};
pub use moving_mesh::body::{Body, Shape};
#[cfg(feature = "vdb")]
pub use samples::{SamplesSettings, samples};

// For the modules that depend on this one, tests and benchmarks.
#[doc(hidden)]
pub use crate::distance::Face;
pub use crate::distance::lattice::{Fixed, Lattice, UNITS};
pub use crate::sweep::window::Window;
pub use chain::{Weights, boundary};
pub use moving_mesh::topology::Topology;
pub use signed_distance::voxelise::{ALL, Band, Piece, Scratch, Voxeliser};

use crate::error::{Error, Result, fail_if};

/// Default of [`Settings::tolerance`] (cells): the error of a sweep is far below what a level set can represent.
pub const TOLERANCE: f64 = 0.02;

/// Parameters of a swept volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Cell size (m).
    pub voxel: f64,
    /// Half width of the narrow band (cells), at least 3.
    pub half_width: f32,
    /// Maximum error against true arcs and flat moving triangles (cells), 0.001..=1.
    pub tolerance: f64,
}

impl Settings {
    /// Half width 3 and [`TOLERANCE`].
    pub fn new(voxel: f64) -> Self {
        Self { voxel, half_width: 3.0, tolerance: TOLERANCE }
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
            fail_if(!(low..=high).contains(&value), || {
                Error::argument(format!("{name} = {value} is not within {low} to {high} {unit}"))
            })?;
        }
        Ok(())
    }
}

/// Peak memory (bytes) of building a level set whose surface has an area of `area` m2, with cells of `cell` m.
pub fn surface_bytes(area: f64, cell: f64) -> u64 {
    // A band of six voxels crosses 1.6 blocks of 8 voxels on average, at slightly over four bytes per voxel; an inclined surface crosses
    // more; writing a file needs as much again.
    (area / (cell * cell) * 128.0).min(1.0e18) as u64
}

#[cfg(feature = "vdb")]
mod grid;
#[cfg(feature = "vdb")]
#[doc(hidden)]
pub use grid::fill;
#[cfg(feature = "vdb")]
pub use grid::{chain, voxelise, voxelise_within};
