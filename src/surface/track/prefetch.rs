//! Prefetching: the surface of the coming particles is computed in advance.

use std::sync::Arc;

use crate::geometry::DVec3;
use crate::surface::Particles;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::isosurface::Isosurface;

/// The implicit function and the triangles of its zero set.
type Surface = Arc<(Implicit, Isosurface)>;

/// The prefetched surface, or the request for it.
#[derive(Debug, Clone, Default)]
pub(in crate::surface) struct Prefetch {
    /// Particles whose surface is to be computed during the next step.
    pub(in crate::surface) wanted: Option<Arc<Particles>>,
    /// Particles whose surface is ready, and that surface.
    pub(in crate::surface) ready: Option<(Arc<Particles>, Surface)>,
}

impl Prefetch {
    /// The surface of particles at these positions, if it is ready.
    pub fn ready(&self, positions: &[DVec3]) -> Option<Surface> {
        self.ready
            .as_ref()
            .filter(|(own, _)| *own.positions == *positions)
            .map(|(_, surface)| surface.clone())
    }
}
