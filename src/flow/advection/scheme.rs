//! How values are advected.

use crate::flow::Flow;

/// Advection scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// First order: stable, diffusive.
    SemiLagrangian,
    /// MacCormack (second order) for velocities and cubic interpolation for the density; no new extrema.
    #[default]
    Bounded,
    /// The same without bounds: to measure the order of convergence.
    Unbounded,
}

/// Inputs of an advection step.
pub struct AdvectionStep<'a> {
    /// Velocity (m/s) of the air outside all tiles.
    pub ambient: [f32; 3],
    /// Displacement (cells) per speed (m/s): the time divided by the cell's edge (s/m).
    pub scale: f32,
    pub scheme: Scheme,
    /// The surrounding air after the step.
    pub around: Option<&'a Flow>,
    /// How the mass of the density is conserved; none: only as well as the scheme does.
    pub conservation: Option<MassConservation>,
}

/// How the mass of an advected density is conserved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassConservation {
    /// Share 0..=1 of the mass that remains.
    pub kept_share: f32,
    /// Densities below this fade over several steps; their mass goes to neighbouring density.
    pub fade_below: f32,
}
