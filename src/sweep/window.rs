//! Where a sweep is wanted.

use crate::distance::lattice::Fixed;

/// Fixed-point box in which a sweep is wanted. Faces are made wherever a line along z (the axis of the scan lines) through it may meet
/// them: which voxels are inside depends on everything that a line meets, above and below the box too.
#[derive(Debug, Clone, Copy)]
pub struct Window {
    /// Minimum corner.
    pub min: Fixed,
    /// Maximum corner.
    pub max: Fixed,
}

impl Window {
    /// Whether a triangle with this bounding box can matter: it overlaps the window in x and y.
    pub fn wants(&self, low: Fixed, high: Fixed) -> bool {
        high[0] >= self.min[0] && low[0] <= self.max[0] && high[1] >= self.min[1] && low[1] <= self.max[1]
    }
}
