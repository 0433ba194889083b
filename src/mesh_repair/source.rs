//! Where triangles of a repaired mesh come from.

/// Where a triangle of a repaired mesh comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// An unchanged triangle of the input mesh.
    Whole(u32),
    /// A part of a triangle of the input mesh.
    Part(u32),
    /// Closes a hole, or was rebuilt.
    New,
}

impl Source {
    /// The source after two changes; `first` holds the sources of all triangles after the first change.
    pub(crate) fn after(self, first: &[Self]) -> Self {
        match self {
            Self::Whole(triangle) => first[triangle as usize],
            Self::Part(triangle) => match first[triangle as usize] {
                Self::Whole(triangle) | Self::Part(triangle) => Self::Part(triangle),
                Self::New => Self::New,
            },
            Self::New => Self::New,
        }
    }
}
