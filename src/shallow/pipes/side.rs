//! Sides of cells.

/// A side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::shallow) enum Side {
    East,
    South,
    West,
    North,
}

impl Side {
    pub const ALL: [Self; 4] = [Self::East, Self::South, Self::West, Self::North];

    pub fn is_along_x(self) -> bool {
        matches!(self, Self::East | Self::West)
    }

    pub fn opposite(self) -> Self {
        match self {
            Self::East => Self::West,
            Self::South => Self::North,
            Self::West => Self::East,
            Self::North => Self::South,
        }
    }

    /// Outward direction, along x and z.
    pub fn outward(self) -> [i32; 2] {
        match self {
            Self::East => [1, 0],
            Self::South => [0, 1],
            Self::West => [-1, 0],
            Self::North => [0, -1],
        }
    }

    /// The cell beyond this side, if it is within the domain.
    pub fn cell(self, [x, z]: [usize; 2], [nx, nz]: [usize; 2]) -> Option<[usize; 2]> {
        match self {
            Self::East => (x + 1 < nx).then(|| [x + 1, z]),
            Self::South => (z + 1 < nz).then(|| [x, z + 1]),
            Self::West => x.checked_sub(1).map(|x| [x, z]),
            Self::North => z.checked_sub(1).map(|z| [x, z]),
        }
    }
}
