//! Steps of a tracker that are computed in advance, so that easing (`track/easing.rs`) knows their changes; the results are reused when the
//! steps are made.

use std::collections::VecDeque;

use super::easing::{Eased, EasingTargets, eased};
use super::easing_limit::{Displaced, uncrossed};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::surface::Particles;
use crate::surface::report::StepReport;
use crate::surface::tracked_mesh::Tracker;

/// The coming steps of a tracker.
#[derive(Debug, Default)]
pub struct Outlook {
    /// The particles at which the first step begins.
    from: Particles,
    /// In order.
    steps: VecDeque<ComingStep>,
}

/// A coming step.
#[derive(Debug)]
struct ComingStep {
    to: Particles,
    dt: f64,
    after: Tracker,
    report: StepReport,
    targets: EasingTargets,
}

impl Outlook {
    /// Computes the coming steps, starting at the particles `from`, at which the tracker is, each `dt` (s) after the previous one. Steps
    /// already computed for the same particles are kept. A tracker with a different history needs another outlook.
    ///
    /// # Errors
    /// As [`Tracker::step`]; the steps before the one that failed stay.
    pub fn look(
        &mut self,
        ctx: &Context,
        tracker: &Tracker,
        from: Particles,
        coming: Vec<Particles>,
        dt: f64,
    ) -> Result<()> {
        if self.from != from {
            self.steps.clear();
            self.from = from;
        }
        let is_same = |(step, to): &(&ComingStep, &Particles)| step.dt == dt && step.to == **to;
        let same = self.steps.iter().zip(&coming).take_while(is_same).count();
        self.steps.truncate(same);
        for to in coming.into_iter().skip(same) {
            let last = self.steps.back();
            let (mut after, from) = match last {
                Some(last) => (last.after.clone(), &last.to),
                None => (tracker.clone(), &self.from),
            };
            let triangles = after.triangles().to_vec();
            let report = after.step(ctx, from, &to, dt)?;
            let spacing = tracker.params().spacing;
            let targets = match &report.change {
                Some(change) => EasingTargets::of(ctx, change, &triangles, spacing)?,
                None => EasingTargets::default(),
            };
            self.steps.push_back(ComingStep { to, dt, after, report, targets });
        }
        Ok(())
    }

    /// The result of a step, if it has been computed.
    pub fn take(&mut self, from: &Particles, to: &Particles, dt: f64) -> Option<(Tracker, StepReport)> {
        let is_next = |step: &ComingStep| step.dt == dt && step.to == *to;
        if self.from != *from || !self.steps.front().is_some_and(is_next) {
            *self = Self::default();
            return None;
        }
        let ComingStep { to, after, report, .. } = self.steps.pop_front()?;
        self.from = to;
        Some((after, report))
    }

    /// Positions (m) of the tracker's vertices as displayed: those that a coming step removes move towards their replacement, for `ahead`
    /// steps before it, as far as the mesh does not intersect itself.
    ///
    /// # Errors
    /// Cancel.
    pub fn eased(&self, ctx: &Context, tracker: &Tracker, ahead: usize) -> Result<Vec<DVec3>> {
        let mut positions = tracker.vertices().to_vec();
        let moved = displaced(&eased(self.steps.iter().map(|step| &step.targets), ahead));
        for (vertex, by) in uncrossed(ctx, tracker.vertices(), tracker.triangles(), moved)? {
            positions[vertex as usize] += by;
        }
        Ok(positions)
    }
}

/// The vertices that are displaced now.
pub fn displaced(eased: &[Eased]) -> Vec<Displaced> {
    let moved = eased.iter().filter(|eased| eased.now != DVec3::zeros());
    moved.map(|eased| (eased.vertex, eased.now)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, rebuilt, two_balls};

    const DT: f64 = 0.04;

    /// Two balls of particles that meet.
    fn balls(frame: i32) -> Particles {
        two_balls(4.2, DVec3::new(6.5 - 0.2 * f64::from(frame), 0.1, 0.0))
    }

    #[test]
    fn steps_that_were_made_ahead_are_those_that_come_and_only_what_goes_is_moved() {
        let ctx = context(2);
        let first = balls(0);
        let mut tracker = rebuilt(&ctx, &first);
        let mut plain = tracker.clone();
        let (mut outlook, mut moved) = (Outlook::default(), 0);
        for frame in 0..16 {
            let (from, to) = (balls(frame), balls(frame + 1));
            let coming: Vec<Particles> = (1..=3).map(|ahead| balls(frame + ahead)).collect();
            outlook.look(&ctx, &tracker, from.clone(), coming, DT).unwrap();
            let positions = outlook.eased(&ctx, &tracker, 3).unwrap();
            moved += positions.iter().zip(tracker.vertices()).filter(|(shown, own)| shown != own).count();
            let (next, report) = outlook.take(&from, &to, DT).unwrap();
            tracker = next;
            let wanted = plain.step(&ctx, &from, &to, DT).unwrap();
            assert!(tracker.save() == plain.save(), "{frame}");
            assert_eq!(report.change.is_some(), wanted.change.is_some(), "{frame}");
        }
        assert!(moved > 20, "{moved}");
        // Other particles are a different path.
        outlook.look(&ctx, &tracker, balls(16), vec![balls(17)], DT).unwrap();
        assert!(outlook.take(&balls(16), &balls(18), DT).is_none());
        assert!(outlook.take(&balls(16), &balls(17), DT).is_none());
    }
}
