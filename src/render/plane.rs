//! A plane of a picture that cuts a field.

use std::fmt;

use crate::geometry::DVec3;

/// A plane across one of the world's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The axis: 0, 1 or 2 for x, y or z.
    pub axis: usize,
    /// Its coordinate on this axis (m).
    pub at: f64,
}

impl Plane {
    /// Where a ray meets the plane; none if it never does.
    pub(super) fn intersection(self, eye: DVec3, toward: DVec3) -> Option<DVec3> {
        let distance = (self.at - eye[self.axis]) / toward[self.axis];
        let mut position = eye + toward * distance;
        position[self.axis] = self.at;
        (distance > 0.0 && distance.is_finite()).then_some(position)
    }
}

impl fmt::Display for Plane {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}={}", ["x", "y", "z"][self.axis], self.at)
    }
}
