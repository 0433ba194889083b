//! A detailed triangle mesh that follows a particle liquid and keeps its detail where the liquid neither breaks nor stretches (thesis
//! chapter 2).
//!
//! In each frame the particles carry the mesh along (`track/advect.rs`), then each vertex is moved to the distance from the particles'
//! surface that it had at the first frame (`track/project.rs`). That surface is the zero set of an implicit function of the particles
//! (`level_set/implicit.rs`), converted to signed distances (`level_set/band.rs`). Where this would move vertices too far, the liquid has
//! merged or split: these vertices are flagged, and so are those beside a part of the surface that the mesh does not cover
//! (`topology/coverage.rs`).
//!
//! There the mesh is changed (`topology/update.rs`, `topology/change.rs`): the signed distances from it take the topology of phi, the
//! function above (`topology/mesh_distance.rs`, `topology/matching/`), and it is cut and rebuilt in the cells where it no longer fits
//! (`mesh_repair`). Parts without liquid are removed (`topology/dry_parts.rs`), stretched edges are split and compressed ones collapsed
//! (`remesh/`).
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | spacing, r | initial distance between particles |
//! | cell, node | a cube of the grid, also the length of its edge, r / 2 by default; a corner of such a cube, where phi is known |
//! | phi | the implicit function of the particles; then the signed distance from its zero set, negative inside |
//! | delta | the distance from phi = 0 that a vertex keeps: its detail, with the sign of phi |
//! | fading | delta shrinks: detail of a runny liquid is not retained |
//! | patch | 4 x 4 x 4 nodes, which are evaluated together |
//! | foot | the projection of a vertex onto phi = 0: the vertex without its detail |
//! | covered | of a position on phi = 0: a triangle whose corners are feet is near it |
//! | Gamma, psi | the signed distance from the mesh; Gamma - phi |
//! | change | how a step changed the mesh's vertices and triangles, where it was rebuilt or improved |
//! | flagged | of a vertex: its projection failed or jumped (it stays where advection put it), or there is uncovered surface beside its foot |

// Kernels index several arrays by one lane or axis.
#![allow(clippy::needless_range_loop)]

mod level_set;
mod params;
mod particles;
mod pieces;
mod remesh;
mod report;
mod state;
#[cfg(test)]
pub(crate) mod test_particles;
mod topology;
mod track;
mod tracked_mesh;
mod tracker;

pub use crate::surface::params::Weighting;
pub use crate::surface::particles::paths::VelocityMismatch;
pub use level_set::SUPPORT;
pub use level_set::band::Distances;
pub use level_set::implicit::Implicit;
pub use level_set::isosurface::Isosurface;
#[doc(hidden)]
#[cfg(feature = "vdb")]
pub use level_set::openvdb::{HALF_WIDTH, level_set};
#[cfg(feature = "vdb")]
pub use level_set::openvdb::{is_sphere_radius, spheres};
pub use level_set::sampler::Sampler;
pub use level_set::smooth::smooth;
pub use params::Params;
pub use particles::agreement::disagreement;
pub use particles::grid::TOO_FAR;
pub use particles::paths::interpolate;
pub use particles::rest_position::Rest;
pub use particles::spacing::{estimate as estimate_spacing, rough as rough_spacing};
pub use particles::specks::specks;
pub use particles::transfer::transfer;
pub use remesh::Improvements;
pub use report::StepReport;
pub use topology::change::Change;
pub use topology::matching::{Matched, Matching, Node, Solver, match_topology};
pub use topology::uncovered_parts::UncoveredPart;
pub use track::advect::carried;
pub use track::easing::{Eased, EasingTargets, eased};
pub use track::easing_limit::{Displaced, uncrossed};
pub use track::lookahead::{Outlook, displaced};
pub use track::project::{Foot, foot};
pub use tracked_mesh::Tracker;

use crate::error::{Error, Result};
use crate::geometry::DVec3;

/// Particles of a frame; each array that is not empty has one value for each particle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Velocities (m/s); may be empty.
    pub velocities: Vec<[f32; 3]>,
    /// Ids that identify particles from frame to frame; may be empty.
    pub ids: Vec<i64>,
}

impl Particles {
    /// Checks that arrays have one value for each particle, that numbers are finite and ids unique. There may be no particles.
    ///
    /// # Errors
    /// Names the first particle at fault, counted from 1.
    pub fn validate(&self) -> Result<()> {
        let count = self.positions.len();
        let refuse = |what: String| Err(Error::argument(what));
        for (name, length) in [("velocities", self.velocities.len()), ("ids", self.ids.len())] {
            if length != 0 && length != count {
                return refuse(format!("there are {count} particles, but {length} {name}"));
            }
        }
        if let Some(at) = self.positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
            return refuse(format!("the position of particle {} is not finite", at + 1));
        }
        if let Some(at) = self.velocities.iter().position(|speed| !speed.iter().all(|x| x.is_finite())) {
            return refuse(format!("the velocity of particle {} is not finite", at + 1));
        }
        if self.ids.windows(2).all(|pair| pair[0] < pair[1]) {
            return Ok(());
        }
        let mut ids: Vec<(i64, usize)> = self.ids.iter().copied().zip(1..).collect();
        ids.sort_unstable();
        match ids.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => {
                refuse(format!("particles {} and {} have the same id, {}", pair[0].1, pair[1].1, pair[0].0))
            }
            None => Ok(()),
        }
    }
}
