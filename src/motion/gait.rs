//! Gait analysis: how the lowest parts of a figure move while they are on the ground.
//!
//! Walk cycles usually walk in place: the standing foot moves backwards under the figure. If the figure is carried forwards at that speed,
//! the foot stays where it stands.

use super::{Motion, Poses};
use crate::error::Result;
use crate::geometry::DVec3;
use crate::geometry::shape::bounds;

/// Sampled poses per second of the motion, and the minimum and maximum number of poses in all.
const RATE: f64 = 60.0;
const POSES: (f64, f64) = (24.0, 240.0);
/// Maximum number of vertices in all poses together: limits the time of the analysis.
const MAX_VERTICES: f64 = 5e7;
/// Tolerance, as a fraction of a figure's height: a standing part may be this far above the lowest part of its pose, and that lowest part
/// this far above the ground. The ground is the quantile `REACHED` of the lowest parts' heights, so that neither a toe that digs in nor a
/// jump hides a walk.
const STANDS: f64 = 0.015;
const REACHED: f64 = 0.4;
/// A part that rises or falls by more than the fraction `LEVEL` of its horizontal path does not count as standing, unless it rises or
/// falls by at most the fraction `STILL` of the tolerance `STANDS`.
const LEVEL: f64 = 0.25;
const STILL: f64 = 0.1;
/// Maximum spread of steady velocities, as a fraction of the speed: walks have up to 0.22, runs 0.45.
const STEADY: f64 = 0.33;
/// Minimum fraction of the time that something stands; else the motion is not a gait.
const MIN_STANDING: f64 = 0.2;

/// How a motion's lowest parts move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gait {
    /// Horizontal velocity of the standing parts (m/s): the median, component by component, of their mean velocities at the times when
    /// something stands.
    pub velocity: DVec3,
    /// Median deviation of those mean velocities from `velocity` (m/s).
    pub spread: f64,
    /// Fraction of the time that something stands, 0..=1.
    pub standing: f64,
    /// y of the lowest position (m).
    pub lowest: f64,
    /// Maximum height of the figure (m).
    pub height: f64,
}

impl Gait {
    /// Whether standing parts move steadily enough, in one direction, for one speed to carry the figure.
    pub fn is_steady(&self) -> bool {
        self.standing >= MIN_STANDING && self.spread <= STEADY * self.velocity.norm()
    }

    /// Velocity (m/s) at which the figure must be carried so that standing parts stay where they are.
    pub fn carry(&self) -> DVec3 {
        -self.velocity
    }
}

/// Analyses a motion (m, Y up) from one time to another (s); `None` if parts stand for less than a fifth of the time.
///
/// # Errors
/// A pose that cannot be computed.
pub fn gait(motion: &dyn Motion, from: f64, to: f64) -> Result<Option<Gait>> {
    let vertices = motion.vertex_count().max(1) as f64;
    let max_count = (MAX_VERTICES / vertices).clamp(POSES.0, POSES.1);
    let count = ((to - from) * RATE).ceil().clamp(POSES.0, max_count) as usize;
    let step = (to - from) / count as f64;
    if step.is_nan() || step <= 0.0 || motion.vertex_count() == 0 {
        return Ok(None);
    }
    let time = |number: usize| from + step * number as f64;
    let mut poses = Poses::start(motion, from)?;
    let (mut lows, mut height) = (Vec::with_capacity(count + 1), 0.0f64);
    for number in 0..=count {
        let (low, high) = bounds(poses.go_to(time(number))?.1);
        lows.push(low.y);
        height = height.max(high.y - low.y);
    }
    let near = STANDS * height;
    let ground = quantile(lows.clone(), REACHED) + near;
    let mut velocities = Vec::new();
    poses.go_to(from)?;
    for number in 1..=count {
        let (before, pose) = poses.go_to(time(number))?;
        let (low, lower) = (lows[number - 1], lows[number]);
        let stands = |(p, q): &(&DVec3, &DVec3)| {
            let displacement = *q - *p;
            let along = DVec3::new(displacement.x, 0.0, displacement.z).norm();
            p.y <= low + near
                && q.y <= lower + near
                && displacement.y.abs() <= (LEVEL * along).max(STILL * near)
        };
        if low.max(lower) <= ground {
            let standing = before.iter().zip(pose).filter(stands);
            let (sum, parts) = standing.fold((DVec3::zeros(), 0), |(sum, n), (p, q)| (sum + (q - p), n + 1));
            if parts > 0 {
                let mean = sum / (f64::from(parts) * step);
                velocities.push(DVec3::new(mean.x, 0.0, mean.z));
            }
        }
    }
    let lowest = lows.into_iter().fold(f64::INFINITY, f64::min);
    let standing = velocities.len() as f64 / count as f64;
    if standing < MIN_STANDING {
        return Ok(None);
    }
    let middle = |pick: fn(&DVec3) -> f64| quantile(velocities.iter().map(pick).collect(), 0.5);
    let velocity = DVec3::new(middle(|v| v.x), 0.0, middle(|v| v.z));
    let spread = quantile(velocities.iter().map(|v| (v - velocity).norm()).collect(), 0.5);
    Ok(Some(Gait { velocity, spread, standing, lowest, height }))
}

/// A quantile: the median for 0.5.
fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get((values.len() as f64 * part) as usize).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{TriMesh, Vec3};
    use crate::motion::{Key, Keys, Morph, Rigid};

    /// A foot that stands for half a second while it moves back 0.6 m, then swings forward again.
    fn walk() -> Rigid {
        let foot = TriMesh {
            positions: vec![Vec3::zeros(), Vec3::new(0.1, 0.0, 0.3), Vec3::new(0.0, 1.7, 0.0)],
            triangles: vec![[0, 1, 2]],
        };
        let key = |time: f64, y: f64, z: f64| Key { time, at: DVec3::new(0.0, y, z), turn: DVec3::zeros() };
        let keys = vec![
            key(0.0, 0.0, 0.3),
            key(0.5, 0.0, -0.3),
            key(0.6, 0.3, -0.1),
            key(0.9, 0.3, 0.2),
            key(1.0, 0.0, 0.3),
        ];
        Rigid::new(foot, Keys::new(keys).unwrap())
    }

    #[test]
    fn a_foot_that_moves_back_carries_the_figure_forward() {
        let gait = gait(&walk(), 0.0, 1.0).unwrap().unwrap();
        assert!((gait.carry() - DVec3::z() * 1.2).norm() < 0.02, "{gait:?}");
        assert!(gait.is_steady() && gait.lowest == 0.0 && (0.45..0.6).contains(&gait.standing), "{gait:?}");
    }

    #[test]
    fn what_flies_or_rests_has_no_speed() {
        let at = |y: f32| vec![Vec3::new(0.0, y, 0.0), Vec3::new(0.0, y + 1.0, 0.0), Vec3::new(1.0, y, 0.0)];
        let mesh = TriMesh { positions: at(0.0), triangles: vec![[0, 1, 2]] };
        let rises = Morph::new(mesh.clone(), at(5.0)).unwrap();
        assert_eq!(gait(&rises, 0.0, 1.0).unwrap(), None);
        let still = Rigid::new(mesh, Keys::default());
        let found = gait(&still, 0.0, 1.0).unwrap().unwrap();
        assert_eq!((found.velocity, found.standing), (DVec3::zeros(), 1.0));
        assert_eq!(gait(&still, 1.0, 1.0).unwrap(), None);
    }
}
