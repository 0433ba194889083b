//! Which triangles of a mesh are flipped or left out, and what remains ambiguous.

/// What an open part bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// Its loops are capped by cones.
    Caps,
    /// All below its upward-facing triangles is solid.
    Below,
}

/// What happens to a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    Stays,
    Turned,
    /// It duplicates an earlier one.
    LeftOut,
}

/// What remains ambiguous.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Doubts {
    /// Parts with only one side, where no choice makes all triangles agree.
    pub one_sided: usize,
    /// Non-manifold edges that do not determine which side is out.
    pub non_manifold_edges: usize,
    /// Inside-out parts whose inner parts may or may not be cavities.
    pub nested: usize,
}

/// Which triangles of a mesh must be flipped or left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Orientation {
    /// Empty: all triangles stay.
    pub(super) fates: Vec<Fate>,
    /// Whether each triangle belongs to an open part; empty: none does.
    pub(super) open: Vec<bool>,
    /// Signed volume of the closed parts (m3), before and after they were turned.
    pub(super) volumes: [f64; 2],
    /// Parts turned as a whole.
    pub turned_parts: usize,
    /// What remains ambiguous.
    pub doubts: Doubts,
}
