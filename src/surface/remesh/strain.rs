//! Which edges have changed recently. An edge that is out of range is left alone while it rests: improvement was tried when it left the
//! range, and an edge that jitters around a limit would be remeshed in every frame.

use super::Improvable;
use super::improvable::{TOO_LONG, TOO_SHORT};
use crate::geometry::DVec3;

/// Change of a length since the reference (targets) above which an edge is not at rest, unless it is within [`Improvable::jitter`].
/// Particles at rest that jitter by 0.02 spacings change lengths by up to 0.02 targets, and by 0.01 spacings.
const STRAIN: f64 = 0.04;
/// Displacement since the reference up to which a vertex is at rest, in units of [`Improvable::jitter`]: 0.3 spacings. On a sheet half a
/// spacing thick, where fits extrapolate far beyond the particles, a jitter of 0.02 spacings displaces vertices by up to 0.26.
const STILL: f64 = 30.0;
/// In a creeping liquid, edges change more slowly than [`STRAIN`]. So an edge is also strained each time it crosses one of a series of
/// limits: the first is the bound of the range times the first factor, each further one the one before times the second factor.
const BEYOND: [f64; 2] = [4.0 / 3.0, 1.5];
/// Factor on these limits for an edge whose ends are at rest. Moving edges are split or collapsed when they reach a limit, so that edges
/// come to rest slightly within it and jitter across it, but not as far as the limit with this factor.
const AT_REST: f64 = 1.25;
/// Maximum number of limits.
const LIMITS: u32 = 64;

impl Improvable<'_> {
    /// Whether an edge has an end that was created in this frame, or its length has changed since the reference by more than jitter
    /// explains. If the change is unknown (not finite), it is strained.
    pub(super) fn is_strained(&self, ends: [u32; 2]) -> bool {
        let [a, b] = ends.map(|end| end as usize);
        if self.origins[a].is_none() || self.origins[b].is_none() {
            return true;
        }
        let now = self.positions[a] - self.positions[b];
        let drift = |at: usize| DVec3::from(self.drifts[at].map(f64::from));
        let (now, before) = (now.norm(), (now - (drift(a) - drift(b))).norm());
        let [shortest, longest] = self.target(ends);
        let target = if now > longest { longest } else { shortest };
        let change = (now - before).abs();
        // Ends that have hardly moved mean no strain: the difference comes from a fit to few particles.
        let is_still = |at: usize| drift(at).norm() <= STILL * self.jitter;
        let is_still = is_still(a) && is_still(b);
        let rests = is_still || change <= (STRAIN * target).max(self.jitter);
        let limits = |length: f64| limits(length / target, if is_still { AT_REST } else { 1.0 });
        !rests || limits(now) > limits(before)
    }
}

/// How many of the limits, scaled by `farther`, a length (targets) is beyond.
fn limits(length: f64, farther: f64) -> u32 {
    let out = (length / TOO_LONG).max(TOO_SHORT / length);
    let (mut count, mut limit) = (0, BEYOND[0] * farther);
    while out > limit && count < LIMITS {
        limit *= BEYOND[1];
        count += 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::super::tests::Body;
    use super::*;

    #[test]
    fn limits_are_farther_and_farther_out() {
        let counts =
            [1.0, 1.9, 2.1, 2.9, 3.1, 0.4, 0.37, 0.26, 0.24, 0.0, f64::MAX].map(|length| limits(length, 1.0));
        assert_eq!(counts, [0, 0, 1, 1, 2, 0, 1, 1, 2, LIMITS, LIMITS]);
        assert_eq!([2.1, 2.49, 2.51, 0.31, 0.29].map(|length| limits(length, AT_REST)), [0, 0, 1, 0, 1]);
    }

    /// Whether an edge of this length (targets) is strained between two vertices with these drifts.
    fn is_strained_by(length: f64, drifts: [[f32; 3]; 2], jitter: f64) -> bool {
        let mut body = Body::of(vec![DVec3::zeros(), DVec3::x() * length, DVec3::y()], vec![[0, 1, 2]]);
        body.sizes = vec![[1.0; 2]; 3];
        body.drifts = vec![drifts[0], drifts[1], [0.0; 3]];
        body.jitter = jitter;
        body.improvable().is_strained([0, 1])
    }

    #[test]
    fn an_edge_rests_until_it_changes_or_creeps_far_out() {
        // Two vertices 1.6 targets apart, of which the second was this much nearer before.
        let is_strained = |length: f64, nearer: f32, jitter: f64| {
            is_strained_by(length, [[100.0, 7.0, 0.0], [100.0 + nearer, 7.0, 0.0]], jitter)
        };
        assert!(!is_strained(1.6, 0.0, 0.0) && !is_strained(1.6, 0.03, 0.0) && !is_strained(1.6, -0.03, 0.0));
        assert!(is_strained(1.6, 0.05, 0.0) && is_strained(1.6, -0.05, 0.0) && !is_strained(1.6, 0.05, 0.1));
        assert!(is_strained(2.01, 0.02, 0.1) && !is_strained(2.05, 0.02, 0.1));
        assert!(is_strained(1.6, f32::NAN, 0.0));
        // It came back from beyond a limit: that is no reason.
        assert!(!is_strained(1.99, -0.02, 0.1));
    }

    #[test]
    fn ends_that_are_where_they_were_do_not_strain_an_edge_before_it_creeps_far_out() {
        let is_strained = |length: f64, by: f32| is_strained_by(length, [[0.0; 3], [by, 0.0, 0.0]], 0.01);
        assert!(!is_strained(1.6, 0.29) && !is_strained(1.6, -0.29));
        assert!(is_strained(1.6, 0.31) && is_strained(1.6, -0.31));
        // An edge that only jitters about a limit of moving edges does not cross the one at rest.
        assert!(is_strained(2.55, 0.29) && !is_strained(2.05, 0.29) && !is_strained(2.85, 0.29));
        assert!(is_strained(1.6, f32::NAN));
    }
}
