//! The box in which a sweep is wanted.

use crate::distance::lattice::Fixed;

/// Fixed-point box in which a sweep is wanted. Faces above and below it are made too: they lie on scan lines (along z) through the box, and
/// decide which of its voxels are inside.
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
