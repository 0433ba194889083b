//! Consecutive poses of a motion, and poses between two given ones.

use super::Motion;
use crate::error::Result;
use crate::geometry::{DVec3, Vec3};

/// A motion's pose, and the one that was queried before it.
pub struct Poses<'a> {
    motion: &'a dyn Motion,
    before: Vec<DVec3>,
    pose: Vec<DVec3>,
}

impl<'a> Poses<'a> {
    /// Begins at a time (s).
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn start(motion: &'a dyn Motion, time: f64) -> Result<Self> {
        let mut out = Self { motion, before: Vec::new(), pose: Vec::new() };
        motion.pose(time, &mut out.pose)?;
        Ok(out)
    }

    /// Advances to a time (s); returns the previous pose and the one at that time (m).
    ///
    /// # Errors
    /// As [`Poses::start`].
    pub fn go_to(&mut self, time: f64) -> Result<(&[DVec3], &[DVec3])> {
        std::mem::swap(&mut self.before, &mut self.pose);
        self.motion.pose(time, &mut self.pose)?;
        Ok((&self.before, &self.pose))
    }

    /// The current pose (m).
    pub fn now(&self) -> &[DVec3] {
        &self.pose
    }
}

/// Writes positions on straight lines between two poses (m) into `out` (cleared first): `from` at `part` 0, `to` at 1.
pub fn between(from: &[Vec3], to: &[Vec3], part: f64, out: &mut Vec<DVec3>) {
    out.clear();
    match part {
        0.0 => out.extend(from.iter().map(|p| p.cast::<f64>())),
        _ => out.extend(from.iter().zip(to).map(|(p, q)| p.cast::<f64>().lerp(&q.cast(), part))),
    }
}
