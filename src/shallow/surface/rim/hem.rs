//! The rim of a column at which films end.

/// Where the surface of a column ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shallow::surface) struct Hem {
    /// Index of the column.
    pub column: u32,
    /// For east, north, west and south: how far the ground reaches (cells) where the surface ends there.
    pub sides: [Option<f32>; 4],
    /// How much higher the ground is there than the column's base (m).
    pub rise: f32,
}

impl Hem {
    /// Offset from the middle of the cell along x and z (cells).
    pub fn offset(&self) -> [f32; 2] {
        let [east, north, west, south] = self.sides.map(|reach| reach.unwrap_or(0.0));
        [east - west, south - north]
    }
}
