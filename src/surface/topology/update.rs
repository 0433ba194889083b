//! The topology update of a tracker: after each step its mesh is rebuilt where it no longer fits its liquid.

use rayon::prelude::*;

use super::change::{Change, FlaggedMesh, finish, rebuild};
use super::full_check::FullCheck;
use super::uncovered_parts::is_near;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::coords::cell_of;
use crate::geometry::{Coord, DVec3};
use crate::surface::level_set::band::Distances;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::params::Params;
use crate::surface::tracked_mesh::Tracker;
use crate::surface::tracker::{Coverage, Next};

impl Tracker {
    /// The change of the mesh after a step: rebuilt where it no longer fits, improved elsewhere. None if it stays as it is.
    pub(in crate::surface) fn changed_mesh(
        &self,
        ctx: &Context,
        next: &Next,
        feet: &[Option<DVec3>],
        coverage: &Coverage,
        (phi, distances): (&Implicit, &Distances),
        particles: &[DVec3],
    ) -> Result<Option<Change>> {
        // A vertex without a distance to keep did not fit at the first frame either: that is no change.
        let mut flags: Vec<bool> =
            next.flags.iter().zip(&next.delta).map(|(flag, delta)| *flag && !delta.is_nan()).collect();
        self.unflag_lone_jumps(&mut flags, &coverage.uncovered);
        let bin = |position: &DVec3| cell_of(&(position / coverage.reach));
        let beside =
            feet.iter().zip(&coverage.uncovered).filter(|(_, is)| **is).filter_map(|(foot, _)| foot.as_ref());
        let mut beside: Vec<Coord> = beside.map(bin).collect();
        beside.par_sort_unstable();
        beside.dedup();
        let mut uncovered: Vec<DVec3> =
            coverage.positions.iter().filter(|position| is_near(&beside, bin(position))).copied().collect();
        uncovered.extend_from_slice(&coverage.missing.positions);
        let Params { spacing, cell, change: farthest, every, .. } = self.params;
        let specks = &coverage.missing.specks;
        let full_check = every.then(|| FullCheck { delta: &next.delta, spacing: 1.0 / cell, specks });
        let (vertices, triangles) = (&next.vertices, &self.triangles);
        let mesh = FlaggedMesh { vertices, triangles, flags: &flags, uncovered: &uncovered, full_check };
        let rebuilt = rebuild(ctx, &mesh, phi, distances)?;
        let particle_count_test = self.particle_count_test(particles);
        let own = (&*self.sizes, &*next.drifts);
        finish(ctx, &mesh, own, rebuilt, distances, &particle_count_test, farthest * spacing)
    }

    /// Unflags vertices that jump while no neighbour does, were not flagged in the last step, and have only covered surface beside them. In
    /// most such cases the foot slips over a crease and comes back; rebuilding the crease would lose much of the mesh. Lasting changes are
    /// flagged again in the next step.
    fn unflag_lone_jumps(&self, flags: &mut [bool], uncovered: &[bool]) {
        if !flags.contains(&true) {
            return;
        }
        let mut is_alone = vec![true; flags.len()];
        for corners in &self.triangles {
            for (at, next) in [(0, 1), (1, 2), (2, 0)] {
                let ends = [corners[at] as usize, corners[next] as usize];
                if ends.iter().all(|end| flags[*end]) {
                    ends.iter().for_each(|end| is_alone[*end] = false);
                }
            }
        }
        for (at, flag) in flags.iter_mut().enumerate() {
            *flag &= !is_alone[at] || uncovered[at] || self.flags[at];
        }
    }

    /// Replaces the mesh by the changed one, and carries all values of vertices over.
    pub(in crate::surface) fn apply_change(&mut self, change: &Change) {
        let mut made = change.delta.iter();
        let delta =
            |at: &Option<u32>| at.map_or_else(|| *made.next().unwrap_or(&0.0), |at| self.delta[at as usize]);
        self.delta = change.origins.iter().map(delta).collect();
        let flag = |flags: &[bool], at: &Option<u32>| at.is_some_and(|at| flags[at as usize]);
        self.flags = change.origins.iter().map(|at| flag(&self.flags, at)).collect();
        self.never_covered = change.origins.iter().map(|at| flag(&self.never_covered, at)).collect();
        if !self.detail_retention.is_empty() {
            self.detail_retention = change.carried_shares(&self.detail_retention);
        }
        self.sizes.clone_from(&change.sizes);
        self.drift.vertices.clone_from(&change.drifts);
        self.vertices.clone_from(&change.vertices);
        self.triangles.clone_from(&change.triangles);
        self.is_rebuilt = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};

    #[test]
    fn a_vertex_that_jumps_alone_has_a_step_to_come_back() {
        let particles = numbered(shell(DVec3::zeros(), 0.0, 3.2));
        let ctx = context(1);
        let mesh = own_surface(&ctx, &particles.positions);
        let params = Params { rebuild: true, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(&ctx, params, &mesh, &particles).unwrap();
        let none = vec![false; mesh.positions.len()];
        let waited = |tracker: &Tracker, flagged: &[u32], uncovered: &[bool]| {
            let mut flags = none.clone();
            flagged.iter().for_each(|at| flags[*at as usize] = true);
            tracker.unflag_lone_jumps(&mut flags, uncovered);
            (0..).zip(flags).filter(|(_, flag)| *flag).map(|(at, _)| at).collect::<Vec<u32>>()
        };
        let [a, b, _] = mesh.triangles[0];
        assert!(waited(&tracker, &[a], &none).is_empty());
        assert_eq!(waited(&tracker, &[a, b], &none), [a.min(b), a.max(b)]);
        let mut uncovered = none.clone();
        uncovered[a as usize] = true;
        assert_eq!(waited(&tracker, &[a], &uncovered), [a]);
        tracker.flags[a as usize] = true;
        assert_eq!(waited(&tracker, &[a], &none), [a]);
    }
}
