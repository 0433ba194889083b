//! Replaces the tracked mesh by one that was edited by hand.

use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::surface::Particles;
use crate::surface::report::StepReport;
use crate::surface::tracked_mesh::Tracker;

impl Tracker {
    /// Replaces the mesh by an edited one (m) with any vertices and triangles. `particles` are those of the tracker's current frame: those
    /// to which the last step went, or with which it began. The distance of each vertex is measured anew and kept from then on; the
    /// parameters stay, detail retention is replaced ([`Tracker::set_detail_retention`]), no vertex is flagged. The report is that of
    /// [`Tracker::begin`]. After an error the tracker is unchanged.
    ///
    /// States saved after this contain the edited mesh's triangles; [`Tracker::resume`] still takes the initial mesh.
    ///
    /// # Errors
    /// As [`Tracker::begin`] and [`Tracker::set_detail_retention`].
    pub fn resculpt(
        &mut self,
        ctx: &Context,
        mesh: &TriMesh,
        detail_retention: Vec<f32>,
        particles: &Particles,
    ) -> Result<StepReport> {
        let ((mut next, report), phases) = ctx.step(4, || Self::begin(ctx, self.params, mesh, particles))?;
        next.set_detail_retention(detail_retention)?;
        // Even if the triangles are the initial ones: sizes and detail retention are no longer those of the initial mesh.
        next.is_rebuilt = true;
        // The surface of the coming particles is the same for every mesh.
        next.prefetch = std::mem::take(&mut self.prefetch);
        *self = next;
        Ok(StepReport { phases, ..report })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{DVec3, Vec3};
    use crate::surface::Params;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};

    /// Height of the bump (m); particles lie 1 m apart.
    const HEIGHT: f64 = 0.8;
    const DT: f64 = 1.0 / 24.0;

    /// The middle of the ball at a frame (m).
    fn middle(frame: i32) -> DVec3 {
        DVec3::new(0.3, 0.1, -0.2) * f64::from(frame)
    }

    /// A ball of particles that travels.
    fn ball(frame: i32) -> Particles {
        numbered(shell(middle(frame), 0.0, 5.2))
    }

    /// A mesh of its surface that has followed it to a frame, and the initial mesh.
    fn followed(ctx: &Context, rebuild: bool, frame: i32) -> (Tracker, TriMesh) {
        let first = ball(0);
        let mesh = own_surface(ctx, &first.positions);
        let params = Params { rebuild, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(ctx, params, &mesh, &first).unwrap();
        go_on(ctx, &mut tracker, [0, frame]);
        (tracker, mesh)
    }

    fn go_on(ctx: &Context, tracker: &mut Tracker, [from, to]: [i32; 2]) {
        for frame in from..to {
            tracker.step(ctx, &ball(frame), &ball(frame + 1), DT).unwrap();
        }
    }

    /// Height of the mesh above the ball's middle (m).
    fn top(tracker: &Tracker, frame: i32) -> f64 {
        tracker.vertices().iter().map(|position| (position - middle(frame)).y).fold(0.0, f64::max)
    }

    /// The mesh of a frame with a bump on top.
    fn with_bump(tracker: &Tracker, frame: i32) -> TriMesh {
        let mut mesh = tracker.mesh();
        for position in &mut mesh.positions {
            let out = (position.cast::<f64>() - middle(frame)).normalize();
            let share = ((out.y - 0.7) / 0.3).clamp(0.0, 1.0);
            *position += (out * (HEIGHT * share)).cast::<f32>();
        }
        mesh
    }

    #[test]
    fn a_bump_that_was_sculpted_into_a_later_frame_stays() {
        let ctx = context(2);
        for rebuild in [false, true] {
            let (mut tracker, _) = followed(&ctx, rebuild, 5);
            let plain = top(&tracker, 5);
            let report = tracker.resculpt(&ctx, &with_bump(&tracker, 5), Vec::new(), &ball(5)).unwrap();
            assert!(report.lost == 0 && report.change.is_none() && report.triangles > 100);
            assert!(tracker.flags().iter().all(|flag| !flag));
            let most = |tracker: &Tracker| tracker.delta().iter().copied().fold(0.0, f32::max);
            let (height, delta) = (top(&tracker, 5), most(&tracker));
            assert!(height - plain > 0.9 * HEIGHT, "{plain} to {height}");
            assert!((f64::from(delta) - HEIGHT).abs() < 0.15, "{delta}");
            go_on(&ctx, &mut tracker, [5, 10]);
            assert!((top(&tracker, 10) - height).abs() < 0.2, "{height} to {}", top(&tracker, 10));
            assert!((most(&tracker) - delta).abs() < 0.1, "{delta} to {}", most(&tracker));
        }
    }

    #[test]
    fn a_state_after_it_goes_on_with_the_same_bytes() {
        let ctx = context(2);
        for rebuild in [false, true] {
            let (mut tracker, first) = followed(&ctx, rebuild, 2);
            tracker.set_detail_retention(vec![0.5; tracker.vertices().len()]).unwrap();
            let mut edited = with_bump(&tracker, 2);
            if !rebuild {
                // A mesh that is not rebuilt may be open.
                edited.triangles.truncate(edited.triangles.len() - 2);
            }
            tracker.resculpt(&ctx, &edited, Vec::new(), &ball(2)).unwrap();
            assert!(tracker.is_rebuilt() && tracker.triangles() == edited.triangles);
            assert!(tracker.detail_retention.is_empty());
            tracker.set_detail_retention(vec![0.25; edited.positions.len()]).unwrap();
            let state = tracker.save();
            // A state belongs to the initial mesh.
            let mut back = Tracker::resume(tracker.params, &first, &state).unwrap();
            assert!(back.save() == state && back.detail_retention == tracker.detail_retention);
            go_on(&ctx, &mut tracker, [2, 4]);
            go_on(&ctx, &mut back, [2, 4]);
            assert!(back.save() == tracker.save() && state != tracker.save());
        }
    }

    #[test]
    fn a_mesh_that_does_not_fit_leaves_the_tracker_as_it_was() {
        let ctx = context(2);
        let (mut tracker, _) = followed(&ctx, true, 1);
        let before = tracker.save();
        let refused = |tracker: &mut Tracker, mesh: &TriMesh, words: &str| {
            let error = tracker.resculpt(&ctx, mesh, Vec::new(), &ball(1)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            assert!(tracker.save() == before, "{words}");
        };
        let mut open = tracker.mesh();
        open.triangles.pop();
        refused(&mut tracker, &open, "not closed and 2-manifold by index");
        let mut far = tracker.mesh();
        far.positions.iter_mut().for_each(|position| *position += Vec3::new(100.0, 0.0, 0.0));
        refused(&mut tracker, &far, "same space");
        refused(&mut tracker, &TriMesh::default(), "");
        ctx.cancel();
        let mesh = tracker.mesh();
        refused(&mut tracker, &mesh, "cancelled");
        ctx.reset();
        tracker.resculpt(&ctx, &mesh, Vec::new(), &ball(1)).unwrap();
    }
}
