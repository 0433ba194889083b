//! A mesh without liquid: before the first particles appear, and when all are gone.

use super::prefetch::Prefetch;
use crate::context::Context;
use crate::error::Result;
use crate::surface::Particles;
use crate::surface::params::Params;
use crate::surface::particles::paths::Paths;
use crate::surface::remesh::drift::Drift;
use crate::surface::report::StepReport;
use crate::surface::topology::change::{Change, FlaggedMesh};
use crate::surface::tracked_mesh::Tracker;

impl Tracker {
    /// A mesh without vertices: that of frames before the first particles. With `rebuild`, a step to a frame with particles makes a mesh
    /// from their surface.
    ///
    /// # Errors
    /// Parameters out of range.
    pub fn without_mesh(params: Params) -> Result<Self> {
        params.validate()?;
        // Its state includes its own triangles: none.
        Ok(Self { is_rebuilt: true, ..Self::of(params, Vec::new(), Vec::new()) })
    }

    /// A step to a frame without particles.
    pub(in crate::surface) fn dry_up(
        &mut self,
        ctx: &Context,
        from: &Particles,
        dt: f64,
    ) -> Result<StepReport> {
        let ((carried, report), phases) = ctx.step(10, || {
            let paths = Paths::between(from, &Particles::default(), dt)?;
            let (carried, parts) = ctx.phase("advect", || self.carried(ctx, &paths))?;
            let lost = self.vertices.len();
            Ok((carried, StepReport { lost, parts, died: paths.died, ..StepReport::default() }))
        })?;
        self.prefetch = Prefetch::default();
        let mut report = StepReport { phases, ..report };
        if !self.params.rebuild {
            self.flags.fill(true);
        } else if !self.vertices.is_empty() {
            let mesh = FlaggedMesh {
                vertices: &carried,
                triangles: &self.triangles,
                flags: &self.flags,
                uncovered: &[],
                full_check: None,
            };
            let change = Change::to_nothing(&mesh);
            self.apply_change(&change);
            self.drift = Drift::default();
            report.change = Some(change);
        }
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::geometry::check::faults::Faults;
    use crate::surface::Params;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};

    const DT: f64 = 0.04;

    /// A ball of particles, 1 m apart, around a position.
    fn ball(x: f64) -> Particles {
        numbered(shell(DVec3::new(x, 0.1, 0.2), 0.0, 4.2))
    }

    fn params(rebuild: bool) -> Params {
        Params { rebuild, ..Params::for_spacing(1.0) }
    }

    #[test]
    fn liquid_that_is_gone_and_comes_back_has_no_mesh_and_then_one_again() {
        let ctx = context(2);
        let (first, none, second) = (ball(0.0), Particles::default(), ball(20.0));
        let mesh = own_surface(&ctx, &first.positions);
        let mut tracker = Tracker::new(&ctx, params(true), &mesh, &first).unwrap();
        let report = tracker.step(&ctx, &first, &none, DT).unwrap();
        let change = report.change.unwrap();
        assert!(change.origins.is_empty() && change.before.len() == mesh.positions.len());
        assert_eq!((report.died, report.lost), (first.positions.len(), mesh.positions.len()));
        assert!(tracker.vertices().is_empty() && tracker.triangles().is_empty());
        let report = tracker.step(&ctx, &none, &none, DT).unwrap();
        assert!(report.change.is_none() && report.died == 0);
        // The saved state continues with the same bytes.
        let mut back = Tracker::resume(params(true), &mesh, &tracker.save()).unwrap();
        let report = tracker.step(&ctx, &none, &second, DT).unwrap();
        assert_eq!(report.born, second.positions.len());
        back.step(&ctx, &none, &second, DT).unwrap();
        assert!(back.save() == tracker.save());
        let faults = Faults::of(&tracker.mesh());
        assert!(faults.by_index.is_watertight() && faults.parts == 1, "{faults:?}");
        let wanted = own_surface(&ctx, &second.positions).volume();
        assert!((tracker.mesh().volume() / wanted - 1.0).abs() < 0.02, "{}", tracker.mesh().volume());
        // A mesh that starts without vertices gives the same result.
        let mut born = Tracker::without_mesh(params(true)).unwrap();
        born.step(&ctx, &none, &second, DT).unwrap();
        assert!(born.triangles() == tracker.triangles() && born.vertices() == tracker.vertices());
    }

    #[test]
    fn a_mesh_that_is_not_rebuilt_waits_where_it_was() {
        let ctx = context(2);
        let (first, none) = (ball(0.0), Particles::default());
        let mesh = own_surface(&ctx, &first.positions);
        let mut tracker = Tracker::new(&ctx, params(false), &mesh, &first).unwrap();
        let before = tracker.vertices().to_vec();
        let report = tracker.step(&ctx, &first, &none, DT).unwrap();
        assert!(report.lost == before.len() && tracker.flags().iter().all(|flag| *flag));
        assert!(tracker.vertices() == before);
        let report = tracker.step(&ctx, &none, &first, DT).unwrap();
        assert!(report.lost == 0 && tracker.vertices() == before);
    }
}
