//! The surface of the particles to come, made while the mesh is rebuilt: that work keeps few threads busy.

use std::sync::Arc;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::surface::Particles;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::isosurface::Isosurface;
use crate::surface::tracker::Tracker;

/// Where phi is 0, and its triangles.
type Surface = Arc<(Implicit, Isosurface)>;

/// What is known of particles to come.
#[derive(Debug, Clone, Default)]
pub(in crate::surface) struct Ahead {
    /// Those whose surface is to be made during the next step.
    wanted: Option<Arc<Particles>>,
    /// Those whose surface is there, and that.
    ready: Option<(Arc<Particles>, Surface)>,
}

impl Ahead {
    /// The surface of particles at these positions, if it is there.
    pub fn ready(&self, positions: &[DVec3]) -> Option<Surface> {
        self.ready
            .as_ref()
            .filter(|(own, _)| *own.positions == *positions)
            .map(|(_, surface)| surface.clone())
    }
}

impl Tracker {
    /// Hands over the particles to which the step after the coming one goes: where the mesh is rebuilt, their surface is made at the same
    /// time, on threads that have nothing to do. The result is identical.
    pub fn set_ahead(&mut self, particles: Arc<Particles>) {
        self.ahead.wanted = Some(particles);
    }

    /// Drops the surface that was made ahead: the step that it is for is done elsewhere.
    pub fn forget_ahead(&mut self) {
        self.ahead = Ahead::default();
    }

    /// Does some work, and makes the surface of the particles to come at the same time.
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
            // What fails here fails again when it is that frame's turn, and is told there.
            let ready = made.ok().map(|surface| (particles.clone(), Arc::new(surface)));
            Ok((done, Ahead { wanted: None, ready }))
        })
    }
}
