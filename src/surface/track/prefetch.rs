//! The surface of the coming particles, computed while the mesh is rebuilt, which keeps few threads busy.

use std::sync::Arc;

use super::ahead::Ahead;
use crate::context::Context;
use crate::error::Result;
use crate::surface::Particles;
use crate::surface::tracked_mesh::Tracker;

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
