//! The state of a tracker: its mesh, the detail of each vertex, and settings.

use super::params::Params;
use super::remesh::Size;
use super::remesh::drift::Drift;
use super::track::prefetch::Prefetch;
use crate::error::{Error, Result, fail_if};
use crate::geometry::{DVec3, TriMesh};

/// Minimum reach of the band, and the maximum that is tried at the first frame (r).
pub(in crate::surface) const REACH: [f64; 2] = [1.5, 8.0];

/// Factor on the vertices' deltas in the reach of the band (thesis 2.3.1).
pub(in crate::surface) const WIDER: f64 = 1.25;

/// Maximum drift of a vertex in a frame, where nothing merges or splits (r).
pub(in crate::surface) const DRIFT: f64 = 0.25;

/// A detailed mesh that follows particles.
#[derive(Debug, Clone)]
pub struct Tracker {
    pub(super) params: Params,
    /// Positions of vertices (m).
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Distance from the surface that each vertex keeps (m); NaN: it was too far from the surface to have one.
    pub(super) delta: Vec<f32>,
    /// Detail retention of each vertex, 0 (fades as fast as the parameters say) to 1 (never fades); empty: 0 everywhere.
    pub(super) detail_retention: Vec<f32>,
    /// Vertices where the last step found a change.
    pub(super) flags: Vec<bool>,
    /// Whether each vertex lay beside surface that the mesh did not cover at the first frame: there, uncovered surface is never reported as
    /// a change.
    pub(super) never_covered: Vec<bool>,
    /// Distance from the surface up to which distances are known (r).
    pub(super) reach: f64,
    /// Whether the triangles are no longer the initial ones.
    pub(super) is_rebuilt: bool,
    /// Lengths (m) of the shortest and of the longest edge around each vertex at its birth; empty if the mesh is not rebuilt.
    pub(super) sizes: Vec<Size>,
    /// Displacements of the vertices over the last steps; empty if the mesh is not rebuilt.
    pub(super) drift: Drift,
    /// Prefetched surface of the coming particles.
    pub(super) prefetch: Prefetch,
}

impl Tracker {
    /// A mesh with vertices at these positions (m); all other state is empty.
    pub(super) fn of(params: Params, vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let (delta, detail_retention, flags, never_covered, sizes) = Default::default();
        let (reach, is_rebuilt, drift, prefetch) = (REACH[0], false, Drift::default(), Prefetch::default());
        Self {
            params,
            vertices,
            triangles,
            delta,
            detail_retention,
            flags,
            never_covered,
            reach,
            is_rebuilt,
            sizes,
            drift,
            prefetch,
        }
    }

    /// Sets the parameters from the next step on.
    ///
    /// # Errors
    /// A parameter out of range, another spacing or cell, or a different `rebuild` flag; the old parameters are then kept.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        for (name, old, new) in
            [("spacing", self.params.spacing, params.spacing), ("cell", self.params.cell, params.cell)]
        {
            fail_if(old != new, || Error::argument(format!("{name} = {new} cannot change, it is {old}")))?;
        }
        if self.params.rebuild != params.rebuild {
            return Err(Error::argument("whether the mesh is rebuilt cannot change"));
        }
        self.params = params;
        Ok(())
    }

    /// Sets the detail retention of each vertex, 0 (fades as fast as the parameters say) to 1 (never fades); empty: 0 everywhere.
    ///
    /// # Errors
    /// A count other than that of the vertices; a share out of range, reported with its vertex, counted from 1.
    pub fn set_detail_retention(&mut self, shares: Vec<f32>) -> Result<()> {
        let count = self.vertices.len();
        fail_if(!shares.is_empty() && shares.len() != count, || {
            Error::argument(format!("there are {count} vertices, but {} shares of detail", shares.len()))
        })?;
        if let Some(at) = shares.iter().position(|share| !(0.0..=1.0).contains(share)) {
            let what = format!("detail of vertex {} is {}, not within 0 to 1", at + 1, shares[at]);
            return Err(Error::argument(what));
        }
        self.detail_retention = shares;
        Ok(())
    }

    /// The current parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// The mesh (m).
    pub fn mesh(&self) -> TriMesh {
        TriMesh {
            positions: self.vertices.iter().map(|position| position.cast()).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// The triangles: the initial ones, until a step changes them.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Whether any step, or [`Tracker::resculpt`], has changed vertices or triangles: by rebuilding, or only by splitting, collapsing or
    /// flipping edges.
    pub fn is_rebuilt(&self) -> bool {
        self.is_rebuilt
    }

    /// Positions of the vertices (m).
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Distance from the particles' surface that each vertex keeps (m), negative inside; NaN: it was too far away to have one.
    pub fn delta(&self) -> &[f32] {
        &self.delta
    }

    /// Vertices at which the last step found a change: those that it could not project, and those beside uncovered surface.
    pub fn flags(&self) -> &[bool] {
        &self.flags
    }
}
