//! What lies beyond the border of the domain.

/// What lies beyond the border of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Border {
    /// A wall.
    #[default]
    Closed,
    /// Nothing: liquid flows off along the slope of the ground near the border, and is counted as lost.
    Open,
    /// Liquid at rest, at the height to which the domain was last filled: waves leave and are not reflected. Outflow and inflow are
    /// counted. Before the first filling, and where the ground is above that height, the border acts like [`Border::Open`].
    Absorbing,
}
