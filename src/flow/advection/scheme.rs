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

/// How a step advects a flow.
pub struct Way<'a> {
    /// Velocity (m/s) of the air outside all tiles.
    pub ambient: [f32; 3],
    /// Displacement in cells of a value at 1 m/s: the time over the cell's edge (s/m).
    pub scale: f32,
    pub scheme: Scheme,
    /// The surrounding air after the step.
    pub around: Option<&'a Flow>,
    /// How the density conserves its mass; none: only as well as the scheme does.
    pub keeping: Option<Keeping>,
}

/// What happens to a density besides advection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keeping {
    /// Share 0..=1 of the mass that remains.
    pub share: f32,
    /// Densities below this fade over several steps; their mass goes to neighbouring density.
    pub least: f32,
}
