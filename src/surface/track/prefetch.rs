//! The surface of the coming particles, computed while the mesh is rebuilt, which keeps few threads busy.

use std::sync::Arc;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::surface::Particles;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::isosurface::Isosurface;
use crate::surface::tracker::Tracker;

/// The implicit function and the triangles of its zero set.
type Surface = Arc<(Implicit, Isosurface)>;

/// Data of the coming particles.
#[derive(Debug, Clone, Default)]
pub(in crate::surface) struct Ahead {
    /// Particles whose surface is to be computed during the next step.
    wanted: Option<Arc<Particles>>,
    /// Particles whose surface is ready, and that surface.
    ready: Option<(Arc<Particles>, Surface)>,
}

impl Ahead {
    /// The surface of particles at these positions, if it is ready.
    pub fn ready(&self, positions: &[DVec3]) -> Option<Surface> {
        self.ready
            .as_ref()
            .filter(|(own, _)| *own.positions == *positions)
            .map(|(_, surface)| surface.clone())
    }
}

impl Tracker {
    /// Prefetches the particles of the step after next: while the mesh is rebuilt, their surface is computed on idle threads. The result is
    /// identical.
    pub fn set_ahead(&mut self, particles: Arc<Particles>) {
        self.ahead.wanted = Some(particles);
    }

    /// Drops the prefetched surface: its step is done elsewhere.
    pub fn forget_ahead(&mut self) {
        self.ahead = Ahead::default();
    }

    /// Runs `work`, and computes the surface of the coming particles at the same time.
    pub(in crate::surface) fn with_next<R>(
        &self,
        ctx: &Context,
        work: impl FnOnce() -> Result<R>,
    ) -> Result<(R, Ahead)> {
        let wanted = self.ahead.wanted.clone().filter(|_| ctx.pool().threads() > 1);
        std::thread::scope(|scope| {
            let surface_of = |particles: &Particles| ctx.pool().install(|| self.surface_of(ctx, particles));
            let making = wanted.as_ref().map(|particles| scope.spawn(move || surface_of(particles)));
            let done = work()?;
            let (Some(making), Some(particles)) = (making, &wanted) else {
                return Ok((done, Ahead::default()));
            };
            let made = making.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            // An error here will occur again in that frame's own step, and is reported there.
            let ready = made.ok().map(|surface| (particles.clone(), Arc::new(surface)));
            Ok((done, Ahead { wanted: None, ready }))
        })
    }
}
