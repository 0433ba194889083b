//! Poses of a motion looked at one after another.

use super::Motion;
use crate::base::DVec3;
use crate::error::Result;

/// A motion's pose, and the one that was looked at before it.
pub struct Poses<'a> {
    motion: &'a dyn Motion,
    before: Vec<DVec3>,
    pose: Vec<DVec3>,
}

impl<'a> Poses<'a> {
    /// Begins at a time (s).
    ///
    /// # Errors
    /// A pose that cannot be had.
    pub fn start(motion: &'a dyn Motion, time: f64) -> Result<Self> {
        let mut out = Self { motion, before: Vec::new(), pose: Vec::new() };
        motion.pose(time, &mut out.pose)?;
        Ok(out)
    }

    /// Goes on to a time (s); gives the pose before and the one there (m).
    ///
    /// # Errors
    /// As [`Poses::start`].
    pub fn go_to(&mut self, time: f64) -> Result<(&[DVec3], &[DVec3])> {
        std::mem::swap(&mut self.before, &mut self.pose);
        self.motion.pose(time, &mut self.pose)?;
        Ok((&self.before, &self.pose))
    }

    /// The pose (m) that was looked at last.
    pub fn now(&self) -> &[DVec3] {
        &self.pose
    }
}

/// Least and greatest corner of places; infinite, and the other way round, where there are none.
pub fn span(places: &[DVec3]) -> (DVec3, DVec3) {
    let none = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
    places.iter().fold(none, |(low, high), place| (low.inf(place), high.sup(place)))
}
