//! The parts of a chain's faces that bound its volume.

use crate::distance::lattice::Fixed;

/// A triangle that bounds the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Corners, counter-clockwise seen from outside.
    pub v: Corners,
    /// The chain's face that it is a part of.
    pub face: u32,
    /// Whether it is known to be open throughout; otherwise it is open where it was sampled, and buried sheets pass nearby.
    pub sure: bool,
}

/// Corners of a triangle.
pub type Corners = [Fixed; 3];
