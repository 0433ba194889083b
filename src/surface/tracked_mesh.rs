//! The mesh of a tracker, and what it knows of the liquid.

/// Minimum reach of the band, and the maximum that is tried at the first frame (r).
pub(in crate::surface) const REACH: [f64; 2] = [1.5, 8.0];

/// Factor by which the band reaches farther than the vertices did before (thesis 2.3.1).
pub(in crate::surface) const WIDER: f64 = 1.25;

/// Maximum drift of a vertex in a frame, where nothing merges or splits (r).
pub(in crate::surface) const DRIFT: f64 = 0.25;
