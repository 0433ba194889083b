//! Vertices at the lower edge of skirts.

/// Where the surface of a column comes down to the ground's edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shallow::surface) struct SkirtVertex {
    /// Index of the column.
    pub column: u32,
    /// East, north, west and south, where the surface ends on that side: how far the ground reaches from the middle of the cell (cells).
    pub sides: [Option<f32>; 4],
    /// Height of the ground's edge above the column's base (m).
    pub rise: f32,
}

impl SkirtVertex {
    /// Offset from the middle of the cell along x and z (cells).
    pub fn offset(&self) -> [f32; 2] {
        let [east, north, west, south] = self.sides.map(|reach| reach.unwrap_or(0.0));
        [east - west, south - north]
    }
}
