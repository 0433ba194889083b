//! Detects whether the mesh is strained or at rest: accumulates by how much the liquid has displaced each vertex over the last steps, which
//! gives the change of edge lengths. Without it, edges near a limit of improvement would be remeshed forever by jittering particles.
//! Projection is excluded: where the surface depends on few particles, as on thin sheets, the surface moves ten times as far as they
//! jitter.

use crate::geometry::DVec3;

/// Steps from one reference to the next.
pub(in crate::surface) const WINDOW: u32 = 8;

/// Displacements since a reference step; empty if the mesh is not rebuilt.
#[derive(Debug, Clone, Default)]
pub(in crate::surface) struct Drift {
    /// Steps since the reference, less than [`WINDOW`].
    pub steps: u32,
    /// The displacement of each vertex (m). Vertices created since then began with 0, or with the mean displacement of the ends of the
    /// edge that they split.
    pub vertices: Vec<[f32; 3]>,
}

impl Drift {
    /// The drift of a mesh of this many vertices at a reference step.
    pub fn at_reference(vertices: usize) -> Self {
        Self { steps: 0, vertices: vec![[0.0; 3]; vertices] }
    }

    /// Displacements after a step in which the particles carried the vertices from `from` to `to` (m); the reference stays.
    pub fn after(&self, from: &[DVec3], to: &[DVec3]) -> Vec<[f32; 3]> {
        let moved = |(drift, (from, to)): (&[f32; 3], (&DVec3, &DVec3))| {
            let by = to - from;
            [0, 1, 2].map(|axis| drift[axis] + by[axis] as f32)
        };
        self.vertices.iter().zip(from.iter().zip(to)).map(moved).collect()
    }

    /// Counts a step, with the displacements (m) after it: every [`WINDOW`] steps the mesh becomes the new reference, and always if there
    /// are no vertices.
    pub fn next(&self, displacements: Vec<[f32; 3]>) -> Self {
        let steps = self.steps + 1;
        if steps < WINDOW && !displacements.is_empty() {
            Self { steps, vertices: displacements }
        } else {
            Self::at_reference(displacements.len())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};
    use crate::surface::{Params, Particles, Tracker};

    /// Frames in which the liquid is stretched, and those in which it rests.
    const MOVING: i32 = 18;
    const RESTING: i32 = 24;

    #[test]
    fn a_mesh_that_was_drawn_out_keeps_every_triangle_when_its_particles_only_tremble() {
        let ctx = context(2);
        let positions = shell(DVec3::zeros(), 0.0, 4.2);
        let mut seed = 1u64;
        let mut chance = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1u32 << 30) - 1.0
        };
        let mut at = |frame: i32| -> Particles {
            let long = libm::exp(0.05 * f64::from(frame.min(MOVING)));
            let thin = 1.0 / long.sqrt();
            let moved = |position: &DVec3| {
                let by = DVec3::new(chance(), chance(), chance()) * 0.0115;
                position.component_mul(&DVec3::new(long, thin, thin)) + by
            };
            numbered(positions.iter().map(moved).collect())
        };
        let mut from = at(0);
        let mesh = own_surface(&ctx, &from.positions);
        let params = Params { rebuild: true, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(&ctx, params, &mesh, &from).unwrap();
        let mut made = Vec::new();
        for frame in 1..=MOVING + RESTING {
            let to = at(frame);
            let report = tracker.step(&ctx, &from, &to, 0.04).unwrap();
            from = to;
            made.push(report.change.map_or(0, |change| change.made_triangles()));
            if frame == MOVING + 3 {
                // The state includes what is known about rest.
                let state = tracker.save();
                tracker = Tracker::resume(params, &mesh, &state).unwrap();
                assert!(tracker.save() == state && tracker.drift.steps != 0);
            }
        }
        let resting = made.split_off((MOVING as u32 + WINDOW) as usize);
        assert!(made.iter().sum::<usize>() > 500, "{made:?}");
        assert!(resting.iter().all(|made| *made == 0), "{resting:?}");
    }

    #[test]
    fn a_reference_is_as_old_as_the_window_at_most() {
        let mut drift = Drift::at_reference(1);
        let by = DVec3::new(0.5, 0.0, -0.25);
        for step in 1..=2 * WINDOW {
            let after = drift.after(&[by * f64::from(step - 1)], &[by * f64::from(step)]);
            assert_eq!(after[0][0], 0.5 * ((step - 1) % WINDOW + 1) as f32);
            drift = drift.next(after);
            assert_eq!(drift.steps, step % WINDOW);
        }
        assert_eq!(drift.vertices, [[0.0; 3]]);
    }
}
