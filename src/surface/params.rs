//! Parameters of a mesh that follows particles.

use crate::error::{Error, Result, fail_if};

/// Parameters of a mesh that follows particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Initial distance r between particles (m), over 0.
    pub spacing: f64,
    /// Edge of a cell (r), 0.125..=2 (thesis 2.7: 0.5).
    pub cell: f64,
    /// Maximum distance (r) that projection may move a vertex; beyond, the liquid has merged or split there (thesis 2.3.3: 0.5).
    pub change: f64,
    /// How particles carry vertices.
    pub weighting: Weighting,
    /// Time (s) in which half of the detail fades (suggested in thesis 2.8), over 0; infinite: detail does not fade with time.
    pub half_life: f64,
    /// How much detail fades where the mesh is strained: it shrinks to exp(-fade) times its size when lengths change by a factor of e;
    /// 0..=1000.
    pub fade: f64,
    /// Whether the mesh is rebuilt where the liquid merges or splits (thesis 2.4, 2.5); it must then be a closed 2-manifold by index. If
    /// false, vertices are only flagged there.
    pub rebuild: bool,
    /// If the mesh is rebuilt: whether its topology is matched to that of the particles everywhere and in every step (thesis 2.8),
    /// including bubbles; if false, only where vertices are flagged, and at drops.
    pub every: bool,
    /// If the mesh is rebuilt: minimum count of particles in a part of the mesh, 0..=1,000,000. Parts with fewer are removed, and drops
    /// with fewer get no mesh; with 0 and 1 only parts without any particle inside are removed. If at least one particle lies inside a
    /// part, those outside within half a spacing of it count too. If the mesh has only one part, this rule
    /// does not remove it.
    pub min_drop: usize,
}

impl Params {
    /// The thesis' values, for particles with this spacing (m), except that the weighting is affine and the mesh is not rebuilt.
    pub fn for_spacing(spacing: f64) -> Self {
        let (half_life, fade) = (f64::INFINITY, 0.0);
        let weighting = Weighting::Affine;
        let (rebuild, every, min_drop) = (false, false, 1);
        Self { spacing, cell: 0.5, change: 0.5, weighting, half_life, fade, rebuild, every, min_drop }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field and its range.
    pub fn validate(&self) -> Result<()> {
        let ranges = [
            ("spacing", self.spacing, 1e-9, 1e6, "m"),
            ("cell", self.cell, 0.125, 2.0, "r"),
            ("change", self.change, 1e-3, 100.0, "r"),
            ("half_life", self.half_life, f64::MIN_POSITIVE, f64::INFINITY, "s"),
            ("fade", self.fade, 0.0, 1000.0, ""),
            ("min_drop", self.min_drop as f64, 0.0, 1e6, "particles"),
        ];
        for (name, value, low, high, unit) in ranges {
            fail_if(!(low..=high).contains(&value), || {
                Error::argument(format!("{name} = {value} is not within {low} to {high} {unit}"))
            })?;
        }
        Ok(())
    }
}

/// How the displacements of particles are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weighting {
    /// By affine maps.
    #[default]
    Affine,
    /// By their mean (thesis 2.2).
    Mean,
}
